"""Raters whose grades stay in the record and enter no number."""

from collections.abc import Callable
from datetime import datetime

from masrel._event_log import utc_now
from masrel.conduct._study_log import append_event, check_rater, read_conduct, stated
from masrel.errors import ParameterError
from masrel.protocol import Protocol, StudyPaths


def excluded_raters(study: StudyPaths) -> tuple[str, ...]:
    """Return the raters who are excluded from the analysis of a study.

    Parameters
    ----------
    study : StudyPaths
        Where the study is.

    Returns
    -------
    tuple of str
        In the order in which they were excluded; those included again are not there.

    Raises
    ------
    SessionLogError
        If the log of the study's conduct is damaged.
    """
    excluded: dict[str, None] = {}
    for event in read_conduct(study):
        if event.kind == "excluded":
            excluded[str(event.fields["rater"])] = None
        elif event.kind == "included":
            excluded.pop(str(event.fields["rater"]), None)
    return tuple(excluded)


def record_exclusion(
    study: StudyPaths,
    protocol: Protocol,
    rater: str,
    *,
    who: str,
    why: str,
    now: Callable[[], datetime] = utc_now,
) -> None:
    """Record that a rater is left out of the analysis; the grades stay in the study.

    Parameters
    ----------
    study : StudyPaths
        Where the study is.
    protocol : Protocol
        The study's protocol.
    rater : str
        Who is left out.
    who, why : str
        Who says so, and for what reason.
    now : callable, optional
        Gives the time of day, aware.

    Raises
    ------
    ParameterError
        If the protocol has no such rater, he or she is excluded already, or `who` or
        `why` is blank.
    SessionLogError
        If the log of the study's conduct is damaged.
    OSError
        If it cannot be written.
    """
    check_rater(protocol, rater)
    if rater in excluded_raters(study):
        raise ParameterError(
            f"rater: needed one who is not excluded, {rater} is; masrel rater include "
            "takes it back"
        )
    reasons = stated(who=who, why=why)
    append_event(study, protocol, "excluded", {"rater": rater, **reasons}, now=now)


def record_inclusion(
    study: StudyPaths,
    protocol: Protocol,
    rater: str,
    *,
    who: str,
    why: str,
    now: Callable[[], datetime] = utc_now,
) -> None:
    """Record that a rater who was excluded is analysed after all.

    Parameters
    ----------
    study : StudyPaths
        Where the study is.
    protocol : Protocol
        The study's protocol.
    rater : str
        Who was left out.
    who, why : str
        Who says so, and for what reason.
    now : callable, optional
        Gives the time of day, aware.

    Raises
    ------
    ParameterError
        If the protocol has no such rater, he or she is not excluded, or `who` or `why`
        is blank.
    SessionLogError
        If the log of the study's conduct is damaged.
    OSError
        If it cannot be written.
    """
    check_rater(protocol, rater)
    if rater not in excluded_raters(study):
        raise ParameterError(f"rater: needed one who is excluded, {rater} is not")
    reasons = stated(who=who, why=why)
    append_event(study, protocol, "included", {"rater": rater, **reasons}, now=now)
