"""Single stretches in columns: the formulas of one scene over arrays of scenes.

In: parameters by name, and pieces of motions, a row a scene. Out: one output of every
scene, and which scenes floats leave in doubt.
"""

import functools
import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import pairwise
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from masrel.lab.elbow import _law
from masrel.lab.elbow._law import TorqueLaw
from masrel.lab.elbow._motion import Floats
from masrel.lab.elbow._polynomials import (
    NOTHING,
    Number,
    Polynomial,
    bernstein,
    derivative,
    refined_columns,
    shifted,
    value,
)
from masrel.lab.elbow._torque import (
    Section,
    TorqueSegment,
    section_impulse,
    section_peak,
    section_work,
)
from masrel.lab.elbow.motions._prescribed import (
    ConstantSpeed,
    MinimumJerk,
    Trapezoid,
    quintic,
    ramps,
)

_CLOSE = 1e-9
# Of a time, a speed or a line: nearer than that to a tie a scene goes through alone.

Flags = NDArray[np.bool_]
Which = NDArray[np.intp] | slice


class _ColumnPiece(NamedTuple):
    """A piece of many motions, in which the speed rises, falls, or stays."""

    start: Number
    length: Number
    angle: Polynomial

    def rows(self, which: Which) -> "_ColumnPiece":
        start, length, *angle = _rows([self.start, self.length, *self.angle], which)
        return _ColumnPiece(start, length, angle)


def _rows(columns: Sequence[Number], which: Which) -> list[Number]:
    return [c[which] if isinstance(c, np.ndarray) and c.ndim else c for c in columns]


def _chosen(flags: Flags, *, share: float = 1.0) -> Which | None:
    # the rows that are meant; all of them, without a copy, from a share on
    n = np.count_nonzero(flags)
    if n >= share * flags.size:
        return slice(None)
    return np.flatnonzero(flags) if n else None


PIECES: dict[type, Callable[[SimpleNamespace], list[tuple[Any, ...]]]] = {
    ConstantSpeed: lambda motion: [
        (0.0, (motion.end - motion.start) / motion.speed, (0.0, motion.speed))
    ],
    MinimumJerk: lambda motion: quintic(motion.end - motion.start, motion.mean_speed),
    Trapezoid: lambda motion: ramps(
        motion.end - motion.start, motion.speed, motion.acceleration_rate
    ),
}


