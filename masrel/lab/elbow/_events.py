"""The events of a motion, as roots of its pieces: no time stepping.

Source: Park, Kim and Damiano (2012), IEEE TNSRE 20(3), 361-370,
https://doi.org/10.1109/TNSRE.2012.2195330, equations (2), (4), (6) and Fig. 7.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields
from itertools import pairwise
from math import nan
from typing import Any, NamedTuple

import numpy as np

from masrel.errors import ParameterError
from masrel.lab.elbow._polynomials import (
    NOTHING,
    TIE,
    Flag,
    Number,
    Polynomial,
    derivative,
    first_above,
    greatest,
    known,
    least,
    pick,
    shifted,
    some,
    split_at_roots,
    value,
)
from masrel.lab.elbow.motions import Motion, Piece
from masrel.lab.elbow.parameters import (
    CATCH,
    POST_CATCH,
    PRE_CATCH,
    ElbowParameters,
    catch_bounds,
    catch_line,
    pre_catch_law,
    slow_line,
)
from masrel.lab.recording import PHASES, Phase

__all__ = ["Events", "PhaseSpan", "StretchEvents", "events"]


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
        none does; None if there is no stretch.
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
    line = Timeline(parameters, motion)
    marks = phase_marks(line)
    phases = [
        PhaseSpan(
            PHASES[phase], time, end, line.origin + angle, line.origin + end_angle
        )
        for (phase, time, angle), (_, end, end_angle) in pairwise(marks)
        if end > time  # one of no length is left out
    ]
    names: list[dict[str, Any]] = [
        {n: None if (x := getattr(stretch, n)) != x else x for n in _REACHED}
        for stretch in (line.first, *line.stretches)
    ]
    return Events(
        **names[0],
        stretches=tuple([StretchEvents(**each) for each in names[1:]]),
        end=line.end,
        phases=tuple(phases),
    )


def phase_marks(line: "Timeline") -> list[tuple[int, float, float]]:
    """Return where phases begin: position in PHASES, s, rad; last the end of all."""
    marks = [(PRE_CATCH, 0.0, line.pieces[0].angle[0])]
    for s in line.stretches:
        marks += [
            (CATCH, s.catch, s.caught_angle),
            (POST_CATCH, s.catch_end, s.left_angle),
            (PRE_CATCH, s.over, s.over_angle),
        ]
    marks = [mark for mark in marks if mark[1] == mark[1]]  # what has come
    return [*marks, (-1, line.end, line.end_angle)]


@dataclass(slots=True, eq=False)
class Stretch:
    """A movement in extension that reached ν_th; nan is what has not come.

    Of one scene each stretch has its own, numbers; of a column of scenes, all of single
    stretches, there is one, and its fields are columns.
    """

    onset: Number = nan  # this and those to `post_catch_end` as of `StretchEvents`
    catch: Number = nan
    catch_angle: Number = nan
    catch_speed: Number = nan
    mean_speed: Number = nan
    peak_end: Number = nan
    catch_end: Number = nan
    post_catch_end: Number = nan
    onset_angle: Number = nan  # these four: rad from the motion's origin
    caught_angle: Number = nan
    left_angle: Number = nan
    over_angle: Number = nan
    over: Number = nan  # s: pre-catch again, at once where a catch is ended by flexing
    pre_end: Number = nan  # τ_pre_end of (3)
    rise: Number = nan  # H·v_c of (3)

    def mark(self, which: Flag, **numbers: Number) -> None:
        """Have some numbers come, in some rows."""
        for name, number in numbers.items():
            if which is not True:  # of columns
                number = pick(which, number, getattr(self, name))
            setattr(self, name, number)


class Timeline:
    """What happens in a motion: the state machine of Fig. 7, led from piece to piece.

    `p` and `motion` may have columns in their fields, one row per scene, if the motion
    is a single stretch. Then whatever happens does so in some rows.
    """

    def __init__(self, p: ElbowParameters, motion: Motion) -> None:
        check_starts(motion.start, p.range_end)
        self.p, self.origin = p, motion.origin
        self.pieces = motion.pieces()
        rest = motion.start
        if p.rest_angle is not None:
            rest = known(p.rest_angle, rest)
        self.law = pre_catch_law(p, rest - self.origin)  # of pre-catch
        self.constant = p.catch_angle_constant - self.origin  # L
        smallest, largest = catch_bounds(p, self.origin)
        # θ_catch jumps at ν_H where ν_L is above that
        self.jumps = smallest > largest
        self.lowest = least(smallest, largest)
        self.highest = greatest(smallest, largest)
        self.phase: Number = PRE_CATCH
        self.is_armed: Flag = True
        self.since: Number = nan  # time since onset, of a movement in pre-catch
        self.goal: Number = math.inf  # where the catch ends, rad from the origin
        self.stretches: list[Stretch] = []
        self.end: Number = nan  # of the motion, or of the range of motion, s
        self.end_angle: Number = motion.end - self.origin
        for piece in self.pieces:
            if not some(is_left := self.end != self.end):
                break
            self._piece(piece, is_left)
        self.end = known(self.end, motion.duration)
        for stretch in self.stretches:  # the catch may end before its peak
            left = known(stretch.catch_end, self.end)
            stretch.peak_end = least(left, stretch.catch + p.peak_duration)
        caught = [s for s in self.stretches if some(s.catch == s.catch)]
        # that catches first, or the first of all if none does
        self.first = (caught or self.stretches or [Stretch()])[0]

    def _piece(self, piece: Piece, is_left: Flag) -> None:
        # cut where the range of motion ends
        start, length, angle, slowest, fastest = piece
        limit, until = self.p.range_end - self.origin, length
        highest = value(angle, length)
        if not isinstance(highest, np.ndarray) and slowest < 0.0:
            highest = angle[0] + fastest * length
        if some(cut := is_left & (highest > limit + NOTHING * abs(limit))):
            beyond = first_above(angle, 0.0, length, level=limit, among=cut)
            cut = beyond == beyond
            until = pick(cut, beyond, length)
            self.end = pick(cut, start + beyond, self.end)
            self.end_angle = pick(cut, limit, self.end_angle)
        until = pick(is_left, until, 0.0)
        if isinstance(until, np.ndarray):
            self._piece_of_rows(start, angle, until, fastest)
        elif until > 0.0:
            self._piece_of_one(start, angle, until, slowest, fastest)

    def _piece_of_one(
        self,
        start: float,
        angle: Polynomial,
        length: float,
        slowest: float,
        fastest: float,
    ) -> None:
        # cut where the speed passes ν_th either way
        threshold = self.p.speed_threshold
        if slowest > threshold:
            self._fast(start, angle, length, may_catch=True)
        elif fastest <= -threshold:
            self._flexed(start, angle[0])
        elif -threshold < slowest and fastest < threshold:
            self._slow(start, angle, 0.0, length, fastest)
        else:
            speed = derivative(angle)
            cuts = split_at_roots(speed, length, (threshold, -threshold))
            for low, high in pairwise(cuts):
                middle = value(speed, 0.5 * (low + high))
                if len(speed) > 1:  # no more than touched
                    middle *= 1.0 - NOTHING
                if middle <= -threshold:
                    self._flexed(start + low, value(angle, low))
                elif middle < threshold:
                    self._slow(start, angle, low, high, fastest)
                else:
                    part, is_more = shifted(angle, low), middle > threshold
                    self._fast(start + low, part, high - low, may_catch=is_more)

    def _piece_of_rows(
        self, start: Number, angle: Polynomial, length: Number, fastest: Number
    ) -> None:
        # the speed is constant, only rises, or only falls
        threshold, speed = self.p.speed_threshold, derivative(angle)
        lasts = length > 0.0
        if len(speed) == 1:
            slow, fast = lasts & (speed[0] < threshold), lasts & (speed[0] >= threshold)
            self._slow(start, angle, 0.0, pick(slow, length, 0.0), fastest)
            may = speed[0] > threshold
            self._fast(start, angle, pick(fast, length, 0.0), may_catch=may)
            return
        falls = some(speed[0] > value(speed, length))
        sign = -1.0 if falls else 1.0
        passed = first_above(
            [sign * c for c in speed], 0.0, length, level=sign * threshold, among=lasts
        )
        passed = known(passed, length)
        if falls:
            self._fast(start, angle, passed, may_catch=True)
            self._slow(start, angle, passed, length, fastest)
        else:
            self._slow(start, angle, 0.0, passed, fastest)
            part = shifted(angle, passed)
            self._fast(start + passed, part, length - passed, may_catch=True)

    def _flexed(self, time: float, angle: float) -> None:
        # the stretch is over, and the next may catch
        if self.phase != PRE_CATCH:
            stretch = self.stretches[-1]
            stretch.mark(True, over=time, over_angle=angle)
            if self.phase == CATCH:
                stretch.mark(True, catch_end=time, left_angle=angle)
            else:
                stretch.mark(True, post_catch_end=time)
        self.phase, self.is_armed, self.since = PRE_CATCH, True, nan

    def _slow(
        self,
        start: Number,
        angle: Polynomial,
        low: Number,
        high: Number,
        fastest: Number,
    ) -> None:
        lasts = high > low
        leaves = lasts & (self.phase == CATCH)
        if some(leaves):
            top = value(angle, low) + fastest * (high - low)
            if some(leaves := leaves & (top > self.goal)):
                low = self._leave_catch(leaves, start, angle, low, high)
        ends = lasts & (self.phase == POST_CATCH)  # below ν_th, Fig. 7
        if some(ends):
            over, there = start + low, value(angle, low)
            stretch = self.stretches[-1]
            stretch.mark(ends, over=over, over_angle=there, post_catch_end=over)
            self.phase = pick(ends, PRE_CATCH, self.phase)
        self.since = pick(lasts, nan, self.since)

    def _fast(
        self, start: Number, angle: Polynomial, length: Number, *, may_catch: Flag
    ) -> None:
        lasts, end, at = length > 0.0, value(angle, length), 0.0
        pre = lasts & (self.phase == PRE_CATCH)
        if some(pre):
            if some(begins := pre & (self.since != self.since)):
                if not self.stretches or not isinstance(begins, np.ndarray):
                    self.stretches.append(Stretch())
                self.stretches[-1].mark(begins, onset=start, onset_angle=angle[0])
                self.since = pick(begins, 0.0, self.since)
            later = pick(pre, self.since + length, self.since)
            ready = pre & self.is_armed & may_catch & (end > self.lowest)
            if some(ready):
                at = self._catch(ready, start, angle, length, end)
            self.since = pick(self.phase == PRE_CATCH, later, nan)
        leaves = lasts & (self.phase == CATCH) & (end > self.goal)
        if some(leaves):
            self._leave_catch(leaves, start, angle, at, length)

    def _catch(
        self, ready: Flag, start: Number, angle: Polynomial, length: Number, end: Number
    ) -> Number:
        # where it catches, else 0
        p, stretch, at = self.p, self.stretches[-1], nan
        # v̄ is way over since; both are over the time, in the piece of the onset
        if some(new := ready & (self.since == 0.0)):
            at = self._catch_place(new, angle, length, end, angle[1:], [1.0])
        if some(later := ready & (self.since > 0.0)):
            top = end + p.catch_slope * (end - stretch.onset_angle) / self.since
            # else not even at its end, with the mean speed too large
            later = later & (self.jumps | (end > self.highest) | (top > self.constant))
        if some(later):
            way, since = [angle[0] - stretch.onset_angle, *angle[1:]], [self.since, 1.0]
            place = self._catch_place(later, angle, length, end, way, since)
            at = pick(later, place, at)
        caught = at == at
        if not some(caught):
            return 0.0
        speeds, time = derivative(angle), self.since + at
        there, speed = value(angle, at), value(speeds, at)
        mean = (there - stretch.onset_angle) / pick(time > 0.0, time, 1.0)
        if some(begun := self.since == 0.0):
            mean = pick(begun, value(angle[1:], at), mean)
        pre_end = self.law.commanded(there, speed)
        if some(p.inertia != 0.0):
            pre_end = pre_end + p.inertia * value(derivative(speeds), at)
        stretch.mark(
            caught,
            catch=start + at,
            catch_angle=self.origin + there,
            catch_speed=speed,
            mean_speed=mean,
            caught_angle=there,
            pre_end=pre_end,
            rise=p.catch_torque_constant * speed,
        )
        self.goal = pick(caught, there + p.catch_travel, self.goal)
        self.is_armed = pick(caught, False, self.is_armed)
        self.phase = pick(caught, CATCH, self.phase)
        return pick(caught, at, 0.0)

    def _catch_place(
        self,
        ready: Flag,
        angle: Polynomial,
        length: Number,
        end: Number,
        way: Polynomial,
        since: Polynomial,
    ) -> Number:
        # where a movement first passes the catch angle; θ only grows
        line = catch_line(self.p, self.constant, angle, way, since)
        if some(self.jumps):
            slow = [*slow_line(self.p, way, since), *[0.0] * len(line)]
            line = [pick(self.jumps, s, c) for s, c in zip(slow, line, strict=False)]
        place = first_above(line, 0.0, length, among=ready)
        if some(low := value(angle, place) < self.lowest):
            begin = first_above(angle, place, length, level=self.lowest, among=low)
            place = pick(low, first_above(line, begin, length, among=low), place)
        top = ready & (end > self.highest)
        if some(top) and some(top := top & ~(value(angle, place) <= self.highest)):
            late = first_above(angle, 0.0, length, level=self.highest, among=top)
            place = pick(top, late, place)
        return pick(length - place <= TIE * length, nan, place)

    def _leave_catch(
        self,
        which: Flag,
        start: Number,
        angle: Polynomial,
        low: Number,
        high: Number,
    ) -> Number:
        # (4): the catch ends when the angle travelled exceeds D
        place = first_above(angle, low, high, level=self.goal, among=which)
        leaves = high - place > TIE * high
        if not some(leaves):
            return low
        stretch, there = self.stretches[-1], value(angle, place)
        stretch.mark(leaves, catch_end=start + place, left_angle=there)
        self.phase = pick(leaves, POST_CATCH, self.phase)
        return pick(leaves, place, low)


def check_starts(start: Number, limit: Number, rows: Sequence[int] = ()) -> None:
    """Refuse a motion, or rows of them, that start at or beyond the end of range."""
    if not some(late := start >= limit):
        return
    i = int(np.argmax(late))
    start, limit = (np.broadcast_to(x, np.shape(late)).flat[i] for x in (start, limit))
    name = f"motions[{rows[i]}].start" if len(rows) else "start"
    raise ParameterError(
        f"{name}: needs less than the end of range, {math.degrees(limit):g} degrees, "
        f"got {math.degrees(start):g} degrees"
    )
