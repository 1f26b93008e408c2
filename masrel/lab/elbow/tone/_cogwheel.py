"""Cogwheel rigidity: lead-pipe rigidity that gives way at regular times."""

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from masrel.errors import ParameterError
from masrel.lab.elbow._motion import Floats, Motion
from masrel.lab.elbow.tone._lead_pipe import LeadPipe, RigidStepper
from masrel.lab.elbow.tone._model import ToneEvent, events_at, quantity
from masrel.lab.elbow.tone._passages import movements


@dataclass(frozen=True, slots=True, kw_only=True)
class Cogwheel(LeadPipe):
    """Rigidity that gives way f times a second while the arm moves.

    τ = τ_lead-pipe - m·g·F·z/z_c, where g is 1 in the last share d of every period 1/f
    since the movement began, and 0 else. A movement begins where the arm becomes as
    fast as ω_th and ends where it becomes slower or turns. A gap opens and closes
    along a raised cosine.

    Attributes
    ----------
    gap_rate : float
        f, Hz. 6 to 9 Hz is the postural tremor, cited from memory; the value is a
        choice of ours, not from a source.
    gap_depth : float
        m: share of the bristle's torque that a gap takes, at most 1. A choice of
        ours, not from a source.
    gap_share : float
        d: share of a period that is gap. A choice of ours, not from a source.
    gap_edge : float
        How long a gap takes to open, and to close, s; 0 for steps. A choice of ours,
        not from a source.
    movement_speed : float
        ω_th, rad/s. A choice of ours, not from a source.
    coulomb_torque, stiffness, damping, bristle_travel, rest_angle : float
        As of `LeadPipe`. A choice of ours, not from a source.
    range_end, speed_threshold : float
        As of the spastic elbow, rad and rad/s.

    Raises
    ------
    ParameterError
        If a parameter is not finite or outside its range, or the edges are longer
        than a gap; the message names it.

    Examples
    --------
    >>> joint = Cogwheel.of_updrs(3)
    >>> round(joint.gap_rate, 1), round(joint.coulomb_torque, 1)
    (6.0, 1.6)
    """

    kind: ClassVar[str] = "cogwheel-rigidity"
    is_passive: ClassVar[bool] = False  # a gap that ends while it sticks pushes

    gap_rate: float = quantity(6.0, "Hz", "frequency")
    gap_depth: float = quantity(0.5, "", "share")
    gap_share: float = quantity(0.4, "", "share")
    gap_edge: float = quantity(0.010, "s", "not negative")
    movement_speed: float = quantity(math.radians(5.0), "rad/s", "positive")

    def _check_together(self) -> None:
        longest = 0.5 * self.gap_share / self.gap_rate
        if self.gap_edge > longest:
            raise ParameterError(
                f"gap_edge: needs at most half a gap, {longest:g} s, "
                f"got {self.gap_edge:g} s"
            )

    def stepper(self, start_angle: float) -> "CogwheelStepper":
        """Return the joint as a state machine that has not seen a sample yet."""
        del start_angle
        return CogwheelStepper(self)

    def _gap(self, since: float) -> float:
        # how far a gap is open, 0 to 1, so long after the onset of the movement, s
        period = 1.0 / self.gap_rate
        # a gap that begins now but for rounding has begun
        left = period - math.fmod(since + 1e-12, period)
        inside = self.gap_share * period - left
        if inside < 0.0:
            return 0.0
        return _edge(inside, self.gap_edge) * _edge(left, self.gap_edge)

    def _give_way(self, torque: float, bristle: float, gap: float) -> float:
        lost = self.gap_depth * gap * self.coulomb_torque
        return torque - lost * bristle / self.bristle_travel

    def events(self, motion: Motion) -> tuple[ToneEvent, ...]:
        """Return when gaps begin and end and the bristle slips and sticks, in order."""
        times = [(event.name, event.time) for event in LeadPipe.events(self, motion)]
        period = 1.0 / self.gap_rate
        for begun, until in movements(motion, self.movement_speed):
            for n in range(math.ceil((until - begun) * self.gap_rate)):
                opens = begun + (n + 1.0 - self.gap_share) * period
                closes = min(begun + (n + 1.0) * period, until)
                if opens < until:
                    times += [("gap", opens), ("gap ends", closes)]
        return events_at(motion, times)

    def _torque(
        self, motion: Motion, times: Floats, angle: Floats, velocity: Floats
    ) -> Floats:
        torque = LeadPipe._torque(self, motion, times, angle, velocity)
        gap = np.zeros(times.size)
        for begun, until in movements(motion, self.movement_speed):
            last = self._gap(until - begun)
            for i in np.flatnonzero((times >= begun) & (times < until + self.gap_edge)):
                since = float(times[i]) - begun
                over = float(times[i]) - until
                gap[i] += self._gap(since) if over < 0.0 else self._closing(last, over)
        rows = zip(torque, self._bristles(motion, times), gap, strict=True)
        return np.array([self._give_way(*row) for row in rows])

    def _closing(self, last: float, over: float) -> float:
        # a gap in which the movement ended closes as any other does
        return last * (1.0 - _edge(over, self.gap_edge))


class CogwheelStepper(RigidStepper):
    """Cogwheel rigidity that sees one sample at a time."""

    __slots__ = ("_cogwheel", "_ended", "_last", "_onset", "_way")

    def __init__(self, model: Cogwheel) -> None:
        super().__init__(model)
        self._cogwheel = model
        self._way = 0  # of the movement, 0 at rest
        self._onset = 0.0  # s
        self._ended = -math.inf  # when the movement before ended, s
        self._last = 0.0  # how far its last gap was open

    def release(self) -> None:
        """Straighten the bristle, and begin anew."""
        super().release()
        self._way, self._last = 0, 0.0

    def step(self, time_s: float, angle: float, velocity: float) -> float:
        """Decide the torque of one sample, N·m."""
        model = self._cogwheel
        slow = abs(velocity) < model.movement_speed
        way = 0 if slow else (1 if velocity > 0.0 else -1)
        if way != self._way:
            if self._way:
                self._last = model._gap(time_s - self._onset)
                self._ended = time_s
            self._way, self._onset = way, time_s
        gap = model._gap(time_s - self._onset) if way else 0.0
        gap += model._closing(self._last, time_s - self._ended)
        torque = super().step(time_s, angle, velocity)
        return model._give_way(torque, self._bristle, gap)


def _edge(since: float, length: float) -> float:
    # a raised cosine from 0 to 1 over `length`
    if since >= length:
        return 1.0
    return 0.5 - 0.5 * math.cos(math.pi * since / length)
