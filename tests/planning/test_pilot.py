"""A pilot's ratings as the numbers of a plan."""

import json
import math
from pathlib import Path

import pytest

from masrel.errors import RatingsError
from masrel.planning import pilot
from tests.cli.process import Caller

# Four items of two raters: one disagreement, marginals 3/8 and 5/8. Observed agreement
# 3/4, by chance (9 + 25) / 64 = 17/32, kappa (24 - 17) / (32 - 17) = 7/15.
ITEMS = [["0", "0"], ["0", "1"], ["1", "1"], ["1", "1"]]
CSV = "item,Kim,Lee\n" + "".join(f"{i},{a},{b}\n" for i, (a, b) in enumerate(ITEMS))
OPTIONS = ("--model", "mixture", "--target", "items", "--interval", "t", "--quiet")
SIZE = ("--raters", "2", "--items", "30", "--json", "-")


@pytest.fixture
def masrel(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> Caller:
    return Caller(monkeypatch, capsys)


def test_a_pilot_by_hand() -> None:
    made = pilot("fleiss_kappa", ITEMS, target="items")
    assert made.estimate.value == pytest.approx(7 / 15, rel=1e-15)
    assert made.estimate.interval is not None
    assert made.categories == ("0", "1")
    assert made.prevalences == (3 / 8, 5 / 8)
    assert made.p_missing == 0.0


def test_what_is_missing_and_what_nobody_chose() -> None:
    ratings = [[*ITEMS[0], None], *([*row, row[0]] for row in ITEMS[1:])]
    made = pilot("fleiss_kappa", ratings, target="items", categories=["0", "1", "2"])
    assert made.p_missing == pytest.approx(1 / 12)
    assert made.prevalences == (4 / 11, 7 / 11, 0.0)


def test_a_plan_takes_from_it_what_is_not_given(masrel: Caller, tmp_path: Path) -> None:
    file = tmp_path / "pilot.csv"
    file.write_text(CSV)
    done = masrel("plan", "--pilot", file, *OPTIONS, *SIZE)
    assert done.err.startswith(f"pilot {file}: fleiss_kappa: 0.4667")
    by_hand = ("--value", repr(7 / 15), "--prevalences", "0.375,0.625")
    same = masrel("plan", *by_hand, *OPTIONS, *SIZE)
    plans = [json.loads(each.out)["plans"][0] for each in (done, same)]
    assert plans[0] == plans[1]
    given = masrel("plan", "--pilot", file, "--value", "0.7", *OPTIONS, *SIZE)
    assert math.isclose(json.loads(given.out)["plans"][0]["value"], 0.7)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("item,a,b\n1,0,0\n2,0,0\n", "pilot: fleiss_kappa is undefined in it: "),
        ("", "the file is empty"),
    ],
)
def test_a_pilot_that_says_nothing(
    masrel: Caller, tmp_path: Path, text: str, words: str
) -> None:
    file = tmp_path / "pilot.csv"
    file.write_text(text)
    done = masrel("plan", "--pilot", file, *OPTIONS, *SIZE)
    assert done.code == 2
    assert words in done.err
    assert len(done.err.splitlines()) == 1


def test_an_undefined_coefficient_is_no_pilot() -> None:
    with pytest.raises(RatingsError, match="undefined in it"):
        pilot("fleiss_kappa", [["0", "0"], ["0", "0"]], target="items")
