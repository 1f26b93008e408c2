"""Instructions, practice, breaks, order of sessions, coming back, questionnaires."""

import contextlib
import io
from collections.abc import Callable
from contextlib import nullcontext
from datetime import UTC, datetime, timedelta

import pytest

from masrel.errors import (
    MasrelWarning,
    ParameterError,
    SessionLogError,
    SessionStoppedError,
)
from masrel.lab._event_log import Event, read_log
from masrel.lab.protocol import Protocol, StudyPaths, scale_of
from masrel.lab.ratings import (
    answers_from_logs,
    ratings_from_logs,
    read_answers,
    study_remarks,
)
from masrel.lab.recording import read_recording
from masrel.lab.run._grade_sources import GradeRequest
from masrel.lab.run._simulated_raters import SimulatedGrades
from masrel.lab.run.console import ConsoleGrades
from masrel.lab.run.session import SessionSummary, run_session
from masrel.lab.schedule.presentation import read_schedule
from masrel.lab.verification import verify_study
from tests.lab.run.test_command import typed
from tests.lab.run.test_session import console
from tests.lab.script import ScriptGrades

New = Callable[..., tuple[StudyPaths, Protocol]]

OCCASIONS = """
[occasions]
instructions = "Hold the wrist."
practice = ["HM3", "HM3"]
break_after = 2
break_minutes = 3.0

[schedule]"""

QUESTIONS = """
[[questionnaires]]
id = "each"
title = "This one"
when = "presentation"
[[questionnaires.questions]]
id = "sure"
text = "How sure are you?"
type = "visual-analogue"

[[questionnaires]]
id = "realism"
title = "Realism"
when = "session"
[[questionnaires.questions]]
id = "score"
text = "How real did it feel?"
type = "whole"
low = 1
high = 10
high_label = "like a patient's"
[[questionnaires.questions]]
id = "note"
text = "Anything else?"
type = "text"
required = false

[[questionnaires]]
id = "end"
title = "The study"
when = "study"
[[questionnaires.questions]]
id = "again"
text = "Would you do it again?"
type = "choice"
choices = ["yes", "no"]

[schedule]"""

ANSWERS = {"each.sure": 50, "realism.score": 7, "end.again": "yes"}
MONDAY = datetime(2026, 11, 2, 9, 0, tzinfo=UTC)


def at(day: int) -> Callable[[], datetime]:
    return lambda: MONDAY + timedelta(days=day)


def script(**changes: object) -> ScriptGrades:
    answers = ANSWERS | {k.replace("_", ".", 1): v for k, v in changes.items()}
    return ScriptGrades(["1", "2", "1+"], practice=["2", "3"], answers=answers)  # type: ignore[arg-type]


def run(
    study: StudyPaths, protocol: Protocol, rater: str = "R1", **options: object
) -> SessionSummary:
    chosen: dict[str, object] = {
        "session": "test",
        "grades": script(),
        "clock": "simulated",
    }
    return run_session(study, protocol, rater, **(chosen | options))  # type: ignore[arg-type]


def events_of(
    study: StudyPaths, session: str = "test", rater: str = "R1"
) -> tuple[Event, ...]:
    return read_log(study.log_file(rater, session))


def kinds_of(study: StudyPaths) -> list[str]:
    return [event.kind for event in events_of(study)]


PRACTICE = ["practised", "practice-grade"] * 2
RATED = ["presented", "grade"]


