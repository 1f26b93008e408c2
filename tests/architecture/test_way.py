"""The way of a rating that docs/architecture.md tells is the one that it goes."""

import re
import sys
from pathlib import Path
from types import FrameType

import masrel
from tests.cli.process import Caller

ROOT = Path(masrel.__file__).parent
PAGE = (ROOT.parent / "docs" / "architecture.md").read_text("utf-8")
STOP = re.compile(r"^\| \d+ \| `([\w/]+\.py)` \| `([\w.]+)` \|", re.MULTILINE)
GRADES = ("1 1 2", "0 0 0", "2 2 2", "3 2 3", "1 1 1", "0 1 0") * 2


def test_a_rating_goes_the_way_that_is_told(masrel: Caller, tmp_path: Path) -> None:
    rows = [f"P{place} {row}".replace(" ", ",") for place, row in enumerate(GRADES)]
    file = tmp_path / "ratings.csv"
    file.write_text("\n".join(["patient,Kim,Lee,Ann", *rows]), encoding="utf-8")
    passed: dict[tuple[str, str], int] = {}  # in the order of first calls

    def note(frame: FrameType, event: str, _: object) -> None:
        place = Path(frame.f_code.co_filename)
        if event == "call" and place.is_relative_to(ROOT):
            stop = place.relative_to(ROOT).as_posix(), frame.f_code.co_qualname
            passed.setdefault(stop, len(passed))

    sys.setprofile(note)
    try:
        done = masrel("agree", file, "--target", "items")
    finally:
        sys.setprofile(None)
    assert done.code == 0
    told = STOP.findall(PAGE)
    assert 10 <= len(told) <= 15
    assert told == sorted(told, key=lambda stop: passed[stop])
