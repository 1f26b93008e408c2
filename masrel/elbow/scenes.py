"""Thousands of scenes at once: one array, a column an output.

In: joints and motions, as objects or as columns. Out: the outputs asked for, of every
scene. Single stretches go through together, by the formulas of one scene over columns;
what floats leave in doubt there, and every other motion, goes through piece by piece.
"""

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import MISSING, dataclass, field, fields
from itertools import chain
from operator import attrgetter
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from masrel.elbow import _law
from masrel.elbow._law import TorqueLaw
from masrel.elbow._polynomials import (
    NOTHING,
    Number,
    Polynomial,
    bernstein,
    derivative,
    refined_columns,
    shifted,
    value,
)
from masrel.elbow.events import first_stretch, rounded, timeline
from masrel.elbow.motion import Floats, Motion
from masrel.elbow.motions.prescribed import (
    ConstantSpeed,
    MinimumJerk,
    Trapezoid,
    quintic,
    ramps,
)
from masrel.elbow.parameters import ElbowParameters
from masrel.elbow.torque import (
    Section,
    TorqueSegment,
    along,
    loads,
    section_impulse,
    section_peak,
    section_work,
)
from masrel.errors import ParameterError

__all__ = ["EVENTS", "LOADS", "Columns", "SceneTable", "evaluate"]

EVENTS = (
    "onset",
    "catch",
    "catch_angle",
    "catch_speed",
    "mean_speed",
    "peak_end",
    "catch_end",
    "post_catch_end",
    "end",
)
"""Outputs that are attributes of `Events`."""

LOADS = ("peak_torque", "residual_torque", "work", "impulse")
"""Outputs that are functions of `masrel.elbow`."""

_CLOSE = 1e-9
# Of a time, a speed or a line: nearer than that to a tie a scene goes through alone.

Flags = NDArray[np.bool_]


class Columns:
    """Many joints, or many motions of one kind: a column a field.

    Parameters
    ----------
    kind : type
        `ElbowParameters`, `ConstantSpeed`, `MinimumJerk` or `Trapezoid`.
    **columns : array_like, shape (n,), or number or str
        The fields of the kind by their names, as arrays or one value for all; those
        with a default may be left out. A `rest_angle` of ``nan`` is the angle where
        the stretch starts.

    Attributes
    ----------
    kind : type
        As given.
    columns : dict of str to ndarray or value
        By name.

    Raises
    ------
    ParameterError
        If the lengths differ, or a row is none that the kind takes; the message says
        which, the first being 1.

    Examples
    --------
    >>> from math import radians
    >>> import numpy as np
    >>> from masrel.elbow import STANDARD_MODELS, ConstantSpeed
    >>> speeds = np.radians([60.0, 92.0, 131.0])
    >>> stretches = Columns(
    ...     ConstantSpeed, start=radians(30), end=radians(146), speed=speeds
    ... )
    >>> table = evaluate(STANDARD_MODELS["HM3"], stretches, ["catch_angle"])
    >>> np.degrees(table.column("catch_angle")).round(2).tolist()
    [94.0, 82.8, 69.15]
    """

    __slots__ = ("_n", "columns", "kind")

    def __init__(self, kind: type, **columns: ArrayLike) -> None:
        if kind is not ElbowParameters and kind not in _PIECES:
            raise ParameterError(
                "kind: needs ElbowParameters, ConstantSpeed, MinimumJerk or Trapezoid, "
                f"got {kind.__name__}"
            )
        self.kind, self.columns = (
            kind,
            {
                name: np.asarray(column) if np.ndim(column) else column
                for name, column in columns.items()
            },
        )
        shapes = {c.shape for c in self.columns.values() if isinstance(c, np.ndarray)}
        if len(shapes) > 1 or any(len(shape) > 1 for shape in shapes):
            raise ParameterError(
                "columns: need one length, got the shapes "
                f"{', '.join(map(str, sorted(shapes)))}"
            )
        self._n: int = next(iter(shapes), (1,))[0]
        for i in self._suspects() if self._n else ():
            try:
                self.row(i)
            except ParameterError as error:
                raise ParameterError(f"row {i + 1}: {error}") from error

    def _suspects(self) -> list[int]:
        # rows with an extreme: if these are valid, all are
        arrays = {k: c for k, c in self.columns.items() if isinstance(c, np.ndarray)}
        rows = {0}
        for column in arrays.values():
            if column.dtype.kind in "US":
                rows.update(np.unique(column, return_index=True)[1].tolist())
            else:
                rows.update((int(np.argmin(column)), int(np.argmax(column))))
        full = SimpleNamespace(**{**_defaults(self.kind), **self.columns})
        for margin in _MARGINS[self.kind](full):
            rows.add(int(np.argmin(margin)))
        return sorted(rows)

    def __len__(self) -> int:
        return self._n

    def row(self, i: int) -> Any:
        """Return the joint or motion of one row.

        Parameters
        ----------
        i : int
            The row, from 0.

        Returns
        -------
        ElbowParameters or Motion
            The object, of `kind`.
        """
        values = {
            name: c[i].item() if isinstance(c, np.ndarray) else c
            for name, c in self.columns.items()
        }
        if values.get("rest_angle") != values.get("rest_angle"):  # nan
            values["rest_angle"] = None
        return self.kind(**values)


