"""What a coordinator does beside the sessions: the functions that the verbs call."""

from collections.abc import Callable, Mapping
from typing import Any

from masrel.errors import ParameterError
from masrel.lab.conduct import (
    allot_schedules,
    record_note,
    record_standing,
    record_unblinding,
)
from masrel.lab.protocol import Protocol, StudyPaths
from masrel.lab.run import record_answer, record_skip

Fields = Mapping[str, Any]
Act = Callable[[StudyPaths, Protocol, Fields], str]


def _draw(study: StudyPaths, protocol: Protocol, fields: Fields) -> str:  # noqa: ARG001 - as all
    n_drawn = len(allot_schedules(study, protocol))
    return f"All {n_drawn} schedules are drawn."


def _note(study: StudyPaths, protocol: Protocol, fields: Fields) -> str:
    kind: Any = text(fields, "kind") or "note"
    severity: Any = text(fields, "severity")
    record_note(
        study,
        protocol,
        needed(fields, "text"),
        who=needed(fields, "who"),
        kind=kind,
        rater=text(fields, "rater"),
        session=text(fields, "session"),
        severity=severity,
        action=text(fields, "action"),
        outcome=text(fields, "outcome"),
    )
    return f"Recorded: {kind}."


def _answer(study: StudyPaths, protocol: Protocol, fields: Fields) -> str:
    question = needed(fields, "question")
    record_answer(
        study,
        protocol,
        needed(fields, "rater"),
        needed(fields, "session"),
        question=question,
        answer=text(fields, "answer"),
        code=text(fields, "code"),
        who=needed(fields, "who"),
        why=needed(fields, "why"),
    )
    return f"The answer to {question} is corrected; what it was stays in the log."


def _skip(study: StudyPaths, protocol: Protocol, fields: Fields) -> str:  # noqa: ARG001 - as all
    code = needed(fields, "code")
    rater, session = needed(fields, "rater"), needed(fields, "session")
    reasons = {"who": needed(fields, "who"), "why": needed(fields, "why")}
    record_skip(
        *(study, rater, session), code=code, who=reasons["who"], why=reasons["why"]
    )
    return f"{code} of {rater}, session {session}, is left without a grade."


def _withdraw(study: StudyPaths, protocol: Protocol, fields: Fields) -> str:
    rater = needed(fields, "rater")
    record_standing(
        *(study, protocol, rater, "withdrawn"),
        who=needed(fields, "who"),
        why=needed(fields, "why"),
    )
    return f"{rater} is withdrawn; the grades given before are kept."


def _unblind(study: StudyPaths, protocol: Protocol, fields: Fields) -> str:
    revealed = record_unblinding(
        study,
        protocol,
        needed(fields, "code"),
        who=needed(fields, "who"),
        why=needed(fields, "why"),
        rater=text(fields, "rater"),
        session=text(fields, "session"),
    )
    lines = [
        f"{one.code} of {schedule.rater}, session {schedule.session}, is {one.model}"
        for schedule, one in revealed
    ]
    return "Recorded. " + "; ".join(lines) + "."


ACTS: dict[str, Act] = {
    "draw": _draw,
    "note": _note,
    "answer": _answer,
    "skip": _skip,
    "withdraw": _withdraw,
    "unblind": _unblind,
}
"""What can be done, by name; each says in a sentence what it did."""


def text(fields: Fields, name: str) -> str | None:
    """Return a text that may be left out."""
    words = fields.get(name)
    if words is not None and not isinstance(words, str):
        raise ParameterError(f"{name}: needed text, got {words!r}")
    return (words or "").strip() or None


def needed(fields: Fields, name: str) -> str:
    """Return a text that is needed."""
    words = text(fields, name)
    if words is None:
        raise ParameterError(f"{name}: needed text, got none")
    return words
