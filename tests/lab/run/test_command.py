"""``masrel run``, ``ratings`` and ``record`` as they are typed: who graded, and what is
skipped, corrected to missing, or graded late."""

import io
import sys
from collections.abc import Callable
from functools import partial

import pytest
from click.testing import CliRunner

from masrel.cli import cli
from masrel.errors import DeviceError, SessionLogError
from masrel.lab._event_log import read_log
from masrel.lab.protocol import Protocol, StudyPaths, scale_of
from masrel.lab.ratings import (
    Correction,
    corrections_of,
    ratings_from_logs,
    read_study_ratings,
    study_remarks,
    write_ratings,
)
from masrel.lab.run._corrections import record_correction, record_skip
from masrel.lab.run._simulated_raters import SimulatedGrades
from masrel.lab.run.session import run_session
from masrel.lab.schedule.presentation import read_schedule
from masrel.lab.verification import verify_study
from tests.cli.process import Caller, Done
from tests.lab.run.test_session import console, run
from tests.lab.script import ScriptGrades

Small = tuple[StudyPaths, Protocol]

R1 = ("--rater", "R1", "--session", "test")
BY = {"who": "Kim", "why": "the motor is hot"}
KIM = ("--who", "Kim", "--why", "the motor is hot")


def typed(*arguments: object, answers: str = "", code: int = 0) -> tuple[str, str]:
    """What the command line says on stdout and stderr, when it ends with `code`."""
    result = CliRunner().invoke(
        cli, [str(a) for a in arguments], input=answers, catch_exceptions=False
    )
    assert result.exit_code == code, result.output
    return result.stdout, result.stderr


def by_console(small: Small, answers: str) -> str:
    """What a person is told who types answers."""
    source, said = console(answers)
    run(small, source)
    return said.getvalue()


def codes(small: Small) -> list[str]:
    schedule = read_schedule(small[0].schedule_file("R1", "test"))
    return [shown.code for shown in schedule.presentations]


def grades(small: Small) -> list[object]:
    table = ratings_from_logs(*small).table
    return [None if grade != grade else grade for grade in table["grade"]]


