"""Thousands of scenes at once: one array, one column per output.

In: joints and motions, as objects or as columns. Out: the outputs asked for, of every
scene. Single stretches of a kind go through together, as one joint and one motion whose
fields are columns; every other motion is computed separately.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import MISSING, dataclass, field, fields
from operator import attrgetter
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from masrel._input import check_option, refuse
from masrel.errors import ParameterError
from masrel.lab.elbow._events import Timeline, check_starts
from masrel.lab.elbow._polynomials import Number
from masrel.lab.elbow._torque import load
from masrel.lab.elbow.motions import (
    ConstantSpeed,
    Floats,
    MinimumJerk,
    Motion,
    Trapezoid,
)
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
    """Many joints, or many motions of one kind: one column per field.

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
        If the lengths differ, or a row is outside the range of its kind; the message
        says which row, counted from 1.

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
        self.kind = kind
        self.columns = {
            name: np.asarray(column) if np.ndim(column) else column
            for name, column in columns.items()
        }
        shapes = {c.shape for c in self.columns.values() if isinstance(c, np.ndarray)}
        refuse(
            (
                kind not in _FIELDS,
                "kind: needs ElbowParameters, ConstantSpeed, MinimumJerk or Trapezoid, "
                f"got {kind.__name__}",
            ),
            (
                len(shapes) > 1 or any(len(shape) > 1 for shape in shapes),
                "columns: need one length, got the shapes "
                f"{', '.join(map(str, sorted(shapes)))}",
            ),
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
        rows |= {int(np.argmin(margin)) for margin in _MARGINS[self.kind](full)}
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
        Number of scenes that were computed separately, because their motion is not a
        single stretch, or they are the only one.
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
        check_option("output", output, self.outputs)
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
    joints = _listed(parameters, ElbowParameters)
    moves = _listed(motions, Motion)
    n = max(len(joints), len(moves)) if len(joints) and len(moves) else 0
    refuse(
        (
            unknown or not names,
            f"outputs: needs some of {', '.join(_OUTPUTS)}, "
            f"got {', '.join(map(repr, unknown)) or 'none'}",
        ),
        (chunk < 1, f"chunk: needs 1 or more, got {chunk}"),
        (
            len(joints) not in (1, n) or len(moves) not in (1, n) or n == 0,
            "parameters, motions: need as many joints as motions, or one of either, "
            f"got {len(joints)} and {len(moves)}",
        ),
    )
    if n > 1000:  # once so much has been given back, the allocator keeps its pages
        np.empty(128 * min(n, chunk))
    values, n_alone = np.empty((len(names), n)).T, 0
    for rows, p, motion, is_alone in _batches(joints, moves, n, chunk):
        n_alone += is_alone
        if not isinstance(parameters, ElbowParameters) or moves is motions:
            check_starts(motion.start, p.range_end, rows.tolist())
        if is_alone:
            values[rows[0]] = _found(p, motion, names)
            continue
        with np.errstate(all="ignore"):  # rows that a formula does not mean
            for i, column in enumerate(_found(p, motion, names)):
                values[rows, i] = column
    values.setflags(write=False)
    return SceneTable(outputs=names, values=values, n_alone=n_alone)


_Rows = NDArray[np.intp]
_OUTPUTS = EVENTS + LOADS


def _found(p: ElbowParameters, motion: Motion, names: Sequence[str]) -> list[Number]:
    # what is asked for of one scene, numbers, or of many, columns
    line = Timeline(p, motion)
    return [
        load(line, motion, name)
        if name in LOADS
        else getattr(line if name == "end" else line.first, name)
        for name in names
    ]


def _listed(items: Any, kind: type) -> Any:
    return [items] if isinstance(items, kind) else items


def _row(items: Any, i: int) -> Any:
    i = 0 if len(items) == 1 else i
    return items.row(i) if isinstance(items, Columns) else items[i]


def _batches(
    joints: Sequence[ElbowParameters] | Columns,
    moves: Sequence[Motion] | Columns,
    n: int,
    chunk: int,
) -> Iterator[tuple[_Rows, ElbowParameters, Motion, bool]]:
    # rows that go through together, and their joint and motion with columns in them
    kinds = {moves.kind} if isinstance(moves, Columns) else {type(m) for m in moves}
    for first in range(0, n, chunk):
        every = np.arange(first, min(first + chunk, n))
        for kind in kinds:
            rows = every
            if len(kinds) > 1:
                rows = every[[type(_row(moves, i)) is kind for i in every.tolist()]]
            if kind not in _FIELDS or n == 1:
                for i in rows.tolist():
                    yield np.array([i]), _row(joints, i), _row(moves, i), True
            elif rows.size:
                columns = _columns_of(moves, kind, rows).items()
                motion = {name: np.broadcast_to(c, rows.shape) for name, c in columns}
                joint = _columns_of(joints, ElbowParameters, rows)
                joint = _unchecked(ElbowParameters, joint)
                yield rows, joint, _unchecked(kind, motion), False


def _unchecked(kind: type, values: dict[str, Any]) -> Any:
    # a joint or motion with columns in its fields: its formulas take them as numbers
    made: Any = object.__new__(kind)
    for name, column in values.items():
        object.__setattr__(made, name, column)
    return made


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


def _columns_of(items: Any, kind: type, rows: _Rows) -> dict[str, Any]:
    # fields by name, each a column or one value for all
    which = rows if len(items) > 1 else np.zeros(1, dtype=np.intp)
    if isinstance(items, Columns):
        fields_of = {
            name: column[which] if isinstance(column, np.ndarray) else column
            for name, column in items.columns.items()
        }
        return _DEFAULTS[kind] | fields_of
    chosen = [items[i] for i in which.tolist()]
    columns: dict[str, Any] = {}
    for name in _FIELDS[kind]:
        values = list(map(attrgetter(name), chosen))
        # None, the rest angle of a joint that has none of its own, is nan
        column = np.array(values, dtype=None if name in READINGS else float)
        is_same = bool((column == column[0]).all())
        columns[name] = column[0].item() if is_same else column
    return columns
