"""How far a slow verb has come: a bar at a terminal, and elsewhere a line at times."""

import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Never

import click

if TYPE_CHECKING:
    from tqdm import tqdm

_PERIOD_S = 10.0


class Progress:
    """Steps made of those that are expected."""

    def __init__(
        self, description: str, bar: "tqdm[Never] | None", *, shows: bool
    ) -> None:
        self._description = description
        self._bar = bar
        self._shows = shows  # lines, where there is no bar
        self._n_made = 0
        self._n_expected = 0
        self._start = self._last = time.monotonic()

    def expect(self, n_steps: int) -> None:
        """Say how many steps there will be in all, as far as is known."""
        self._n_expected = n_steps
        if self._bar is not None:
            self._bar.total = n_steps
            self._bar.refresh()

    def reach(self, n_made: int, n_expected: int) -> None:
        """Say how many steps are made, and how many there will be."""
        self.expect(n_expected)
        self.update(n_made - self._n_made)

    def update(self, n_steps: int) -> None:
        """Count steps that were made."""
        self._n_made += n_steps
        if self._bar is not None:
            self._bar.update(n_steps)
        now = time.monotonic()
        if self._shows and now - self._last >= _PERIOD_S:
            self._last = now
            click.echo(self._line(now - self._start), err=True)

    def _line(self, elapsed: float) -> str:
        share = self._n_made / max(self._n_expected, self._n_made)
        left = duration_words(elapsed * (1.0 / share - 1.0))
        return f"{self._description}: {100.0 * share:.0f} %, {left} left"


@contextmanager
def progress(description: str, unit: str, *, is_quiet: bool) -> Iterator[Progress]:
    """Show a bar on stderr, or a line every ten seconds where that is no terminal."""
    if is_quiet or not sys.stderr.isatty():
        yield Progress(description, None, shows=not is_quiet)
        return
    from tqdm import tqdm

    # nothing is shown of a call that is refused at once
    with tqdm(desc=description, unit=unit, delay=0.01) as bar:
        yield Progress(description, bar, shows=False)


def duration_words(seconds: float) -> str:
    """Return a duration in words no more exact than an estimate is."""
    if seconds >= 90.0:
        return f"about {seconds / 60.0:.0f} min"
    if seconds >= 10.0:
        return f"about {round(seconds, -1):.0f} s"
    return f"about {max(seconds, 1.0):.0f} s"
