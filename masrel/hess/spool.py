"""A recording that outlives its process: samples in a file that is mapped to memory.

What the loop writes is in the system's hands at once, so that a process that is killed
in the middle of a presentation leaves every sample up to that moment. The file is laid
down whole before the first tick: a full disk is noticed before anything moves.
"""

import json
import mmap
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from masrel.errors import RecordingError
from masrel.recording import Fact

__all__ = ["N_COLUMNS", "Spool", "Spooled", "read_spool"]

N_COLUMNS = 6
_HEADER = 4096  # bytes for the facts, a page
_WORD = 8  # bytes of a float64


class Spool:
    """The file, open for the samples of one presentation."""

    __slots__ = ("_map", "words")

    def __init__(self, path: Path, capacity: int, facts: dict[str, Fact]) -> None:
        header = json.dumps({**facts, "capacity": capacity}).encode()
        n_bytes = _HEADER + _WORD * (1 + N_COLUMNS * capacity)
        path.parent.mkdir(parents=True, exist_ok=True)
        try:
            with path.open("w+b") as file:
                file.write(header.ljust(_HEADER))
                file.write(bytes(n_bytes - _HEADER))  # not sparse: the space is taken
                file.flush()
                self._map = mmap.mmap(file.fileno(), n_bytes)
        except OSError as error:
            path.unlink(missing_ok=True)  # nothing was sampled
            error.filename = str(path)  # a full disk does not say which file it was
            raise
        self.words = memoryview(self._map)[_HEADER:].cast("d")

    def close(self) -> None:
        """Let go of the file; it stays where it is."""
        self.words.release()
        self._map.close()


@dataclass(frozen=True, slots=True, kw_only=True)
class Spooled:
    """What a presentation that never ended left."""

    columns: NDArray[np.float64]  # (6, n): its samples, as the loop wrote them
    facts: dict[str, Fact]  # what was known before the first


def read_spool(path: Path) -> Spooled | None:
    """Read what a process that died left."""
    data = path.read_bytes()
    if len(data) < _HEADER + _WORD or not data[:_HEADER].strip():
        return None  # it died while it laid the file down
    try:
        return _spooled(json.loads(data[:_HEADER]), data)
    except (ValueError, KeyError, TypeError) as error:
        raise RecordingError(
            f"{path}: needs the samples of a presentation that was cut off, got "
            f"something else ({error}); move it away to go on"
        ) from error


def _spooled(facts: dict[str, Fact], data: bytes) -> Spooled | None:
    # Raises ValueError, KeyError or TypeError where it is no such file.
    if not isinstance(facts, dict):
        raise TypeError(f"no facts but {facts}")
    capacity, rate_hz = facts.pop("capacity"), facts["rate_hz"]
    threshold = facts["speed_threshold"]
    if not isinstance(capacity, int) or capacity < 1:
        raise ValueError(f"a capacity of {capacity}")
    for fact in (rate_hz, threshold):
        if not isinstance(fact, int | float):
            raise TypeError(f"{fact!r} where a number should be")
    n = float(np.frombuffer(data, np.float64, count=1, offset=_HEADER)[0])
    if n == 0.0:
        return None  # not one sample, whether the file is whole or not
    if not (n.is_integer() and 0.0 < n <= capacity):
        raise ValueError(f"{n:g} samples where {capacity} fit in")
    words = np.frombuffer(
        data, np.float64, count=N_COLUMNS * capacity, offset=_HEADER + _WORD
    )
    columns = words.reshape(N_COLUMNS, capacity)[:, : int(n)]
    return Spooled(columns=columns.copy(), facts=facts)
