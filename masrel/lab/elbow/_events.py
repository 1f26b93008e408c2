"""The events of a motion, as roots of its pieces: no time stepping.

Source: Park, Kim and Damiano (2012), IEEE TNSRE 20(3), 361-370,
https://doi.org/10.1109/TNSRE.2012.2195330, equations (2), (4), (6) and Fig. 7.
"""

import math
from dataclasses import dataclass, fields
from itertools import pairwise
from typing import NamedTuple

from masrel.errors import ParameterError
from masrel.lab.elbow import _law
from masrel.lab.elbow._law import TorqueLaw
from masrel.lab.elbow._motion import Motion
from masrel.lab.elbow._polynomials import (
    NOTHING,
    TIE,
    Polynomial,
    derivative,
    first_above,
    shifted,
    split_at_roots,
    value,
)
from masrel.lab.elbow.parameters import ElbowParameters
from masrel.lab.recording import PHASES, Phase

__all__ = ["Events", "PhaseSpan", "StretchEvents", "events"]

_PRE_CATCH, CATCH, _POST_CATCH, _OVER = range(4)  # positions in PHASES, but the last


class PhaseSpan(NamedTuple):
    """One phase of a motion.

    Attributes
    ----------
    name : {"pre-catch", "catch", "post-catch"}
        The phase.
    start, end : float
        Times, s.
    start_angle, end_angle : float
        Angles, rad.
    """

    name: Phase
    start: float
    end: float
    start_angle: float
    end_angle: float


@dataclass(frozen=True, slots=True, kw_only=True)
class _Reached:
    """What a stretch may reach."""

    onset: float | None = None
    catch: float | None = None
    catch_angle: float | None = None
    catch_speed: float | None = None
    mean_speed: float | None = None
    peak_end: float | None = None
    catch_end: float | None = None
    post_catch_end: float | None = None


_REACHED = tuple(item.name for item in fields(_Reached))


@dataclass(frozen=True, slots=True, kw_only=True)
class StretchEvents(_Reached):
    """When one stretch catches and goes on; None for what it does not reach.

    Attributes
    ----------
    onset : float
        Speed first reaches ν_th, s.
    catch : float or None
        The catch begins, s.
    catch_angle : float or None
        Angle where it begins, rad.
    catch_speed : float or None
        v_c of (3), rad/s.
    mean_speed : float or None
        Mean speed from onset to catch, rad/s.
    peak_end : float or None
        The peak of (3) ends, s.
    catch_end : float or None
        The catch ends, s; None when the motion ends within it.
    post_catch_end : float or None
        Speed falls below ν_th again after the catch, s; None when it does not.
    """

    onset: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Events(_Reached):
    """When a motion moves, catches, and goes on.

    Attributes
    ----------
    stretches : tuple of StretchEvents
        Every movement in extension that reaches ν_th, in order.
    end : float
        The motion ends, at its own end or at the end of range, s.
    phases : tuple of PhaseSpan
        The phases in order.
    onset, catch, catch_angle, catch_speed : float or None
        As of `StretchEvents`, of the first stretch that catches, or of the first if
        none does; None if there is none.
    mean_speed, peak_end, catch_end, post_catch_end : float or None
        Likewise.
    """

    stretches: tuple[StretchEvents, ...]
    end: float
    phases: tuple[PhaseSpan, ...]


def events(parameters: ElbowParameters, motion: Motion) -> Events:
    """Find the events of a motion.

    Parameters
    ----------
    parameters : ElbowParameters
        The joint.
    motion : Motion
        The motion, SI units.

    Returns
    -------
    Events
        Times within 1e-11 s or 1e-14 of the duration; what the motion does not reach
        is None.

    Raises
    ------
    ParameterError
        If the motion starts at or beyond the end of range.

    Notes
    -----
    Two instants of a piece of the motion that are nearer than 1e-13 of its length are
    one: what would begin at the very end of a piece does so in the next, or not at all.
    A speed that passes ν_th by rounding alone does not pass it.

    Examples
    --------
    HM3 at 92 deg/s catches at L - α v = 115 - 0.35 x 92 = 82.8 deg:

    >>> from math import degrees, radians
    >>> from masrel.lab.elbow import STANDARD_MODELS, ConstantSpeed
    >>> stretch = ConstantSpeed(start=radians(30), end=radians(146), speed=radians(92))
    >>> result = events(STANDARD_MODELS["HM3"], stretch)
    >>> round(degrees(result.catch_angle), 6)
    82.8
    >>> [span.name for span in result.phases]
    ['pre-catch', 'catch', 'post-catch']
    """
    line = timeline(parameters, motion)
    origin = motion.origin
    phases = [
        PhaseSpan(
            PHASES[begun.phase],
            begun.time,
            ended.time,
            origin + begun.angle,
            origin + ended.angle,
        )
        for begun, ended in pairwise([*line.changes, line.end])
        if ended.time > begun.time  # one of no length is left out
    ]
    reached = [{n: getattr(stretch, n) for n in _REACHED} for stretch in line.stretches]
    first = {} if line.first is None else reached[line.stretches.index(line.first)]
    return Events(
        **first,
        stretches=tuple([StretchEvents(**names) for names in reached]),
        end=line.end.time,
        phases=tuple(phases),
    )