class SingleStretches:
    """Events and loads of single stretches; nan is what is not reached.

    Angles count from where the stretch starts. What is nearly a tie is in doubt.
    """

    def __init__(
        self, p: SimpleNamespace, start: Floats, pieces: list[tuple[Any, ...]]
    ) -> None:
        self.p, self.start = p, start
        self.pieces = [_ColumnPiece(*piece) for piece in pieces]
        self.constant = p.catch_angle_constant - start  # L
        rest: Number = 0.0
        if not np.isnan(p.rest_angle).all():
            rest = np.where(np.isnan(p.rest_angle), 0.0, p.rest_angle - start)
        self.law = _law.pre_catch(p, rest)
        self.lowest, self.highest = _law.catch_bounds(p, start)
        # θ_catch jumps at ν_H
        self.is_doubtful: Flags = self.lowest > self.highest
        self.end = self._end()
        self.onset, self.slow = self._movement()
        self.catch, self.angle, self.speed, self.mean_speed, self.pre_end = np.full(
            (5, start.size), math.nan
        )
        self._catch()
        self.rise = p.catch_torque_constant * self.speed
        goal = self.angle + p.catch_travel  # (4)
        self.catch_end = self._before_end(self._reached(goal))
        self.left = np.where(np.isnan(self.catch_end), self.end, self.catch_end)
        # nan unless both are reached
        self.post_catch_end = np.maximum(self.slow, self.catch_end)

    def output(self, name: str) -> Floats:
        """One output by its name."""
        if name == "catch_angle":
            return np.asarray(self.start + self.angle)
        if name == "catch_speed":
            return np.asarray(self.speed)
        if name == "peak_end":
            return np.asarray(np.minimum(self.catch + self.p.peak_duration, self.left))
        if name == "residual_torque":
            return np.asarray(_law.catch(self.p, self.pre_end, self.rise)[1].level)
        if name == "peak_torque":
            return self._peak()
        if name in ("work", "impulse"):
            of_section = section_work if name == "work" else section_impulse
            return np.asarray(sum(map(of_section, self._sections(self._segments()))))
        return np.asarray(getattr(self, name))

    def _before_end(self, time: Floats) -> Floats:
        # nan where it is not before the end
        self.is_doubtful |= np.abs(time - self.end) <= _CLOSE * self.end
        return np.where(time < self.end, time, math.nan)

    def _end(self) -> Floats:
        last = self.pieces[-1]
        whole, top = last.start + last.length, value(last.angle, last.length)
        limit = self.p.range_end - self.start
        is_cut = top - limit > NOTHING * top
        self.ends_in_range = not is_cut.any()
        if self.ends_in_range:
            return np.asarray(whole)
        self.is_doubtful |= is_cut & (top - limit < _CLOSE * top)
        return np.where(is_cut, self._reached(limit), whole)

    def _reached(self, goal: Floats) -> Floats:
        # when the angle, which grows, reaches a goal; nan if it does not
        time = np.full(goal.shape, math.nan)
        for piece in self.pieces:
            here = (goal > piece.angle[0]) & (goal <= value(piece.angle, piece.length))
            share = 0.2 if len(piece.angle) == 2 else 1.0  # lines cost less than copies
            if (rows := _chosen(here, share=share)) is not None:
                start, length, angle = piece.rows(rows)
                line = [angle[0] - goal[rows], *angle[1:]]
                place = start + refined_columns(line, 0.0, length)
                time[rows] = np.where(here[rows], place, time[rows])
        return time

    def _movement(self) -> tuple[Floats, Floats]:
        # when the speed reaches ν_th, and when it is below again
        threshold = self.p.speed_threshold
        onset, slow = (np.full(self.start.shape, math.nan) for _ in range(2))
        for piece in self.pieces:
            start, length, angle = piece
            speed, lasts = derivative(angle), length > 0.0
            first = speed[0] - threshold
            is_near = np.abs(first) <= _CLOSE * threshold
            at_once = lasts & (first > 0.0)
            if piece is not self.pieces[0]:
                at_once = at_once & np.isnan(onset)
            onset = np.where(at_once, start, onset)
            if len(speed) > 1:
                last = value(speed, length) - threshold
                is_near = is_near | (np.abs(last) <= _CLOSE * threshold)
                rises = lasts & (first < 0.0) & (last > 0.0)
                self._crossed(piece, onset, rises, 1.0)
                self._crossed(piece, slow, lasts & (first > 0.0) & (last < 0.0), -1.0)
            self.is_doubtful |= lasts & is_near
        if self.ends_in_range:
            return onset, slow
        return self._before_end(onset), self._before_end(slow)

    def _crossed(
        self, piece: _ColumnPiece, times: Floats, which: Flags, sign: float
    ) -> None:
        if (rows := _chosen(which)) is not None:
            start, length, angle = piece.rows(rows)
            (threshold,) = _rows([self.p.speed_threshold], rows)
            speed = [sign * c for c in derivative(angle)]
            speed[0] = speed[0] - sign * threshold
            times[rows] = start + refined_columns(speed, 0.0, length)

    def _catch(self) -> None:
        stop = np.fmin(self.slow, self.end)
        first = self.pieces[0]
        for piece in self.pieces:
            begin = np.maximum(self.onset, piece.start)
            until = np.minimum(stop, piece.start + piece.length)
            top = value(piece.angle, until - piece.start)
            is_open = (until > begin) & (top > self.lowest)
            if piece is not first:
                is_open &= np.isnan(self.catch)
            if (rows := _chosen(is_open)) is not None:
                # the speed reaches ν_th in the first piece, if it does
                times = begin[rows], until[rows], top[rows]
                self._catch_in(piece, rows, *times, is_first=piece is first)

    def _catch_in(
        self,
        piece: _ColumnPiece,
        rows: Which,
        begin: Floats,
        until: Floats,
        top: Floats,
        *,
        is_first: bool,
    ) -> None:
        start, _, angle = piece.rows(rows)
        slope, constant, onset = _rows(
            [self.p.catch_slope, self.constant, self.onset], rows
        )
        width = until - begin
        way: Polynomial
        if not is_first:
            first = self.pieces[0].rows(rows)
            way = [angle[0] - value(first.angle, onset), *angle[1:]]
            since = [start - onset, 1.0]
        else:  # both over the time, in the piece of the onset
            angle = shifted(angle, onset) if onset.any() else angle
            way, since = angle[1:], [1.0]
        p = SimpleNamespace(catch_slope=slope)
        line = _law.catch_line(p, constant, angle, way, since)
        place, doubt = _first_rise(line, width)
        low, high = self.lowest[rows], self.highest[rows]
        here = value(angle, place)
        _reach(angle, low, width, place, here < low)
        is_late = np.isnan(place) | (here > high)
        _reach(angle, high, width, place, is_late & (top > high))
        self.is_doubtful[rows] |= doubt | (width - place <= _CLOSE * width)
        self._begin(rows, begin, place, angle, value(way, place) / value(since, place))

    def _begin(
        self,
        rows: Which,
        begin: Floats,
        place: Floats,
        angle: Polynomial,
        mean: Floats,
    ) -> None:
        # the state at the catch; nan where there is none
        none, speeds = 0.0 * place, derivative(angle)
        state, speed = value(angle, place), value(speeds, place) + none
        self.catch[rows], self.angle[rows] = begin + place, state
        self.speed[rows], self.mean_speed[rows] = speed, mean + none
        law = TorqueLaw(*_rows(self.law, rows))
        self.pre_end[rows] = _torque(law, speeds, place, state, speed)

    def _segments(self) -> list[TorqueSegment]:
        p, end, none = self.p, self.end, np.isnan(self.catch)
        left, slowed = self.left, self.post_catch_end
        catch, slowed = (
            np.where(none, end, self.catch),
            np.where(np.isnan(slowed), end, slowed),
        )
        pre_end, rise, travelled = (
            np.where(none, 0.0, column)
            for column in (self.pre_end, self.rise, self.angle + p.catch_travel)
        )
        peak, residual = _law.catch(p, pre_end, rise)
        post = _law.post_catch(p, residual.level, pre_end, travelled, self.law.origin)
        risen, laid = catch, [TorqueSegment(np.zeros(end.shape), catch, self.law)]
        if np.any(p.catch_rise):
            risen = np.minimum(catch + p.catch_rise, left)
            onset = rise, np.where(p.catch_rise, p.catch_rise, 1.0)
            laid.append(TorqueSegment(catch, risen, TorqueLaw(pre_end, onset=onset)))
        fallen = np.minimum(catch + p.peak_duration, left)
        return [
            *laid,
            TorqueSegment(risen, fallen, peak),
            TorqueSegment(fallen, left, residual),
            TorqueSegment(left, slowed, post),
            TorqueSegment(slowed, end, self.law),
        ]

    def _sections(self, segments: Iterable[TorqueSegment]) -> Iterator[Section]:
        # what the segments and the pieces have in common; of length 0 where nothing
        for segment in segments:
            for start, length, angle in self.pieces:
                low = np.maximum(segment.start - start, 0.0)
                until = np.minimum(segment.end - start, length)
                if (until > low).any():
                    part = shifted(angle, low) if low.any() else angle
                    torque = segment.law.along(part, start + low - segment.start)
                    yield Section(np.maximum(until - low, 0.0), part, torque)

    def _peak(self) -> Floats:
        before, *levels, after, slowed = self._segments()
        best = np.full(self.end.shape, -math.inf)
        for segment in levels:  # of the catch
            lasts = segment.end > segment.start
            best = np.where(lasts, np.maximum(best, _last_level(segment)), best)
        for segment in (slowed, after, before):
            for start, length, angle in self.pieces:
                low = np.maximum(segment.start - start, 0.0)
                high = np.minimum(segment.end - start, length)
                if not (lasts := high > low).any():
                    continue
                bound = _bound(segment.law, angle, low, high)
                if len(angle) == 2:  # along a line the end has the largest
                    best = np.where(lasts, np.maximum(best, bound), best)
                elif (rows := _chosen(lasts & (bound > best))) is not None:
                    law, part = TorqueLaw(*_rows(segment.law, rows)), _rows(angle, rows)
                    peak = _moving_peak(law, part, low[rows], high[rows], best[rows])
                    best[rows] = np.maximum(best[rows], peak)
        return best


