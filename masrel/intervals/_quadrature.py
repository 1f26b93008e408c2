"""Distributions on the line by trapezoid sums, and the solving for their quantiles.

A density that is analytic beside the line and falls off both ways is known from equally
spaced points: the error of the trapezoid sum falls as exp(-c / step), so that halving
the step doubles the digits [1].

[1] Trefethen, L. N., Weideman, J. A. C. (2014). The exponentially convergent
trapezoidal rule. SIAM Review, 56(3), 385-458. https://doi.org/10.1137/130932132
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.special import betainc, expit, sici

from masrel.agreement._engine import Floats
from masrel.errors import ConvergenceError

SETTLED = 1e-7
"""Halving the step moves a quantile less: its own error is about the square."""
TOLERANCE = 1e-12
"""How far off a point is solved for, or relative to it where that is more."""
NEGLIGIBLE = 1e-18
"""Weight of a node that is dropped, relative to the largest."""

_REACHED = 1e-6  # how far the probability of a point may be off the share
_MAX_TAIL = 1e-14  # mass that the outermost points may hold
_FIRST_STEPS, _MAX_STEPS = 32, 1 << 15
_MAX_W = 9.0  # sinh 9 = 4051 scales of the logit
_MAX_SCALE = 2.0  # one end can fall off within a few units of the logit


@dataclass(frozen=True, slots=True, kw_only=True)
class LineDistribution:
    """Probabilities at equally spaced points, and all in between."""

    points: Floats = field(compare=False, repr=False)  # (n,): ascending
    # (n,): the density at each, times the step; they sum to 1
    masses: Floats = field(compare=False, repr=False)
    step: float  # distance of two points
    log_total: float  # logarithm of the integral that the density was divided by

    def at(self, point: float) -> tuple[float, float]:
        """Return the probability of at most a point, and the density there."""
        away = point - self.points
        probability = float(self.masses @ integrated_sinc(away, self.step))
        density = float(self.masses @ np.sinc(away / self.step)) / self.step
        return probability, max(density, 0.0)  # rounding can bring it below 0


def integrated_sinc(away: Floats, step: float) -> Floats:
    """Return how much of the mass at points lies at most so far from them."""
    # Haber, S. (1993). Two formulas for numerical indefinite integration. Mathematics
    # of Computation, 60(201), 279-296.
    # https://doi.org/10.1090/S0025-5718-1993-1149292-9
    return np.asarray(0.5 + sici(away * (np.pi / step))[0] / np.pi)


def line_distribution(
    log_density: Callable[[Floats], Floats],
    low: float,
    high: float,
    shares: Sequence[float],
) -> tuple[LineDistribution, list[float]]:
    """Halve the step until the requested quantiles no longer move."""
    points = np.linspace(low, high, _FIRST_STEPS + 1)
    log = log_density(points)
    before: list[float] = []
    while points.size <= _MAX_STEPS + 1:
        masses = np.exp(log - log.max())
        total, step = float(masses.sum()), float(points[1] - points[0])
        result = LineDistribution(
            points=points,
            masses=masses / total,
            step=step,
            log_total=float(log.max() + np.log(total * step)),
        )
        near = result.masses.cumsum().searchsorted(shares).clip(max=points.size - 1)
        starts = before or points[near].tolist()
        after = [
            solve_quantile(result.at, share, start, (low, high), TOLERANCE)
            for share, start in zip(shares, starts, strict=True)
        ]
        if before and np.allclose(after, before, rtol=0.0, atol=SETTLED):
            if max(result.masses[0], result.masses[-1]) > _MAX_TAIL:
                raise ConvergenceError("the posterior reaches beyond its quadrature")
            return result, after
        before = after
        between = 0.5 * (points[:-1] + points[1:])
        added = log_density(between)
        points = np.insert(between, np.arange(points.size), points)
        log = np.insert(added, np.arange(log.size), log)
    raise ConvergenceError("the quadrature of the posterior has not settled")


def solve_quantile(
    at: Callable[[float], tuple[float, float]],
    share: float,
    start: float,
    bounds: tuple[float, float],
    tolerance: float,
) -> float:
    """Return where a distribution function passes a share."""
    # `at` gives the probability of at most a point and the density there. Newton's
    # method, with a bisection where a step would leave the bracket, or is small only
    # because the density is endless at one point, as that of kappa can be at 0.
    low, high = bounds
    point = start
    for _ in range(200):
        probability, density = at(point)
        excess = probability - share
        low, high = (low, point) if excess > 0.0 else (point, high)
        ahead = point - excess / density if density > 0.0 else low
        close = tolerance * max(1.0, abs(point))
        is_close = density > 0.0 and abs(ahead - point) < close
        if is_close and abs(excess) < _REACHED:
            return min(max(ahead, low), high)  # rounding can put it outside
        if is_close or not low < ahead < high:
            ahead = 0.5 * (low + high)
        if abs(ahead - point) < close:
            return ahead
        point = ahead
    return point


def beta_nodes(
    a: float, b: float, step: float, least: float = 0.0
) -> tuple[Floats, Floats]:
    """Return nodes x, 1 - x and weights of a Beta(a, b) from least to 1 - least."""
    # -> (n, 2), (n,)
    # The logit of the place in the range is its mode plus a scale times sinh w, with w
    # equally spaced: a power of the distance to an end, as small parameters give, is
    # smooth in w.
    # Takahasi, H., Mori, M. (1974). Double exponential formulas for numerical
    # integration. Publications of the RIMS, 9(3), 721-741.
    # https://doi.org/10.2977/prims/1195192451

    def at(logit: Floats) -> tuple[Floats, Floats]:
        place = np.column_stack([expit(logit), expit(-logit)])
        x = least + (1.0 - 2.0 * least) * place
        log_place = -np.logaddexp(0.0, np.column_stack([-logit, logit]))
        log = np.log(x) if least > 0.0 else log_place
        # the slope of x in the logit is place (1 - place), times a constant
        return x, log @ np.array([a - 1.0, b - 1.0]) + log_place.sum(axis=1)

    if least > 0.0:
        middle, scale = _mode(lambda logit: at(logit)[1])
        total = float(betainc(b, a, 1.0 - least) - betainc(b, a, least))
    else:
        middle, total = float(np.log(a / b)), 1.0
        scale = min(float(np.sqrt(1.0 / a + 1.0 / b)), _MAX_SCALE)
    w = np.arange(-_MAX_W, _MAX_W + 0.5 * step, step)
    x, log = at(middle + scale * np.sinh(w))
    weights = np.exp(log - log.max()) * np.cosh(w)
    large = weights > NEGLIGIBLE * weights.max()
    return x[large], weights[large] * (total / weights[large].sum())


def _mode(log_density: Callable[[Floats], Floats]) -> tuple[float, float]:
    # where it is highest, and the distance at which it has fallen by half a nat
    low, high = -40.0, 40.0
    for _ in range(6):
        at = np.linspace(low, high, 41)
        log = log_density(at)
        near = np.flatnonzero(log > log.max() - 0.5)
        if near.size > 8:
            break
        low, high = at[max(near[0] - 1, 0)], at[min(near[-1] + 1, 40)]
    return float(at[log.argmax()]), float(0.5 * (at[near[-1]] - at[near[0]]))


def log_sum_exp(logs: Floats) -> Floats:
    """Return the logarithm of each row's sum of exponentials."""
    # (n, m) -> (n,)
    top = logs.max(axis=1)
    return np.asarray(top + np.log(np.exp(logs - top[:, None]).sum(axis=1)))
