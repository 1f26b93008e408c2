"""Which puck a command of ``masrel device`` is for, and how it says what it found."""

import dataclasses
import functools
import json
import math
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from tqdm import tqdm

from masrel.hess import Clock, RealClock, SimulatedClock, SimulatedHand
from masrel.hess.puck.emulator_options import EmulatorOptions
from masrel.hess.puck.options import PuckOptions
from masrel.hess.puck.properties import PropertyTable, read_property_table

if TYPE_CHECKING:
    from masrel.hess import Device, EmergencyStop
    from masrel.hess.puck.bus import Link

__all__ = ["Bench", "for_a_puck"]

_RANGE_END = math.radians(146.0)
_EMULATED_START = math.radians(60.0)


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class Bench:
    """A puck, and the screen or file that is told about it.

    Attributes
    ----------
    options : PuckOptions
        Bus, node and how to treat it.
    clock : Clock
        Simulated for an emulated puck.
    hand : SimulatedHand or None
        What holds the arm of an emulated puck: a hand that has let go.
    json_file : str or None
        Where the JSON goes; "-" for the screen.
    quiet : bool
        Whether there are no progress bars.
    """

    options: PuckOptions
    clock: Clock
    hand: SimulatedHand | None
    json_file: str | None
    quiet: bool

    @contextmanager
    def link(self, *, hears_all: bool = False) -> "Iterator[Link]":
        """Join the bus for a while."""
        from masrel.hess.puck.connection import connected

        with connected(
            self.options,
            clock=self.clock,
            hand=self.hand,
            range_end=_RANGE_END,
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
            range_end=_RANGE_END,
            options=self.options,
        )

    @contextmanager
    def emergency_stop(self) -> "Iterator[EmergencyStop]":
        """Give a button that signals press, and any key of the terminal."""
        from masrel.hess import EmergencyStop
        from masrel.hess.stop import stop_on_key, stop_on_signals

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


_OPTIONS = (
    click.option(
        "--interface",
        default="socketcan",
        show_default=True,
        help="The adapter, as python-can names it.",
    ),
    click.option("--channel", default="can0", show_default=True, help="Its channel."),
    click.option("--puck", type=int, default=1, show_default=True, help="Its node."),
    click.option(
        "--direction",
        type=click.Choice(["1", "-1"]),
        default="1",
        show_default=True,
        help="-1 where its counts shrink with extension.",
    ),
    click.option("--gear-ratio", type=float, default=18.8, show_default=True),
    click.option(
        "--properties",
        type=click.Path(path_type=Path),
        help="TOML file with the property numbers of a firmware unknown to masrel.",
    ),
    click.option(
        "--emulate", is_flag=True, help="Emulate the puck; with --interface virtual."
    ),
    click.option(
        "--json", "json_file", help="Write what was found as JSON; - for the screen."
    ),
    click.option("--quiet", is_flag=True, help="No progress bar."),
)


def for_a_puck(function: Callable[..., None]) -> Callable[..., None]:
    """Give a command the options that say which puck it is for.

    Parameters
    ----------
    function : callable
        Takes a `Bench`, and the command's own options by name.

    Returns
    -------
    callable
        Takes the options that make a `Bench`, and the command's own.
    """

    @functools.wraps(function)
    def called(
        *,
        interface: str,
        channel: str,
        puck: int,
        direction: str,
        gear_ratio: float,
        properties: Path | None,
        emulate: bool,
        json_file: str | None,
        quiet: bool,
        **own: Any,
    ) -> None:
        options = PuckOptions(
            interface=interface,
            channel=channel,
            puck=puck,
            gear_ratio=gear_ratio,
            direction=1 if direction == "1" else -1,
            properties=_table(properties),
        )
        bench = Bench(
            options=_emulated(options) if emulate else options,
            clock=SimulatedClock() if emulate else RealClock(),
            hand=_free_hand() if emulate else None,
            json_file=json_file,
            quiet=quiet,
        )
        function(bench, **own)

    for option in reversed(_OPTIONS):
        called = option(called)
    return called


def _emulated(options: PuckOptions) -> PuckOptions:
    emulator = EmulatorOptions(
        gear_ratio=options.gear_ratio,
        direction=options.direction,
        properties=options.properties,
    )
    return dataclasses.replace(
        options, emulator=emulator, angle_after_reset=_EMULATED_START
    )


def _write(path: Path, text: str) -> None:
    try:
        path.write_text(text, encoding="utf-8")
    except OSError as error:
        error.filename = str(path)  # a full disk does not say which file it was
        raise


def _free_hand() -> SimulatedHand:
    return SimulatedHand(
        start=_EMULATED_START, end=_RANGE_END, mean_speed=1.0, slip_time=0.0
    )


def _table(path: Path | None) -> PropertyTable | None:
    return None if path is None else read_property_table(path)