def _torque(
    law: TorqueLaw, speeds: Polynomial, at: Floats, angle: Number, speed: Number
) -> Number:
    # at a time of a piece whose angle and speed there are known
    torque = law.commanded(angle, speed)
    if np.any(law.inertia):
        torque = torque + law.inertia * value(derivative(speeds), at)
    return torque


def _last_level(segment: TorqueSegment) -> Number:
    # the largest torque of the catch: a smoothed onset only rises
    if segment.law.onset is None:
        return segment.law.level
    rise, time = segment.law.onset
    return segment.law.level + rise * _law.onset_share(
        (segment.end - segment.start) / time
    )


def _bound(law: TorqueLaw, angle: Polynomial, low: Floats, high: Floats) -> Floats:
    # no torque between two times is larger; the angle grows, the speed goes one way
    speeds = derivative(angle)
    fastest = speeds[0]
    if len(speeds) > 1:
        fastest = np.maximum(value(speeds, low), value(speeds, high))
    bound = law.commanded(value(angle, high), fastest)
    if np.any(law.inertia):
        accelerations = bernstein(derivative(shifted(speeds, low)), high - low)
        bound = bound + law.inertia * functools.reduce(np.maximum, accelerations)
    return np.asarray(bound)


def _moving_peak(
    law: TorqueLaw, angle: Polynomial, low: Floats, high: Floats, best: Floats
) -> Floats:
    # the largest torque between two times; where it turns only if that may be the best
    start, end = (
        _torque(law, derivative(angle), x, value(angle, x), value(derivative(angle), x))
        for x in (low, high)
    )
    peak = np.maximum(start, end)
    torque = law.along(shifted(angle, low), 0.0)
    bound = functools.reduce(np.maximum, bernstein(torque, high - low))
    if (rows := _chosen(bound > np.maximum(best, peak))) is not None:
        turns = _turning_peak(_rows(torque, rows), (high - low)[rows])
        peak[rows] = np.maximum(peak[rows], turns)
    return np.asarray(peak)


