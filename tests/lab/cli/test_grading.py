"""masrel grading: odds ratios as a table or JSON, and undefined ones with a reason."""

import json
from pathlib import Path

import pytest

from masrel.lab.analysis import grade_regression
from masrel.lab.protocol import read_protocol, scale_of
from masrel.lab.ratings import read_study_ratings
from tests.cli.process import Caller

STUDY = Path(__file__).parents[3] / "studies/hess2012"


def test_json_is_one_document_with_every_digit(masrel: Caller, tmp_path: Path) -> None:
    protocol = read_protocol(STUDY / "protocol.toml")
    file = STUDY / "ratings" / "published.csv"
    ratings = read_study_ratings(file, scale_of(protocol))
    found = grade_regression(protocol, ratings, predictors=("H", "speed"), level=0.9)
    asked = ("grading", STUDY, "--on", "H, speed", "--level", 0.9, "--json")
    done = masrel(*asked, "-")
    assert (done.code, done.err) == (0, "")
    document = json.loads(done.out)
    names = ("predictor", "odds_ratio", "low", "high")
    assert [[said[name] for name in names] for said in document["effects"]] == [
        [getattr(effect, name) for name in names] for effect in found.effects
    ]
    assert (document["level"], document["simulated"]) == (0.9, False)
    written = masrel(*asked, tmp_path / "grading.json")
    assert "90 % interval" in written.out
    assert (tmp_path / "grading.json").read_text("utf-8") == done.out


def test_what_is_undefined_is_null_and_said_why(masrel: Caller) -> None:
    done = masrel("grading", STUDY, "--json", "-")
    assert done.code == 0
    assert done.err.startswith("note: these predictors separate some grades")
    document = json.loads(done.out, parse_constant=pytest.fail)  # no NaN
    assert {effect["odds_ratio"] for effect in document["effects"]} == {None}
    assert document["reason"].startswith("these predictors separate some grades")
    assert document["dropped"] == [
        ["D", "it is a combination of L, H, Q in these ratings"]
    ]


def test_only_the_ratings_asked_for_are_regressed(masrel: Caller) -> None:
    done = masrel("grading", STUDY, "--models", "dummy", "--on", "H,speed")
    assert done.code == 2
    assert "needs two grades and two raters or more, got 0 and 0" in done.err
    done = masrel("grading", STUDY, "--session", "third")
    assert done.code == 2
    assert done.err.startswith("masrel: --session: needs one of ")