def test_a_session_has_instructions_practice_and_breaks(new_study: New) -> None:
    study, protocol = new_study(("[schedule]", OCCASIONS))
    run(study, protocol)
    events = events_of(study)
    assert [event.kind for event in events] == [
        *("session", "instructed", *PRACTICE),
        *(*RATED, *RATED, "break", *RATED, "complete"),
    ]
    said = {e.kind: e.fields for e in events}
    assert said["instructed"] == {"text": "Hold the wrist."}
    assert said["break"] == {"after": 2, "minutes": 3.0, "lasted_s": 0.0}
    practised = [e.fields for e in events if e.kind == "practised"]
    assert [f["code"] for f in practised] == ["P1", "P2"]
    assert {f["model"] for f in practised} == {"HM3"}
    recording = read_recording(study.sessions / str(practised[0]["recording"]))
    assert recording.facts["practice"] is True
    assert verify_study(study).findings == ()
    table = ratings_from_logs(study, protocol).table  # practice is no rating
    assert sorted(table["grade"]) == ["1", "1+", "2"]
    assert "P1" not in study.schedule_file("R1", "test").read_text()
    ids = [("[schedule]", OCCASIONS), ('"D1"', '"P1"')]
    of_a_model, protocol = new_study(*ids, name="of a model")
    run(of_a_model, protocol)
    practised = [e for e in events_of(of_a_model) if e.kind == "practised"]
    assert [e.fields["code"] for e in practised] == ["P2", "P3"]


def test_the_console_says_what_is_practice_and_what_a_break(new_study: New) -> None:
    study, protocol = new_study(("[schedule]", OCCASIONS))
    grades, shown = console("\n" + "\n2\n" * 4 + "what\n\n" + "\n2\n")
    run(study, protocol, grades=grades)
    text = shown.getvalue()
    first = "Hold the wrist.\nPress Enter to continue, or type stop: PRACTICE, "
    assert text.startswith(first)
    assert "PRACTICE, not a rating of the study. Presentation 2 of 2, code P2. " in text
    assert text.count("PRACTICE") == 2
    assert text.count("A break of 3 minutes. Then press Enter to continue") == 2
    assert "HM" not in text


@pytest.mark.parametrize("n_lines", [0, 1, 3, 5, 9, 10])
def test_a_stopped_session_goes_on_before_what_was_not_over(
    new_study: New, n_lines: int
) -> None:
    study, protocol = new_study(("[schedule]", OCCASIONS))
    lines = ["", *["", "2"] * 4, "", *["", "2"]]

    for texts in ([*lines[:n_lines], "stop"], lines[n_lines:]):
        stops = pytest.raises(SessionStoppedError)
        with stops if texts[-1] == "stop" else nullcontext():
            typed = "".join(f"{text}\n" for text in texts)
            run(study, protocol, grades=console(typed)[0])
    kinds = kinds_of(study)
    for kind, n in (("instructed", 1), ("break", 1), ("grade", 3), ("stopped", 1)):
        assert kinds.count(kind) == n, kind
    assert kinds.count("practice-grade") == 2
    assert verify_study(study).findings == ()


AFTER = (
    'id = "retest"',
    'id = "retest"\nafter = "test"\nat_least_days = 7\nat_most_days = 14',
)


@pytest.mark.parametrize("policy", ["refuse", "warn"])
@pytest.mark.parametrize(
    ("day", "problem"),
    [
        (None, "session test complete before it, got one that is not"),
        (6, "at least 7 days after session test, got 6"),
        (7, ""),
        (14, ""),
        (15, "at most 14 days after session test, got 15"),
    ],
)
def test_a_session_out_of_order_is_refused_or_its_log_says_so(
    new_study: New, day: int | None, problem: str, policy: str
) -> None:
    old, new = AFTER
    study, protocol = new_study((old, f'{new}\norder_policy = "{policy}"'))
    if day is not None:
        run(study, protocol, now=at(0))
    match = f"protocol.toml: sessions.retest: needed {problem}"
    with contextlib.ExitStack() as said:
        if problem and policy == "refuse":
            said.enter_context(pytest.raises(ParameterError, match=match))
        elif problem:
            said.enter_context(pytest.warns(MasrelWarning, match=match))
        run(study, protocol, session="retest", now=at(day or 0))
    events = events_of(study, "retest")
    assert (events == ()) is (problem != "" and policy == "refuse")
    for interval in (e.fields for e in events if e.kind == "interval"):
        days = {"days": day, "at_least_days": 7, "at_most_days": 14}
        assert interval == {"after": "test", **days, "kept": not problem}
    assert ("interval" in [e.kind for e in events]) is (events != ())


