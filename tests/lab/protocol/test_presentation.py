"""`[presentation]`: every wrong value is one sentence with file and key."""

from pathlib import Path

import pytest

from masrel.errors import ProtocolError
from masrel.lab.protocol import read_protocol
from tests.lab.protocol.documents import VALID, changed, write

STRETCHES = (
    'needed "free" or a whole number at least 1 and at most 100 or an array of 1 to '
    '100 entries, each one of "fast", "slow"'
)


@pytest.mark.parametrize("stretches", ["free", 1, 7, ["slow", "fast"], ["fast"]])
def test_stretches_are_free_counted_or_cued(tmp_path: Path, stretches: object) -> None:
    document = changed("presentation", to={"stretches": stretches})
    rules = read_protocol(write(document, tmp_path)).presentation
    cues = tuple(stretches) if isinstance(stretches, list) else stretches
    assert rules.stretches == cues


def test_a_protocol_without_the_table_has_one_stretch(tmp_path: Path) -> None:
    rules = read_protocol(write(VALID, tmp_path)).presentation
    assert (rules.stretches, rules.time_limit_s, rules.stretch_limit_s) == (1, 60, 20)


@pytest.mark.parametrize(
    ("table", "problem"),
    [
        ({"stretches": 0}, f"stretches: {STRETCHES}, got 0"),
        ({"stretches": -2}, f"stretches: {STRETCHES}, got -2"),
        ({"stretches": 1.5}, f"stretches: {STRETCHES}, got 1.5"),
        ({"stretches": True}, f"stretches: {STRETCHES}, got true"),
        ({"stretches": "many"}, f'stretches: {STRETCHES}, got "many"'),
        (
            {"stretches": []},
            "stretches: needed an array of 1 to 100 entries, each one of "
            '"fast", "slow", got an array of 0',
        ),
        (
            {"stretches": ["slow", "brisk"]},
            'stretches[1]: needed one of "fast", "slow", got "brisk"',
        ),
        (
            {"stretches": "free", "time_limit_s": -1.0},
            "time_limit_s: needed a number above 0 and at most 3600, got -1.0",
        ),
        (
            {"stretches": "free", "stretch_limit_s": 0.0},
            "stretch_limit_s: needed a number above 0 and at most 600, got 0.0",
        ),
        (
            {"stretches": 2, "done_with": "voice"},
            'done_with: needed one of "button", "enter", got "voice"',
        ),
        (
            {"time_limit_s": 30.0},
            "time_limit_s: needed with presentation.stretches other than 1 only, got "
            "30.0",
        ),
        (
            {"stretches": ["slow"], "stretch_limit_s": 5.0},
            "slow_speed_deg_s: needed a stretch of 116 deg within "
            "presentation.stretch_limit_s (5), got 10",
        ),
        (
            {"stretches": ["fast"], "fast_speed_deg_s": 140.0},
            "fast_speed_deg_s: needed at most stretch.largest_speed_deg_s (131), got "
            "140",
        ),
        (
            {"stretches": ["slow", "fast"], "slow_speed_deg_s": 120.0},
            "slow_speed_deg_s: needed less than presentation.fast_speed_deg_s (120), "
            "got 120",
        ),
        ({"pause_s": 1.0}, "pause_s: needed a known key"),
    ],
)
def test_what_is_wrong_is_said_once(
    tmp_path: Path, table: dict[str, object], problem: str
) -> None:
    path = write(changed("presentation", to=table), tmp_path)
    with pytest.raises(ProtocolError) as caught:
        read_protocol(path)
    (said,) = caught.value.problems
    assert said.startswith(f"{path}: presentation.{problem}")
