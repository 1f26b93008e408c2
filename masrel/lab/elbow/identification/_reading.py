"""Recordings of a spasticity evaluator: read, checked, and put on even times.

In: CSV, npz, or masrel's own recordings. Out: time, angle and torque in SI units, with
what must not be used marked.
"""

import csv
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from masrel._input import not_utf8, refuse, warn_caller
from masrel.errors import RecordingError, RecordingWarning
from masrel.lab._study_files import MAX_RECORDING, read_regular, sha256_of
from masrel.lab.recording import (
    _FIRST_COLUMNS,
    MEASURED_TORQUE,
    _Floats,
    _read_columns,
    read_recording,
)

TorqueSource = Literal["recorded", "sensor", "model"]


# Shorter is no stretch at any rate that is allowed.
_MIN_SAMPLES = 50

# Below the first, nothing is left of a peak of 0.1 s; above the second, no evaluator
# works.
_MIN_RATE_HZ, _MAX_RATE_HZ = 50.0, 100_000.0

# An elbow's range with room for a goniometer that is not zeroed, rad.
_ANGLE_RANGE = (math.radians(-30.0), math.radians(210.0))

# A movement of less is no stretch, rad.
MIN_TRAVEL = math.radians(15.0)

# No manual stretch of an elbow asks for more, N·m.
_MAX_TORQUE = 100.0

# So many equal samples in a row, at the largest torque and nowhere else, are a sensor
# at the end of its range.
_SATURATED_RUN = 10


@dataclass(frozen=True, slots=True, kw_only=True)
class Movement:
    """Angle and torque of a joint that somebody moves, as recorded.

    Attributes
    ----------
    name : str
        Where it is from: the file.
    time : ndarray, shape (n_samples,)
        Strictly increasing times, s; they need not be even.
    angle : ndarray, shape (n_samples,)
        Angle, 0 at full flexion, growing with extension, rad.
    torque : ndarray, shape (n_samples,)
        Torque that resists extension, N·m.
    velocity : ndarray, shape (n_samples,), or None
        Angular velocity, rad/s. It is compared with the angle's derivative, no more.
    saturated : ndarray of bool, shape (n_samples,)
        Samples at which the torque sensor is at the end of its range.
    simulated : bool
        Whether no joint and no hand was there.
    torque_source : {"recorded", "sensor", "model"}
        Where the torque is from: somebody's recording; in one of masrel's driver the
        sensor of the device, or what the joint model asked for.
    model : str or None
        The model that was presented, in a recording of masrel's driver.
    sha256 : str or None
        Checksum of the file, if it is from one.

    Raises
    ------
    RecordingError
        If the columns differ in length, hold what is not finite, time does not
        increase, or angle and torque are implausible.

    Warns
    -----
    RecordingWarning
        If the torque looks saturated.
    """

    name: str
    time: _Floats = field(compare=False, repr=False)
    angle: _Floats = field(compare=False, repr=False)
    torque: _Floats = field(compare=False, repr=False)
    velocity: _Floats | None = field(default=None, compare=False, repr=False)
    saturated: NDArray[np.bool_] = field(init=False, compare=False, repr=False)
    simulated: bool = False
    torque_source: TorqueSource = "recorded"
    model: str | None = None
    sha256: str | None = None

    def __post_init__(self) -> None:
        optional = [] if self.velocity is None else [self.velocity]
        columns = [self.time, self.angle, self.torque, *optional]
        refuse(
            (
                len({column.shape for column in columns}) != 1 or self.time.ndim != 1,
                f"{self.name}: columns need one length, got shapes "
                f"{', '.join(str(column.shape) for column in columns)}",
            ),
            (
                not all(np.isfinite(column).all() for column in columns),
                f"{self.name}: columns need finite numbers",
            ),
            error=RecordingError,
        )
        _check_time(self.name, self.time)
        _check_sizes(self.name, self.angle, self.torque)
        object.__setattr__(self, "saturated", _saturated(self.name, self.torque))
        for column in (*columns, self.saturated):
            column.setflags(write=False)


