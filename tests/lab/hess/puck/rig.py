"""A bench for the tests: an emulated puck on a bus inside the process.

It alone looks inside the driver; `tests/lab/internal/hess/puck` tests its parts.
"""

from dataclasses import dataclass, replace
from itertools import count
from math import radians

from masrel.lab.elbow import STANDARD_MODELS
from masrel.lab.hess import (
    Controller,
    DeviceLimits,
    Hand,
    Presented,
    SimulatedClock,
    SimulatedHand,
    StretchRules,
    open_device,
    run_presentation,
)
from masrel.lab.hess.puck import EmulatorOptions, InjectedFault, Link, PuckOptions
from masrel.lab.hess.puck._bus import open_link
from masrel.lab.hess.puck._emulator import PuckEmulator
from masrel.lab.hess.puck._node import PuckNode
from masrel.lab.hess.puck._properties import Transmission
from masrel.lab.hess.puck._puck_device import PuckDevice
from masrel.lab.hess.puck._puck_options import FaultKind

START, END = radians(30.0), radians(146.0)
LIMITS = DeviceLimits(torque=20.0, speed=radians(400.0), missed_ticks=20)

PUCK = Transmission(counts_per_turn=4096, units_per_nm=2700)

_channels = count()


def stretching(speed_deg_s: float = 92.0, n_stretches: int = 1) -> SimulatedHand:
    speed = radians(speed_deg_s)
    again = (speed,) * (n_stretches - 1)
    return SimulatedHand(
        start=START, end=END, mean_speed=speed, again=again, returns=n_stretches > 1
    )


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


def presented(
    *faults: InjectedFault,
    model: str = "HM3",
    speed_deg_s: float = 92.0,
    n_stretches: int = 1,
    **changes,
) -> tuple[Presented, PuckDevice, SimulatedClock]:
    """One presentation on an emulated puck; the device is closed afterwards."""
    clock, hand = SimulatedClock(), stretching(speed_deg_s, n_stretches)
    controller = Controller(STANDARD_MODELS[model], start_angle=START)
    with opened(clock, hand, emulator={"faults": faults, **changes}) as device:
        done = run_presentation(
            device,
            controller,
            clock=clock,
            limits=LIMITS,
            end_angle=END,
            stretches=StretchRules(n=n_stretches),
        )
    return done, device, clock


def told(device: PuckDevice) -> list[tuple[str, int]]:
    """What an emulated puck was set to, in order."""
    return [(setting.name, setting.value) for setting in device.emulator.settings]


def packed_torques(first: int, second: int, third: int, fourth: int) -> bytes:
    """Bytes that set T (42) of four pucks; the driver reads such frames, sends none."""
    packed = 0
    for torque in (first, second, third, fourth):
        packed = packed << 14 | torque & 0x3FFF
    return bytes((0x80 | 42,)) + packed.to_bytes(7, "big")


def fault(kind: FaultKind, start_s: float = 0.4, **more) -> InjectedFault:
    return InjectedFault(kind=kind, start_s=start_s, **more)