def _first_rise(line: Polynomial, width: Floats) -> tuple[Floats, Flags]:
    # where a line is first above 0, nan if it is not; and which need another look
    b = bernstein(line, width)
    sizes = list(map(np.abs, b))
    is_near = sizes[0] <= _CLOSE * functools.reduce(np.maximum, sizes)
    if len(b) == 2:
        return np.where(
            b[1] > 0.0, refined_columns(line, 0.0, width), math.nan
        ), is_near
    above, changes = _signs(b)
    place = np.where(above[0], 0.0, math.nan)
    if (rows := _chosen((changes == 1) & above[-1])) is not None:
        place[rows] = refined_columns(_rows(line, rows), 0.0, width[rows])
    return place, is_near | (changes + above[0] > 1)


def _signs(b: Sequence[Number]) -> tuple[list[Flags], NDArray[np.int8]]:
    # which Bernstein coefficients are above 0, and how often that changes
    above = [np.greater(c, 0.0) for c in b]
    return above, sum((u != v).astype(np.int8) for u, v in pairwise(above))


def _reach(
    angle: Polynomial, goal: Floats, width: Floats, place: Floats, which: Flags
) -> None:
    # set some places to where a growing angle reaches a goal
    if (rows := _chosen(which)) is not None:
        first, *others = _rows(angle, rows)
        line = [first - goal[rows], *others]
        root = refined_columns(line, 0.0, width[rows])
        place[rows] = np.where(line[0] >= 0.0, 0.0, root)


def _turning_peak(torque: Polynomial, length: Floats) -> Floats:
    # the largest value at the inner maxima of polynomials; -inf without one
    falls = [-c for c in derivative(torque)]
    above, changes = _signs(bernstein(falls, length))
    largest = np.full(length.shape, -math.inf)
    rows = _chosen((changes == 1) & above[-1])  # rises, then falls
    if rows is not None:
        x = refined_columns(_rows(falls, rows), 0.0, length[rows])
        largest[rows] = value(_rows(torque, rows), x)
    for i in np.flatnonzero(changes > 1).tolist():
        one = [float(np.broadcast_to(c, length.shape)[i]) for c in torque]
        largest[i] = section_peak(Section(float(length[i]), [0.0], one))
    return largest
