"""Where the posterior of ρ lies, before its polynomial is expanded.

Every category's polynomial times its Dirichlet moment is largest at one power. The
values there give the density of ρ up to a slowly varying factor, in a few vector
operations, and the tilt under which the polynomial can be expanded in floats.
"""

from dataclasses import dataclass, field

import numpy as np
from scipy.special import gammaln

from masrel.agreement._kernel import Floats
from masrel.errors import ConvergenceError
from masrel.intervals.dirichlet.model import DirichletMultinomial

__all__ = ["Factors", "Region"]

_WIDEST = 160.0  # of log λ either way: beyond any posterior that floats can hold
_NATS = 45.0  # what is left out is below exp(-40) of the density's largest value
_STEPS = 12  # of Newton's method at most; it is quadratic,
_CLOSE = 1e-9  # so that after a step as small as that, of x, the next changes nothing


@dataclass(frozen=True, slots=True, kw_only=True)
class Factors:
    """The likelihood Π_k Π_j (A π_k + j)^N_kj / Π_j (A + j)^n_j and its priors."""

    # (n_used, n_depths): n_kj of the categories that were used
    powers: Floats = field(compare=False, repr=False)
    below: Floats = field(compare=False, repr=False)  # (n_depths,): n_j
    # (n_used,): dirichlet parameters of the used categories
    a: Floats = field(compare=False, repr=False)
    a_total: float  # the sum of all, unused ones included
    shape: float  # the prior of ρ is Beta(shape, shape)

    @classmethod
    def of(cls, model: DirichletMultinomial) -> "Factors":
        """Take the factors of a model apart."""
        n_used = int(model.above.max()) + 1
        powers = np.zeros((n_used, model.times_below.size))
        powers[model.above, model.depth] = model.times
        return cls(
            powers=powers,
            below=model.times_below,
            a=model.prior[:n_used],
            a_total=float(model.prior.sum()),
            shape=model.shape,
        )

    def outside(self, logit: Floats) -> Floats:
        """Return what multiplies the polynomial in A = exp(-logit ρ), as logarithm."""
        # logit (n,) -> (n,)
        # -Σ n_j log(A + j), with the prior (ρ (1 - ρ))^(shape - 1) and the Jacobian ρ
        # (1 - ρ) of the logit.
        depth = np.arange(self.below.size)
        with np.errstate(divide="ignore"):  # j = 0 is the logit itself
            log = np.logaddexp(-logit[:, None], np.log(depth))
        spread = np.logaddexp(0.0, logit) + np.logaddexp(0.0, -logit)
        return np.asarray(-log @ self.below - self.shape * spread)

    def saddle(self, tilt: Floats) -> tuple[Floats, Floats]:
        """Find where each category's tilted polynomial is largest."""
        # With t(x) = Σ_j N_kj x / (x + j), the mean power of Π_j (x + j)^N_kj at x, it
        # is at x = λ (a_k + t(x)). Newton's method from the right, where x - λ (a_k +
        # t(x)) is convex and rises.
        # Takes tilt (n,)
        depth = np.arange(self.below.size)
        tilt = tilt[:, None]
        x = tilt * (self.a + self.powers.sum(axis=1))
        for _ in range(_STEPS):
            share = 1.0 / (x[..., None] + depth)
            t = x * (self.powers * share).sum(axis=-1)
            slope = (self.powers * depth * share * share).sum(axis=-1)
            step = (x - tilt * (self.a + t)) / (1.0 - tilt * slope)
            x = x - step
            if (np.abs(step) <= _CLOSE * x).all():
                break
        share = 1.0 / (x[..., None] + depth)
        return x, x * (self.powers * share).sum(axis=-1)

    def profile(self, tilt: Floats) -> tuple[Floats, Floats]:
        """Return the largest term of the density at the logits that tilts belong to."""
        # Takes tilt (n,)
        # Logits of ρ and the logarithm of the term, both (n,).
        x, t = self.saddle(tilt)
        total = t.sum(axis=1)
        logit = -np.log(tilt) - np.log(self.a_total + total)
        depth = np.arange(self.below.size)
        terms = (self.powers * np.log(x[..., None] + depth)).sum(axis=-1)
        terms += gammaln(self.a + t) - t * np.log(x)
        inner = terms.sum(axis=1) - gammaln(self.a_total + total) - total * logit
        return logit, inner + self.outside(logit)


@dataclass(frozen=True, slots=True, kw_only=True)
class Region:
    """Where the posterior is not negligible, and the tilts there."""

    # logits, log_tilts: (n,): logits of ρ, ascending, and the logarithm of λ at each
    logits: Floats = field(compare=False, repr=False)
    log_tilts: Floats = field(compare=False, repr=False)
    mode: float  # about the logit of the highest density

    @classmethod
    def of(cls, factors: Factors) -> "Region":
        """Narrow a grid of tilts until a dozen of them lie where the density does."""
        grid = np.linspace(_WIDEST, -_WIDEST, 65)
        for _ in range(30):
            logits, density = factors.profile(np.exp(grid))
            best = int(density.argmax())
            high = np.flatnonzero(density > density[best] - _NATS)
            first, last = max(high[0] - 1, 0), min(high[-1] + 1, grid.size - 1)
            if high.size >= 12:
                inside = slice(first, last + 1)
                return cls(
                    logits=logits[inside],
                    log_tilts=grid[inside],
                    mode=float(logits[best]),
                )
            grid = np.linspace(grid[first], grid[last], 33)
        raise ConvergenceError("the posterior is too narrow to be found")

    def log_tilt(self, logit: float) -> float:
        """Return log λ at a logit."""
        return float(np.interp(logit, self.logits, self.log_tilts))