@dataclass(slots=True, eq=False)
class Stretch:
    """A movement in extension that reached ν_th, as far as it has got."""

    onset_angle: float  # rad from the motion's origin
    onset: float  # this and the next as of `StretchEvents`
    catch: float | None = None
    catch_angle: float | None = None
    catch_speed: float | None = None
    mean_speed: float | None = None
    peak_end: float | None = None
    catch_end: float | None = None
    post_catch_end: float | None = None
    pre_end: float = 0.0  # τ_pre_end of (3)
    rise: float = 0.0  # H·v_c of (3)


class Change(NamedTuple):
    """The beginning of a phase, or the end of the last."""

    phase: int  # position in PHASES
    time: float  # s
    angle: float  # rad from the motion's origin
    stretch: Stretch | None = None  # whose catch or post-catch it is


class Timeline(NamedTuple):
    """What happens in a motion."""

    law: TorqueLaw  # of pre-catch
    changes: list[Change]  # in order
    stretches: list[Stretch]
    first: Stretch | None  # that catches, or the first of all if none does
    end: Change  # of the motion, or of the range of motion


def timeline(p: ElbowParameters, motion: Motion) -> Timeline:
    """Find out what happens in a motion, piece by piece."""
    if motion.start >= p.range_end:
        raise ParameterError(
            "start: needs less than the end of range, "
            f"{math.degrees(p.range_end):g} degrees, got "
            f"{math.degrees(motion.start):g} degrees"
        )
    machine, limit = _PhaseMachine(p, motion), p.range_end - motion.origin
    near = limit + NOTHING * abs(limit)
    for start, length, angle, slowest, fastest in motion.pieces():
        if not machine.changes:
            machine.changes.append(Change(_PRE_CATCH, 0.0, angle[0]))
        highest = angle[0] + fastest * length if slowest < 0.0 else value(angle, length)
        beyond = None
        if highest > near:
            beyond = first_above(angle, 0.0, length, level=limit)
        until = length if beyond is None else beyond
        if until > 0.0:
            machine.piece(start, angle, until, slowest, fastest)
        if beyond is not None:
            end = Change(_OVER, start + beyond, limit)
            break
    else:
        end = Change(_OVER, motion.duration, motion.end - motion.origin)
    stretches = machine.stretches
    for stretch in stretches:
        if stretch.peak_end is not None:  # the catch may end before
            left = end.time if stretch.catch_end is None else stretch.catch_end
            stretch.peak_end = min(stretch.peak_end, left)
    caught = [stretch for stretch in stretches if stretch.catch is not None]
    first = next(iter(caught or stretches), None)
    return Timeline(machine.law, machine.changes, stretches, first, end)