def _check_time(name: str, time: _Floats) -> None:
    if time.size < _MIN_SAMPLES:
        raise RecordingError(
            f"{name}: needs at least {_MIN_SAMPLES} samples, got {time.size}"
        )
    steps = np.diff(time)
    if not (steps > 0.0).all():
        at = int(np.argmax(steps <= 0.0))
        raise RecordingError(
            f"{name}: time must increase, got {time[at + 1]:.9g} s after "
            f"{time[at]:.9g} s (samples {at} and {at + 1}, counted from 0)"
        )
    rate = 1.0 / float(np.median(steps))
    # times that were rounded as they were written may be a little off
    if not 0.999 * _MIN_RATE_HZ <= rate <= 1.001 * _MAX_RATE_HZ:
        raise RecordingError(
            f"{name}: needs {_MIN_RATE_HZ:g} to {_MAX_RATE_HZ:g} samples a "
            f"second, got {rate:.3g}; is the unit of time right?"
        )


def _check_sizes(name: str, angle: _Floats, torque: _Floats) -> None:
    low, high = math.degrees(angle.min()), math.degrees(angle.max())
    largest = float(np.abs(torque).max())
    is_small, needed = high - low < math.degrees(MIN_TRAVEL), math.degrees(MIN_TRAVEL)
    message = f"{name}: got angles from {low:.4g} to {high:.4g} degrees and torques "
    message += f"to {largest:.4g} N·m"
    refuse(
        (
            largest > _MAX_TORQUE and (is_small or largest < 180.0),
            f"{message}; are the columns of angle and torque swapped?",
        ),
        (largest > _MAX_TORQUE, f"{message}; is the unit of torque right?"),
        (
            angle.min() < _ANGLE_RANGE[0] or angle.max() > _ANGLE_RANGE[1],
            f"{message}; is the unit of the angle right?",
        ),
        (
            angle.max() - angle.min() < MIN_TRAVEL,
            f"{message}; a stretch travels {needed:g} degrees or more. Is the unit of "
            "the angle right, and is this not the torque column?",
        ),
        error=RecordingError,
    )


def _saturated(name: str, torque: _Floats) -> NDArray[np.bool_]:
    # samples of long runs at the largest or smallest torque; long runs elsewhere too
    # mean a coarse or noise-free sensor, not a saturated one
    starts = np.flatnonzero(np.diff(torque, prepend=np.nan) != 0.0)
    lengths = np.diff(starts, append=torque.size)
    long = lengths >= _SATURATED_RUN
    extreme = np.isin(torque[starts], (torque.min(), torque.max()))
    extreme &= np.abs(torque[starts]) >= 0.9 * np.abs(torque).max()
    if not (long & extreme).any() or (long & ~extreme).any():
        return np.zeros(torque.size, dtype=np.bool_)
    marked = np.repeat(extreme, lengths)
    limits = ", ".join(f"{value:.4g}" for value in np.unique(torque[marked]))
    warn_caller(
        f"{name}: the torque stays at {limits} N·m for {int(marked.sum())} samples: "
        "the sensor is saturated; these samples are left out, and a stretch whose "
        "peak they cut off gives no H and Q",
        RecordingWarning,
    )
    return marked


# Quantity to unit to its size in SI; the velocity may be absent.
_UNITS: dict[str, dict[str, float]] = {
    "time": {"s": 1.0, "ms": 1e-3, "us": 1e-6},
    "angle": {"deg": math.pi / 180.0, "rad": 1.0},
    "torque": {"nm": 1.0, "mnm": 1e-3, "ncm": 1e-2},
    "velocity": {"deg_s": math.pi / 180.0, "rad_s": 1.0},
}


