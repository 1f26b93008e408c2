"""The puck that a command of ``masrel device`` is for, and where its results go."""

import dataclasses
import functools
import math
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from tqdm import tqdm

from masrel.cli._options import STDOUT, OutputOptions, output_options, write_output
from masrel.cli._paths import InputFile
from masrel.lab.hess import Clock, RealClock, SimulatedClock, SimulatedHand
from masrel.lab.hess.puck import PuckOptions, read_property_table

if TYPE_CHECKING:
    from masrel.lab.hess import Device, EmergencyStop
    from masrel.lab.hess.puck import Link

_RANGE_END = math.radians(146.0)  # where an emulated arm meets its end stop
_EMULATED_START = math.radians(60.0)

_OPTIONS = (
    click.option(
        "--interface",
        help="The adapter, as python-can names it; default: socketcan, with --emulate "
        "virtual.",
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
        type=InputFile(path_type=Path),
        help="TOML file with the property numbers of a firmware unknown to masrel.",
    ),
    click.option(
        "--emulate", is_flag=True, help="Emulate the puck; there is no hardware then."
    ),
)
_output_options = output_options(
    json="Write what was found as JSON; - for the screen.", quiet="No progress bar."
)


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class PuckSession:
    """A puck, and the screen or file that its results go to."""

    options: PuckOptions  # bus, node and how to treat it
    clock: Clock  # simulated for an emulated puck
    # what holds the arm of an emulated puck: a hand that has let go
    hand: SimulatedHand | None
    output: OutputOptions  # where its results go

    @contextmanager
    def link(self, *, all_nodes: bool = False) -> "Iterator[Link]":
        """Join the bus for a while."""
        from masrel.lab.hess.puck import connected

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
        from masrel.lab.hess import open_device

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
        from masrel.lab.hess import EmergencyStop
        from masrel.lab.hess._stop import stop_on_key, stop_on_signals

        stop = EmergencyStop()
        keys = None if self.hand is not None else sys.stdin  # an emulator is quick
        with stop_on_signals(stop), stop_on_key(stop, keys):
            yield stop

    @contextmanager
    def progress(self, total: int) -> Iterator[Callable[[], None]]:
        """Show a bar of steps on a terminal."""
        hidden = self.output.json_file == STDOUT or self.output.quiet or None
        with tqdm(total=total, unit="", leave=False, disable=hidden) as bar:

            def step() -> None:
                bar.update()

            yield step

    def write_output(self, lines: list[str], document: dict[str, object]) -> None:
        """Print lines, or write the document as JSON; both say whether it is real."""
        simulated = not self.options.moves_hardware
        note = ["(simulated: there is no hardware on this bus)"] if simulated else []
        write_output(
            self.output,
            document=lambda: {**document, "simulated": simulated},
            text=lambda: "\n".join([*lines, *note]),
        )


def puck_command(function: Callable[..., None]) -> Callable[..., None]:
    """Give a command the options that say which puck it is for, as a session."""

    @functools.wraps(function)
    def command(
        *,
        interface: str | None,
        channel: str,
        puck: int,
        direction: str,
        gear_ratio: float,
        properties: Path | None,
        emulate: bool,
        output: OutputOptions,
        **kwargs: Any,
    ) -> None:
        options = PuckOptions(
            interface=interface or ("virtual" if emulate else "socketcan"),
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
            output=output,
        )
        function(session, **kwargs)

    decorated = _output_options(command)
    for option in reversed(_OPTIONS):
        decorated = option(decorated)
    return decorated


def _free_hand() -> SimulatedHand:
    return SimulatedHand(
        start=_EMULATED_START, end=_RANGE_END, mean_speed=1.0, slip_time=0.0
    )
