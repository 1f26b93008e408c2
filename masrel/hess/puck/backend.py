"""Make the device of a puck, on a real bus or emulated."""

import itertools

from masrel.errors import DeviceError
from masrel.hess.clock import SimulatedClock
from masrel.hess.device import DeviceSetup
from masrel.hess.hand import Hand
from masrel.hess.puck.device import PuckDevice
from masrel.hess.puck.emulated import EmulatedPuckDevice, UnwiredPuckDevice
from masrel.hess.puck.options import PuckOptions

__all__ = ["build", "emulated_options"]

_channels = itertools.count(1)


def emulated_options(hand: Hand) -> PuckOptions:
    """Return options for an emulated puck on a bus of its own."""
    channel = f"masrel-{next(_channels)}"
    return PuckOptions(interface="virtual", channel=channel).emulated(hand.start)


def build(setup: DeviceSetup) -> PuckDevice:
    """Make the device of a puck: emulated when there is a hand, else on a real bus."""
    options, hand = setup.options, setup.hand
    if options is None:
        if hand is None:
            raise DeviceError("puck: needs options that say on which bus it is")
        options = emulated_options(hand)
    if not isinstance(options, PuckOptions):
        got = type(options).__name__
        raise DeviceError(f"puck: needs options of type PuckOptions, got {got}")
    if (hand is None) != (options.emulator is None):
        raise DeviceError(
            "puck: needs a simulated hand with an emulated puck and none without, got "
            + ("an emulator alone" if hand is None else "a hand alone")
        )
    if hand is not None:
        return EmulatedPuckDevice(
            options, clock=setup.clock, hand=hand, range_end=setup.range_end
        )
    if isinstance(setup.clock, SimulatedClock):
        raise DeviceError("puck: needs a real clock, its bus is outside this process")
    kind = PuckDevice if options.moves_hardware else UnwiredPuckDevice
    return kind(options, clock=setup.clock)
