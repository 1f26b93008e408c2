"""A session on emulated pucks: a fault on the bus, and it goes on."""

from pathlib import Path

import pytest

from masrel.hess import Device, open_device
from masrel.hess.puck.faults import FaultKind
from tests.hess.injected import CATCH, Injection, outcome
from tests.hess.puck.rig import fault, puck_options


@pytest.mark.parametrize(
    ("kind", "named"),
    [
        ("bus-off", "bus-off"),
        ("unplugged", "missed-replies"),
        ("reset", "missed-replies"),
    ],
)
def test_after_a_fault_on_the_bus_the_session_goes_on(
    kind: FaultKind, named: str, tmp_path: Path
) -> None:
    faults = [(fault(kind, CATCH, end_s=CATCH + 0.05),)]

    def opener(_name: str, *, hand, options, **others) -> Device:
        assert options is None  # the study's own device is the simulated one
        emulator = {"faults": faults.pop() if faults else ()}
        made = puck_options(hand, emulator=emulator)
        return open_device("puck", hand=hand, options=made, **others)

    injection = Injection(name=kind, at_s=CATCH, expected=named)
    made = outcome(injection, tmp_path / "study", opener)
    assert made.kind == named
    assert made.events[1:5] == ["presented", "fault", "presented", "grade"]
    assert made.resumes
    assert made.intact
