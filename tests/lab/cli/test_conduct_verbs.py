"""The verbs of a coordinator: what they record, show and refuse in one sentence."""

import json
import os
from pathlib import Path

import pytest
from click.testing import CliRunner

from masrel.cli import cli
from masrel.lab.protocol import StudyPaths
from tests.files import edit, small_study

FIELDS = """
[rater_fields.years]
type = "whole"
title = "Experience"
unit = "years"

[[sessions]]"""


@pytest.fixture
def study(tmp_path: Path) -> StudyPaths:
    paths = StudyPaths(tmp_path / "study")
    small_study(paths.root)
    edit(paths.protocol, "\n[[sessions]]", FIELDS, 1)
    return paths


def call(*words: object) -> str:
    result = CliRunner().invoke(cli, [str(word) for word in words])
    assert result.exit_code == 0, (result.output, result.exception)
    return result.stdout


def refusal(*words: object) -> str:
    result = CliRunner().invoke(cli, [str(word) for word in words])
    assert result.exit_code != 0
    return f"{result.exception} {result.stderr}"


def test_what_is_recorded_is_listed_and_shown(study: StudyPaths) -> None:
    by = ("--who", "MK")
    call("record", "rater", study.root, "--rater", "R1", "years=12", *by)
    call("record", "deviation", study.root, "power cut", *by, "--rater", "R2")
    call("record", "exclude", study.root, "--rater", "R2", *by, "--why", "left-handed")
    listed = json.loads(call("status", "raters", study.root, "--json", "-"))["raters"]
    assert [(r["status"], r["fields"]) for r in listed] == [
        ("planned", {"years": 12}),
        ("excluded", {"years": None}),
    ]
    assert "Experience (years)" in call("status", "raters", study.root)
    shown = call("status", study.root)
    assert "deviation: text power cut, who MK, rater R2" in shown
    assert f"next: masrel schedule {study.root}  (1 of 2 schedules" in shown
    call("record", "include", study.root, "--rater", "R2", *by, "--why", "it is not so")
    document = json.loads(call("status", study.root, "--json", "-"))
    kinds = [event["event"] for event in document["events"]]
    assert kinds == ["rater-set", "noted", "excluded", "included"]
    assert document["sessions"][0]["stage"] == "not drawn"
    assert document["raters"][1]["status"] == "planned"


def test_the_table_of_raters_is_written_beside_the_ratings(study: StudyPaths) -> None:
    call("schedule", study.root)
    call("run", study.root, "--rater", "R1", "--session", "test", "--grades=simulated")
    call("ratings", study.root)
    rows = study.raters_file.read_text(encoding="utf-8").splitlines()
    assert rows[-3:] == [
        "rater,site,status,late,years",
        "R1,NA,complete,no,NA",
        "R2,NA,planned,no,NA",
    ]
    if os.name == "posix":  # a field may be one that is not public
        assert study.raters_file.stat().st_mode & 0o077 == 0
    other = study.root.parent / "other.csv"
    study.raters_file.unlink()
    call("ratings", study.root, "-o", other)
    assert not study.raters_file.exists()


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        (("record", "rater", "--rater", "R1", "years"), "needed a field, '=' and its"),
        (("record", "rater", "--rater", "R1", "years=1", "years=2"), "each field once"),
        (
            ("record", "rater", "--rater", "R1", "years=x"),
            "needed a whole number, got 'x'",
        ),
        (("record", "rater", "--rater", "R1", "age=3"), "(years), got 'age'"),
        (("record", "rater", "--rater", "R9", "years=3"), "one of R1, R2, got 'R9'"),
        (("record", "note", " "), "text: needed text, got none"),
    ],
)
def test_bad_input_is_one_sentence_and_records_nothing(
    study: StudyPaths, words: tuple[str, ...], reason: str
) -> None:
    assert reason in refusal(*words[:2], study.root, *words[2:], "--who", "MK")
    assert not study.conduct_file.exists()
