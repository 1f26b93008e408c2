"""Which column of a recording holds what, in which unit: said, never guessed."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from masrel.errors import ParameterError, RecordingError

__all__ = ["UNITS", "Column", "find_columns"]

UNITS: dict[str, dict[str, float]] = {
    "time": {"s": 1.0, "ms": 1e-3, "us": 1e-6},
    "angle": {"deg": math.pi / 180.0, "rad": 1.0},
    "torque": {"nm": 1.0, "mnm": 1e-3, "ncm": 1e-2},
    "velocity": {"deg_s": math.pi / 180.0, "rad_s": 1.0},
}
"""Quantity to unit to its size in SI; the velocity may be absent."""

OPTIONAL = ("velocity",)


@dataclass(frozen=True, slots=True, kw_only=True)
class Column:
    """A column of a recording.

    Attributes
    ----------
    name : str
        Its name in the file.
    factor : float
        What its values are multiplied by to be in SI units.
    """

    name: str
    factor: float


def find_columns(
    names: Sequence[str],
    *,
    source: str,
    columns: Mapping[str, str] | None = None,
    units: Mapping[str, str] | None = None,
) -> dict[str, Column]:
    """Find the columns of time, angle, torque and, if there is one, velocity.

    Parameters
    ----------
    names : sequence of str
        Names of the file's columns. ``angle_deg`` says what it holds and in which
        unit; ``angle`` alone needs `units`.
    source : str
        The file, for messages.
    columns : mapping of str to str, optional
        Quantity to the name of its column, where the name does not say it.
    units : mapping of str to str, optional
        Quantity to unit, for the columns whose name has no unit.

    Returns
    -------
    dict of str to Column
        Quantity to column.

    Raises
    ------
    ParameterError
        If `columns` or `units` names a quantity or unit that there is not.
    RecordingError
        If a needed column is missing, there are two for one quantity, or its unit
        is not said.

    Examples
    --------
    >>> names = ["time_ms", "angle_deg", "torque"]
    >>> found = find_columns(names, source="a.csv", units={"torque": "nm"})
    >>> found["time"]
    Column(name='time_ms', factor=0.001)
    """
    columns, units = dict(columns or {}), dict(units or {})
    _check_options(columns, units)
    found = {}
    for quantity in UNITS:
        column = _find(names, quantity, source, columns.get(quantity), units)
        if column is not None:
            found[quantity] = column
        elif quantity not in OPTIONAL:
            forms = [f"{quantity}_{unit}" for unit in UNITS[quantity]]
            raise RecordingError(
                f"{source}: needs a column of {quantity}: {', '.join(forms)}, or its "
                f"name given; got {', '.join(names) or 'no columns'}"
            )
    return found


def _check_options(columns: Mapping[str, str], units: Mapping[str, str]) -> None:
    for quantity in (*columns, *units):
        if quantity not in UNITS:
            raise ParameterError(
                f"columns, units: need one of {', '.join(UNITS)}, got {quantity!r}"
            )
    for quantity, unit in units.items():
        if unit not in UNITS[quantity]:
            raise ParameterError(
                f"units: {quantity} needs one of {', '.join(UNITS[quantity])}, "
                f"got {unit!r}"
            )


def _find(
    names: Sequence[str],
    quantity: str,
    source: str,
    given: str | None,
    units: Mapping[str, str],
) -> Column | None:
    if given is not None:
        if given not in names:
            raise RecordingError(
                f"{source}: needs the column {given!r}, got {', '.join(names)}"
            )
        fitting = [given]
    else:
        forms = {quantity, *(f"{quantity}_{unit}" for unit in UNITS[quantity])}
        fitting = [name for name in names if name.strip().lower() in forms]
    if len(fitting) > 1:
        raise RecordingError(
            f"{source}: needs one column of {quantity}, got {', '.join(fitting)}"
        )
    if not fitting:
        return None
    return _with_unit(fitting[0], quantity, source, units.get(quantity))


def _with_unit(name: str, quantity: str, source: str, asked: str | None) -> Column:
    suffix = name.strip().lower().removeprefix(f"{quantity}_")
    said = suffix if suffix in UNITS[quantity] else None
    if said is not None and asked is not None and said != asked:
        raise RecordingError(
            f"{source}: column {name} says {said}, units says {asked} for {quantity}"
        )
    unit = said or asked
    if unit is None:
        raise RecordingError(
            f"{source}: column {name} has no unit: name it "
            f"{' or '.join(f'{quantity}_{u}' for u in UNITS[quantity])}, or say the "
            f"unit of {quantity}"
        )
    return Column(name=name, factor=UNITS[quantity][unit])