class _PhaseMachine:
    """The state machine of Fig. 7, led from piece to piece instead of sampled."""

    def __init__(self, p: ElbowParameters, motion: Motion) -> None:
        self.p, self.origin = p, motion.origin
        rest = motion.start if p.rest_angle is None else p.rest_angle
        self.law = _law.pre_catch(p, rest - self.origin)
        self.constant = p.catch_angle_constant - self.origin  # L
        smallest, largest = _law.catch_bounds(p, self.origin)
        # θ_catch jumps at ν_H where ν_L is above that
        self.jumps = smallest > largest
        self.lowest, self.highest = sorted((smallest, largest))
        self.goal = math.inf  # angle at which the catch ends, rad from the origin
        self.is_armed = True
        self.since: float | None = None  # time since onset, of a movement in pre-catch
        self.changes: list[Change] = []  # the last is the phase it is in
        self.stretches: list[Stretch] = []

    def piece(
        self,
        start: float,
        angle: Polynomial,
        length: float,
        slowest: float,
        fastest: float,
    ) -> None:
        """Go through a piece, cut where its speed passes ν_th either way."""
        threshold = self.p.speed_threshold
        if slowest > threshold:
            self.fast(start, angle, length, may_catch=True)
        elif fastest <= -threshold:
            self.flexed(start, angle[0])
        elif -threshold < slowest and fastest < threshold:
            self.slow(start, angle, 0.0, length, fastest)
        else:
            speed = derivative(angle)
            cuts = split_at_roots(speed, length, (threshold, -threshold))
            for low, high in pairwise(cuts):
                middle = value(speed, 0.5 * (low + high))
                if len(speed) > 1:  # no more than touched
                    middle *= 1.0 - NOTHING
                if middle <= -threshold:
                    self.flexed(start + low, value(angle, low))
                elif middle < threshold:
                    self.slow(start, angle, low, high, fastest)
                else:
                    part = shifted(angle, low) if low else angle
                    may_catch = middle > threshold
                    self.fast(start + low, part, high - low, may_catch=may_catch)

    def flexed(self, time: float, angle: float) -> None:
        # the stretch is over, and the next may catch
        phase, _, _, stretch = self.changes[-1]
        if stretch is not None:
            if phase == CATCH:
                stretch.catch_end = time
            else:
                stretch.post_catch_end = time
            self.changes.append(Change(_PRE_CATCH, time, angle))
        self.is_armed, self.since = True, None

    def slow(
        self, start: float, angle: Polynomial, low: float, high: float, fastest: float
    ) -> None:
        if (
            self.changes[-1].phase == CATCH
            and value(angle, low) + fastest * (high - low) > self.goal
        ):
            low = self.leave_catch(start, angle, low, high, grows=False)
        if self.changes[-1].phase == _POST_CATCH:  # ends below ν_th, Fig. 7
            self.stretches[-1].post_catch_end = start + low
            self.changes.append(Change(_PRE_CATCH, start + low, value(angle, low)))
        self.since = None

    def fast(
        self, start: float, angle: Polynomial, length: float, *, may_catch: bool
    ) -> None:
        at = 0.0
        if self.changes[-1].phase == _PRE_CATCH:
            if self.since is None:
                self.since = 0.0
                self.stretches.append(Stretch(angle[0], start))
            place = None
            if may_catch and self.is_armed:
                place = self.catch_place(angle, length)
            if place is None:
                self.since += length
                return
            self.catch(start, angle, place)
            at = place
        if self.changes[-1].phase == CATCH:
            self.leave_catch(start, angle, at, length, grows=True)

    def catch_place(self, angle: Polynomial, length: float) -> float | None:
        """Where a piece of a movement first passes the catch angle; θ only grows."""
        end = value(angle, length)
        if end <= self.lowest:
            return None
        p, onset = self.p, self.stretches[-1].onset_angle
        way, since = angle[1:], [1.0]  # both over the time, in the piece of the onset
        if self.since:
            top = end + p.catch_slope * (end - onset) / self.since
            if not self.jumps and end <= self.highest and top <= self.constant:
                return None  # even at its end, with the mean speed too large
            way, since = [angle[0] - onset, *angle[1:]], [self.since, 1.0]
        if self.jumps:
            line = _law.slow_line(p, way, since)
        else:
            line = _law.catch_line(p, self.constant, angle, way, since)
        place = first_above(line, 0.0, length)
        if place is not None and value(angle, place) < self.lowest:
            place = first_above(angle, place, length, level=self.lowest, grows=True)
            if place is not None:
                place = first_above(line, place, length)
        if end > self.highest and (place is None or value(angle, place) > self.highest):
            place = first_above(angle, 0.0, length, level=self.highest, grows=True)
        is_tie = place is not None and length - place <= TIE * length
        return None if is_tie else place

    def catch(self, start: float, angle: Polynomial, at: float) -> None:
        p, stretch = self.p, self.stretches[-1]
        speeds = derivative(angle)
        time, there, speed = start + at, value(angle, at), value(speeds, at)
        if self.since:
            stretch.mean_speed = (there - stretch.onset_angle) / (self.since + at)
        else:
            stretch.mean_speed = value(angle[1:], at)
        stretch.catch, stretch.catch_speed = time, speed
        stretch.catch_angle = self.origin + there
        stretch.pre_end = self.law.commanded(there, speed)
        if p.inertia:
            stretch.pre_end += p.inertia * value(derivative(speeds), at)
        stretch.rise = p.catch_torque_constant * speed
        stretch.peak_end = time + p.peak_duration
        self.goal = there + p.catch_travel
        self.is_armed, self.since = False, None
        self.changes.append(Change(CATCH, time, there, stretch))

    def leave_catch(
        self, start: float, angle: Polynomial, low: float, high: float, *, grows: bool
    ) -> float:
        # (4): the catch ends when the angle travelled exceeds D
        place = first_above(angle, low, high, level=self.goal, grows=grows)
        if place is None or high - place <= TIE * high:
            return low
        time, stretch = start + place, self.stretches[-1]
        stretch.catch_end = time
        self.changes.append(Change(_POST_CATCH, time, value(angle, place), stretch))
        return place