@dataclass(frozen=True, slots=True, kw_only=True)
class SceneTable:
    """Outputs of many scenes.

    Attributes
    ----------
    outputs : tuple of str
        Their names.
    values : ndarray, shape (n_scenes, n_outputs)
        SI units; ``nan`` for what a scene does not reach. Read-only.
    n_alone : int
        How many scenes were led through piece by piece, because their motion is not a
        single stretch or something in them is nearly a tie.
    """

    outputs: tuple[str, ...]
    values: Floats = field(compare=False, repr=False)
    n_alone: int

    def column(self, output: str) -> Floats:
        """Return one output of every scene.

        Parameters
        ----------
        output : str
            Its name.

        Returns
        -------
        ndarray, shape (n_scenes,)
            SI units.

        Raises
        ------
        ParameterError
            If it was not asked for.
        """
        if output not in self.outputs:
            raise ParameterError(
                f"output: needs one of {', '.join(self.outputs)}, got {output!r}"
            )
        return np.asarray(self.values[:, self.outputs.index(output)])


def evaluate(
    parameters: ElbowParameters | Sequence[ElbowParameters] | Columns,
    motions: Motion | Sequence[Motion] | Columns,
    outputs: Sequence[str] = ("catch_angle", "peak_torque"),
    *,
    chunk: int = 8192,
) -> SceneTable:
    """Compute outputs of many scenes.

    Parameters
    ----------
    parameters : ElbowParameters, sequence of ElbowParameters, or Columns
        The joints, one a scene; or one for all.
    motions : Motion, sequence of Motion, or Columns
        The motions, one a scene; or one for all.
    outputs : sequence of str, optional
        What is asked for, of `EVENTS` and `LOADS`; nothing else is computed.
    chunk : int, optional
        Scenes at a time: what is needed beside the result does not grow with their
        number.

    Returns
    -------
    SceneTable
        The outputs; those of the functions for one scene, to rounding.

    Raises
    ------
    ParameterError
        If an output is unknown, the numbers of joints and motions do not fit, `chunk`
        is not 1 or more, or a motion starts at or beyond the end of range; the
        message says which scene.

    Examples
    --------
    The standard models, stretched at 92 deg/s: catch angles in degrees, and N·m.

    >>> from math import radians
    >>> from masrel.elbow import STANDARD_MODELS, ConstantSpeed
    >>> stretch = ConstantSpeed(start=radians(30), end=radians(146), speed=radians(92))
    >>> table = evaluate(list(STANDARD_MODELS.values()), stretch)
    >>> np.degrees(table.column("catch_angle")).round(1).tolist()
    [97.8, 87.8, 82.8, 77.8]
    >>> table.column("peak_torque").round(3).tolist()
    [7.999, 8.412, 10.984, 15.424]
    """
    names = tuple(outputs)
    unknown = [name for name in names if name not in _OUTPUTS]
    if unknown or not names:
        raise ParameterError(
            f"outputs: needs some of {', '.join(_OUTPUTS)}, "
            f"got {', '.join(map(repr, unknown)) or 'none'}"
        )
    if chunk < 1:
        raise ParameterError(f"chunk: needs 1 or more, got {chunk}")
    if isinstance(parameters, ElbowParameters) and isinstance(motions, Motion):
        values, n_alone = np.array([_alone(parameters, motions, names)]), 1
    else:
        joints = _listed(parameters, ElbowParameters)
        moves = _listed(motions, Motion)
        values, n_alone = _evaluated(joints, moves, names, chunk)
    values.setflags(write=False)
    return SceneTable(outputs=names, values=values, n_alone=n_alone)


