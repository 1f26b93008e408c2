"""What a check says of a puck whose faults begin while it is looked at."""

import pytest

from masrel.lab.hess import SimulatedClock
from masrel.lab.hess.puck import connected
from masrel.lab.hess.puck._commissioning import awake, check_awake
from tests.lab.hess.puck.rig import END, fault, loose, puck_options


@pytest.mark.parametrize(
    ("fault_kind", "more", "failed"),
    [
        ("dropped-replies", {"every": 100}, ["answers"]),
        ("late-replies", {"size": 0.0006}, ["answers"]),
        ("late-replies", {"size": 0.0004}, []),
        ("jumping-encoder", {"every": 2, "size": 5.0}, ["rest"]),
        ("jumping-encoder", {"every": 2, "size": 4.0}, []),
        ("jumping-encoder", {"size": 30_000.0}, ["position"]),
        ("error-frames", {"every": 400}, ["error frames"]),
        ("unplugged", {"end_s": 1.0}, ["answers"]),
    ],
)
def test_what_is_wrong_with_a_puck_is_found(
    fault_kind, more: dict, failed: list[str]
) -> None:
    # The faults of an emulated puck begin with its first torque mode: put it there
    # and back before it is looked at.
    clock, hand = SimulatedClock(), loose()
    emulator = {"awake": True, "faults": (fault(fault_kind, 0.004, **more),)}
    options = puck_options(hand, emulator=emulator)
    with connected(options, clock=clock, hand=hand, range_end=END) as link:
        puck = awake(link, clock, options)
        puck.node.set(puck.table.number("MODE"), 2)
        puck.node.wait(0.001)
        puck.node.set(puck.table.number("MODE"), 0)
        puck.node.wait(0.004)
        checks = check_awake(puck, options)
    assert [one.name for one in checks if not one.holds] == failed