@pytest.fixture
def masrel(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> Callable[..., Done]:
    def call(*words: object, answers: str = "") -> Done:
        monkeypatch.setattr(sys, "stdin", io.StringIO(answers))
        return Caller(monkeypatch, capsys).at_a_terminal(*words)

    return call


def test_simulated_sessions_become_a_table(small: Small) -> None:
    study, _ = small
    out, err = typed("run", study.root, *R1, "--grades", "simulated")
    assert out.startswith("session test of R1 is complete: 3 grades (simulated) in ")
    assert err == ""  # no terminal, no bar
    header = read_log(study.log_file("R1", "test"))[0].fields
    assert (header["grades"], header["clock"]) == ("simulated", "simulated")
    out, _ = typed("ratings", study.root)
    assert out == f"3 ratings (simulated), 0 missing: {study.ratings_file}\n"
    first = study.ratings_file.read_bytes()
    assert first.startswith(b"# SIMULATED")
    other = study.root / "elsewhere" / "again.csv"
    typed("ratings", study.root, "-o", other)
    assert other.read_bytes() == first


def test_a_stop_and_a_fault_end_with_1_and_a_wrong_rater_with_2(
    faulty: Small, new_study: Callable[..., Small], masrel: Callable[..., Done]
) -> None:
    fast, root = faulty[0].root, new_study(name="usual")[0].root
    stopped = masrel("run", root, *R1, "--clock", "simulated", answers="\n1\n")
    options = ("--session", "test", "--grades", "simulated", "--quiet")
    failed = masrel("run", fast, "--rater", "R1", *options)
    wrong = masrel("run", fast, "--rater", "R9", *options)
    assert (stopped.code, failed.code, wrong.code) == (1, 1, 2)
    assert "the same command resumes it there" in stopped.err
    assert "was stopped by a fault: speed" in failed.err
    assert failed.out == ""


def test_a_terminal_sees_the_presentations_counted_unless_quiet(
    new_study: Callable[..., Small], masrel: Callable[..., Done]
) -> None:
    call = (*R1, "--grades", "simulated")
    assert "3/3" in masrel("run", new_study()[0].root, *call).err
    quiet = masrel("run", new_study(name="other")[0].root, *call, "--quiet")
    assert (quiet.code, quiet.out, quiet.err) == (0, "", "")


def test_a_person_skips_what_faults_and_the_session_becomes_complete(
    faulty: Small,
) -> None:
    study, protocol = faulty
    said = by_console(faulty, "\nskip\nskip too fast\n" + "\nSKIP again\n" * 2)
    assert "Skipping needs a reason" in said
    log = read_log(study.log_file("R1", "test"))
    assert [event.kind for event in log[1:]] == [
        *["presented", "fault", "skipped"] * 3,
        "complete",
    ]
    place = {"code": codes(faulty)[0], "position": 1}
    assert log[3].fields == {**place, "who": "R1", "why": "too fast"}
    assert grades(faulty) == [None, None, None]
    verification = verify_study(study)
    assert not verification.findings
    (record,) = (r for r in verification.sessions if r.stage == "complete")
    assert (record.n_graded, record.n_skipped) == (0, 3)
    remarks = study_remarks(study, protocol)
    assert len(remarks) == 3
    assert "skipped after a fault by R1: too fast. Its grade is missing" in remarks[0]
    out, _ = typed("verify", study.root)
    assert "complete, 0 of 3 graded, 3 skipped, 3 rec" in out


def test_a_fault_is_skipped_later_and_its_grade_given_later_still(
    faulty: Small,
) -> None:
    study, protocol = faulty
    with pytest.raises(DeviceError):
        by_console(faulty, "\nno\n")
    first, second, _ = codes(faulty)
    said, _ = typed("record", "skip", study.root, *R1, "--code", first, *KIM)
    assert f"{first} of R1, session test, is skipped" in said
    with pytest.raises(SessionLogError, match=r"and is not skipped yet \(none\)"):
        record_skip(*faulty, "R1", "test", code=first, **BY)
    with pytest.raises(SessionLogError, match=r"was presented \(.*\), got"):
        record_correction(*faulty, "R1", "test", code=second, grade="1", **BY)
    assert "Presentation 1 of 3" not in by_console(faulty, "\nskip a\n\nskip b\n")
    correct = ("record", "correct", study.root, *R1, "--code", first)
    typed(*correct, "--grade", "1+", *KIM)
    assert grades(faulty) == ["1+", None, None]
    assert len(study_remarks(study, protocol)) == 2
    assert not verify_study(study).findings


def test_a_grade_is_corrected_at_the_console_while_the_session_runs(
    small: Small,
) -> None:
    first, second, _ = codes(small)
    lines = [
        *["", "1+"],
        f"correct {first}",  # neither grade nor reason
        f"correct {second} 2 it was softer",  # has no grade yet
        f"correct {first} 5 it was softer",  # no grade of the scale
        *["", f"correct {first} 2 pressed the wrong key", "3"],
        *[f"correct {second} NA the arm was held wrongly", "", "0"],
    ]
    said = by_console(small, "".join(f"{line}\n" for line in lines))
    assert grades(small) == ["2", None, "0"]
    log = read_log(small[0].log_file("R1", "test"))
    corrections = [event.fields for event in log if event.kind == "correction"]
    assert [(c["code"], c["grade"], c["why"]) for c in corrections] == [
        (first, "2", "pressed the wrong key"),
        (second, None, "the arm was held wrongly"),
    ]
    assert said.count("correct CODE GRADE WHY") == 2
    assert f"needed a code that was graded ({first}), got '{second}'" in said
    assert verify_study(small[0]).is_whole


def test_corrections_are_in_the_report_and_only_if_there_are_any(
    new_study: Callable[..., Small],
) -> None:
    brief = '[report]\nsections = ["design"]\n\n[schedule]'
    study, protocol = small = new_study(("[schedule]", brief))
    run(small, ScriptGrades(["1", "2", "3"]))

    def page(*options: str) -> str:
        typed("report", study.root, *options)
        return (study.root / "report" / "report.md").read_text(encoding="utf-8")

    assert "Corrected grades" not in page()
    shown = read_schedule(study.schedule_file("R1", "test")).presentations[1]
    for grade in (None, "4"):
        record_correction(*small, "R1", "test", code=shown.code, grade=grade, **BY)
    facts = {"session": "test", "rater": "R1", "model": shown.model, "repeat": 1}
    made = partial(Correction, first_grade="2", **facts, **BY)  # type: ignore[arg-type]
    corrections = corrections_of(study, protocol)
    assert corrections == (made(grade=None), made(grade="4"))
    text = page()
    assert "Corrected grades" in text
    assert "| 2 | 4 |" in text
    assert not [private for private in ("Kim", "the motor is hot") if private in text]
    assert "| 2 | 4 | the motor is hot |" in page("--include", "notes")
    assert f"{shown.model} | 1 | 2 | 4 | Kim |" in page("--include", "who")


@pytest.mark.parametrize("source", ["a person", "both"])
def test_who_graded_and_on_which_device_are_two_facts_and_both_are_said(
    new_study: Callable[..., Small], source: str
) -> None:
    small = study, protocol = new_study()
    by_console(small, "\n1\n\n2\n\n3\n")
    other = console("\n1\n\n2\n\n3\n")[0] if source == "a person" else None
    second = other or SimulatedGrades(protocol)
    run_session(*small, "R2", "test", grades=second, clock="simulated")
    logged = ratings_from_logs(*small)
    assert (logged.simulated, logged.n_by_programs) == (True, 0 if other else 3)
    write_ratings(logged, study.ratings_file)
    read = read_study_ratings(study.ratings_file, scale_of(protocol))
    for table in (logged.table, read.table):
        columns = (table["rater"], table["grades_from"], table["device"])
        assert set(zip(*columns, strict=True)) == {
            ("R1", "console", "simulated"),
            ("R2", second.name, "simulated"),
        }