class StopsAtTheSecond(ScriptGrades):
    """A script whose rater leaves before the second presentation."""

    def make_ready(self, request: GradeRequest) -> None:
        if request.presentation.position == 2:
            raise SessionStoppedError("left")


def left_on_monday(new_study: New, policy: str) -> tuple[StudyPaths, Protocol]:
    keys = f'[occasions]\nresume = "{policy}"\n\n[schedule]'
    study, protocol = new_study(("[schedule]", keys))
    with pytest.raises(SessionStoppedError):
        run(study, protocol, grades=StopsAtTheSecond("333"), now=at(0))
    return study, protocol


def test_a_session_of_one_day_is_refused_on_another(new_study: New) -> None:
    study, protocol = left_on_monday(new_study, "same-day")
    before = study.log_file("R1", "test").read_bytes()
    with pytest.raises(SessionLogError, match="was left on 2026-11-02: "):
        run(study, protocol, now=at(1))
    assert study.log_file("R1", "test").read_bytes() == before
    assert run(study, protocol, now=at(0)).n_graded == 3


def test_a_session_that_begins_anew_sets_aside_what_was(new_study: New) -> None:
    study, protocol = left_on_monday(new_study, "restart")
    done = run(study, protocol, now=at(3))
    assert (done.n_graded, done.n_set_aside) == (3, 1)
    events = events_of(study)
    aged, anew = (e.fields for e in events if e.kind in ("aged", "restarted"))
    assert (aged["days"], aged["resume"], aged["restart"]) == (3, "restart", True)
    assert anew["n_graded"] == 1
    grades = [e.fields["grade"] for e in events if e.kind == "grade"]
    assert grades == ["3", "1", "2", "1+"]
    assert "3" not in set(ratings_from_logs(study, protocol).table["grade"])
    verification = verify_study(study)
    assert verification.findings == ()
    assert verification.sessions[0].n_recordings == 4
    (remark,) = study_remarks(study, protocol)
    assert remark.endswith("not among the ratings: 1.")


@pytest.mark.parametrize(("word", "restart"), [("resume", False), ("restart", True)])
def test_a_rater_is_asked_whether_to_go_on(
    new_study: New, word: str, restart: bool
) -> None:
    study, protocol = left_on_monday(new_study, "ask")

    class Person(ScriptGrades):
        name = "script"

        def begins_anew(self, request: GradeRequest, days: int) -> bool:
            console = ConsoleGrades(
                scale_of(protocol), answers=io.StringIO(f"why\n{word}\n"), questions=out
            )
            return console.begins_anew(request, days)

    out = io.StringIO()
    run(study, protocol, grades=Person(["1", "2", "1+"]), now=at(2))
    assert out.getvalue().startswith(
        "This session was left 2 days ago, before presentation 2 of 3. "
    )
    assert ("restarted" in kinds_of(study)) is restart


NO_WHOLE_NUMBERS = (11, 7.5, True, "nan", " ")


def test_every_kind_of_questionnaire_is_asked_when_it_is_due(new_study: New) -> None:
    study, protocol = new_study(("[schedule]", QUESTIONS))
    for key, wrong, needed in (
        ("each.sure", -1, "a number, 0 to 100"),
        *(("realism.score", n, "a whole number, 1 to 10") for n in NO_WHOLE_NUMBERS),
        ("realism.note", "\ud800", "text"),
    ):
        of = f"answer to {key} (of ... )?by R1 in session test: needed {needed}, got "
        with pytest.raises(ParameterError, match=of):
            run(study, protocol, grades=script(**{key.replace(".", "_"): wrong}))
    # what was refused is asked for again
    run(study, protocol, grades=script(realism_score=" 7 ", realism_note=" it stuck "))
    answered = [e.fields for e in events_of(study) if e.kind == "answered"]
    codes = [e.fields["code"] for e in events_of(study) if e.kind == "grade"]
    assert [(f["question"], f["code"], f["answer"]) for f in answered] == [
        *(("sure", code, 50) for code in codes),
        ("score", None, 7),
        ("note", None, "it stuck"),
    ]
    assert not study.conduct_file.exists()  # the retest is still to come
    later = script(each_sure="62.5", realism_note=" ", end_again="Yes")
    with pytest.raises(ParameterError, match="needed one of yes, no, got 'Yes'"):
        run(study, protocol, session="retest", grades=later)
    run(study, protocol, session="retest")
    answered = [e.fields for e in events_of(study, "retest") if e.kind == "answered"]
    assert [f["answer"] for f in answered] == [62.5, 62.5, 62.5, 7, None]
    last = dict(read_log(study.conduct_file)[-1].fields)
    assert list(last.values()) == ["R1", "end", "again", "yes"]
    run(study, protocol, session="retest")  # nothing is asked twice
    assert verify_study(study).findings == ()