def _find_columns(
    names: Sequence[str],
    *,
    source: str,
    columns: Mapping[str, str],
    units: Mapping[str, str],
    quantities: Iterable[str] = _UNITS,
) -> dict[str, tuple[str, float]]:
    # the columns of time, angle, torque and, if there is one, velocity, and the size of
    # their units in SI
    refuse(
        *(
            (
                quantity not in _UNITS,
                f"columns, units: need one of {', '.join(_UNITS)}, got {quantity!r}",
            )
            for quantity in (*columns, *units)
        ),
        *(
            (
                unit not in (known := _UNITS.get(quantity, {})),
                f"units: {quantity} needs one of {', '.join(known)}, got {unit!r}",
            )
            for quantity, unit in units.items()
        ),
    )
    result = {}
    for quantity in quantities:
        forms = [f"{quantity}_{unit}" for unit in _UNITS[quantity]]
        named = [n for n in names if n.strip().lower() in (quantity, *forms)]
        fitting = [columns[quantity]] if quantity in columns else named
        refuse(
            (
                not set(fitting) <= set(names),
                f"{source}: needs the column {columns.get(quantity)!r}, got "
                f"{', '.join(names)}",
            ),
            (
                len(fitting) > 1,
                f"{source}: needs one column of {quantity}, got {', '.join(fitting)}",
            ),
            (
                not fitting and quantity != "velocity",
                f"{source}: needs a column of {quantity}: {', '.join(forms)}, or its "
                f"name given; got {', '.join(names) or 'no columns'}",
            ),
            error=RecordingError,
        )
        for name in fitting:
            factor = _factor(name, quantity, source, units.get(quantity))
            result[quantity] = name, factor
    return result


def _factor(name: str, quantity: str, source: str, requested: str | None) -> float:
    # the size of the unit of a column, in SI
    units = _UNITS[quantity]
    suffix = name.strip().lower().removeprefix(f"{quantity}_")
    unit = suffix if suffix in units else requested or ""
    refuse(
        (
            suffix in units and requested not in (None, suffix),
            f"{source}: column {name} says {suffix}, units says {requested} for "
            f"{quantity}",
        ),
        (
            not unit,
            f"{source}: column {name} has no unit: name it "
            f"{' or '.join(f'{quantity}_{u}' for u in units)}, or give the "
            f"unit of {quantity}",
        ),
        error=RecordingError,
    )
    return units[unit]


@dataclass(frozen=True, slots=True, kw_only=True)
class _Table:
    """A recording of any kind: its columns by name, as they are asked for."""

    names: Sequence[str]
    column: Callable[[str], _Floats]
    simulated: bool
    model: str | None = None
    sha256: str


def _read_table(path: Path) -> _Table:
    if not path.is_file():
        why = "a folder; needs a file" if path.is_dir() else "no such file"
        why = "not a regular file" if path.exists() and not path.is_dir() else why
        raise RecordingError(f"{path}: {why}")
    content = read_regular(path, most=MAX_RECORDING)
    read = _read_archive if path.suffix.lower() == ".npz" else _read_text
    return read(path, content)


def _read_archive(path: Path, content: bytes) -> _Table:
    arrays, model = _read_columns(path, content), None
    if _is_own(arrays) and path.with_suffix(".json").is_file():
        local = read_recording(path)  # holds it to its checksum
        simulated = local.facts.get("simulated") is True
        arrays = {
            name: column[: local.n_presented] for name, column in local.columns.items()
        }
        if faults := local.facts.get("channel_faults"):
            warn_caller(f"{path}: {faults}", RecordingWarning)
        model = local.facts.get("model")
    else:
        simulated = bool(np.any(arrays.pop("simulated", False)))

    def column(name: str) -> _Floats:
        array = arrays[name]
        if array.ndim != 1 or array.dtype.kind not in "iuf":
            raise RecordingError(
                f"{path}: column {name} needs numbers in one dimension, got "
                f"{array.dtype} of shape {array.shape}"
            )
        numbers = array.astype(np.float64)
        if np.isinf(numbers).any():
            place = int(np.argmax(np.isinf(numbers)))
            raise RecordingError(
                f"{path}, sample {place} (counted from 0), column {name}: needs a "
                f"finite number, got {numbers[place]}"
            )
        return numbers

    return _Table(
        names=list(arrays),
        column=column,
        simulated=simulated,
        model=model if isinstance(model, str) else None,
        sha256=sha256_of(content),
    )


