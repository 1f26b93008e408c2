"""A presentation without a grade: skipped, corrected to missing, graded late."""

import io
from collections.abc import Callable

import pytest
from click.testing import CliRunner

from masrel.cli import cli
from masrel.errors import DeviceError, SessionLogError
from masrel.lab.protocol import Protocol, StudyPaths
from masrel.lab.ratings import (
    Correction,
    corrections_of,
    ratings_from_logs,
    study_remarks,
)
from masrel.lab.run import (
    ConsoleGrades,
    ScriptGrades,
    SessionSummary,
    read_log,
    record_correction,
    record_skip,
    run_session,
)
from masrel.lab.schedule import read_schedule
from masrel.lab.verification import verify_study
from masrel.scales import MODIFIED_ASHWORTH

Small = tuple[StudyPaths, Protocol]

BY = {"who": "Kim", "why": "the motor is hot"}


@pytest.fixture
def faulty(new_study: Callable[..., Small]) -> Small:
    """A study whose speed limit every stretch exceeds."""
    limit = "[device]\nspeed_limit_deg_s = 30.0\n\n[schedule]"
    return new_study(("[schedule]", limit))


def run(small: Small, answers: str) -> tuple[SessionSummary, str]:
    said = io.StringIO()
    source = ConsoleGrades(
        MODIFIED_ASHWORTH, answers=io.StringIO(answers), questions=said
    )
    summary = run_session(*small, "R1", "test", grades=source, clock="simulated")
    return summary, said.getvalue()


def codes(small: Small) -> list[str]:
    schedule = read_schedule(small[0].schedule_file("R1", "test"))
    return [shown.code for shown in schedule.presentations]


def grades(small: Small) -> list[object]:
    table = ratings_from_logs(*small).table
    return [None if grade != grade else grade for grade in table["grade"]]


def call(*words: object, code: int = 0) -> str:
    result = CliRunner().invoke(cli, [str(word) for word in words])
    assert result.exit_code == code, result.output
    return result.output


def test_a_person_skips_what_faults_and_the_session_becomes_complete(
    faulty: Small,
) -> None:
    study, protocol = faulty
    summary, said = run(faulty, "\nskip\nskip too fast\n" + "\nSKIP again\n" * 2)
    assert "To skip it needs a reason" in said
    assert (summary.n_presentations, summary.n_graded) == (3, 0)
    log = read_log(study.log_file("R1", "test"))
    assert [event.kind for event in log[1:]] == [
        *["presented", "fault", "skipped"] * 3,
        "complete",
    ]
    assert log[3].fields == {
        **{"code": codes(faulty)[0], "position": 1},
        **{"who": "R1", "why": "too fast"},
    }
    assert grades(faulty) == [None, None, None]
    verification = verify_study(study)
    assert not verification.findings
    (record,) = (r for r in verification.sessions if r.stage == "complete")
    assert (record.n_graded, record.n_skipped) == (0, 3)
    remarks = study_remarks(study, protocol)
    assert len(remarks) == 3
    assert "skipped after a fault by R1: too fast. Its grade is missing" in remarks[0]
    assert "complete, 0 of 3 graded, 3 skipped, 3 rec" in call("verify", study.root)


def test_a_fault_is_skipped_later_and_its_grade_given_later_still(
    faulty: Small,
) -> None:
    study, protocol = faulty
    with pytest.raises(DeviceError):
        run(faulty, "\nno\n")
    first, second, _ = codes(faulty)
    who = ("--rater", "R1", "--session", "test")
    by = ("--who", "Kim", "--why", "too fast")
    said = call("record", "skip", study.root, *who, "--code", first, *by)
    assert f"{first} of R1, session test, is skipped" in said
    with pytest.raises(SessionLogError, match=r"and is not skipped yet \(none\)"):
        record_skip(study, "R1", "test", code=first, **BY)
    with pytest.raises(SessionLogError, match=r"was presented \(.*\), got"):
        record_correction(*faulty, "R1", "test", code=second, grade="1", **BY)
    _, said = run(faulty, "\nskip a\n\nskip b\n")
    assert "Presentation 1 of 3" not in said
    correct = ("record", "correct", study.root, *who, "--code", first)
    call(*correct, "--grade", "1+", *by)
    assert grades(faulty) == ["1+", None, None]
    assert len(study_remarks(study, protocol)) == 2
    assert not verify_study(study).findings


