"""What a session has around its presentations: questions, and days before it."""

import warnings
from collections.abc import Callable, Container, Sequence
from datetime import datetime

from masrel.errors import MasrelWarning, ParameterError
from masrel.lab._event_log import Event, read_log
from masrel.lab._study_files import Fact
from masrel.lab.protocol import Protocol, Question, Questionnaire, Session, StudyPaths
from masrel.lab.protocol._values import When, checked_answer, questions_of
from masrel.lab.run._grade_sources import Correct, GradeSource, QuestionRequest
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
    log: Callable[[dict[str, Fact]], object],
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
        log(
            {
                "questionnaire": questionnaire.id,
                "question": question.id,
                "answer": answer,
            }
        )


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


# Events that do not say when a rater was there last
_NOT_THE_RATERS = ("recovered", "correction", "answer-correction", "stopped")


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
) -> dict[str, Fact] | None:
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
