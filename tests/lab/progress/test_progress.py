"""Where a study stands follows from its logs, and no model is named."""

import os
from collections.abc import Callable
from pathlib import Path

import pytest
from click.testing import CliRunner

from masrel.cli import cli
from masrel.errors import ParameterError
from masrel.lab.conduct import Note, record_note, record_standing
from masrel.lab.progress import (
    NextStep,
    next_step,
    rater_progress,
    raters_csv,
    session_progress,
)
from masrel.lab.protocol import Protocol, StudyPaths
from masrel.lab.run._corrections import record_correction
from masrel.lab.run.session import run_session
from masrel.lab.schedule.presentation import read_schedule
from masrel.lab.schedule.sheets import write_schedules
from tests.lab.script import ScriptGrades

Small = tuple[StudyPaths, Protocol]
BY = {"who": "MK", "why": "moved away"}


def run(small: Small, rater: str, session: str = "test", *, n: int = 3) -> None:
    grades = ScriptGrades(["1", "2", "3"][:n])
    run_session(*small, rater, session, grades=grades, clock="simulated")


def stop_after(small: Small, rater: str, n: int) -> None:
    with pytest.raises(ParameterError):  # the script ends
        run(small, rater, n=n)


def step(small: Small) -> NextStep:
    sessions = session_progress(*small)
    return next_step(small[0], sessions, rater_progress(*small, sessions))


def status(small: Small) -> dict[str, str]:
    raters = rater_progress(*small, session_progress(*small))
    return {rater.rater: rater.status for rater in raters}


def test_a_session_is_drawn_begun_and_complete(small: Small) -> None:
    study, protocol = small
    study.schedule_file("R1", "retest").unlink()
    stop_after(small, "R1", 2)
    run(small, "R2")
    code = read_schedule(study.schedule_file("R2", "test")).presentations[0].code
    record_correction(study, protocol, "R2", "test", code=code, grade=None, **BY)
    of_r1, of_r2, retest = session_progress(study, protocol)
    assert (of_r1.stage, of_r1.n_graded, of_r1.n_presentations) == ("begun", 2, 3)
    assert of_r1.last_event == "presented"
    assert (of_r2.stage, of_r2.n_graded, of_r2.n_corrections) == ("complete", 2, 1)
    assert of_r2.simulated
    assert (retest.stage, retest.last_event) == ("not drawn", None)
    assert not [m.id for m in protocol.models if m.id in repr((of_r1, of_r2, retest))]


def test_a_damaged_log_is_said_and_hides_no_other_session(
    new_study: Callable[..., Small],
) -> None:
    small = study, _ = new_study(('id = "retest"', 'id = "retest"\nafter = "test"'))
    run(small, "R1")
    run(small, "R2")
    log = study.log_file("R1", "test")
    log.write_bytes(log.read_bytes().replace(b'"attempt": 1', b'"attempt": 2'))
    of_r1, of_r2, retest = session_progress(*small)
    assert retest.stage == "drawn"  # after the one that is damaged
    assert of_r1.stage == "unreadable"
    assert "needed previous" in str(of_r1.problem)
    assert of_r2.stage == "complete"
    assert step(small).command == f"masrel verify {study.root}"


def test_a_line_that_a_kill_cut_off_hides_nothing(small: Small) -> None:
    study, protocol = small
    stop_after(small, "R1", 2)
    record_standing(study, protocol, "R2", "withdrawn", **BY)
    for log in (study.log_file("R1", "test"), study.conduct_file):
        log.write_bytes(log.read_bytes() + b'{"event": "gra')
    (of_r1, _, _) = session_progress(*small)
    assert (of_r1.stage, of_r1.n_graded) == ("begun", 2)
    assert "ends without a newline" in str(of_r1.problem)
    shown = call("status", study.root)
    assert "2 of 3" in shown
    assert shown.count("ends without a newline") == 2
    assert f"next: masrel run {study.root} --rater R1 --session test" in shown
    # takes the torn line out
    record_note(study, protocol, Note(text="power cut", who="MK"))
    assert status(small)["R2"] == "withdrawn"
    assert "note: text power cut" in call("status", study.root)


def test_the_next_step_is_one_command(small: Small) -> None:
    study, protocol = small
    root = study.root
    assert step(small).command == f"masrel run {root} --rater R1 --session test"
    stop_after(small, "R2", 1)
    assert step(small).command == f"masrel run {root} --rater R2 --session test"
    assert step(small).why == "1 of 3 graded"
    assert (step(small).verb, step(small).rater) == ("run", "R2")
    record_standing(study, protocol, "R2", "withdrawn", **BY)
    run(small, "R1")
    assert step(small).command == f"masrel run {root} --rater R1 --session retest"
    study.schedule_file("R1", "retest").unlink()
    assert step(small).command == f"masrel schedule {root}"
    assert (step(small).verb, step(small).session) == ("schedule", None)
    write_schedules(protocol, study)
    run(small, "R1", "retest")
    assert step(small).command == f"masrel ratings {root}"
    study.ratings_file.parent.mkdir()
    study.ratings_file.write_text("")
    assert step(small).command == f"masrel report {root}"


def test_the_table_of_raters_has_every_field(
    new_study: Callable[..., Small],
) -> None:
    fields = '[rater_fields.clinic]\ntype = "text"\n\n[[raters]]\nid = "R1"\n'
    values = '[raters.fields]\nclinic = "=A1"\n'
    small = new_study(('[[raters]]\nid = "R1"\n', fields + values))
    assert raters_csv(*small).startswith("# Raters")
    run(small, "R1")
    text = raters_csv(*small)
    assert text.splitlines()[0].startswith("# SIMULATED")
    assert text.splitlines()[3:] == [
        "rater,site,status,late,clinic",
        "R1,NA,begun,no,'=A1",  # no spreadsheet runs it
        "R2,NA,planned,no,NA",
    ]


def test_every_log_is_read_once(small: Small, monkeypatch: pytest.MonkeyPatch) -> None:
    for rater in ("R1", "R2"):
        run(small, rater)
    reads: list[Path] = []
    opened = os.open

    def counted(path: str, *options: object, **others: object) -> int:
        reads.extend([Path(path)] * str(path).endswith(".jsonl"))
        return opened(path, *options, **others)  # type: ignore[arg-type]

    monkeypatch.setattr(os, "open", counted)
    for command in ("status", "ratings"):
        reads.clear()
        call(command, small[0].root)
        assert len(reads) == len(set(reads)) == 2


def call(*words: object) -> str:
    result = CliRunner().invoke(cli, [str(word) for word in words])
    assert result.exit_code == 0, result.output
    return result.output