_OUTPUTS = dict.fromkeys(EVENTS + LOADS)


def _alone(
    joint: ElbowParameters, motion: Motion, outputs: tuple[str, ...]
) -> list[float]:
    line = timeline(joint, motion)
    first = first_stretch(line)
    events = None if first is None else rounded(first, motion.origin, line.end)
    row = []
    for name in outputs:
        if name in LOADS:
            row.append(loads(joint, motion, line, name))
        elif name == "end":
            row.append(line.end.time)
        else:
            number = None if events is None else getattr(events, name)
            row.append(math.nan if number is None else number)
    return row


def _listed(items: Any, kind: type) -> Any:
    return [items] if isinstance(items, kind) else items


def _evaluated(
    joints: Sequence[ElbowParameters] | Columns,
    moves: Sequence[Motion] | Columns,
    outputs: tuple[str, ...],
    chunk: int,
) -> tuple[Floats, int]:
    n = max(len(joints), len(moves)) if len(joints) and len(moves) else 0
    if len(joints) not in (1, n) or len(moves) not in (1, n) or n == 0:
        raise ParameterError(
            "parameters, motions: need as many joints as motions, or one of either, "
            f"got {len(joints)} and {len(moves)}"
        )
    values, n_alone = np.empty((n, len(outputs))), 0
    for kind, rows in _groups(moves, n, chunk):
        alone = rows
        if kind in _PIECES:
            p, motion = _joint_columns(joints, rows), _motion_columns(moves, kind, rows)
            _check_starts(motion.start, p.range_end, rows)
            with np.errstate(all="ignore"):  # what is in doubt may be anything
                scenes = _Scenes(p, motion.start, _PIECES[kind](motion))
                for i, name in enumerate(outputs):
                    values[rows, i] = scenes.output(name)
            alone = rows[scenes.is_doubtful]
        for i in alone.tolist():
            joint, motion = _row(joints, i), _row(moves, i)
            _check_starts(np.array([motion.start]), joint.range_end, alone[alone == i])
            values[i] = _alone(joint, motion, outputs)
        n_alone += alone.size
    return values, n_alone


def _check_starts(start: Floats, limit: Number, rows: NDArray[np.intp]) -> None:
    if (late := start >= limit).any():
        i = int(late.argmax())
        raise ParameterError(
            f"motions[{rows[i]}].start: needs less than the end of range, "
            f"{np.degrees(np.broadcast_to(limit, start.shape)[i]):g} degrees, got "
            f"{np.degrees(start[i]):g} degrees"
        )


def _row(items: Any, i: int) -> Any:
    i = 0 if len(items) == 1 else i
    return items.row(i) if isinstance(items, Columns) else items[i]


def _groups(
    moves: Sequence[Motion] | Columns, n: int, chunk: int
) -> Iterator[tuple[type, NDArray[np.intp]]]:
    # rows of motions of one kind, not too many at a time
    if isinstance(moves, Columns):
        groups = {moves.kind: np.arange(n)}
    elif len(kinds := set(map(type, moves))) == 1:
        groups = {kinds.pop(): np.arange(n)}
    else:
        places: dict[type, list[int]] = {}
        for i, motion in enumerate(moves):
            places.setdefault(type(motion), []).append(i)
        groups = {kind: np.array(rows) for kind, rows in places.items()}
    for kind, rows in groups.items():
        for first in range(0, rows.size, chunk):
            yield kind, rows[first : first + chunk]


_NUMBERS = tuple(
    item.name
    for item in fields(ElbowParameters)
    if item.name not in ("rest_angle", "post_catch", "residual_reading")
)