def test_a_grade_is_corrected_to_missing_and_back(small: Small) -> None:
    study, _ = small
    run_session(
        *small, "R1", "test", grades=ScriptGrades(["1", "2", "3"]), clock="simulated"
    )
    first = codes(small)[0]
    words = ("record", "correct", study.root, "--rater", "R1", "--session", "test")
    correct = (*words, "--code", first, "--who", "Kim", "--why", "wrong arm")
    said = call(*correct, "--grade", "NA")
    assert f"{first} of R1, session test, is now missing" in said
    assert grades(small) == [None, "2", "3"]
    with pytest.raises(SessionLogError, match="needed a code that has a grade"):
        record_correction(*small, "R1", "test", code=first, grade=None, **BY)
    assert not verify_study(study).findings
    call(*correct, "--grade", "4")
    assert grades(small) == ["4", "2", "3"]


def test_what_was_presented_and_graded_late_is_not_presented_again(
    small: Small,
) -> None:
    study, _ = small
    words = ("run", small[0].root, "--rater", "R1", "--session", "test")
    CliRunner().invoke(cli, [*map(str, words), "--clock", "simulated"], input="\nstop")
    first = codes(small)[0]
    record_correction(*small, "R1", "test", code=first, grade="2", **BY)
    summary, said = run(small, "\n1\n\n3\n")
    assert "Presentation 1 of 3" not in said
    assert summary.n_graded == summary.n_presentations == 3
    assert grades(small) == ["2", "1", "3"]
    assert not verify_study(study).findings


def test_a_graded_presentation_is_not_skipped(small: Small) -> None:
    run_session(*small, "R1", "test", grades=ScriptGrades(["1"] * 3), clock="simulated")
    with pytest.raises(SessionLogError, match="needed a code that a fault stopped"):
        record_skip(small[0], "R1", "test", code=codes(small)[0], **BY)


def test_a_grade_is_corrected_at_the_console_while_the_session_runs(
    new_study: Callable[..., Small],
) -> None:
    small = new_study()
    first, second, _ = codes(small)
    lines = [
        *["", "1+"],
        f"correct {first}",  # neither grade nor reason
        f"correct {second} 2 it was softer",  # has no grade yet
        f"correct {first} 5 it was softer",  # no grade of the scale
        *["", f"correct {first} 2 pressed the wrong key", "3"],
        *[f"correct {second} NA the arm was held wrongly", "", "0"],
    ]
    summary, said = run(small, "".join(f"{line}\n" for line in lines))
    assert grades(small) == ["2", None, "0"]
    assert summary.n_graded == 2
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
    study, protocol = new_study(("[schedule]", brief))
    run_session(
        *(study, protocol, "R1", "test"),
        grades=ScriptGrades(["1", "2", "3"]),
        clock="simulated",
    )
    call("report", study.root)
    page = study.root / "report" / "report.md"
    assert "Corrected grades" not in page.read_text(encoding="utf-8")
    shown = read_schedule(study.schedule_file("R1", "test")).presentations[1]
    for grade in (None, "4"):
        where = (study, protocol, "R1", "test")
        record_correction(*where, code=shown.code, grade=grade, **BY)
    facts = {
        **{"session": "test", "rater": "R1", "model": shown.model, "repeat": 1},
        **{"first_grade": "2", **BY},
    }
    assert corrections_of(study, protocol) == (
        Correction(grade=None, **facts),  # type: ignore[arg-type]
        Correction(grade="4", **facts),  # type: ignore[arg-type]
    )
    call("report", study.root)
    text = page.read_text(encoding="utf-8")
    assert "Corrected grades" in text
    assert "| 2 | 4 |" in text
    assert "Kim" not in text
    assert "the motor is hot" not in text
    call("report", study.root, "--include", "notes")
    text = page.read_text(encoding="utf-8")
    assert "| 2 | 4 | the motor is hot |" in text
    call("report", study.root, "--include", "who")
    text = page.read_text(encoding="utf-8")
    assert f"{shown.model} | 1 | 2 | 4 | Kim |" in text