def _read_text(path: Path, content: bytes) -> _Table:
    try:
        lines = content.decode("utf-8-sig").splitlines()
    except UnicodeDecodeError as error:
        raise RecordingError(f"{path}: {not_utf8(error)}") from error
    is_remark = [line.startswith("#") or not line.strip() for line in lines]
    if all(is_remark):
        raise RecordingError(f"{path}: needs a line of column names, got none")
    remarks = is_remark.index(False)
    separator = max(",;\t", key=lines[remarks].count)
    try:
        names, *rows = csv.reader(lines[remarks:], delimiter=separator)
    except csv.Error as error:
        raise RecordingError(f"{path}: needs cells of numbers ({error})") from error
    names = [name.strip() for name in names]
    if len(set(names)) != len(names):
        twice = next(name for name in names if names.count(name) > 1)
        raise RecordingError(f"{path}: column {twice!r} occurs twice")
    # rows that are not blank, by the line where they stand
    filled = {line: row for line, row in enumerate(rows, remarks + 2) if row}
    for line, row in filled.items():
        if len(row) != len(names):
            raise RecordingError(
                f"{path}, line {line}: needs {len(names)} cells, got {len(row)}"
            )

    def column(name: str) -> _Floats:
        place = names.index(name)
        numbers = []
        for line, row in filled.items():
            try:
                numbers.append(_number(row[place]))
            except ValueError as error:
                raise RecordingError(
                    f"{path}, line {line}, column {name}: needs a number "
                    f"with a decimal point, or nothing; got {row[place]!r}"
                ) from error
        return np.array(numbers, dtype=np.float64)

    pairs = [line.removeprefix("#").partition(":") for line in lines[:remarks]]
    return _Table(
        names=names,
        column=column,
        simulated=("simulated", "true")
        in [(k.strip(), v.strip()) for k, _, v in pairs],
        sha256=sha256_of(content),
    )


def _number(cell: str) -> float:
    value = float(cell.strip() or "nan")
    if math.isinf(value) or "_" in cell:
        raise ValueError(cell)
    return value


def read_angles(path: Path) -> tuple[_Floats, _Floats]:
    """Return times, s, and angles, rad, of a recording, whatever else is in it."""
    table = _read_table(path)
    columns = _find_columns(
        table.names,
        source=str(path),
        columns={},
        units={},
        quantities=("time", "angle"),
    )
    time, angle = (table.column(name) * factor for name, factor in columns.values())
    return time, angle


_MODEL, _COMMANDED = "model_torque_nm", "command_torque_nm"


def _is_own(names: Iterable[str]) -> bool:
    # Whether these are the columns of masrel's driver, with or without channels
    return set(names) >= _FIRST_COLUMNS


