"""Correct a grade without losing the one that was given."""

from collections.abc import Callable
from datetime import datetime

from masrel.errors import ParameterError, SessionLogError
from masrel.protocol import Protocol, StudyPaths
from masrel.run.log import SessionLog, utc_now
from masrel.run.replay import replay

__all__ = ["record_correction"]


def record_correction(
    study: StudyPaths,
    protocol: Protocol,
    rater: str,
    session: str,
    *,
    code: str,
    grade: str,
    who: str,
    why: str,
    now: Callable[[], datetime] = utc_now,
) -> None:
    """Append a correction to a session's log; the first grade stays in it.

    Parameters
    ----------
    study : StudyPaths
        Where the study is.
    protocol : Protocol
        The study's protocol.
    rater, session : str
        Whose session.
    code : str
        The blinded code of a presentation that has a grade.
    grade : str
        What the grade should have been.
    who, why : str
        Who corrects it, and for what reason.
    now : callable, optional
        Gives the time of day for the log, aware.

    Raises
    ------
    ParameterError
        If the grade is not of the scale, or `who` or `why` is blank.
    SessionLogError
        If there is no such log, it is damaged, or the code has no grade.
    OSError
        If the log cannot be written.
    """
    if grade not in protocol.scale.grades:
        raise ParameterError(
            f"grade: needed one of {', '.join(protocol.scale.grades)}, got {grade!r}"
        )
    for name, text in (("who", who), ("why", why)):
        if not text.strip():
            raise ParameterError(f"{name}: needed text, got none")
    path = study.log_file(rater, session)
    if not path.is_file():
        raise SessionLogError(f"{path}: no such session log")
    with SessionLog.open(path, now=now) as log:
        state = replay(path, log.events)
        if code not in state.given:
            known = ", ".join(state.given) or "none"
            raise SessionLogError(
                f"{path}: needed a code that has a grade ({known}), got {code!r}"
            )
        log.append(
            "correction",
            {"code": code, "grade": grade, "who": who.strip(), "why": why.strip()},
        )
