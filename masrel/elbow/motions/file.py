"""Motions from files: a table of times and angles, or a recording of the loop."""

import csv
import io
import math
from itertools import takewhile
from pathlib import Path

import numpy as np

from masrel._input import MAX_RECORDING, read_regular
from masrel.elbow.motions._recorded import Interpolation, Recorded
from masrel.errors import ParameterError, RecordingError
from masrel.recording import read_recording

__all__ = ["read_motion"]

_COLUMNS = ("time_s", "angle_deg")


def read_motion(path: Path, *, interpolation: Interpolation = "pchip") -> Recorded:
    r"""Read a motion from a file.

    Parameters
    ----------
    path : Path
        CSV with a row of names, of which ``time_s`` and ``angle_deg`` are read; lines
        before it that begin with # are passed over. Or one of the two files of a
        `masrel.recording.Recording`.
    interpolation : {"pchip", "linear"}, optional
        What happens between samples.

    Returns
    -------
    Recorded
        The motion.

    Raises
    ------
    RecordingError
        If there is no such file, a column is absent, or a value is not a number; the
        message names file, row and column. A row is counted with the names as row 1.
    ParameterError
        If the samples are no motion; as of `Recorded`.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> with TemporaryDirectory() as folder:
    ...     path = Path(folder) / "motion.csv"
    ...     _ = path.write_text("time_s,angle_deg\n0,30\n1,90\n")
    ...     read_motion(path).duration
    1.0
    """
    if path.suffix.lower() in (".npz", ".json"):
        columns = read_recording(_checked_pair(path)).columns
        samples = [list(columns[name]) for name in _COLUMNS]
    else:
        samples = _read_table(path)
    try:
        return Recorded(
            time=samples[0],
            angle=np.radians(np.array(samples[1])),
            interpolation=interpolation,
        )
    except ParameterError as error:
        raise ParameterError(f"{path}: {error}") from error


def _checked_pair(path: Path) -> Path:
    # the npz of a recording, which is no motion without its facts
    for suffix in (".npz", ".json"):
        if not path.with_suffix(suffix).is_file():
            raise RecordingError(
                f"{path}: needs both files of a recording, got no "
                f"{path.with_suffix(suffix).name} beside it"
            )
    return path.with_suffix(".npz")


def _read_table(path: Path) -> list[list[float]]:
    try:
        text = read_regular(path, most=MAX_RECORDING).decode("utf-8-sig")
        rows = list(csv.reader(io.StringIO(text, newline="")))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        reason = error.strerror if isinstance(error, OSError) else error
        raise RecordingError(f"{path}: cannot be read: {reason}") from error
    head = 1 + sum(1 for _ in takewhile(_is_remark, rows))  # row of the names
    names = [name.strip() for name in rows[head - 1]] if len(rows) >= head else []
    absent = [name for name in _COLUMNS if name not in names]
    if absent:
        raise RecordingError(
            f"{path}: needs the columns {', '.join(_COLUMNS)} in row {head}, "
            f"got {', '.join(names) or 'nothing'}"
        )
    if twice := [name for name in _COLUMNS if names.count(name) > 1]:
        raise RecordingError(
            f"{path}: needs one column {twice[0]} in row {head}, got more"
        )
    places = [names.index(name) for name in _COLUMNS]
    samples: list[list[float]] = [[], []]
    for number, row in enumerate(rows[head:], start=head + 1):
        for name, place, column in zip(_COLUMNS, places, samples, strict=True):
            cell = row[place] if place < len(row) else ""
            if (value := _number(cell)) is None:
                raise RecordingError(
                    f"{path}, row {number}, {name}: needs a number, got {cell!r}"
                )
            column.append(value)
    return samples


def _is_remark(row: list[str]) -> bool:
    # such as "# simulated: true", before the names
    return bool(row) and row[0].lstrip().startswith("#")


def _number(cell: str) -> float | None:
    # None for what is no finite number; 1_000 is one in Python, and in no table
    try:
        value = float(cell)
    except ValueError:
        return None
    return value if math.isfinite(value) and "_" not in cell else None
