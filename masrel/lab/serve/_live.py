"""The samples of a presentation while it goes on, read beside the loop.

The loop writes into a file that is mapped into memory and was allocated before it
began; whoever maps it too reads what is there, and nobody waits for anybody.
"""

import mmap
from collections.abc import Iterator, Sequence
from pathlib import Path

from masrel.lab._study_files import parse_json
from masrel.lab.hess._recorder import _HEADER, _WORD
from masrel.lab.recording import RECORDING_COLUMNS


class SampleTail:
    """A file of samples, open for reading while another process writes it.

    Attributes
    ----------
    n_stretches_over : int
        Stretches that are over, as far as rows were read.
    """

    def __init__(self, file: Path) -> None:
        with open(file, "rb") as source:
            self._map = mmap.mmap(source.fileno(), 0, access=mmap.ACCESS_READ)
        try:
            facts = parse_json(self._map[:_HEADER])
            capacity = int(facts["capacity"])
            n_values = 1 + int(facts["n_columns"]) * capacity
            if len(self._map) < _HEADER + _WORD * n_values:
                raise ValueError("it is being allocated")
        except (ValueError, KeyError, TypeError):
            self._map.close()
            raise FileNotFoundError(f"{file}: no samples yet") from None
        self._values = memoryview(self._map)[_HEADER:].cast("d")
        starts = range(1, 1 + capacity * len(RECORDING_COLUMNS), capacity)
        self._starts = dict(zip(RECORDING_COLUMNS, starts, strict=True))
        self._n_read = 0
        self._stretch = 0
        self.n_stretches_over = 0

    def new_rows(self, *columns: str, every: int = 1) -> dict[str, Sequence[float]]:
        """Return what came since the last call, in the units of the loop (rad, N·m).

        One of `every` rows, and the last.
        """
        first, n = self._n_read, int(self._values[0])
        rows = [*range(first, n - 1, every), *([n - 1] if n > first else [])]
        self._n_read = n
        self._count_stretches(rows)
        return {
            name: [self._values[self._starts[name] + row] for row in rows]
            for name in columns
        }

    def _count_stretches(self, rows: Sequence[int]) -> None:
        start = self._starts["stretch"]
        for row in rows:
            stretch = int(self._values[start + row])
            if stretch != self._stretch:
                self.n_stretches_over = max(
                    self.n_stretches_over, self._stretch, stretch - 1
                )
                self._stretch = stretch

    def close(self) -> None:
        """Let go of the file."""
        self._values.release()
        self._map.close()


class LiveTail:
    """The samples of whatever is presented now."""

    def __init__(self) -> None:
        self._file: Path | None = None
        self._tail: SampleTail | None = None

    def news(self, file: Path | None) -> Iterator[SampleTail | None]:
        """Yield None where a presentation begins, and then its samples."""
        if self._tail is not None:
            yield self._tail  # also the last ones of one that is over
            if file != self._file:
                self.close()
        elif file is not None:
            try:
                self._tail, self._file = SampleTail(file), file
            except (OSError, ValueError):
                return
            yield None

    def close(self) -> None:
        """Let go of the samples."""
        if self._tail is not None:
            self._tail.close()
        self._file = self._tail = None
