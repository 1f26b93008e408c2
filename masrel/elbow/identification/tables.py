"""Tables of a recording, text or archive: a column is read when it is asked for.

What is not asked for, such as EMG or the name of a phase, may be anything.
"""

import csv
import json
import math
import zipfile
import zlib
from dataclasses import dataclass, field
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from masrel.errors import RecordingError
from masrel.recording import RECORDING_COLUMNS, read_recording

__all__ = ["Table", "read_archive", "read_text"]

Floats = NDArray[np.float64]


class Table(Protocol):
    """Columns of a recording.

    Attributes
    ----------
    names : list of str
        Their names.
    simulated : bool
        Whether the table says that it is simulated.
    """

    @property
    def names(self) -> list[str]:
        """Names of the columns."""

    @property
    def simulated(self) -> bool:
        """Whether it says so."""

    def column(self, name: str) -> Floats:
        """Read one column.

        Parameters
        ----------
        name : str
            Its name.

        Returns
        -------
        ndarray, shape (n_rows,)
            Its numbers, ``nan`` where a cell is empty.
        """


@dataclass(frozen=True, slots=True, kw_only=True)
class _Archive:
    path: Path
    arrays: dict[str, NDArray[np.generic]] = field(repr=False)
    simulated: bool

    @property
    def names(self) -> list[str]:
        return list(self.arrays)

    def column(self, name: str) -> Floats:
        array = self.arrays[name]
        if array.ndim != 1 or array.dtype.kind not in "iuf":
            raise RecordingError(
                f"{self.path}: column {name} needs numbers in one dimension, got "
                f"{array.dtype} of shape {array.shape}"
            )
        numbers = array.astype(np.float64)
        if np.isinf(numbers).any():
            place = int(np.argmax(np.isinf(numbers)))
            raise RecordingError(
                f"{self.path}, sample {place} (counted from 0), column {name}: needs a "
                f"finite number, got {numbers[place]}"
            )
        return numbers


def read_archive(path: Path) -> Table:
    """Read an npz archive.

    Parameters
    ----------
    path : Path
        An archive with one array a column; an array ``simulated`` says whether it is.

    Returns
    -------
    Table
        Its columns.

    Raises
    ------
    RecordingError
        If it is none, or a column that is asked for is no column of numbers.
    """
    try:
        with np.load(path, allow_pickle=False) as archive:
            arrays = {name: archive[name] for name in archive.files}
    except (ValueError, EOFError, OSError, zipfile.BadZipFile, zlib.error) as error:
        raise RecordingError(f"{path}: not an archive of columns ({error})") from error
    except TypeError as error:  # numpy gives the one array of an npy file
        raise RecordingError(
            f"{path}: not an archive of columns (one array without a name)"
        ) from error
    if set(arrays) == set(RECORDING_COLUMNS) and path.with_suffix(".json").is_file():
        own = read_recording(path)  # holds it to its checksum
        simulated = own.facts.get("simulated") is True
        return _Archive(path=path, arrays=dict(own.columns), simulated=simulated)
    simulated = bool(np.any(arrays.pop("simulated", False)))
    return _Archive(path=path, arrays=arrays, simulated=simulated)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Text:
    path: Path
    names: list[str]
    rows: list[list[str]] = field(repr=False)
    lines: list[int] = field(repr=False)  # where each row stands, from 1 on
    simulated: bool

    def column(self, name: str) -> Floats:
        place = self.names.index(name)
        numbers = np.empty(len(self.rows))
        for i, row in enumerate(self.rows):
            try:
                numbers[i] = _number(row[place])
            except ValueError as error:
                raise RecordingError(
                    f"{self.path}, line {self.lines[i]}, column {name}: needs a number "
                    f"with a decimal point, or nothing; got {row[place]!r}"
                ) from error
        return numbers


def _number(cell: str) -> float:
    if not cell.strip():
        return math.nan
    value = float(cell)
    if math.isinf(value) or "_" in cell:
        raise ValueError(cell)
    return value


def read_text(path: Path, content: bytes) -> Table:
    """Read a CSV file.

    Parameters
    ----------
    path : Path
        Where it is from.
    content : bytes
        What is in it: remarks, a line of names, and a row a line, separated by comma,
        semicolon or tab.

    Returns
    -------
    Table
        Its columns.

    Raises
    ------
    RecordingError
        If it is none, or a cell of a column that is asked for is no number.
    """
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
    filled = _filled(path, rows[1:], len(names), remarks + 2)
    return _Text(
        path=path,
        names=names,
        rows=[row for _, row in filled],
        lines=[line for line, _ in filled],
        simulated=any(_is_simulated(line) for line in lines[:remarks]),
    )


def _filled(
    path: Path, rows: list[list[str]], n_columns: int, first: int
) -> list[tuple[int, list[str]]]:
    # rows that are not blank, each with its line; `first` is the line of the first
    filled = [(first + i, row) for i, row in enumerate(rows) if row]
    for line, row in filled:
        if len(row) != n_columns:
            raise RecordingError(
                f"{path}, line {line}: needs {n_columns} cells, got {len(row)}"
            )
    return filled


def _is_simulated(remark: str) -> bool:
    key, _, value = remark.removeprefix("#").partition(":")
    return key.strip() == "simulated" and value.strip() == json.dumps(True)
