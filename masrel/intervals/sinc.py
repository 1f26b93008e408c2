"""A distribution on the line from its log-density, by sinc quadrature.

A density that is analytic beside the line and falls off both ways is known from equally
spaced points: the error of the trapezoid sum falls as exp(-c / step), so that halving
the step doubles the digits.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.special import sici

from masrel.agreement._kernel import Floats
from masrel.errors import ConvergenceError

__all__ = ["SincDistribution", "sinc_distribution"]

_SETTLED = 1e-7  # halving moves a quantile less: its own error is about the square
_FALLEN_OFF = 1e-14  # what an end may hold
_FIRST, _MOST = 32, 1 << 15  # steps


@dataclass(frozen=True, slots=True, kw_only=True)
class SincDistribution:
    """Probabilities at equally spaced points, and all in between."""

    # [1] Haber, S. (1993). Two formulas for numerical indefinite integration.
    # Mathematics of Computation, 60(201), 279-296.
    # https://doi.org/10.1090/S0025-5718-1993-1149292-9
    # [2] Trefethen, L. N., Weideman, J. A. C. (2014). The exponentially convergent
    # trapezoidal rule. SIAM Review, 56(3), 385-458. https://doi.org/10.1137/130932132

    points: Floats = field(compare=False, repr=False)  # (n,): ascending, equally spaced
    # (n,): the density at each, times the step; they sum to 1
    masses: Floats = field(compare=False, repr=False)
    log_total: float = 0.0  # logarithm of the integral that the density was divided by

    @classmethod
    def of_logs(cls, points: Floats, log: Floats) -> "SincDistribution":
        """Take log-densities (n,) at equally spaced points (n,), up to a constant."""
        masses = np.exp(log - log.max())
        total = float(masses.sum())
        return cls(
            points=points,
            masses=masses / total,
            log_total=float(log.max() + np.log(total * (points[1] - points[0]))),
        )

    @property
    def step(self) -> float:
        """Distance of two points."""
        return float(self.points[1] - self.points[0])

    def probability(self, point: float) -> float:
        """Return the probability of at most a point: the integral of [1]."""
        away = (point - self.points) * (np.pi / self.step)
        return float(self.masses @ (0.5 + sici(away)[0] / np.pi))

    def density(self, at: float) -> float:
        """Return the density at a point, never below 0."""
        away = np.sinc((at - self.points) / self.step)
        return max(float(self.masses @ away) / self.step, 0.0)

    def quantile(self, share: float, start: float | None = None) -> float:
        """Solve for the point below which a share lies."""
        low, high = float(self.points[0]), float(self.points[-1])
        if start is None:
            below = int(np.searchsorted(self.masses.cumsum(), share))
            start = float(self.points[min(below, self.points.size - 1)])
        at = start
        for _ in range(100):
            missing = self.probability(at) - share
            low, high = (low, at) if missing > 0.0 else (at, high)
            slope = self.density(at)
            ahead = at - missing / slope if slope > 0.0 else low
            if slope > 0.0 and abs(ahead - at) < 1e-12 * max(1.0, abs(at)):
                return ahead  # also where rounding puts it beyond what is known
            if not low < ahead < high:
                ahead = 0.5 * (low + high)
            at = ahead
        return at


def sinc_distribution(
    log_density: Callable[[Floats], Floats],
    low: float,
    high: float,
    shares: Sequence[float],
) -> tuple[SincDistribution, list[float]]:
    """Halve the step until the quantiles asked for no longer move."""
    points = np.linspace(low, high, _FIRST + 1)
    log = log_density(points)
    before: list[float] = []
    while points.size <= _MOST + 1:
        found = SincDistribution.of_logs(points, log)
        starts: Sequence[float | None] = before or [None] * len(shares)
        after = [found.quantile(p, at) for p, at in zip(shares, starts, strict=True)]
        if before and np.allclose(after, before, rtol=0.0, atol=_SETTLED):
            if max(found.masses[0], found.masses[-1]) > _FALLEN_OFF:
                raise ConvergenceError("the posterior reaches beyond its quadrature")
            return found, after
        before = after
        between = 0.5 * (points[:-1] + points[1:])
        added = log_density(between)
        points = np.insert(between, np.arange(points.size), points)
        log = np.insert(added, np.arange(log.size), log)
    raise ConvergenceError("the quadrature of the posterior has not settled")
