"""Join a bus for a while, and wake a puck on it; nothing moves."""

from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass

from masrel.hess.clock import Clock
from masrel.hess.hand import Hand
from masrel.hess.puck.arrivals import accepted_identifiers
from masrel.hess.puck.bring_up import configure, wake
from masrel.hess.puck.bus import Link, open_link
from masrel.hess.puck.emulator import PuckEmulator
from masrel.hess.puck.emulator_options import EmulatorOptions
from masrel.hess.puck.identity import identify, table_of
from masrel.hess.puck.node import PuckNode
from masrel.hess.puck.options import PuckOptions
from masrel.hess.puck.properties import PropertyTable
from masrel.hess.puck.transmission import Transmission

__all__ = ["Awake", "awake", "connected"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Awake:
    """A puck that is awake, idle and configured."""

    node: PuckNode  # the puck
    table: PropertyTable  # numbers of its properties
    transmission: Transmission  # what it counts in
    # whether it was woken just now, and so does not know where the arm is
    was_asleep: bool


@contextmanager
def connected(
    options: PuckOptions,
    *,
    clock: Clock,
    hand: Hand | None = None,
    range_end: float,
    hears_all: bool = False,
) -> Iterator[Link]:
    """Join a bus for a while, with an emulated puck on it where there is a hand."""
    with ExitStack() as held:
        emulator = None
        if hand is not None:
            emulator = PuckEmulator(
                link=held.enter_context(
                    open_link(options.interface, options.channel, clock=clock)
                ),
                clock=clock,
                hand=hand,
                range_end=range_end,
                options=options.emulator or EmulatorOptions(),
                puck=options.puck,
            )
        yield held.enter_context(
            open_link(
                options.interface,
                options.channel,
                clock=clock,
                accepted=None if hears_all else accepted_identifiers(options.puck),
                neighbour=emulator,
            )
        )


def awake(link: Link, clock: Clock, options: PuckOptions) -> Awake:
    """Wake a puck if it sleeps, idle it, and set what the driver needs set."""
    node = PuckNode(link, clock, options.puck)
    identity = identify(node)
    table = table_of(identity, options.properties)
    if not identity.is_awake:
        wake(node)
    return Awake(
        node=node,
        table=table,
        transmission=configure(node, table, options),
        was_asleep=not identity.is_awake,
    )