def test_the_console_asks_until_there_is_an_answer(new_study: New) -> None:
    study, protocol = new_study(("[schedule]", QUESTIONS))
    each = "\n1\n33.5\n"
    grades, shown = console(each * 3 + "11\n\n7\n\n")
    run(study, protocol, grades=grades)
    text = shown.getvalue()
    question = "(a whole number, 1 to 10; 10: like a patient's; stop): "
    assert text.count(f"How real did it feel? {question}") == 3
    assert "needed a whole number, 1 to 10, got '11'." in text
    assert "Anything else? (text; Enter for none; stop): " in text


def test_simulated_raters_answer_the_same_each_time(new_study: New) -> None:
    logs = []
    for name in ("a", "b"):
        study, protocol = new_study(("[schedule]", QUESTIONS), name=name)
        run(study, protocol, grades=SimulatedGrades(protocol))
        logs.append([e.fields for e in events_of(study) if e.kind == "answered"])
        assert verify_study(study).findings == ()
    assert logs[0] == logs[1]
    assert len({fields["answer"] for fields in logs[0]}) > 2


def test_an_answer_is_corrected_by_the_command(new_study: New) -> None:
    study, protocol = new_study(("[schedule]", QUESTIONS))
    run(study, protocol)
    first = read_schedule(study.schedule_file("R1", "test")).presentations[0].code
    command = ("record", "answer", study.root, "--rater", "R1", "--session", "test")
    command += ("--who", "AB", "--why", "slip")
    for options, said in (
        (["--question", "realism.score", "--answer", "9"], "realism.score is now 9;"),
        (
            ["--question", "each.sure", "--code", first, "--answer", "NA"],
            f"each.sure of {first} is now missing;",
        ),
        (["--question", "end.again", "--answer", "no"], "end.again is now no;"),
    ):
        out, _ = typed(*command, *options)
        assert said in out
    out, _ = typed("ratings", study.root)
    assert "answers.csv" in out
    rows = study.answers_file.read_text(encoding="utf-8").splitlines()
    assert "test,R1,realism,score,,,9,script" in rows
    assert ",R1,end,again,,,no,script" in rows
    assert sum(row.endswith(",,script") for row in rows) == 2  # the note; made missing
    assert read_answers(study.answers_file, protocol) == answers_from_logs(
        study, protocol
    )
    assert verify_study(study).findings == ()
    text = study.answers_file.read_text(encoding="utf-8")
    study.answers_file.write_text(text.replace(",9,", ",8,"), encoding="utf-8")
    (finding,) = verify_study(study).findings
    assert "answers.csv" in str(finding.path)
    assert finding.message.endswith("masrel ratings writes it again")


def test_what_is_no_source_of_grades_is_refused_before_anything_happens(
    new_study: New,
) -> None:
    study, protocol = new_study(("[schedule]", QUESTIONS))

    class Old:
        name = "old"
        simulated = True
        make_ready = grade = present_again = None

    with pytest.raises(ParameterError, match="grades: needed a GradeSource, got Old"):
        run(study, protocol, grades=Old())
