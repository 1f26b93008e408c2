"""A pilot's ratings as the numbers of a plan."""

import json
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


def test_a_pilot_by_hand() -> None:
    made = pilot("fleiss_kappa", ITEMS, target="items", categories=["0", "1", "2"])
    assert made.estimate.value == pytest.approx(7 / 15, rel=1e-15)
    assert made.prevalences == (3 / 8, 5 / 8, 0.0)
    gap = [[*ITEMS[0], None], *([*row, row[0]] for row in ITEMS[1:])]
    assert pilot("fleiss_kappa", gap, target="items").p_missing == 1 / 12
    with pytest.raises(RatingsError, match="undefined in it"):
        pilot("fleiss_kappa", ITEMS[2:], target="items")


def test_a_plan_takes_from_it_what_is_not_given(
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
) -> None:
    masrel, file = Caller(monkeypatch, capsys), tmp_path / "pilot.csv"
    file.write_text(CSV)
    by_hand = ("--value", repr(7 / 15), "--prevalences", "0.375,0.625")
    plans = [
        json.loads(masrel("plan", *from_, *OPTIONS, *SIZE).out)["plans"][0]
        for from_ in (("--pilot", file), by_hand, ("--pilot", file, "--value", "0.7"))
    ]
    assert plans[0] == plans[1]
    assert plans[2]["value"] == pytest.approx(0.7)
