"""masrel plan: sizes, grids, a study's own plan, and what is printed of them."""

import json
import tomllib
from pathlib import Path

import pytest

from tests.cli.process import Caller

KAPPA = (
    *("plan", "--value", "0.6", "--prevalences", "0.7,0.3", "--model", "mixture"),
    *("--target", "items", "--interval", "t", "--quiet"),
)


def test_the_number_of_items_is_solved_for(masrel: Caller) -> None:
    done = masrel(*KAPPA, "--raters", "3", "--half-width", "0.2", "--csv")
    assert done.code == 0
    head, row = done.out.splitlines()
    plan = dict(zip(head.split(","), row.split(","), strict=True))
    assert float(plan["half_width"]) <= 0.2
    fewer = str(int(plan["n_items"]) - 1)
    less = masrel(*KAPPA, "--raters", "3", "--items", fewer, "--json", "-")
    assert json.loads(less.out)["plans"][0]["expected_half_width"] > 0.2


def test_a_sentence_for_a_protocol(masrel: Caller) -> None:
    done = masrel(*KAPPA, "--raters", "2", "--items", "30", "--sentence")
    assert done.out.startswith(
        "With 30 items and 2 raters, the 95 % interval of Fleiss' κ for other items "
        "has an expected half-width of 0.331 (0.254 to 0.916), with coverage 0.923, if "
        "the coefficient is 0.6 (mixture model; summed over all studies"
    )


def test_lines_for_a_protocol_are_toml(masrel: Caller) -> None:
    done = masrel(*KAPPA, "--raters", "2", "--items", "30", "--toml")
    analysis = tomllib.loads(done.out)["analysis"]
    assert analysis["level"] == 0.95
    assert analysis["estimates"][0]["coefficient"] == "fleiss_kappa"


def test_a_grid_has_a_curve(masrel: Caller, tmp_path: Path) -> None:
    sizes = ("--raters", "2,3", "--items", "10:30:10")
    file = tmp_path / "curve.svg"
    done = masrel(*KAPPA, *sizes, "--figure", file, "--json", tmp_path / "plan.json")
    assert (done.code, file.exists()) == (0, True)
    plans = json.loads((tmp_path / "plan.json").read_text("utf-8"))["plans"]
    assert [(plan["n_items"], plan["n_raters"]) for plan in plans] == [
        (n, r) for n in (10, 20, 30) for r in (2, 3)
    ]


def test_a_study_says_what_its_plan_can_show(
    masrel: Caller, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("masrel.planning._tasks.TASK", 10)  # each line takes seconds
    monkeypatch.setattr("masrel.planning._tasks._CHOSEN_TASK", 5)
    monkeypatch.setattr("masrel.planning._tasks._RELATIVE", 1.0)
    assert masrel("init", tmp_path / "study").code == 0
    done = masrel("plan", tmp_path / "study", "--value", "0.6", "--csv")
    assert done.code == 0
    assert done.out.startswith("line,value,n_items,n_raters,")


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--raters", "x"), "needs numbers as 10,20 or 10:50:10, got 'x'"),
        (("--raters", "5:1:1"), "needs numbers as 10,20"),
        (("--raters", "2"), "half_width: needs an aim"),
        ((), "n_items, n_raters: needs exactly one of them"),
        (("--items", "5,6"), "a grid needs both"),
        (("--items", "0", "--raters", "2"), "n_items: needs a whole number above 0"),
        (("--raters", "2", "--prevalences", "a"), "--prevalences: needs numbers as"),
        (("--raters", "2", "--prices", "1"), "--prices: needs three"),
        (("--raters", "2", "--items", "9", "--power", ".8"), "--power: needs --items"),
        (("--raters", "2", "--items", "9", "--figure", "x.png"), "--figure: needs sev"),
    ],
)
def test_bad_input_is_one_sentence(
    masrel: Caller, options: tuple[str, ...], words: str
) -> None:
    done = masrel(*KAPPA, *options)
    assert done.code == 2
    assert words in done.err
    assert "Traceback" not in done.err
