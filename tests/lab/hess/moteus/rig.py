"""A bench for the tests: an emulated moteus on a bus inside the process."""

from itertools import count
from math import radians
from typing import Any

from masrel.lab.hess import (
    Device,
    Hand,
    Presented,
    SimulatedClock,
    SimulatedHand,
    StretchRules,
    open_device,
    run_presentation,
)
from masrel.lab.hess.moteus import MoteusEmulatorOptions, MoteusOptions
from masrel.lab.hess.puck import InjectedFault
from tests.lab.hess.rig import END, LIMITS, controls, stretching

_channels = count()


def loose(start_deg: float = 60.0) -> SimulatedHand:
    """A hand that has let go: the arm is free."""
    return SimulatedHand(
        start=radians(start_deg), end=END, mean_speed=radians(90.0), slip_time=0.0
    )


def moteus_options(*faults: InjectedFault, emulator: Any = (), **changes: Any):
    emulated = MoteusEmulatorOptions(faults=faults, **dict(emulator))
    channel = f"moteus-{next(_channels)}"
    where = {"interface": "virtual", "channel": channel}
    return MoteusOptions(**{**where, "emulator": emulated, **changes})


def opened(
    *faults: InjectedFault, clock: Any = None, hand: Hand | None = None, **options: Any
) -> Device:
    return open_device(
        "moteus",
        clock=clock or SimulatedClock(),
        hand=hand or loose(),
        options=moteus_options(*faults, **options),
    )


def presented(
    *faults: InjectedFault,
    model: str = "HM3",
    clock: SimulatedClock | None = None,
    n_stretches: int = 1,
    **options: Any,
) -> tuple[Presented, Device]:
    """One presentation on an emulated moteus; the device is closed afterwards."""
    clock = clock or SimulatedClock()
    again = (radians(92.0),) * (n_stretches - 1)
    hand = stretching(92.0, again=again, returns=n_stretches > 1)
    with opened(*faults, clock=clock, hand=hand, **options) as device:
        done = run_presentation(
            device,
            controls(model),
            clock=clock,
            limits=LIMITS,
            end_angle=END,
            stretches=StretchRules(n=n_stretches),
        )
    return done, device
