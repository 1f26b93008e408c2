"""masrel plan: sizes, grids, a study's own plan, and what is printed of them."""

import json
from pathlib import Path
from typing import Any

import pytest

from masrel.planning import units_needed
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


def test_a_grid_has_a_curve(masrel: Caller, tmp_path: Path) -> None:
    sizes = ("--raters", "2,3", "--items", "10:30:10")
    file = tmp_path / "curve.svg"
    done = masrel(*KAPPA, *sizes, "--figure", file, "--json", tmp_path / "plan.json")
    assert (done.code, file.exists()) == (0, True)
    plans = json.loads((tmp_path / "plan.json").read_text("utf-8"))["plans"]
    assert [(plan["n_items"], plan["n_raters"]) for plan in plans] == [
        (n, r) for n in (10, 20, 30) for r in (2, 3)
    ]


def plans_of(masrel: Caller, *options: object) -> list[dict[str, Any]]:
    done = masrel(*options, "--json", "-")
    assert done.code == 0, done.err
    plans: list[dict[str, Any]] = json.loads(done.out)["plans"]
    return plans


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    """Few studies, since only where plans come from is looked at."""
    monkeypatch.setattr("masrel.planning._studies._TASK", 20)
    monkeypatch.setattr("masrel.planning._studies._CHOSEN_TASK", 5)
    monkeypatch.setattr("masrel.planning._studies._RELATIVE", 1.0)


@pytest.fixture
def study(masrel: Caller, tmp_path: Path) -> Path:
    """Four models, two raters, a line with an interval and one without."""
    assert masrel("init", tmp_path / "study").code == 0
    return tmp_path / "study"


def changed(study: Path, *changes: tuple[str, str]) -> None:
    protocol = study / "protocol.toml"
    text = protocol.read_text("utf-8")
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    protocol.write_text(text, "utf-8")


@pytest.mark.usefixtures("quick")
def test_lines_are_planned_with_their_methods_targets_and_repeats(
    masrel: Caller, study: Path
) -> None:
    retest = """
[[analysis.estimates]]
id = "again"
kind = "test-retest"
coefficient = "pooled_kappa"
sessions = ["test", "later"]
target = "items"
interval = "jackknife"

[report]
"""
    changed(
        study,
        ("repeats = 1", "repeats = 3"),
        ('id = "R2"\n', 'id = "R2"\n\n[[raters]]\nid = "R3"\n'),
        (
            'id = "test"\nraters = ["R1", "R2"]\n',
            'id = "test"\nraters = ["R1", "R2", "R3"]\n\n[[sessions]]\nid = "later"\n'
            'raters = ["R1"]\n',
        ),
        (
            'target = "items"\ninterval = "auto"',
            'target = "raters"\ninterval = "jackknife"',
        ),
        ('interval = "none"', 'interval = "posterior"'),
        ("[report]\n", retest),
    )
    plans = plans_of(masrel, "plan", study, "--value", "0.6")
    keys = ("target", "interval", "n_items", "n_raters")
    assert [tuple(plan[key] for key in keys) for plan in plans] == [
        ("raters", "jackknife", 12, 3),
        ("items", "posterior", 12, 3),
        ("items", "jackknife", 12, 1),
    ]


@pytest.mark.usefixtures("quick")
def test_what_the_protocol_says_of_its_size_is_taken(
    masrel: Caller, study: Path
) -> None:
    lines = masrel("plan", study, "--value", "0.7", "--interval", "t", "--toml")
    assert lines.code == 0
    protocol = study / "protocol.toml"
    made = lines.out.replace("n_items = 4", "n_items = 5", 1)
    text = protocol.read_text("utf-8").replace("[report]\n", f"{made}\n[report]\n")
    protocol.write_text(text, "utf-8")
    assert masrel("check", study).code == 0
    done = masrel("plan", study, "--json", "-")
    (plan,) = json.loads(done.out)["plans"]
    assert (plan["value"], plan["interval"]) == (0.7, "auto")
    assert "note: kappa: the plan is for 5 items, but the study has 4" in done.err


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--items", "30"), "--items: is not allowed for a study"),
        (("--coefficient", "cohen_kappa"), "--coefficient: is not allowed for a study"),
        (("--power", "0.8"), "--power: is not allowed for a study"),
        (("--toml", "--interval", "t"), "--toml: needs one --value"),
        (("--value", "2"), "needs a line of [[analysis.estimates]] that can be"),
    ],
)
@pytest.mark.usefixtures("quick")
def test_a_study_has_its_own_plan(
    masrel: Caller, study: Path, options: tuple[str, ...], words: str
) -> None:
    done = masrel("plan", study, *options)
    assert done.code == 2
    assert words in done.err


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--raters", "x"), "needs numbers as 10,20 or 10:50:10, got 'x'"),
        (("--raters", "5:1:1"), "needs numbers as 10,20"),
        (("--raters", "2"), "--half-width: needs an aim"),
        ((), "--items, --raters: needs exactly one of them"),
        (("--items", "5,6"), "--half-width: needs an aim"),
        (("--value", "0.4,0.6"), "--items, --raters: a grid needs one of them"),
        (("--items", "0", "--raters", "2"), "--items: needs a whole number above 1"),
        (("--raters", "2", "--prevalences", "a"), "needs numbers as 10,20"),
        (("--raters", "2", "--prices", "1"), "--prices: needs three"),
        (
            ("--raters", "2", "--items", "9", "--power", ".8"),
            "--power: needs null, lower",
        ),
        (
            ("--raters", "2", "--items", "9", "--max-cost", "8"),
            "--max-cost: needs either",
        ),
        (("--raters", "2", "--items", "9,8", "--max-cost", "8"), "--max-cost: is not"),
        (
            ("--raters", "2", "--items", "9,8", "--method", "wald"),
            "--method: a grid needs",
        ),
        (
            ("--raters", "2", "--items", "9", "--scheduler", "x"),
            "--scheduler: needs executor",
        ),
        (("--prices", "1,1,1"), "--half-width: needs an aim"),
        (
            ("--prices", "0,1,0", "--half-width", ".2"),
            "--prices: needs a price for an item",
        ),
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


def test_units_of_any_estimate(masrel: Caller) -> None:
    call = ("plan", "--error", "0.04", "--items", "20", "--half-width", "0.03")
    n = units_needed(0.04, 20, half_width=0.03)
    assert f"{n} are needed" in masrel(*call).out
    document = json.loads(masrel(*call, "--level", "0.9", "--json", "-").out)
    assert document["n_needed"] == units_needed(0.04, 20, half_width=0.03, level=0.9)
