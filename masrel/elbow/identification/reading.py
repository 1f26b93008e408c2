"""Read recordings of a spasticity evaluator: CSV, npz, or those of masrel itself."""

import hashlib
import warnings
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from masrel.elbow.identification.columns import find_columns
from masrel.elbow.identification.movement import Movement
from masrel.elbow.identification.tables import Table, read_archive, read_text
from masrel.errors import RecordingError, RecordingWarning
from masrel.recording import RECORDING_COLUMNS

__all__ = ["read_movement"]

OWN_TORQUE = "model_torque_nm"
"""Of masrel's own recordings, what the joint asked for: its law can be fitted back."""


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
        why = "a folder; needs a file" if path.is_dir() else "no such file"
        raise RecordingError(f"{path}: {why}")
    content = path.read_bytes()
    table: Table = (
        read_archive(path) if path.suffix == ".npz" else read_text(path, content)
    )
    if set(table.names) == set(RECORDING_COLUMNS):
        columns = {"torque": OWN_TORQUE, **(columns or {})}
        units = {"torque": "nm", **(units or {})}
    found = find_columns(table.names, source=str(path), columns=columns, units=units)
    values = {key: table.column(column.name) for key, column in found.items()}
    _check_lengths(path, {found[key].name: values[key] for key in values})
    whole = np.isfinite(np.stack(list(values.values()))).all(axis=0)
    if not whole.all():
        empty = {found[key].name: int(np.isnan(values[key]).sum()) for key in values}
        warnings.warn(
            _left_out(path, int((~whole).sum()), empty), RecordingWarning, stacklevel=2
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


def _check_lengths(path: Path, columns: Mapping[str, NDArray[np.float64]]) -> None:
    sizes = {name: column.size for name, column in columns.items()}
    if len(set(sizes.values())) > 1:
        said = ", ".join(f"{name} {size}" for name, size in sizes.items())
        raise RecordingError(f"{path}: columns need one length, got {said}")


def _left_out(path: Path, n_rows: int, empty: Mapping[str, int]) -> str:
    said = ", ".join(f"{name} {count}" for name, count in empty.items() if count)
    rows = "1 row has" if n_rows == 1 else f"{n_rows} rows have"
    left = "is" if n_rows == 1 else "are"
    return f"{path}: {rows} an empty cell ({said}) and {left} left out"
