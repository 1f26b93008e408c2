"""Read recordings of a spasticity evaluator: CSV, npz, or those of masrel itself."""

import csv
import hashlib
import json
import warnings
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from masrel.elbow.identification.columns import find_columns
from masrel.elbow.identification.movement import Movement
from masrel.errors import RecordingError, RecordingWarning
from masrel.recording import RECORDING_COLUMNS, read_recording

__all__ = ["read_movement"]

Floats = NDArray[np.float64]

OWN_TORQUE = "model_torque_nm"
"""Of masrel's own recordings, what the joint asked for: its law can be fitted back."""


@dataclass(frozen=True, slots=True, kw_only=True)
class _Table:
    names: list[str]
    values: dict[str, Floats]  # nan where a cell is empty
    simulated: bool


def read_movement(
    path: Path,
    *,
    columns: Mapping[str, str] | None = None,
    units: Mapping[str, str] | None = None,
) -> Movement:
    """Read one recording.

    Parameters
    ----------
    path : Path
        A CSV file with a line of names, separated by comma, semicolon or tab; or an
        npz archive with one array a column. Lines that start with ``#`` before the
        names are remarks, of which ``# simulated: true`` is understood; an archive
        has an array ``simulated`` instead. A recording of masrel's driver is
        recognized by its columns; its torque is what the joint model asked for.
    columns : mapping of str to str, optional
        Quantity ("time", "angle", "torque", "velocity") to the name of its column,
        where the name does not say it.
    units : mapping of str to str, optional
        Quantity to unit, for columns without a unit in their name; see
        `masrel.elbow.identification.columns.UNITS`.

    Returns
    -------
    Movement
        The recording in SI units; rows with an empty cell are left out.

    Raises
    ------
    ParameterError
        If `columns` or `units` names what there is not.
    RecordingError
        If the file is missing or not a recording, with row and column; if a unit
        is not said; or if the values cannot be what they are said to be.

    Warns
    -----
    RecordingWarning
        If rows are left out, or the torque is saturated.

    Notes
    -----
    Columns that are not named here, such as EMG, are left alone.
    """
    if not path.is_file():
        raise RecordingError(f"{path}: no such file")
    content = path.read_bytes()
    table = _read_npz(path) if path.suffix == ".npz" else _read_csv(path, content)
    if set(table.names) == set(RECORDING_COLUMNS):
        columns = {"torque": OWN_TORQUE, **(columns or {})}
        units = {"torque": "nm", **(units or {})}
    found = find_columns(table.names, source=str(path), columns=columns, units=units)
    values = {key: table.values[column.name] for key, column in found.items()}
    whole = np.isfinite(np.stack(list(values.values()))).all(axis=0)
    if not whole.all():
        warnings.warn(
            f"{path}: {int((~whole).sum())} rows have an empty cell and are left out",
            RecordingWarning,
            stacklevel=2,
        )
    si = {key: values[key][whole] * found[key].factor for key in values}
    return Movement(
        name=str(path),
        time=si["time"],
        angle=si["angle"],
        torque=si["torque"],
        velocity=si.get("velocity"),
        simulated=table.simulated,
        sha256=hashlib.sha256(content).hexdigest(),
    )


def _read_npz(path: Path) -> _Table:
    try:
        with np.load(path, allow_pickle=False) as archive:
            arrays = {name: archive[name] for name in archive.files}
    except (ValueError, EOFError, OSError, zipfile.BadZipFile) as error:
        raise RecordingError(f"{path}: not an archive of columns ({error})") from error
    if set(arrays) == set(RECORDING_COLUMNS) and path.with_suffix(".json").is_file():
        own = read_recording(path)  # holds it to its checksum
        simulated = own.facts.get("simulated") is True
        return _Table(
            names=list(RECORDING_COLUMNS), values=dict(own.columns), simulated=simulated
        )
    simulated = bool(np.any(arrays.pop("simulated", False)))
    values = {}
    for name, array in arrays.items():
        if array.ndim != 1 or not np.issubdtype(array.dtype, np.number):
            raise RecordingError(
                f"{path}: column {name} needs numbers in one dimension, got "
                f"{array.dtype} of shape {array.shape}"
            )
        values[name] = array.astype(np.float64)
    lengths = {name: array.size for name, array in values.items()}
    if len(set(lengths.values())) > 1:
        said = ", ".join(f"{name} {length}" for name, length in lengths.items())
        raise RecordingError(f"{path}: columns need one length, got {said}")
    return _Table(names=list(values), values=values, simulated=simulated)


def _read_csv(path: Path, content: bytes) -> _Table:
    try:
        lines = content.decode("utf-8-sig").splitlines()
    except UnicodeDecodeError as error:
        raise RecordingError(
            f"{path}: needs UTF-8 text, got byte {content[error.start]:#04x} at offset "
            f"{error.start}"
        ) from error
    remarks = 0
    while remarks < len(lines) and (
        lines[remarks].startswith("#") or not lines[remarks].strip()
    ):
        remarks += 1
    if remarks == len(lines):
        raise RecordingError(f"{path}: needs a line of column names, got none")
    separator = max(",;\t", key=lines[remarks].count)
    rows = list(csv.reader(lines[remarks:], delimiter=separator))
    names = [name.strip() for name in rows[0]]
    if len(set(names)) != len(names):
        twice = next(name for name in names if names.count(name) > 1)
        raise RecordingError(f"{path}: column {twice!r} is there twice")
    cells = _cells(path, rows[1:], names, remarks + 2)
    return _Table(
        names=names,
        values={name: cells[:, i] for i, name in enumerate(names)},
        simulated=any(_is_simulated(line) for line in lines[:remarks]),
    )


def _is_simulated(remark: str) -> bool:
    key, _, value = remark.removeprefix("#").partition(":")
    return key.strip() == "simulated" and value.strip() == json.dumps(True)


def _cells(path: Path, rows: list[list[str]], names: list[str], first: int) -> Floats:
    # (n_rows, n_columns), nan where empty; `first` is the line of the first row
    filled = [(first + i, row) for i, row in enumerate(rows) if row]
    out = np.full((len(filled), len(names)), np.nan)
    for place, (line, row) in enumerate(filled):
        if len(row) != len(names):
            raise RecordingError(
                f"{path}, line {line}: needs {len(names)} cells, got {len(row)}"
            )
        try:
            out[place] = [float(cell) if cell.strip() else np.nan for cell in row]
        except ValueError:
            _blame(path, line, row, names)
    return out


def _blame(path: Path, line: int, row: list[str], names: list[str]) -> None:
    for name, cell in zip(names, row, strict=True):
        try:
            float(cell or "nan")
        except ValueError as error:
            raise RecordingError(
                f"{path}, line {line}, column {name}: needs a number with a decimal "
                f"point, or nothing; got {cell!r}"
            ) from error
