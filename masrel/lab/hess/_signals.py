"""The speed of the arm from an encoder that counts in steps; a torque's soft end."""

import math

CUTOFF_RAD_S = 180.0
"""Of the low-pass, rad/s: that of the filter inside the source's motor amplifier."""


class VelocityEstimate:
    """Differentiate the encoder and pass it through a first-order low-pass."""

    # At 1 kHz one encoder step of 0.005 deg is 5 deg/s from sample to sample. The
    # low-pass leaves 0.8 deg/s of it and delays the speed by 1/180 s = 5.6 ms.

    def __init__(self) -> None:
        self._time: float | None = None
        self._angle = 0.0
        self._velocity = 0.0
        self._interval = 0.0
        self._gain = 0.0

    def update(self, time_s: float, angle: float) -> float:
        """Return the speed after one more reading, rad/s."""
        if self._time is None:
            self._time, self._angle = time_s, angle
            return 0.0
        interval = time_s - self._time
        if interval <= 0.0:
            return self._velocity
        if interval != self._interval:  # the gain is kept while ticks are regular
            self._interval = interval
            self._gain = -math.expm1(-CUTOFF_RAD_S * interval)
        difference = (angle - self._angle) / interval
        self._velocity += self._gain * (difference - self._velocity)
        self._time, self._angle = time_s, angle
        return self._velocity


class Flexion:
    """Tell an arm that is flexed from one that a catch throws back for a moment."""

    _LEAST = math.radians(5.0)
    _LEAST_S = 0.1

    def __init__(self, speed_threshold: float) -> None:
        self._speed = -speed_threshold
        self._began_s = self._began_at = math.nan  # s and rad

    def update(self, time_s: float, angle: float, velocity: float) -> bool:
        """Return whether it has been flexed faster than ν_th far or long enough."""
        if velocity > self._speed:
            self._began_s, self._began_at = time_s, angle
        way, time = self._began_at - angle, time_s - self._began_s
        return way >= self._LEAST or time >= self._LEAST_S


def speed_margin(angle_noise: float, rate_hz: float) -> float:
    """Return how far noise of the angle may move the speed, rad/s."""
    # Both as standard deviations: v = g/T (n_t - g Σ (1 - g)^k n_(t-1-k)) of
    # independent n. A hundred ticks at rest all lie within five of the speed's.
    gain = -math.expm1(-CUTOFF_RAD_S / rate_hz)
    return 5.0 * (angle_noise * rate_hz * gain * math.sqrt(2.0 / (2.0 - gain)))


def passive_damping(stiffness: float, damping: float, rate_hz: float) -> float:
    """Return the damping a device needs to render these passively, N·m·s/rad."""
    # Colgate, Schenkel (1997), J. Robot. Syst. 14(1), 37-47: at every frequency above
    # T / (2 (1 - cos ωT)) Re{(1 - exp(-jωT)) H(exp(jωT))}. For K + B·s behind the
    # low-pass that is largest at the Nyquist rate; without the motor's own delay.
    gain = -math.expm1(-CUTOFF_RAD_S / rate_hz)
    return 0.5 * stiffness / rate_hz + damping * gain / (2.0 - gain)


def raised_cosine(duration_s: float, rate_hz: float) -> tuple[float, ...]:
    """Return which share of a torque is left in each tick of its end, 0 in the last.

    The steepest fall from one tick to the next is π/2 over the number of ticks.
    """
    n_ticks = math.ceil(duration_s * rate_hz - 1e-9)
    return tuple(
        0.5 * (1.0 + math.cos(math.pi * tick / n_ticks))
        for tick in range(1, n_ticks + 1)
    )
