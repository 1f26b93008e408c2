"""What a rater is shown names no model, whatever happens, before it is unblinded."""

import contextlib
import sys
from collections.abc import Callable

import pytest
from click.testing import CliRunner

from masrel.cli import main
from masrel.lab.protocol import Protocol, StudyPaths
from masrel.lab.schedule.presentation import read_schedule

NAMES = (("HM1", "ZEBRA"), ("HM3", "OKAPI"), ("D1", "TAPIR"))


@pytest.fixture
def study(
    new_study: Callable[..., tuple[StudyPaths, Protocol]],
) -> StudyPaths:
    changes = [(f'id = "{old}"', f'id = "{new}"') for old, new in NAMES]
    return new_study(*changes)[0]


def call(monkeypatch: pytest.MonkeyPatch, *words: object, typed: str = "") -> str:
    """All that one call of the command line prints, errors included."""
    monkeypatch.setattr(sys, "argv", ["masrel", *map(str, words)])
    with CliRunner().isolation(input=typed) as (out, errors, _):
        with contextlib.suppress(SystemExit):
            main()
        return (out.getvalue() + errors.getvalue()).decode()


def test_no_output_before_unblinding_names_a_model_to_a_rater(
    study: StudyPaths, monkeypatch: pytest.MonkeyPatch
) -> None:
    where = ("run", study.root, "--rater", "R1", "--session", "test")
    codes = [
        shown.code
        for shown in read_schedule(study.schedule_file("R1", "test")).presentations
    ]
    simulated = ("--clock", "simulated")
    # presented again, a word that is no grade, a grade, a stop, the end of the input
    shown = call(monkeypatch, *where, *simulated, typed="\nagain\n\n9\n1\nstop\n")
    shown += call(monkeypatch, *where, *simulated, typed="\n2\n\n")
    by = ("--who", "A", "--why", "b")
    for code in (codes[0], "00A"):
        correct = ("record", "correct", *where[1:], "--code", code, "--grade", "2")
        shown += call(monkeypatch, *correct, *by)
    shown += study.sheet_file("R1", "test").read_text(encoding="utf-8")
    shown += study.log_file("R1", "test").read_text(encoding="utf-8")
    # a schedule that is damaged, one of another, and one that is not there
    file = study.schedule_file("R1", "test")
    whole = file.read_bytes()
    lines = whole.splitlines(keepends=True)
    for damaged in (whole[:-5], b"".join(lines[:-1]), b"".join(lines[1:]), b"", None):
        file.unlink()
        if damaged is not None:
            file.write_bytes(damaged)
        shown += call(monkeypatch, *where, *simulated, typed="\n")
    assert all(code in shown for code in codes[:2])
    assert "Grade of" in shown
    assert "needed a code that was presented" in shown
    assert not [name for _, name in NAMES if name in shown]
    # and the models are there to be named
    file.write_bytes(whole)
    said = call(monkeypatch, "record", "unblind", study.root, codes[0], *by)
    assert [name for _, name in NAMES if name in said]
