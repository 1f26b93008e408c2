"""Correct a session's grades and answers, or skip a presentation, with who and why.

What was given first stays in the log; a correction is one event more.
"""

from collections.abc import Callable, Iterable
from datetime import datetime
from pathlib import Path

from masrel.errors import ParameterError, SessionLogError
from masrel.lab._event_log import SessionLog, utc_now
from masrel.lab._study_files import Fact
from masrel.lab.conduct._study_log import (
    append_event,
    check_rater,
    past_day,
    stated,
)
from masrel.lab.protocol import Protocol, Question, Questionnaire, StudyPaths
from masrel.lab.protocol._values import checked_answer
from masrel.lab.run._days import log_interval
from masrel.lab.run._state import SessionState, replay


def record_correction(
    study: StudyPaths,
    protocol: Protocol,
    rater: str,
    session: str,
    *,
    code: str,
    grade: str | None,
    who: str,
    why: str,
    now: Callable[[], datetime] = utc_now,
) -> None:
    """Append a correction to a session's log; the first grade stays in it.

    A presentation that has no grade, as one that was skipped, gets it so too: late.
    A correction that says what the last one of its code says is not entered twice.

    Parameters
    ----------
    study : StudyPaths
        Where the study is.
    protocol : Protocol
        The study's protocol.
    rater, session : str
        Whose session.
    code : str
        The blinded code of a presentation that was presented.
    grade : str or None
        What the grade should have been; None for a missing one.
    who, why : str
        Who corrects it, and for what reason.
    now : callable, optional
        Gives the time of day for the log, aware.

    Raises
    ------
    ParameterError
        If the grade is not of the scale, or `who` or `why` is blank.
    SessionLogError
        If there is no such log, it is damaged, the code was not presented, or has
        no grade to be taken away.
    OSError
        If the log cannot be written.
    """
    correction = _checked_correction(protocol, code, grade, who, why)
    with _begun_log(study, rater, session, now) as log:
        state = replay(log.path, log.events)
        _append_correction(log, state, correction, state.presented, "was presented")


def correct_in_session(
    log: SessionLog, protocol: Protocol, *, code: str, grade: str | None, **by: str
) -> None:
    """Append a correction to the log of a session that goes on."""
    correction = _checked_correction(protocol, code, grade, **by)
    state = replay(log.path, log.events)
    # what is asked about now gets a grade of its own
    _append_correction(log, state, correction, sorted(state.settled), "was graded")


def _append_correction(
    log: SessionLog,
    state: SessionState,
    fields: dict[str, Fact],
    known: Iterable[str],
    what: str,
) -> None:
    code = str(fields["code"])
    if fields["grade"] is None:
        known, what = state.grades, "has a grade"
    _check_code(log.path, code, known, what)
    # one that is sent again, as after a lost line, is in the log already
    corrected = (
        event.fields
        for event in reversed(log.events)
        if event.kind == "correction" and event.fields["code"] == code
    )
    if next(corrected, None) != fields:
        log.append("correction", fields)


def _checked_correction(
    protocol: Protocol, code: str, grade: str | None, who: str, why: str
) -> dict[str, Fact]:
    if grade is not None and grade not in protocol.scale.grades:
        raise ParameterError(
            f"grade: needed one of {', '.join(protocol.scale.grades)}, got {grade!r}"
        )
    return {"code": code, "grade": grade, **stated(who=who, why=why)}


def record_answer(
    study: StudyPaths,
    protocol: Protocol,
    rater: str,
    session: str,
    *,
    question: str,
    answer: str | float | None,
    who: str,
    why: str,
    code: str | None = None,
    now: Callable[[], datetime] = utc_now,
) -> Path:
    """Append a correction of an answer to the log it is in; the first one stays there.

    A question that has no answer gets it so too: late.

    Parameters
    ----------
    study : StudyPaths
        Where the study is.
    protocol : Protocol
        The study's protocol.
    rater, session : str
        Whose session; about the study the session says nothing.
    question : str
        The question, as ``questionnaire.question``.
    answer : str, float or None
        What the answer should have been; None for a missing one.
    who, why : str
        Who corrects it, and for what reason.
    code : str, optional
        The blinded code of the presentation that the question is about.
    now : callable, optional
        Gives the time of day for the log, aware.

    Returns
    -------
    Path
        The log.

    Raises
    ------
    ParameterError
        If there is no such question or rater, it cannot have this answer, it is about
        presentations and no `code` says which or the other way round, or `who` or
        `why` is blank.
    SessionLogError
        If there is no such log, it is damaged, or the code was not presented.
    OSError
        If the log cannot be written.
    """
    questionnaire, its_question = _question_named(protocol, question)
    if answer is not None:
        answer = checked_answer(its_question, answer, where=f"answer to {question}")
    if (code is not None) != (questionnaire.when == "presentation"):
        needed = "the code of a presentation" if code is None else "no code"
        raise ParameterError(
            f"code: needed {needed}, as {question} is about each "
            f"{questionnaire.when}, got {code or 'none'}"
        )
    fields: dict[str, Fact] = {
        "questionnaire": questionnaire.id,
        "question": its_question.id,
        "answer": answer,
        **stated(who=who, why=why),
    }
    if questionnaire.when == "study":
        check_rater(protocol, rater)
        of_study = {"rater": rater, **fields}
        append_event(study, protocol, "answer-correction", of_study, now=now)
        return study.conduct_file
    with _begun_log(study, rater, session, now) as log:
        state = replay(log.path, log.events)
        if code is not None:
            _check_code(log.path, code, state.presented, "was presented")
        log.append("answer-correction", {**fields, "code": code})
    return log.path