_FIELDS: dict[type, tuple[str, ...]] = {
    kind: tuple(item.name for item in fields(kind))
    for kind in (ConstantSpeed, MinimumJerk, Trapezoid)
}


def _defaults(kind: type) -> dict[str, Any]:
    every = fields(kind)
    return {item.name: item.default for item in every if item.default is not MISSING}


_MARGINS: dict[type, Callable[[SimpleNamespace], list[Any]]] = {
    # what has to be 0 or more, of two fields or more
    ElbowParameters: lambda p: [p.peak_duration - p.catch_rise],
    ConstantSpeed: lambda m: [m.end - m.start],
    MinimumJerk: lambda m: [m.end - m.start],
    Trapezoid: lambda m: [
        m.end - m.start,
        (m.end - m.start) * m.acceleration_rate - m.speed**2,
    ],
}


def _joint_columns(
    joints: Sequence[ElbowParameters] | Columns, rows: NDArray[np.intp]
) -> SimpleNamespace:
    # parameters by name, each a column or one value for all
    if isinstance(joints, Columns):
        p = SimpleNamespace(**_taken(joints, rows))
        rest = p.rest_angle
        p.rest_angle = math.nan if rest is None else rest
    else:
        distinct, index = _distinct(joints, rows)
        p = SimpleNamespace(**_read(distinct, index, _NUMBERS))
        for name in ("rest_angle", "post_catch", "residual_reading"):
            values = list(map(attrgetter(name), distinct))
            if len(set(values)) == 1:
                setattr(p, name, math.nan if values[0] is None else values[0])
            else:
                column = np.array([math.nan if v is None else v for v in values])
                setattr(p, name, column if index is None else column[index])
    decrease = np.equal(p.residual_reading, "decrease")
    p.residual_share = np.where(decrease, 1.0 - p.residual_ratio, p.residual_ratio)
    return p


def _motion_columns(
    moves: Sequence[Motion] | Columns, kind: type, rows: NDArray[np.intp]
) -> SimpleNamespace:
    # the fields of motions of one kind by name, as columns
    if isinstance(moves, Columns):
        taken = _taken(moves, rows)
    else:
        taken = _read(*_distinct(moves, rows), _FIELDS[kind])
    whole = {k: np.broadcast_to(c, rows.shape) for k, c in taken.items()}
    return SimpleNamespace(**whole)


def _taken(items: Columns, rows: NDArray[np.intp]) -> dict[str, Any]:
    return _defaults(items.kind) | {
        name: column
        if not isinstance(column, np.ndarray)
        else column[rows]
        if len(items) > 1
        else column[0]
        for name, column in items.columns.items()
    }


def _distinct(
    items: Sequence[Any], rows: NDArray[np.intp]
) -> tuple[list[Any], NDArray[np.intp] | None]:
    # objects, each once, and which of them is in each row; None as they come
    if len(items) == 1:
        return [items[0]], None
    chosen = items if rows.size == len(items) else [items[i] for i in rows.tolist()]
    once = dict(zip(map(id, chosen), chosen, strict=True))
    if len(once) in (1, len(chosen)):
        return list(once.values()), None
    places = dict(zip(once, range(len(once)), strict=True))
    index = np.fromiter(map(places.__getitem__, map(id, chosen)), dtype=np.intp)
    return list(once.values()), index


def _read(
    items: Sequence[Any], index: NDArray[np.intp] | None, names: tuple[str, ...]
) -> dict[str, Number]:
    if len(items) == 1:
        return {name: getattr(items[0], name) for name in names}
    n = len(items) * len(names)
    every = chain.from_iterable(map(attrgetter(*names), items))
    table = np.fromiter(every, dtype=np.float64, count=n).reshape(len(items), -1)
    table = np.ascontiguousarray((table if index is None else table[index]).T)
    return dict(zip(names, table, strict=True))


class _ColumnPiece(NamedTuple):
    """A piece of many motions, in which the speed rises, falls, or stays."""

    start: Number
    length: Number
    angle: Polynomial

    def rows(self, which: NDArray[np.intp]) -> "_ColumnPiece":
        start, length, *angle = _rows([self.start, self.length, *self.angle], which)
        return _ColumnPiece(start, length, angle)


