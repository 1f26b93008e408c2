"""What the arm did a fixed time ago, sample by sample."""

from collections import deque

_ROUNDING_S = 1e-6  # a sample as old as the delay but for this is old enough


class DelayLine:
    """Give the latest sample that is as old as the delay.

    At a regular rate that is a whole number of samples; after a missed tick the line
    is still right. Before the first sample is old enough the arm is taken to have
    rested where it was then.
    """

    __slots__ = ("_delay", "_late", "_samples")

    def __init__(self, delay: float) -> None:
        self._delay = delay - _ROUNDING_S
        self._samples: deque[tuple[float, float, float]] = deque()
        self._late: tuple[float, float] | None = None

    def step(self, time_s: float, angle: float, velocity: float) -> tuple[float, float]:
        """Take a sample in -> angle, rad, and velocity, rad/s, of the late one."""
        samples = self._samples
        samples.append((time_s, angle, velocity))
        late = self._late or (angle, 0.0)
        while samples and time_s - samples[0][0] >= self._delay:
            late = samples.popleft()[1:]
        self._late = late
        return late
