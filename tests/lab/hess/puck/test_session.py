"""A session on emulated pucks: a fault, on the bus or off it, and it goes on."""

import math
from pathlib import Path

import pytest

from masrel.lab.hess import Device, open_device
from tests.lab.hess.injected import CATCH, injections, outcome
from tests.lab.hess.puck.rig import FaultKind, PuckDevice, fault
from tests.lab.hess.puck.test_faults import session


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
    injected = fault(kind, CATCH, end_s=CATCH + 0.05)
    made = session(injected, tmp_path / "study")
    assert made.kind == named
    assert made.events[1:5] == ["presented", "fault", "presented", "grade"]
    assert made.events[-1] == "complete"
    assert made.whole


PAGE = Path(__file__).parents[4] / "docs" / "driver.md"
INJECTIONS = {injection.name: injection for injection in injections()}


def on_the_simulated_device(name: str) -> list[str]:
    """What the page says came of a fault there: the cells of its row."""
    rows = [
        [cell.strip() for cell in line.strip("|\n").split("|")]
        for line in PAGE.read_text(encoding="utf-8").splitlines()
    ]
    return next(cells for cells in rows if cells[0] == name and len(cells) == 8)


@pytest.mark.slow
@pytest.mark.parametrize("name", INJECTIONS)
def test_a_fault_does_on_a_puck_what_it_does_on_the_simulated_device(
    name: str, tmp_path: Path
) -> None:
    pucks = []

    def opener(_name: str, **others) -> Device:
        device = open_device("puck", **others)
        pucks.append(device)
        return device

    injection = INJECTIONS[name]
    made = outcome(injection, tmp_path / "study", opener)
    assert made.resumes
    assert made.intact
    _, named, noticed, held, *_ = on_the_simulated_device(name)
    assert (made.kind or "let pass") == named
    for device in pucks:
        assert isinstance(device, PuckDevice)
        assert device.emulator.mode == 0  # idle
    if not noticed:
        return
    # A count is 0.0047 deg and not 0.005, a position 0.075 ms old
    assert made.detected_ms == pytest.approx(float(noticed), abs=1.6)
    assert made.held_nm == pytest.approx(float(held), abs=0.25)
    if named != "released":
        assert made.peak_nm <= made.held_nm
    assert math.isnan(made.zero_ms) == (name == "bus cut for good" or injection.slip)
    if math.isfinite(made.zero_ms):
        assert made.zero_ms <= 100.0