def _rows(columns: Sequence[Number], which: NDArray[np.intp]) -> list[Number]:
    return [c[which] if np.ndim(c) else c for c in columns]


_PIECES: dict[type, Callable[[SimpleNamespace], list[tuple[Any, ...]]]] = {
    ConstantSpeed: lambda motion: [
        (0.0, (motion.end - motion.start) / motion.speed, (0.0, motion.speed))
    ],
    MinimumJerk: lambda motion: quintic(motion.end - motion.start, motion.mean_speed),
    Trapezoid: lambda motion: ramps(
        motion.end - motion.start, motion.speed, motion.acceleration_rate
    ),
}


class _Scenes:
    """Events and loads of single stretches; nan is what is not reached.

    Angles count from where the stretch starts. What is nearly a tie is in doubt.
    """

    def __init__(
        self, p: SimpleNamespace, start: Floats, pieces: list[tuple[Any, ...]]
    ) -> None:
        self.p, self.start = p, start
        self.pieces = [_ColumnPiece(*piece) for piece in pieces]
        self.constant = p.catch_angle_constant - start  # L
        rest = np.where(np.isnan(p.rest_angle), 0.0, p.rest_angle - start)
        self.law = _law.pre_catch(p, rest)
        self.lowest, self.highest = _law.catch_bounds(p, start)
        # θ_catch jumps at ν_H
        self.is_doubtful: Flags = self.lowest - self.highest > NOTHING
        self.end = self._end()
        self.onset, self.slow = self._movement()
        self.catch, self.angle, self.speed, self.mean_speed, self.pre_end = (
            np.full(start.shape, math.nan) for _ in range(5)
        )
        self._catch()
        self.rise = p.catch_torque_constant * self.speed
        goal = self.angle + p.catch_travel  # (4)
        self.catch_end = self._before(self._reached(goal), self.end)
        slowed = np.maximum(self._before(self.slow, self.end), self.catch_end)
        self.post_catch_end = slowed  # nan unless both are reached

    def output(self, name: str) -> Floats:
        """One output by its name."""
        if name == "catch_angle":
            return np.asarray(self.start + self.angle)
        if name == "catch_speed":
            return np.asarray(self.speed)
        if name == "peak_end":
            last = np.where(np.isnan(self.catch_end), self.end, self.catch_end)
            return np.asarray(np.minimum(self.catch + self.p.peak_duration, last))
        if name == "residual_torque":
            return np.asarray(_law.catch(self.p, self.pre_end, self.rise)[1].level)
        if name == "peak_torque":
            return self._peak()
        if name in LOADS:
            of_section = section_work if name == "work" else section_impulse
            return np.asarray(sum(map(of_section, self._sections(self._segments()))))
        return np.asarray(getattr(self, name))

    def _before(self, time: Floats, end: Floats) -> Floats:
        # nan where it is not before the end
        self.is_doubtful = self.is_doubtful | (np.abs(time - end) <= _CLOSE * end)
        return np.where(time < end, time, math.nan)

    def _end(self) -> Floats:
        last = self.pieces[-1]
        whole, top = last.start + last.length, value(last.angle, last.length)
        limit = self.p.range_end - self.start
        is_cut = top - limit > NOTHING * top
        if not is_cut.any():
            return np.asarray(whole)
        self.is_doubtful = self.is_doubtful | (is_cut & (top - limit < _CLOSE * top))
        return np.where(is_cut, self._reached(limit), whole)

    def _reached(self, goal: Floats) -> Floats:
        # when the angle, which grows, reaches a goal; nan if it does not
        time = np.full(goal.shape, math.nan)
        for piece in self.pieces:
            here = (goal > piece.angle[0]) & (goal <= value(piece.angle, piece.length))
            if (rows := np.flatnonzero(here)).size:
                start, length, angle = piece.rows(rows)
                line = [angle[0] - goal[rows], *angle[1:]]
                time[rows] = start + refined_columns(line, 0.0, length)
        return time

    def _movement(self) -> tuple[Floats, Floats]:
        # when the speed reaches ν_th, and when it is below again
        threshold = self.p.speed_threshold
        onset, slow = (np.full(self.start.shape, math.nan) for _ in range(2))
        for piece in self.pieces:
            start, length, angle = piece
            speed = derivative(angle)
            first, last = speed[0] - threshold, value(speed, length) - threshold
            is_near = np.minimum(np.abs(first), np.abs(last)) <= _CLOSE * threshold
            lasts = length > 0.0
            self.is_doubtful = self.is_doubtful | (lasts & is_near)
            at_once = lasts & np.isnan(onset) & (first > 0.0)
            onset = np.where(at_once, start, onset)
            self._crossed(piece, onset, lasts & (first < 0.0) & (last > 0.0), 1.0)
            self._crossed(piece, slow, lasts & (first > 0.0) & (last < 0.0), -1.0)
        return self._before(onset, self.end), slow

    def _crossed(
        self, piece: _ColumnPiece, times: Floats, which: Flags, sign: float
    ) -> None:
        if (rows := np.flatnonzero(which)).size:
            start, length, angle = piece.rows(rows)
            (threshold,) = _rows([self.p.speed_threshold], rows)
            speed = [sign * c for c in derivative(angle)]
            speed[0] = speed[0] - sign * threshold
            times[rows] = start + refined_columns(speed, 0.0, length)

    def _catch(self) -> None:
        stop = np.fmin(self.slow, self.end)
        first = self.pieces[0]
        self.onset_angle = value(first.angle, self.onset - first.start)
        for i, piece in enumerate(self.pieces):
            begin = np.maximum(self.onset, piece.start)
            until = np.minimum(stop, piece.start + piece.length)
            is_open = (until > begin) & np.isnan(self.catch)
            top = value(piece.angle, until - piece.start)
            rows = np.flatnonzero(is_open & (top > self.lowest))
            if rows.size:
                is_first = i == 0  # in which the speed reaches ν_th, if it does
                self._catch_in(
                    piece.rows(rows), rows, begin[rows], until[rows], is_first
                )

    def _catch_in(
        self,
        piece: _ColumnPiece,
        rows: NDArray[np.intp],
        begin: Floats,
        until: Floats,
        is_first: bool,
    ) -> None:
        (slope,) = _rows([self.p.catch_slope], rows)
        onset, width, angle = self.onset[rows], until - begin, piece.angle
        way, since = angle[1:], [1.0]  # both over the time, in the piece of the onset
        if not is_first:
            way = [angle[0] - self.onset_angle[rows], *angle[1:]]
            since = [piece.start - onset, 1.0]
        elif np.any(onset > piece.start):
            angle = shifted(angle, onset - piece.start)
            way = angle[1:]
        p = SimpleNamespace(catch_slope=slope)
        line = _law.catch_line(p, self.constant[rows], angle, way, since)
        place, doubt = _first_rise(line, width)
        low, high = self.lowest[rows], self.highest[rows]
        here = value(angle, place)
        _reach(angle, low, width, place, here < low)
        is_late = np.isnan(place) | (here > high)
        _reach(angle, high, width, place, is_late & (value(angle, width) > high))
        self.is_doubtful[rows] |= doubt | (width - place <= _CLOSE * width)
        is_caught = ~np.isnan(place)
        speeds, state = derivative(angle), value(angle, place)
        self.catch[rows], self.angle[rows] = begin + place, state
        self.speed[rows] = speed = np.where(is_caught, value(speeds, place), place)
        mean = value(way, place) / value(since, place)
        self.mean_speed[rows] = np.where(is_caught, mean, place)
        law = TorqueLaw(*_rows(self.law, rows))
        acceleration = value(derivative(speeds), place)
        self.pre_end[rows] = law.commanded(state, speed) + law.inertia * acceleration

    def _segments(self) -> list[TorqueSegment]:
        p, end = self.p, self.end
        catch, left, slowed = (
            np.where(np.isnan(time), end, time)
            for time in (self.catch, self.catch_end, self.post_catch_end)
        )
        pre_end, rise = np.nan_to_num(self.pre_end), np.nan_to_num(self.rise)
        travelled = np.nan_to_num(self.angle + p.catch_travel)
        peak, residual = _law.catch(p, pre_end, rise)
        post = _law.post_catch(p, pre_end, rise, travelled, self.law.origin)
        risen = np.minimum(catch + p.catch_rise, left)
        fallen = np.minimum(catch + p.peak_duration, left)
        onset = (rise, np.where(np.greater(p.catch_rise, 0.0), p.catch_rise, 1.0))
        laid = [
            TorqueSegment(np.zeros(end.shape), catch, self.law),
            TorqueSegment(catch, risen, TorqueLaw(pre_end), onset),
            TorqueSegment(risen, fallen, peak),
            TorqueSegment(fallen, left, residual),
            TorqueSegment(left, slowed, post),
            TorqueSegment(slowed, end, self.law),
        ]
        return [segment for segment in laid if (segment.end > segment.start).any()]

    def _sections(self, segments: Iterable[TorqueSegment]) -> Iterator[Section]:
        # what the segments and the pieces have in common; of length 0 where nothing
        for segment in segments:
            for start, length, angle in self.pieces:
                low = np.maximum(segment.start - start, 0.0)
                until = np.minimum(segment.end - start, length)
                if (until > low).any():
                    part = shifted(angle, low) if low.any() else angle
                    torque = along(segment, part, start + low - segment.start)
                    yield Section(np.maximum(until - low, 0.0), part, torque)

    def _peak(self) -> Floats:
        best = np.full(self.end.shape, -math.inf)
        moving = []
        for segment in self._segments():
            if segment.law.is_level and segment.onset is None:
                lasts = segment.end > segment.start
                best = np.where(lasts, np.maximum(best, segment.law.level), best)
            else:
                moving.append(segment)
        sections = list(self._sections(moving))
        for length, _, torque in sections:
            ends = np.maximum(torque[0], value(torque, length))
            best = np.where(length > 0.0, np.maximum(best, ends), best)
        for length, _, torque in sections:
            if len(torque) > 2:
                bound = np.maximum.reduce(
                    np.broadcast_arrays(*bernstein(torque, length))
                )
                rows = np.flatnonzero((length > 0.0) & (bound > best))
                if rows.size:
                    turns = _turning(_rows(torque, rows), length[rows])
                    best[rows] = np.maximum(best[rows], turns)
        return best