def record_skip(
    study: StudyPaths,
    protocol: Protocol,  # noqa: ARG001 - as all that is recorded takes it
    rater: str,
    session: str,
    *,
    code: str,
    who: str,
    why: str,
    now: Callable[[], datetime] = utc_now,
) -> None:
    """Record that a presentation that a fault stopped is left without a grade.

    Parameters
    ----------
    study : StudyPaths
        Where the study is.
    protocol : Protocol
        The study's protocol.
    rater, session : str
        Whose session.
    code : str
        The blinded code of a presentation whose last attempt a fault stopped.
    who, why : str
        Who says so, and for what reason.
    now : callable, optional
        Gives the time of day for the log, aware.

    Raises
    ------
    ParameterError
        If `who` or `why` is blank.
    SessionLogError
        If there is no such log, it is damaged, or no fault stopped the code last.
    OSError
        If the log cannot be written.
    """
    reasons = stated(who=who, why=why)
    with _begun_log(study, rater, session, now) as log:
        state = replay(log.path, log.events)
        faulted = {
            each: events[-1].fields["position"]
            for each, events in state.presented.items()
            if each not in state.settled and events[-1].fields["fault"] is not None
        }
        _check_code(log.path, code, faulted, "a fault stopped and is not skipped yet")
        log.append("skipped", {"code": code, "position": faulted[code], **reasons})


def record_day(
    study: StudyPaths,
    protocol: Protocol,
    rater: str,
    session: str,
    *,
    on: str,
    who: str,
    why: str,
    now: Callable[[], datetime] = utc_now,
) -> None:
    """Correct the day on which a session was held; the first one stays in its log.

    The days between sessions are counted again, also for sessions that came after it.

    Parameters
    ----------
    study : StudyPaths
        Where the study is.
    protocol : Protocol
        The study's protocol.
    rater, session : str
        Whose session, which has begun.
    on : str
        The day, ISO 8601.
    who, why : str
        Who corrects it, and for what reason.
    now : callable, optional
        Gives the time of day for the logs, aware.

    Raises
    ------
    ParameterError
        If `on` is not a date, or in the future, or `who` or `why` is blank.
    SessionLogError
        If there is no such log, or it is damaged.
    OSError
        If a log cannot be written.

    Warns
    -----
    MasrelWarning
        If a session was out of the order, or the interval, of the protocol.
    """
    day = {"on": past_day("on", on, now), **stated(who=who, why=why)}
    with _begun_log(study, rater, session, now) as log:
        replay(log.path, log.events)
        before = [e.fields for e in log.events if e.kind == "day-correction"]
        if day not in before[-1:]:  # what a process died after is in the log already
            log.append("day-correction", day)
        log_interval(study, protocol, rater, session, log)
    for each in protocol.sessions:
        if each.after == session and study.log_file(rater, each.id).is_file():
            with _begun_log(study, rater, each.id, now) as log:
                log_interval(study, protocol, rater, each.id, log)


def _begun_log(
    study: StudyPaths, rater: str, session: str, now: Callable[[], datetime]
) -> SessionLog:
    path = study.log_file(rater, session)
    if not path.is_file():
        raise SessionLogError(f"{path}: no such session log")
    return SessionLog.open(path, now=now)


def _check_code(path: Path, code: str, known: Iterable[str], what: str) -> None:
    if code not in known:
        raise SessionLogError(
            f"{path}: needed a code that {what} ({', '.join(known) or 'none'}), "
            f"got {code!r}"
        )


def _question_named(protocol: Protocol, name: str) -> tuple[Questionnaire, Question]:
    # what ``questionnaire.question`` names
    known = {
        f"{questionnaire.id}.{question.id}": (questionnaire, question)
        for questionnaire in protocol.questionnaires
        for question in questionnaire.questions
    }
    if name not in known:
        raise ParameterError(
            f"question: needed one of {', '.join(known) or 'none'}, got {name!r}"
        )
    return known[name]
