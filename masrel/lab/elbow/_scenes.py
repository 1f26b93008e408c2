"""Thousands of scenes at once: one array, a column an output.

In: joints and motions, as objects or as columns. Out: the outputs asked for, of every
scene. Single stretches go through together, by the formulas of one scene over columns;
what floats leave in doubt there, and every other motion, goes through piece by piece.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import MISSING, dataclass, field, fields
from operator import attrgetter
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from masrel.errors import ParameterError
from masrel.lab.elbow._events import timeline
from masrel.lab.elbow._motion import Floats, Motion
from masrel.lab.elbow._polynomials import Number
from masrel.lab.elbow._single_stretches import PIECES, SingleStretches, Which
from masrel.lab.elbow._torque import loads
from masrel.lab.elbow.motions import ConstantSpeed, MinimumJerk, Trapezoid
from masrel.lab.elbow.parameters import READINGS, ElbowParameters

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
"""Outputs that are functions of `masrel.lab.elbow`."""


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
    >>> from masrel.lab.elbow import STANDARD_MODELS, ConstantSpeed
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
        if kind is not ElbowParameters and kind not in PIECES:
            raise ParameterError(
                "kind: needs ElbowParameters, ConstantSpeed, MinimumJerk or Trapezoid, "
                f"got {kind.__name__}"
            )
        self.kind = kind
        self.columns = {
            name: np.asarray(column) if np.ndim(column) else column
            for name, column in columns.items()
        }
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
                # nan comes before any extreme, and a rest angle may be that
                extremes = (
                    np.argmin(column),
                    np.argmax(column),
                    np.isinf(column).argmax(),
                )
                rows.update(map(int, extremes))
        full = SimpleNamespace(**{**_DEFAULTS[self.kind], **self.columns})
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
    chunk: int = 16384,
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
    >>> from masrel.lab.elbow import STANDARD_MODELS, ConstantSpeed
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


_OUTPUTS = EVENTS + LOADS


def _alone(
    joint: ElbowParameters, motion: Motion, outputs: tuple[str, ...]
) -> list[float]:
    line = timeline(joint, motion)
    row = []
    for name in outputs:
        if name in LOADS:
            row.append(loads(joint, motion, line, name))
        elif name == "end":
            row.append(line.end.time)
        else:
            number = None if line.first is None else getattr(line.first, name)
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
    if n > 1000:  # once so much has been given back, the allocator keeps its pages
        np.empty(128 * min(n, chunk))
    values, n_alone = np.empty((len(outputs), n)).T, 0
    for kind, rows in _groups(moves, n, chunk):
        alone = np.arange(n)[rows]
        if kind in PIECES:
            motion = _motion_columns(moves, kind, rows, alone.size)
            p = _joint_columns(joints, rows)
            _check_starts(motion.start, p.range_end, alone)
            with np.errstate(all="ignore"):  # what is in doubt may be anything
                scenes = SingleStretches(p, motion.start, PIECES[kind](motion))
                for i, name in enumerate(outputs):
                    values[rows, i] = scenes.output(name)
            alone = alone[scenes.is_doubtful]
        for i in alone.tolist():
            joint, motion = _row(joints, i), _row(moves, i)
            _check_starts(np.array([motion.start]), joint.range_end, np.array([i]))
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
) -> Iterator[tuple[type, Which]]:
    # rows of motions of one kind, not too many at a time
    kinds = {moves.kind} if isinstance(moves, Columns) else set(map(type, moves))
    if len(kinds) == 1:
        kind = kinds.pop()
        for first in range(0, n, chunk):
            yield kind, slice(first, first + chunk)
        return
    places: dict[type, list[int]] = {}
    for i in range(n):
        places.setdefault(type(_row(moves, i)), []).append(i)
    for kind, of_kind in places.items():
        for first in range(0, len(of_kind), chunk):
            yield kind, np.array(of_kind[first : first + chunk])


_FIELDS: dict[type, tuple[str, ...]] = {
    kind: tuple(item.name for item in fields(kind))
    for kind in (ElbowParameters, ConstantSpeed, MinimumJerk, Trapezoid)
}


_DEFAULTS: dict[type, dict[str, Any]] = {
    kind: {f.name: f.default for f in fields(kind) if f.default is not MISSING}
    for kind in _FIELDS
}


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
    joints: Sequence[ElbowParameters] | Columns, rows: Which
) -> SimpleNamespace:
    # parameters by name, each a column or one value for all
    if isinstance(joints, Columns):
        p = SimpleNamespace(**_taken(joints, rows))
    else:
        packed = b"".join(map(attrgetter("_packed"), _chosen_of(joints, rows)))
        names = _FIELDS[ElbowParameters]
        p = SimpleNamespace(**_unpacked(np.frombuffer(packed), names))
    p.rest_angle = math.nan if p.rest_angle is None else p.rest_angle
    return p


def _unpacked(numbers: Floats, names: tuple[str, ...]) -> dict[str, Any]:
    # fields by name: a column each, or the one value that all have
    table = numbers.reshape(-1, len(names))
    is_same = (table == table[0]).all(axis=0).tolist()
    columns: dict[str, Any] = {}
    for name, column, same in zip(names, table.T, is_same, strict=True):
        values: Any = column[0].item() if same else column.copy()
        if name in READINGS:
            values = np.array(READINGS[name])[np.asarray(values, dtype=int)]
        columns[name] = values
    return columns


def _motion_columns(
    moves: Sequence[Motion] | Columns, kind: type, rows: Which, n: int
) -> SimpleNamespace:
    # the fields of motions of one kind by name, as columns
    if isinstance(moves, Columns):
        taken = _taken(moves, rows)
    else:
        chosen = _chosen_of(moves, rows)
        taken = {
            name: np.fromiter(map(attrgetter(name), chosen), float, len(chosen))
            for name in _FIELDS[kind]
        }
    return SimpleNamespace(**{k: np.broadcast_to(c, n) for k, c in taken.items()})


def _taken(items: Columns, rows: Which) -> dict[str, Any]:
    which = rows if len(items) > 1 else 0
    return _DEFAULTS[items.kind] | {
        name: column[which] if isinstance(column, np.ndarray) else column
        for name, column in items.columns.items()
    }


def _chosen_of(items: Sequence[Any], rows: Which) -> Sequence[Any]:
    if len(items) == 1:
        return items
    return items[rows] if isinstance(rows, slice) else [items[i] for i in rows.tolist()]
