"""The puck that a command of ``masrel device`` is for, and where its results go."""

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
from masrel.hess.puck import PuckOptions, read_property_table

if TYPE_CHECKING:
    from masrel.hess import Device, EmergencyStop
    from masrel.hess.puck import Link

_RANGE_END = math.radians(146.0)  # where an emulated arm meets its end stop
_EMULATED_START = math.radians(60.0)

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


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class PuckSession:
    """A puck, and the screen or file that its results go to."""

    options: PuckOptions  # bus, node and how to treat it
    clock: Clock  # simulated for an emulated puck
    # what holds the arm of an emulated puck: a hand that has let go
    hand: SimulatedHand | None
    json_file: str | None  # where the JSON goes; "-" for the screen
    quiet: bool  # whether there are no progress bars

    @contextmanager
    def link(self, *, all_nodes: bool = False) -> "Iterator[Link]":
        """Join the bus for a while."""
        from masrel.hess.puck import connected

        with connected(
            self.options,
            clock=self.clock,
            hand=self.hand,
            range_end=_RANGE_END,
            all_nodes=all_nodes,
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

    def write_output(self, lines: list[str], document: dict[str, object]) -> None:
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
                _write_text(Path(self.json_file), text + "\n")


def puck_command(function: Callable[..., None]) -> Callable[..., None]:
    """Give a command the options that say which puck it is for, as a session."""

    @functools.wraps(function)
    def command(
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
        **kwargs: Any,
    ) -> None:
        options = PuckOptions(
            interface=interface,
            channel=channel,
            puck=puck,
            gear_ratio=gear_ratio,
            direction=1 if direction == "1" else -1,
            properties=None if properties is None else read_property_table(properties),
        )
        session = PuckSession(
            options=options.emulated(_EMULATED_START) if emulate else options,
            clock=SimulatedClock() if emulate else RealClock(),
            hand=_free_hand() if emulate else None,
            json_file=json_file,
            quiet=quiet,
        )
        function(session, **kwargs)

    for option in reversed(_OPTIONS):
        command = option(command)
    return command


def _free_hand() -> SimulatedHand:
    return SimulatedHand(
        start=_EMULATED_START, end=_RANGE_END, mean_speed=1.0, slip_time=0.0
    )


def _write_text(path: Path, text: str) -> None:
    try:
        path.write_text(text, encoding="utf-8")
    except OSError as error:
        error.filename = str(path)  # a full disk does not say which file it was
        raise
