"""The options that say which puck a command of ``masrel device`` is for."""

import functools
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import click

from masrel.cli.bench import RANGE_END, Bench
from masrel.hess import RealClock, SimulatedClock, SimulatedHand
from masrel.hess.puck.options import PuckOptions
from masrel.hess.puck.properties import PropertyTable
from masrel.hess.puck.property_file import read_property_table

__all__ = ["for_a_puck"]

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


def for_a_puck(function: Callable[..., None]) -> Callable[..., None]:
    """Give a command the options that say which puck it is for."""

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
        function(_bench(options, emulate, json_file, quiet), **own)

    for option in reversed(_OPTIONS):
        called = option(called)
    return called


def _bench(
    options: PuckOptions, emulate: bool, json_file: str | None, quiet: bool
) -> Bench:
    return Bench(
        options=options.emulated(_EMULATED_START) if emulate else options,
        clock=SimulatedClock() if emulate else RealClock(),
        hand=_free_hand() if emulate else None,
        json_file=json_file,
        quiet=quiet,
    )


def _free_hand() -> SimulatedHand:
    return SimulatedHand(
        start=_EMULATED_START, end=RANGE_END, mean_speed=1.0, slip_time=0.0
    )


def _table(path: Path | None) -> PropertyTable | None:
    return None if path is None else read_property_table(path)