def _first_rise(line: Polynomial, width: Floats) -> tuple[Floats, Flags]:
    # where a line is first above 0, nan if it is not; and which need another look
    b = np.array(np.broadcast_arrays(*bernstein(line, width)))
    above = b > 0.0
    changes = (above[1:] != above[:-1]).sum(axis=0)
    smallest = np.minimum(np.abs(b[0]), np.abs(b[-1]))
    doubt = (changes > 1) | (smallest <= _CLOSE * np.abs(b).max(axis=0))
    place = np.where(above[0], 0.0, math.nan)
    rises = np.flatnonzero(~above[0] & (changes == 1))
    place[rises] = refined_columns(_rows(line, rises), 0.0, width[rises])
    return place, doubt | (above[0] & (changes > 0))


def _reach(
    angle: Polynomial, goal: Floats, width: Floats, place: Floats, which: Flags
) -> None:
    # set some places to where a growing angle reaches a goal
    if (rows := np.flatnonzero(which)).size:
        first, *others = _rows(angle, rows)
        line = [first - goal[rows], *others]
        place[rows] = np.where(
            line[0] >= 0.0, 0.0, refined_columns(line, 0.0, width[rows])
        )


def _turning(torque: Polynomial, length: Floats) -> Floats:
    # the largest value at the inner maxima of polynomials; -inf without one
    falls = [-c for c in derivative(torque)]
    b = np.array(np.broadcast_arrays(*bernstein(falls, length)))
    above = b > 0.0
    changes = (above[1:] != above[:-1]).sum(axis=0)
    largest = np.full(length.shape, -math.inf)
    rows = np.flatnonzero((changes == 1) & above[-1])  # rises, then falls
    if rows.size:
        x = refined_columns(_rows(falls, rows), 0.0, length[rows])
        largest[rows] = value(_rows(torque, rows), x)
    for i in np.flatnonzero(changes > 1).tolist():
        one = [float(np.broadcast_to(c, length.shape)[i]) for c in torque]
        largest[i] = section_peak(Section(float(length[i]), [0.0], one))
    return largest
