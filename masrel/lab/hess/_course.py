"""How often an arm may be stretched; the progress and the end of a presentation."""

import math
from dataclasses import dataclass

from masrel.errors import LimitExceededError, ParameterError
from masrel.lab.hess._signals import Flexion, speed_margin
from masrel.lab.hess.limits import DeviceLimits, _check_positive
from masrel.lab.recording import PHASES

_PRE_CATCH = PHASES.index("pre-catch")
_NEVER = math.inf

# An arm has been brought back that is as near to where its stretch began as this share
# of the way that told that it had begun.
_BROUGHT_BACK = 0.5


@dataclass(frozen=True, slots=True, kw_only=True)
class StretchRules:
    """How often an arm may be stretched in one presentation, and for how long.

    With one stretch the presentation is over when the arm has arrived; the times below
    do not matter then. With several, a stretch is over when the arm has arrived or was
    brought back. The next one is armed by flexing it faster than ν_th by 5 deg or for
    100 ms, as a catch seldom throws a soft hand back; where nothing was caught, by
    bringing it back at any speed. The last one can be held like every other: all is
    over when the arm is brought back.

    Attributes
    ----------
    n : int or None, optional
        Stretches of a presentation; None for as many as wanted, until
        `PresentationStatus.done`.
    time_limit : float, optional
        How long after the first stretch began another one may begin, s. Then the
        presentation is over as soon as no stretch goes on.
    stretch_limit : float, optional
        How long a stretch may take, s; a longer one is a fault of the kind
        ``"stretch-limit"``.

    Raises
    ------
    ParameterError
        If `n` is not 1 or more, or a time is not finite and above 0.

    Examples
    --------
    >>> StretchRules(n=None).time_limit
    60.0
    """

    n: int | None = 1
    time_limit: float = 60.0
    stretch_limit: float = 20.0

    def __post_init__(self) -> None:
        if self.n is not None and self.n < 1:
            raise ParameterError(f"n: needs 1 stretch or more, got {self.n}")
        _check_positive(time_limit=self.time_limit, stretch_limit=self.stretch_limit)


class PresentationStatus:
    """What the loop and whoever is with the rater tell each other, while it runs.

    Either side writes its own attributes and reads the other's; nobody waits.

    Attributes
    ----------
    is_done : bool
        Whether the rater has said so; written by `done`.
    is_armed : bool
        Whether the next extension begins a stretch; written by the loop.
    n_stretches : int
        Stretches that are over; written by the loop.

    Examples
    --------
    >>> status = PresentationStatus()
    >>> status.done()
    >>> status.is_done
    True
    """

    def __init__(self) -> None:
        self.is_done = False
        self.is_armed = False
        self.n_stretches = 0

    def done(self) -> None:
        """Say that the rater needs no more: the presentation ends where the arm is."""
        self.is_done = True


class Course:
    """Follow the arm through its stretches, and say when the presentation is over."""

    def __init__(
        self,
        rules: StretchRules,
        limits: DeviceLimits,
        status: PresentationStatus,
        *,
        rate_hz: int,
        end_angle: float,
        speed_threshold: float,
    ) -> None:
        margin = speed_margin(limits.encoder_noise, rate_hz)
        self._arrival_speed = limits.arrival_speed + margin
        self._arrival_time = limits.arrival_time
        self._end_angle = end_angle - limits.arrival_angle
        self._resting_since = _NEVER
        self._is_single = rules.n == 1
        self._n = math.inf if rules.n is None else rules.n
        self._time_limit, self._stretch_limit = rules.time_limit, rules.stretch_limit
        self._over_at = math.inf  # when no stretch may begin any more, s
        self._flexion, self._is_flexed = Flexion(speed_threshold), False
        self._begins_after = limits.arrival_angle
        self._begun_at = 0.0  # the stretch, s
        self._has_caught = False  # in the stretch
        self._back_at = -math.inf  # where the arm is brought back, rad
        self._lowest_angle = math.inf  # since the next stretch is armed, rad
        self.stretch = 0  # the number of the one that goes on, 0 between
        self.status = status
        status.is_armed, status.n_stretches = True, 0

    def update(self, time_s: float, angle: float, velocity: float, phase: int) -> str:
        """Take one sample in -> why the presentation is over, empty while it is not."""
        if self.status.is_done:
            return "done"
        has_arrived = False
        if angle < self._end_angle or abs(velocity) > self._arrival_speed:
            self._resting_since = _NEVER
        elif self._resting_since == _NEVER:
            self._resting_since = time_s
        else:
            has_arrived = time_s - self._resting_since >= self._arrival_time
        if self._is_single:
            if not self.stretch:
                self._watch_for_onset(time_s, angle)
            return "arrived" if has_arrived else ""
        self._is_flexed = self._flexion.update(time_s, angle, velocity)
        if self.stretch:
            self._has_caught = self._has_caught or phase != _PRE_CATCH
            return self._goes_on(time_s, angle, has_arrived)
        if time_s >= self._over_at:
            return "time-limit"
        if self.status.is_armed:
            self._watch_for_onset(time_s, angle)
            return ""
        return self._watch_for_return(angle)

    def end(self) -> None:
        """Let the stretch that goes on be over."""
        if self.stretch:
            self.status.n_stretches += 1
            self.stretch = 0
        self.status.is_armed = False

    def _watch_for_onset(self, time_s: float, angle: float) -> None:
        if angle < self._lowest_angle:
            self._lowest_angle = angle
        elif angle > self._lowest_angle + self._begins_after:
            self.status.is_armed = False
            self.stretch = self.status.n_stretches + 1
            self._begun_at, self._has_caught = time_s, False
            self._back_at = self._lowest_angle + _BROUGHT_BACK * self._begins_after
            if self._over_at == math.inf:
                self._over_at = time_s + self._time_limit

    def _goes_on(self, time_s: float, angle: float, has_arrived: bool) -> str:
        if has_arrived or self._is_brought_back(angle):
            self.end()
            return self._watch_for_return(angle)
        if time_s - self._begun_at > self._stretch_limit:
            raise LimitExceededError(
                f"stretch limit: needs a stretch that ends within "
                f"{self._stretch_limit:g} s, number {self.stretch} has not ended",
                "stretch-limit",
            )
        return ""

    def _is_brought_back(self, angle: float) -> bool:
        return self._is_flexed or angle <= self._back_at

    def _watch_for_return(self, angle: float) -> str:
        # Until then the last stretch is held, as every other is
        if not self._is_brought_back(angle):
            return ""
        if self.status.n_stretches == self._n:
            return "stretches"
        # The law catches again when the arm was flexed, or if it has not caught yet
        if self._is_flexed or not self._has_caught:
            self._lowest_angle = angle
            self.status.is_armed = True
        return ""
