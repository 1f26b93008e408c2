"""A puck that a command of ``masrel device`` is for, and who is told about it."""

import dataclasses
import json
import math
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import click
from tqdm import tqdm

from masrel.hess import Clock, SimulatedHand
from masrel.hess.puck.options import PuckOptions

if TYPE_CHECKING:
    from masrel.hess import Device, EmergencyStop
    from masrel.hess.puck.bus import Link

__all__ = ["RANGE_END", "Bench"]

RANGE_END = math.radians(146.0)
"""Where the arm of an emulated puck meets its end stop, rad."""


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class Bench:
    """A puck, and the screen or file that is told about it."""

    options: PuckOptions  # bus, node and how to treat it
    clock: Clock  # simulated for an emulated puck
    # what holds the arm of an emulated puck: a hand that has let go
    hand: SimulatedHand | None
    json_file: str | None  # where the JSON goes; "-" for the screen
    quiet: bool  # whether there are no progress bars

    @contextmanager
    def link(self, *, hears_all: bool = False) -> "Iterator[Link]":
        """Join the bus for a while."""
        from masrel.hess.puck.connection import connected

        with connected(
            self.options,
            clock=self.clock,
            hand=self.hand,
            range_end=RANGE_END,
            hears_all=hears_all,
        ) as link:
            yield link

    def device(self) -> "Device":
        """Open the puck as a device, in torque mode."""
        from masrel.hess import open_device

        return open_device(
            "puck",
            clock=self.clock,
            hand=self.hand,
            range_end=RANGE_END,
            options=self.options,
        )

    @contextmanager
    def emergency_stop(self) -> "Iterator[EmergencyStop]":
        """Give a button that signals press, and any key of the terminal."""
        from masrel.hess import EmergencyStop
        from masrel.hess._stop import stop_on_key, stop_on_signals

        stop = EmergencyStop()
        keys = None if self.hand is not None else sys.stdin  # an emulator is quick
        with stop_on_signals(stop), stop_on_key(stop, keys):
            yield stop

    @contextmanager
    def progress(self, total: int) -> Iterator[Callable[[], None]]:
        """Show a bar of steps on a terminal."""
        hidden = self.quiet or self.json_file == "-"
        with tqdm(total=total, unit="", leave=False, disable=hidden or None) as bar:

            def step() -> None:
                bar.update()

            yield step

    def say(self, lines: list[str], document: dict[str, object]) -> None:
        """Print lines, or write the document as JSON."""
        simulated = not self.options.moves_hardware
        if self.json_file != "-":
            for line in lines:
                click.echo(line)
            if simulated:
                click.echo("(simulated: there is no hardware on this bus)")
        if self.json_file is not None:
            text = json.dumps({**document, "simulated": simulated}, indent=1)
            if self.json_file == "-":
                click.echo(text)
            else:
                _write(Path(self.json_file), text + "\n")


def _write(path: Path, text: str) -> None:
    try:
        path.write_text(text, encoding="utf-8")
    except OSError as error:
        error.filename = str(path)  # a full disk does not say which file it was
        raise