def read_movement(
    path: Path,
    *,
    columns: Mapping[str, str] | None = None,
    units: Mapping[str, str] | None = None,
    of_device: bool = False,
) -> Movement:
    """Read one recording.

    Parameters
    ----------
    path : Path
        A CSV file with a line of names, separated by comma, semicolon or tab; or an
        npz archive with one array per column. Lines that start with ``#`` before the
        names are remarks; only ``# simulated: true`` is understood. An archive has an
        array ``simulated`` instead. A recording of masrel's driver is
        recognized by its columns; its torque is what the device's sensor measured, and
        without one what the joint model asked for.
    columns : mapping of str to str, optional
        Quantity ("time", "angle", "torque", "velocity") to the name of its column,
        where the name does not say it.
    units : mapping of str to str, optional
        Quantity to unit, for columns without a unit in their name; see
        `docs/howto/laboratory/identification.md`.
    of_device : bool, optional
        Whether the device is of interest and not the joint: of a recording of masrel's
        driver the torque that was sent is then taken off the measured one.

    Returns
    -------
    Movement
        The recording in SI units; rows with an empty cell are left out.

    Raises
    ------
    ParameterError
        If `columns` or `units` names what there is not.
    RecordingError
        If the file is missing or not a recording, with row and column; if a unit is
        missing; if the values are implausible; or if `of_device` is True and the
        driver recorded no measured torque.

    Warns
    -----
    RecordingWarning
        If rows are left out, the torque is saturated, or the driver says of a channel
        that it failed.

    Notes
    -----
    Columns that are not named here, such as EMG, are left alone.
    """
    table = _read_table(path)
    columns, units = dict(columns or {}), dict(units or {})
    source: TorqueSource = "recorded"
    if _is_own(table.names) and "torque" not in columns:
        source = "sensor" if MEASURED_TORQUE.column in table.names else "model"
        torque = MEASURED_TORQUE.column if source == "sensor" else _MODEL
        columns, units = {"torque": torque, **columns}, {"torque": "nm", **units}
    chosen = _find_columns(table.names, source=str(path), columns=columns, units=units)
    values = {quantity: table.column(name) for quantity, (name, _) in chosen.items()}
    if of_device and source != "recorded":
        if source == "model":
            raise RecordingError(
                f"{path}: needs the column {MEASURED_TORQUE.column}: only a sensor "
                "can show what a device adds to the commanded torque"
            )
        values["torque"] = values["torque"] - table.column(_COMMANDED)
    sizes = {chosen[key][0]: column.size for key, column in values.items()}
    if len(set(sizes.values())) > 1:
        words = ", ".join(f"{name} {size}" for name, size in sizes.items())
        raise RecordingError(f"{path}: columns need one length, got {words}")
    whole = np.isfinite(np.stack(list(values.values()))).all(axis=0)
    if n_rows := int((~whole).sum()):
        empty = {chosen[key][0]: int(np.isnan(values[key]).sum()) for key in values}
        words = ", ".join(f"{name} {count}" for name, count in empty.items() if count)
        rows = f"{n_rows} rows have" if n_rows > 1 else "1 row has"
        are = "are" if n_rows > 1 else "is"
        warn_caller(
            f"{path}: {rows} an empty cell ({words}) and {are} left out",
            RecordingWarning,
        )
    si = {key: values[key][whole] * chosen[key][1] for key in values}
    return Movement(
        name=str(path),
        time=si["time"],
        angle=si["angle"],
        torque=si["torque"],
        velocity=si.get("velocity"),
        simulated=table.simulated,
        torque_source=source,
        model=table.model,
        sha256=table.sha256,
    )


# Gaps up to this are bridged by straight lines, longer ones are left out, s.
_LONGEST_GAP = 0.02

# Steps that differ from the median by less than this share of it are even.
_EVEN = 1e-3


class Samples(NamedTuple):
    """A movement at even times, each column of shape (n_samples,), SI units."""

    period: float
    time: _Floats
    angle: _Floats
    torque: _Floats
    in_gap: NDArray[np.bool_]
    saturated: NDArray[np.bool_]

    def cut(self, which: slice) -> "Samples":
        """Return some of the samples."""
        return Samples(
            self.period,
            self.time[which],
            self.angle[which],
            self.torque[which],
            self.in_gap[which],
            self.saturated[which],
        )


def even_samples(movement: Movement) -> Samples:
    """Put a movement on even times."""
    time, cut = movement.time, movement.saturated
    steps = np.diff(time)
    period = float(np.median(steps))
    if np.abs(steps - period).max() <= _EVEN * period:
        whole = np.zeros(time.size, dtype=np.bool_)
        return Samples(period, time, movement.angle, movement.torque, whole, cut)
    even = time[0] + period * np.arange(int((time[-1] - time[0]) / period + 1e-9) + 1)
    before = np.clip(np.searchsorted(time, even, side="right") - 1, 0, time.size - 2)
    inside = (even > time[before]) & (even < time[before + 1])
    return Samples(
        period,
        even,
        np.interp(even, time, movement.angle),
        np.interp(even, time, movement.torque),
        inside & (steps[before] > max(_LONGEST_GAP, 5.0 * period)),
        cut[before] | (cut[before + 1] & inside),
    )
