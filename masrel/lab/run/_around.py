"""What a session has around its presentations: questions, days before it, corrections.

What was given first stays in the log; a correction is one event more, with who and why.
"""

import warnings
from collections.abc import Callable, Container, Iterable, Sequence
from datetime import datetime
from pathlib import Path

from masrel.errors import MasrelWarning, ParameterError, SessionLogError
from masrel.lab._event_log import Event, SessionLog, read_log, utc_now
from masrel.lab.conduct._study_log import append_event, check_rater, stated
from masrel.lab.protocol import Protocol, Question, Questionnaire, Session, StudyPaths
from masrel.lab.protocol._values import When, checked_answer, questions_of
from masrel.lab.recording import _Fact
from masrel.lab.run._grade_sources import Correct, GradeSource, QuestionRequest
from masrel.lab.run._state import replay
from masrel.lab.schedule import Presentation


def ask_questions(
    protocol: Protocol,
    when: When,
    source: GradeSource,
    *,
    rater: str,
    session: str,
    presentation: Presentation | None = None,
    answered: Container[tuple[str, str]] = (),
    correct: Correct | None = None,
    log: Callable[[dict[str, _Fact]], object],
) -> None:
    """Ask what has no answer yet, and log each answer before the next question."""
    for questionnaire, question in questions_of(protocol, when):
        if (questionnaire.id, question.id) in answered:
            continue
        request = QuestionRequest(
            rater=rater,
            session=session,
            questionnaire=questionnaire,
            question=question,
            presentation=presentation,
            correct=correct,
        )
        answer = checked_answer(question, source.answer(request), where=_place(request))
        names: dict[str, _Fact] = {
            "questionnaire": questionnaire.id,
            "question": question.id,
        }
        log({**names, "answer": answer})


def _place(request: QuestionRequest) -> str:
    # which answer, in a message
    name = f"{request.questionnaire.id}.{request.question.id}"
    of = "" if request.presentation is None else f" of {request.presentation.code}"
    return f"answer to {name}{of} by {request.rater} in session {request.session}"


def question_named(protocol: Protocol, name: str) -> tuple[Questionnaire, Question]:
    """Return the question that ``questionnaire.question`` names."""
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


_NOT_THE_RATERS = ("recovered", "correction", "answer-correction", "stopped")
"""Events that do not say when a rater was there last."""


def days_since(time_utc: str, now: Callable[[], datetime]) -> int:
    """Return the calendar days, where the computer is, since a time of a log."""
    day = datetime.fromisoformat(time_utc).astimezone().date()
    return (now().astimezone().date() - day).days


def last_time(events: Sequence[Event]) -> str:
    """Return when a rater was last there, ISO 8601 in UTC."""
    return [e.time_utc for e in events if e.kind not in _NOT_THE_RATERS][-1]


def completed_at(study: StudyPaths, rater: str, session: str) -> str | None:
    """Return when a session came to its end, or None."""
    log = study.log_file(rater, session)
    events = read_log(log) if log.exists() else ()
    completed = next((e.time_utc for e in events if e.kind == "complete"), None)
    # one on paper was on another day than the one on which it was entered
    held = next((str(e.fields["on"]) for e in events if e.kind == "held"), None)
    return held if completed is not None and held is not None else completed


def interval_fields(
    study: StudyPaths,
    protocol: Protocol,
    rater: str,
    session: str,
    now: Callable[[], datetime],
) -> dict[str, _Fact] | None:
    """Return what a log says of the session before; None where none has to be.

    A session that begins out of order is refused, or warned of.
    """
    rules = next(each for each in protocol.sessions if each.id == session)
    before = next((each for each in protocol.sessions if each.id == rules.after), None)
    if before is None or rater not in before.raters:
        return None
    completed = completed_at(study, rater, before.id)
    days = None if completed is None else days_since(completed, now)
    problem = _problem(rules, days)
    if problem is not None:
        message = (
            f"{study.protocol}: sessions.{session}: needed {problem} for rater {rater}"
        )
        if rules.order_policy == "refuse":
            raise ParameterError(message)
        warnings.warn(message, MasrelWarning, stacklevel=2)
    return {
        "after": before.id,
        "days": days,
        "at_least_days": rules.at_least_days,
        "at_most_days": rules.at_most_days,
        "kept": problem is None,
    }


def _problem(rules: Session, days: int | None) -> str | None:
    # what of the order of two sessions does not hold, or None
    low, high = rules.at_least_days, rules.at_most_days
    if days is None:
        return f"session {rules.after} complete before it, got one that is not"
    for key, limit, is_kept in (
        ("at_least_days", low, low is None or days >= low),
        ("at_most_days", high, high is None or days <= high),
    ):
        if not is_kept:
            words = key.replace("_", " ").removesuffix(" days")
            unit = "day" if limit == 1 else "days"
            return f"{words} {limit} {unit} after session {rules.after}, got {days}"
    return None


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
        known = state.presented if grade is not None else state.grades
        what = "was presented" if grade is not None else "has a grade"
        _check_code(log.path, code, known, what)
        _append_once(log, correction)


def correct_in_session(
    log: SessionLog, protocol: Protocol, *, code: str, grade: str | None, **by: str
) -> None:
    """Append a correction to the log of a session that goes on."""
    correction = _checked_correction(protocol, code, grade, **by)
    state = replay(log.path, log.events)
    # what is asked about now gets a grade of its own
    known = state.settled if grade is not None else state.grades
    what = "was graded" if grade is not None else "has a grade"
    _check_code(log.path, code, sorted(known), what)
    _append_once(log, correction)


def _append_once(log: SessionLog, fields: dict[str, _Fact]) -> None:
    # one that is sent again, as after a lost line, is in the log already
    corrected = (
        event.fields
        for event in reversed(log.events)
        if event.kind == "correction" and event.fields["code"] == fields["code"]
    )
    if next(corrected, None) != fields:
        log.append("correction", fields)


def _checked_correction(
    protocol: Protocol, code: str, grade: str | None, who: str, why: str
) -> dict[str, _Fact]:
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
    questionnaire, its_question = question_named(protocol, question)
    if answer is not None:
        answer = checked_answer(its_question, answer, where=f"answer to {question}")
    if (code is not None) != (questionnaire.when == "presentation"):
        needed = "the code of a presentation" if code is None else "no code"
        raise ParameterError(
            f"code: needed {needed}, as {question} is about each "
            f"{questionnaire.when}, got {code or 'none'}"
        )
    fields: dict[str, _Fact] = {
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
