"""Raters who have left the study, and those whose grades enter no number."""

from collections.abc import Callable
from datetime import datetime
from typing import Literal, get_args

from masrel._input import listed
from masrel.errors import ParameterError
from masrel.lab._event_log import utc_now
from masrel.lab.conduct._study_log import (
    append_event,
    check_rater,
    read_conduct,
    stated,
)
from masrel.lab.protocol import Protocol, StudyPaths

Standing = Literal["withdrawn", "excluded", "included"]
"""What is recorded of a rater: who has left, or is left out of the analysis, or not."""


def record_standing(
    study: StudyPaths,
    protocol: Protocol,
    rater: str,
    standing: Standing,
    *,
    who: str,
    why: str,
    now: Callable[[], datetime] = utc_now,
) -> None:
    """Record that a rater has left, or is excluded, or included again.

    The grades of the rater stay in the study, and the protocol goes on having him or
    her. Those of a rater who was withdrawn are counted, and no session goes on; those
    of one who is excluded enter no number.

    Parameters
    ----------
    study : StudyPaths
        Where the study is.
    protocol : Protocol
        The study's protocol.
    rater : str
        Who.
    standing : {"withdrawn", "excluded", "included"}
        What is recorded; who was excluded is included again.
    who, why : str
        Who says so, and for what reason.
    now : callable, optional
        Gives the time of day, aware.

    Raises
    ------
    ParameterError
        If the protocol has no such rater, `standing` is unknown or what he or she has
        already, or `who` or `why` is blank.
    SessionLogError
        If the log of the study's conduct is damaged.
    OSError
        If it cannot be written.
    """
    check_rater(protocol, rater)
    known = get_args(Standing)
    if standing not in known:
        raise ParameterError(
            f"standing: needed one of {listed(known)}, got {standing!r}"
        )
    is_excluded = rater in excluded_raters(study)
    if standing == "withdrawn":
        refuse_withdrawn(study, rater)
    elif standing == "excluded" and is_excluded:
        raise ParameterError(
            f"rater: needed one who is not excluded, {rater} is; masrel rater include "
            "takes it back"
        )
    elif standing == "included" and not is_excluded:
        raise ParameterError(f"rater: needed one who is excluded, {rater} is not")
    fields = {"rater": rater, **stated(who=who, why=why)}
    append_event(study, protocol, standing, fields, now=now)


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


def refuse_withdrawn(study: StudyPaths, rater: str) -> None:
    """Refuse a rater who has left the study."""
    for event in read_conduct(study):
        if event.kind == "withdrawn" and event.fields["rater"] == rater:
            raise ParameterError(
                f"rater: needed one who takes part, {rater} was withdrawn on "
                f"{event.time_utc[:10]} by {event.fields['who']}: "
                f"{event.fields['why']}"
            )
