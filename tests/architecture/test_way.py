"""The ways of a rating and of a presentation in docs/development/ways.md."""

import re
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import CodeType, FrameType

import masrel
from tests.cli.process import Caller
from tests.files import edit

ROOT = Path(masrel.__file__).parent
PAGE = (ROOT.parent / "docs/development/ways.md").read_text("utf-8")
STOP = re.compile(r"^\| \d+ \| `([\w/]+\.py)` \| `([\w.]+)` \|", re.MULTILINE)
GRADES = ("1 1 2", "0 0 0", "2 2 2", "3 2 3", "1 1 1", "0 1 0") * 2

Stop = tuple[str, str]  # file and function


@contextmanager
def passing() -> Iterator[dict[Stop, int]]:
    """Fill in, at its end, what was passed, by the order of first calls."""
    passed: dict[Stop, int] = {}
    codes: dict[CodeType, None] = {}

    def note(frame: FrameType, event: str, _: object) -> None:
        if event == "call":
            codes.setdefault(frame.f_code)

    sys.setprofile(note)
    try:
        yield passed
    finally:
        sys.setprofile(None)
        for code in codes:
            place = Path(code.co_filename)
            if place.is_relative_to(ROOT):
                stop = place.relative_to(ROOT).as_posix(), code.co_qualname
                passed.setdefault(stop, len(passed))


def told(what: str) -> list[Stop]:
    """Return the stops of the table below a heading."""
    section = PAGE.partition(f"## The way of one {what}")[2].partition("\n##")[0]
    return [(file, function) for file, function in STOP.findall(section)]


def test_a_rating_goes_the_way_that_is_told(masrel: Caller, tmp_path: Path) -> None:
    rows = [f"P{place} {row}".replace(" ", ",") for place, row in enumerate(GRADES)]
    file = tmp_path / "ratings.csv"
    file.write_text("\n".join(["patient,Kim,Lee,Ann", *rows]), encoding="utf-8")
    with passing() as passed:
        done = masrel("agree", file, "--target", "items")
    assert done.code == 0
    stops = told("rating")
    assert 10 <= len(stops) <= 15
    assert stops == sorted(stops, key=lambda stop: passed[stop])


def test_a_presentation_goes_the_way_that_is_told(
    masrel: Caller, tmp_path: Path
) -> None:
    study = tmp_path / "study"
    session = ("--rater", "R1", "--session", "test", "--grades", "simulated")
    assert masrel("init", study).code == 0
    edit(study / "protocol.toml", 'stretches = "free"', "stretches = 1")
    with passing() as passed:
        for call in (("schedule",), ("run", *session), ("report", "--quiet")):
            command, *options = call
            assert masrel(command, study, *options).code == 0
    stops = told("presentation")
    assert 15 <= len(stops) <= 20
    assert stops == sorted(stops, key=lambda stop: passed[stop])
