"""Each injected fault is named, takes its torque back, and the session goes on."""

import math
from pathlib import Path

import pytest

from .injected import Injection, injections, outcome, row

PAGE = Path(__file__).parents[2] / "docs" / "driver.md"
INJECTIONS = injections()
BY_NAME = {injection.name: injection for injection in INJECTIONS}


def test_there_are_more_than_twenty_five_of_them() -> None:
    assert len(INJECTIONS) >= 25
    assert len(BY_NAME) == len(INJECTIONS)


@pytest.mark.parametrize("name", BY_NAME)
def test_an_injected_fault(name: str, tmp_path: Path) -> None:
    injection: Injection = BY_NAME[name]
    made = outcome(injection, tmp_path / "study")
    # The page has what came of it, to the digits it prints
    assert row(made) in PAGE.read_text(encoding="utf-8")
    assert made.resumes
    assert made.intact
    if injection.slip:
        assert made.kind == "released"
        assert made.detected_ms <= 20.0
        return
    assert made.kind == injection.expected
    if injection.expected is None:
        assert "fault" not in made.events
        return
    if injection.full_disk:
        assert made.events[:2] == ["session", "resumed"]
        assert made.events[2:4] == ["presented", "fault"]  # from what was kept
        return
    assert made.events[1:5] == ["presented", "fault", "presented", "grade"]
    assert made.peak_nm <= made.held_nm  # never more than was there
    if name == "bus cut for good":
        assert math.isnan(made.zero_ms)  # no software can; docs/driver.md says so
    else:
        assert made.zero_ms <= 100.0
