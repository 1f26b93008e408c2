"""The exact posterior of raters' agreement with themselves, by quadrature."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq
from scipy.special import betainc, expit, logit, sici

from masrel.agreement._kernel import Floats
from masrel.intervals.retest.density import GRID, RaterPairs, Risen
from masrel.intervals.sinc import SincDistribution, sinc_distribution

__all__ = ["RetestPosterior"]

_WIDEST = 48.0  # logit m beyond which a uniform prior has no mass that matters
_NEGLIGIBLE = 45.0  # log-density below its largest
_LEFT_OUT = 1e-6  # probability of the smallest terms of a rater's mixture, together


@dataclass(frozen=True, slots=True, kw_only=True)
class RetestPosterior:
    """The joint posterior of the mean m and the spread g of raters' kappas."""

    raters: tuple[RaterPairs, ...] = field(compare=False, repr=False)  # the data
    shape: float  # m ~ Beta(shape, shape); g ~ U(0, 1/3)
    # the distribution of logit m
    mean: SincDistribution = field(compare=False, repr=False)
    quantiles: tuple[float, ...]  # quantiles of m, as asked for
    # (n_means, n_spreads): probabilities of the points (`mean.points`, `GRID`)
    masses: Floats = field(compare=False, repr=False)

    @classmethod
    def of(
        cls,
        tables: Sequence[NDArray[np.int64]],
        shares: Sequence[float],
        *,
        shape: float,
        concentration: float,
    ) -> "RetestPosterior":
        """Integrate the posterior."""
        # Takes tables (n_categories, n_categories)
        raters = tuple(RaterPairs.of(table, concentration) for table in tables)
        known: dict[float, Floats] = {}  # log-density over GRID, by logit m

        def log_density(mean: Floats) -> Floats:
            rows = _log_joint(raters, shape, mean, GRID)
            known.update(zip(mean.tolist(), rows, strict=True))
            return _log_sum(rows)

        low, high = _reach(raters, shape)
        mean, ends = sinc_distribution(log_density, low, high, shares)
        joint = np.array([known[point] for point in mean.points.tolist()])
        masses = np.exp(joint - joint.max())
        return cls(
            raters=raters,
            shape=shape,
            mean=mean,
            quantiles=tuple(expit(ends).tolist()),
            masses=masses / masses.sum(),
        )

    def rater_quantiles(self, rater: int, shares: Sequence[float]) -> list[float]:
        """Return quantiles of one rater's kappa."""
        # Given m and g it is a mixture of Betas, one a term of the likelihood.
        pairs = self.raters[rater]
        mass, up, down = self._mixture(pairs)

        def missing(kappa: float, share: float) -> float:
            return float(mass @ betainc(up, down, kappa)) - share

        return [
            float(brentq(missing, 0.0, 1.0, args=(share,), xtol=1e-9))
            for share in shares
        ]

    def _mixture(self, pairs: RaterPairs) -> tuple[Floats, Floats, Floats]:
        # -> probability and both parameters of every Beta that weighs, all (n,)
        # every other mean: the lattice before the last halving, which moved nothing
        masses, points = self.masses[::2], self.mean.points[::2]
        at, of = np.nonzero(_weighs(masses))
        mean, spread = points[at], GRID[of]
        terms = pairs.log_terms(Risen.of(mean, spread, pairs.agree + pairs.differ))
        terms -= _log_sum(terms)[:, None]
        mass = masses[at, of, None] * np.exp(terms)  # (n, agree + 1)
        node, j = np.nonzero(_weighs(mass))
        size = 3.0 / expit(spread[node]) - 1.0  # 1 / g - 1, what the population weighs
        up = expit(mean[node]) * size + pairs.agree - j
        down = expit(-mean[node]) * size + pairs.differ + j
        weight = mass[node, j]
        return weight / weight.sum(), up, down

    def spread_quantiles(self, shares: Sequence[float]) -> list[float]:
        """Return quantiles of the standard deviation of kappa over raters."""
        # Quantiles of √(m (1 - m) g), to about 1e-9.
        variance = expit(self.mean.points) * expit(-self.mean.points)
        step = GRID[1] - GRID[0]

        def missing(deviation: float, share: float) -> float:
            # 3 g may go so far at every m; the integral up to there as in `sinc`
            g_most = np.minimum(3.0 * deviation**2 / variance, 1.0)
            away = (logit(g_most)[:, None] - GRID) * (np.pi / step)
            below = 0.5 + sici(away)[0] / np.pi
            return float((self.masses * below).sum()) - share

        return [
            float(brentq(missing, 1e-12, np.sqrt(1.0 / 12.0), args=(share,), xtol=1e-9))
            for share in shares
        ]


def _reach(raters: Sequence[RaterPairs], shape: float) -> tuple[float, float]:
    # logit m between which there is all that matters, from a coarse look
    coarse = np.linspace(-_WIDEST / shape, _WIDEST / shape, 129)
    log = _log_joint(raters, shape, coarse, GRID[::8]).max(axis=1)
    inside = coarse[log > log.max() - _NEGLIGIBLE]
    step = coarse[1] - coarse[0]
    return float(inside[0] - step), float(inside[-1] + step)


def _log_joint(
    raters: Sequence[RaterPairs], shape: float, mean: Floats, spread: Floats
) -> Floats:
    # mean (n,), spread (s,) -> log-density of (logit m, logit 3 g) but for a constant
    most = max(pairs.agree + pairs.differ for pairs in raters)
    risen = Risen.of(np.repeat(mean, spread.size), np.tile(spread, mean.size), most)
    likelihood = np.zeros(mean.size * spread.size)
    for pairs in raters:
        likelihood += _log_sum(pairs.log_terms(risen))
    # densities of m and 3 g times the Jacobians of their logits
    of_mean = shape * (_log_expit(mean) + _log_expit(-mean))
    of_spread = _log_expit(spread) + _log_expit(-spread)
    return likelihood.reshape(mean.size, -1) + of_mean[:, None] + of_spread


def _weighs(masses: Floats) -> NDArray[np.bool_]:
    # False for the smallest, which together are next to nothing
    ascending = np.sort(masses, axis=None)
    few = np.searchsorted(ascending.cumsum(), _LEFT_OUT)
    return np.asarray(masses >= ascending[few])


def _log_sum(logs: Floats) -> Floats:
    # (n, m) -> (n,): logarithm of the sum of the exponentials
    top = logs.max(axis=1, keepdims=True)
    return np.asarray(np.log(np.exp(logs - top).sum(axis=1)) + top[:, 0])


def _log_expit(x: Floats) -> Floats:
    return -np.logaddexp(0.0, -x)
