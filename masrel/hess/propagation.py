"""One step of a driven arm, exactly: the exponential of a small linear system."""

import functools
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

__all__ = ["Propagator", "propagator"]

_TAYLOR_TERMS = 14
_LARGEST_NORM = 0.25  # 0.25^15 / 15! is below 1e-21: the series is exact in floats


class Propagator(NamedTuple):
    """What one step does to angle and speed; a named tuple, unpacked at every step."""

    # angle_angle, angle_speed, angle_lag, angle_force, angle_slope: new angle for a
    # unit of angle, of speed, of what the actuator lags behind its command, of the
    # torque at the beginning of the step, and of its slope
    angle_angle: float
    angle_speed: float
    angle_lag: float
    angle_force: float
    angle_slope: float
    # speed_angle, speed_speed, speed_lag, speed_force, speed_slope: the same for the
    # new speed
    speed_angle: float
    speed_speed: float
    speed_lag: float
    speed_force: float
    speed_slope: float
    lag: float  # share of the actuator's lag that is left after the step


@functools.lru_cache(maxsize=512)
def propagator(
    inertia: float, damping: float, stiffness: float, lag_time: float, step: float
) -> Propagator:
    """Solve I·θ̈ + D·θ̇ + K·θ = f(t) - e(t) over one step."""
    # f is linear within the step, and e, what the actuator's torque lags behind its
    # command, decays as exp(-t / `lag_time`). For such f the result is exact.
    decay = 1.0 / lag_time if lag_time > 0.0 else 0.0
    system = np.zeros((5, 5))  # θ, θ̇, e, f, slope of f
    system[0, 1] = 1.0
    system[1, :4] = np.array([-stiffness, -damping, -1.0, 1.0]) / inertia
    system[2, 2] = -decay
    system[3, 4] = 1.0
    made = _exponential(system * step)
    left = float(made[2, 2]) if lag_time > 0.0 else 0.0
    return Propagator._make([*made[0].tolist(), *made[1].tolist(), left])


def _exponential(matrix: NDArray[np.float64]) -> NDArray[np.float64]:
    # (n, n) -> (n, n), by a Taylor series of the scaled matrix, squared back
    norm = float(np.abs(matrix).sum(axis=1).max())
    squarings = 0
    while norm > _LARGEST_NORM:
        norm *= 0.5
        squarings += 1
    scaled = matrix * 0.5**squarings
    identity = np.eye(matrix.shape[0])
    made = identity
    for term in range(_TAYLOR_TERMS, 0, -1):  # Horner
        made = identity + scaled @ made / term
    for _ in range(squarings):
        made = made @ made
    return made
