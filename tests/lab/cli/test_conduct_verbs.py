"""The verbs of a coordinator: what they record, show and refuse in one sentence."""

import json
import os
import pty
import select
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from click.testing import CliRunner

from masrel.cli import cli
from masrel.lab.protocol import StudyPaths, copy_template

FIELDS = """
[rater_fields.years]
type = "whole"
title = "Experience"
unit = "years"

[[sessions]]"""


@pytest.fixture
def study(tmp_path: Path) -> StudyPaths:
    paths = StudyPaths(tmp_path / "study")
    copy_template("small", paths.root)
    text = paths.protocol.read_text(encoding="utf-8")
    text = text.replace("\n[[sessions]]", FIELDS, 1)
    paths.protocol.write_text(text, encoding="utf-8")
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
    call("rater", "set", study.root, "--rater", "R1", "years=12", *by)
    call("note", study.root, "power cut", *by, "--kind", "deviation", "--rater", "R2")
    call("rater", "exclude", study.root, "--rater", "R2", *by, "--why", "left-handed")
    listed = json.loads(call("rater", "list", study.root, "--json", "-"))["raters"]
    assert [(r["status"], r["fields"]) for r in listed] == [
        ("planned", {"years": 12}),
        ("excluded", {"years": None}),
    ]
    assert "Experience (years)" in call("rater", "list", study.root)
    shown = call("status", study.root)
    assert "deviation: text power cut, who MK, rater R2" in shown
    assert f"next: masrel schedule {study.root}  (1 of 2 schedules" in shown
    call("rater", "include", study.root, "--rater", "R2", *by, "--why", "it is not so")
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
        (("rater", "set", "--rater", "R1", "years"), "needed a field, '=' and its"),
        (("rater", "set", "--rater", "R1", "years=1", "years=2"), "each field once"),
        (
            ("rater", "set", "--rater", "R1", "years=x"),
            "needed a whole number, got 'x'",
        ),
        (("rater", "set", "--rater", "R1", "age=3"), "(years), got 'age'"),
        (("rater", "set", "--rater", "R9", "years=3"), "one of R1, R2, got 'R9'"),
        (("note", "text", "--severity", "mild"), "'adverse-event' only"),
        (("note", "text", "--kind", "fault"), "'fault' is not one of"),
        (("note", " "), "text: needed text, got none"),
    ],
)
def test_bad_input_is_one_sentence_and_records_nothing(
    study: StudyPaths, words: tuple[str, ...], reason: str
) -> None:
    n_verb = 2 if words[0] == "rater" else 1
    verb, rest = words[:n_verb], words[n_verb:]
    assert reason in refusal(*verb, study.root, *rest, "--who", "MK")
    assert not study.conduct_file.exists()


def test_watching_and_json_do_not_go_together(study: StudyPaths) -> None:
    assert "got both" in refusal("status", study.root, "--watch", "--json", "-")


@pytest.mark.slow
def test_watching_shows_what_changes_until_it_is_stopped(study: StudyPaths) -> None:
    master, slave = pty.openpty()
    words = [sys.executable, "-m", "masrel", "status", str(study.root), "--watch"]
    process = subprocess.Popen(words, stdin=slave, stdout=slave, stderr=slave)
    os.close(slave)
    try:
        assert "masrel schedule" in until(master, "not drawn)")
        call("note", study.root, "power cut", "--who", "MK")
        assert "note: text power cut" in until(master, "power cut")
    finally:
        process.send_signal(signal.SIGINT)
        assert process.wait(timeout=30) == 1
        os.close(master)


def until(master: int, text: str) -> str:
    """What a terminal shows, until a text is there."""
    shown, deadline = "", time.monotonic() + 60
    while text not in shown:
        assert time.monotonic() < deadline, shown
        if select.select([master], [], [], 0.2)[0]:
            shown += os.read(master, 65536).decode("utf-8", errors="replace")
    return shown


@pytest.mark.slow
def test_a_merge_is_said_and_goes_on(study: StudyPaths, tmp_path: Path) -> None:
    south = StudyPaths(tmp_path / "south")
    call("schedule", study.root)
    south.root.mkdir()
    for file in (study.protocol, *study.schedules.iterdir()):
        target = south.root / file.relative_to(study.root)
        target.parent.mkdir(exist_ok=True)
        target.write_bytes(file.read_bytes())
    for root, rater in ((study.root, "R1"), (south.root, "R2")):
        where = ("--rater", rater, "--session", "test", "--grades", "simulated")
        call("run", root, *where)
    out = tmp_path / "both"
    said = call("merge", study.root, south.root, "-o", out)
    assert said == (
        f"{out}: 2 studies with 2 raters and 2 session logs, verified. "
        f"Next: masrel ratings {out}\n"
    )
    assert "2 of 2 sessions complete" in call("status", out)
    assert "8 ratings" in call("ratings", out)
    assert "needed two or more, got 1" in refusal("merge", out, "-o", tmp_path / "c")
