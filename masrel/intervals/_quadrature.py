"""Polynomials by logarithms, and distributions on the line by trapezoid sums.

A density that is analytic beside the line and falls off both ways is known from equally
spaced points: the error of the trapezoid sum falls as exp(-c / step) [1].

[1] Trefethen, L. N., Weideman, J. A. C. (2014). The exponentially convergent
trapezoidal rule. SIAM Review, 56(3), 385-458. https://doi.org/10.1137/130932132
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.special import betainc, betaincinv, expit, sici

from masrel.agreement._engine import Floats
from masrel.errors import ConvergenceError

_NATS = 37.0  # a density this far below its largest does not matter
_FEWEST, _COARSE = 12, 65  # points where a density matters, of a grid this large
_CLOSE = 1e-11  # how far off a quantile is solved for
_REACHED = 1e-6  # how far its probability may be off the share, of itself
_MAX_W = 3.1  # where nodes of a Beta end: 1e-15 of it is beyond
_FAR = 700.0  # nats from the largest at which a term underflows
_HELD = 1e-280  # share of the largest above which a sum lost nothing to underflow


def log_convolve(left: Floats, right: Floats) -> Floats:
    """Multiply two polynomials, given the logarithms of their coefficients."""
    # Floats hold some 1300 nats around the largest term. Times λ^t for several λ every
    # term is near the largest once: coefficients are log-concave or nearly so, and
    # the slope of a product's logarithm is among those of its factors'.
    slopes = np.sort(np.concatenate([np.diff(left), np.diff(right)]))[::-1]
    out = np.full(slopes.size + 1, np.nan)
    at = 0
    while at < out.size:
        tilt = -float(slopes[min(at, slopes.size - 1)]) if slopes.size else 0.0
        first, scale = 0, 0.0
        parts: list[Floats] = []
        for log in (left, right):
            tilted = log + tilt * np.arange(log.size)
            largest = float(tilted.max())
            low, high = np.flatnonzero(tilted > largest - _FAR)[[0, -1]].tolist()
            parts.append(np.exp(tilted[low : high + 1] - largest))
            first, scale = first + low, scale + largest
        product = np.convolve(parts[0], parts[1])
        held = np.flatnonzero(product > _HELD)
        t = first + held
        if not t[0] <= at <= t[-1]:
            raise ConvergenceError("floats cannot hold the exact posterior")
        out[t] = np.log(product[held]) + scale - tilt * t
        at = int(t[-1]) + 1
    return out


def log_sum_exp(logs: Floats) -> Floats:
    """Return the logarithm of each row's sum of exponentials."""
    # (n, m) -> (n,)
    top = logs.max(axis=1)
    return np.asarray(top + np.log(np.exp(logs - top[:, None]).sum(axis=1)))


def where_it_matters(
    log_density: Callable[[Floats], Floats],
    low: float,
    high: float,
    nats: float = _NATS,
) -> tuple[float, float]:
    """Return between which points a density is less than so far below its largest."""
    for _ in range(30):
        grid = np.linspace(low, high, _COARSE)
        log = log_density(grid)
        matters = np.flatnonzero(log > log.max() - nats)
        low = float(grid[max(matters[0] - 1, 0)])
        high = float(grid[min(matters[-1] + 1, _COARSE - 1)])
        if matters.size >= _FEWEST:
            break
    return low, high


@dataclass(frozen=True, slots=True, kw_only=True)
class LineDistribution:
    """Probabilities at equally spaced points, and all in between."""

    points: Floats = field(compare=False, repr=False)  # (n,): ascending
    # (n,): the density at each, times the step; they sum to 1
    masses: Floats = field(compare=False, repr=False)

    def probability(self, at: Floats) -> Floats:
        """Return the probabilities of at most some points, (n,)."""
        return np.asarray(integrated_sinc(at, self.points) @ self.masses)

    def density(self, at: Floats) -> Floats:
        """Return the density at some points, (n,)."""
        step = self.points[1] - self.points[0]
        density = np.sinc((at[:, None] - self.points) / step) @ self.masses / step
        return np.asarray(density.clip(0.0))  # but for rounding

    def quantiles(self, shares: Sequence[float]) -> list[float]:
        """Return the points below which shares lie."""
        last = self.points.size - 1
        near = self.masses.cumsum().searchsorted(shares)
        return [
            solve_quantile(
                lambda at: float(self.probability(np.array([at]))[0]),
                share,
                float(self.points[max(i - 2, 0)]),
                float(self.points[min(i + 2, last)]),
            )
            for share, i in zip(shares, near.tolist(), strict=True)
        ]


def integrated_sinc(at: Floats, points: Floats) -> Floats:
    """Return how much of the mass at equally spaced points lies at most at some."""
    # (n,), (n_points,) -> (n, n_points)
    # Haber, S. (1993). Two formulas for numerical indefinite integration. Mathematics
    # of Computation, 60(201), 279-296.
    # https://doi.org/10.1090/S0025-5718-1993-1149292-9
    away = (at[:, None] - points) * (np.pi / (points[1] - points[0]))
    return np.asarray(0.5 + sici(away)[0] / np.pi)


def solve_quantile(
    probability: Callable[[float], float], share: float, low: float, high: float
) -> float:
    """Return where a distribution function passes a share, between two points."""
    # The Illinois method: a chord from the last point to the one on the other side,
    # which counts half when it stays, so that both come near.
    # Dowell, M., Jarratt, P. (1971). A modified regula falsi method for computing the
    # root of an equation. BIT, 11, 168-174. https://doi.org/10.1007/BF01934364
    other, at = low, high
    there, here = probability(low) - share, probability(high) - share
    for _ in range(200):
        before, at = at, at - here / (here - there) * (at - other)
        excess = probability(at) - share
        if excess * here < 0.0:
            other, there = before, here
        else:
            there *= 0.5
        here = excess
        close = _CLOSE * max(1.0, abs(at))
        is_reached = abs(excess) < _REACHED * min(share, 1.0 - share)
        if abs(at - other) < close or (is_reached and abs(at - before) < close):
            break
    return at


def beta_nodes(a: float, b: float, n: int, least: float = 0.0) -> tuple[Floats, Floats]:
    """Return nodes x, 1 - x and weights of a Beta(a, b) from least to 1 - least."""
    # -> (n, 2), (n,)
    # Quantiles at tanh-sinh nodes of the probability, which come so close to both ends
    # that powers of the distance to an end, as small parameters give, are smooth.
    # Takahasi, H., Mori, M. (1974). Double exponential formulas for numerical
    # integration. Publications of the RIMS, 9(3), 721-741.
    # https://doi.org/10.2977/prims/1195192451
    w = np.linspace(-_MAX_W, _MAX_W, n)
    logit = np.pi * np.sinh(w)
    share, rest = expit(logit), expit(-logit)
    weights = np.cosh(w) * share * rest
    below, above = betainc(a, b, least), betainc(b, a, least)
    inside = 1.0 - below - above
    x = betaincinv(a, b, below + inside * share)
    y = betaincinv(b, a, above + inside * rest)
    nodes = np.column_stack([x, y]).clip(least, 1.0 - least)
    return nodes, weights * (inside / weights.sum())
