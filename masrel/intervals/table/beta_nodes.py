"""Quadrature of a Beta distribution, with powers at its ends that are not whole."""

from collections.abc import Callable

import numpy as np
from scipy.special import betainc, expit

from masrel.agreement._kernel import Floats

__all__ = ["LEAST", "beta_nodes"]

LEAST = 1e-18
"""Weight of a node that is kept, relative to the largest."""

_FARTHEST = 9.0  # of w: sinh 9 = 4051 spreads
_WIDEST = 2.0  # spread: one end can fall off within a few units of the logit


def beta_nodes(
    a: float, b: float, step: float, least: float = 0.0
) -> tuple[Floats, Floats]:
    """Return the trapezoid nodes of a Beta(a, b) on a line where it dies off fast."""
    # The logit of the place in the range is its mode plus a spread times sinh w, with w
    # equally spaced: a power of the distance to an end, as small parameters give, is
    # smooth in w [1]_.
    # [1] Takahasi, H., Mori, M. (1974). Double exponential formulas for numerical
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
        middle, spread = _mode(lambda logit: at(logit)[1])
        total = float(betainc(b, a, 1.0 - least) - betainc(b, a, least))
    else:
        middle, total = float(np.log(a / b)), 1.0
        spread = min(float(np.sqrt(1.0 / a + 1.0 / b)), _WIDEST)
    w = np.arange(-_FARTHEST, _FARTHEST + 0.5 * step, step)
    x, log = at(middle + spread * np.sinh(w))
    weights = np.exp(log - log.max()) * np.cosh(w)
    kept = weights > LEAST * weights.max()
    return x[kept], weights[kept] * (total / weights[kept].sum())


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
