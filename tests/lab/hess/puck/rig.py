"""A bench for the tests: an emulated puck on a bus inside the process.

It alone looks inside the driver; `tests/lab/internal/hess/test_codec.py` tests its bus.
"""

from dataclasses import dataclass, replace
from itertools import count
from math import radians

from masrel.lab.hess import (
    DeviceSetup,
    Hand,
    Presented,
    SimulatedClock,
    SimulatedHand,
    StretchRules,
    open_device,
    run_presentation,
)
from masrel.lab.hess._emulated import FaultKind
from masrel.lab.hess.puck import EmulatorOptions, InjectedFault, Link, PuckOptions
from masrel.lab.hess.puck._emulator import PuckEmulator
from masrel.lab.hess.puck._puck_device import PuckDevice, PuckNode, build, release
from masrel.lab.hess.puck._puck_options import (
    MEMORY_WRITERS,
    Transmission,
)
from tests.lab.hess.rig import END, LIMITS, controls, stretching

__all__ = ["release"]

PUCK = Transmission(counts_per_turn=4096, units_per_nm=2700)

_channels = count()


def open_link(interface: str, channel: str, *, clock, accepted=None, peer=None) -> Link:
    options = PuckOptions(interface=interface, channel=channel)
    return options.open_link(clock, accepted=accepted, peer=peer)


def loose(start_deg: float = 90.0) -> SimulatedHand:
    """A hand that has let go: the arm is free."""
    return SimulatedHand(
        start=radians(start_deg), end=END, mean_speed=radians(90.0), slip_time=0.0
    )


@dataclass
class Bench:
    """The two ends of a bus."""

    clock: SimulatedClock
    link: Link
    emulator: PuckEmulator
    node: PuckNode

    def close(self) -> None:
        self.link.close()
        self.emulator.close()


def bench(*, hand: Hand | None = None, puck: int = 1, **options) -> Bench:
    clock = SimulatedClock()
    channel = f"bench-{next(_channels)}"
    emulator = PuckEmulator(
        link=open_link("virtual", channel, clock=clock),
        clock=clock,
        hand=hand or loose(),
        range_end=END,
        options=EmulatorOptions(**options),
        puck=puck,
    )
    link = open_link("virtual", channel, clock=clock, peer=emulator)
    return Bench(clock, link, emulator, PuckNode(link, clock, puck))


def puck_options(hand: Hand, *, emulator: dict | None = None, **changes) -> PuckOptions:
    options = PuckOptions(interface="virtual", channel=f"bench-{next(_channels)}")
    told = {"emulator": EmulatorOptions(**(emulator or {})), **changes}
    return replace(options.emulated(hand.start), **told)


def opened(
    clock: SimulatedClock, hand: Hand, *, emulator: dict | None = None, **changes
) -> PuckDevice:
    options = puck_options(hand, emulator=emulator, **changes)
    device = open_device("puck", clock=clock, hand=hand, options=options)
    assert isinstance(device, PuckDevice)
    return device


def unopened(hand: Hand, *faults: InjectedFault) -> PuckDevice:
    options = puck_options(hand, emulator={"faults": faults})
    return build(DeviceSetup(clock=SimulatedClock(), hand=hand, options=options))


def presented(
    *faults: InjectedFault,
    model: str = "HM3",
    speed_deg_s: float = 92.0,
    n_stretches: int = 1,
    **changes,
) -> tuple[Presented, PuckDevice, SimulatedClock]:
    """One presentation on an emulated puck; the device is closed afterwards."""
    speed, clock = radians(speed_deg_s), SimulatedClock()
    again = {"again": (speed,) * (n_stretches - 1), "returns": n_stretches > 1}
    hand = stretching(speed_deg_s, **again)
    with opened(clock, hand, emulator={"faults": faults, **changes}) as device:
        done = run_presentation(
            device,
            controls(model),
            clock=clock,
            limits=LIMITS,
            end_angle=END,
            stretches=StretchRules(n=n_stretches),
        )
    return done, device, clock


def told(device: PuckDevice) -> list[tuple[str, int]]:
    """What an emulated puck was set to, in order."""
    return [(setting.name, setting.value) for setting in device.emulator.settings]


def n_memory_writes(emulator: PuckEmulator) -> int:
    """How often a puck was told to write its permanent memory."""
    return sum(setting.name in MEMORY_WRITERS for setting in emulator.settings)


def fault(kind: FaultKind, start_s: float = 0.4, **more) -> InjectedFault:
    return InjectedFault(kind=kind, start_s=start_s, **more)
