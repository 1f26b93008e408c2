"""Sealed studies: who met which model stays unknown until every session is over.

Where one account holds the secret this stops curiosity, not intent.
"""

from collections.abc import Callable
from dataclasses import replace
from datetime import datetime
from typing import TYPE_CHECKING

import msgspec

from masrel._files import write_files
from masrel._input import listed
from masrel.errors import ParameterError
from masrel.lab._event_log import utc_now
from masrel.lab.conduct import read_conduct, record_unblinding
from masrel.lab.progress import rater_progress, session_progress
from masrel.lab.protocol import Protocol, StudyPaths
from masrel.lab.protocol.definition import Analysis
from masrel.lab.schedule.presentation import _SEALED, _read_drawn, _schedule_text
from masrel.lab.schedule.sheets import _open_schedule

if TYPE_CHECKING:
    from masrel.lab.ratings import Ratings  # loads numpy

__all__ = ["as_far_as_known", "is_sealed", "unseal_study"]


def is_sealed(study: StudyPaths, protocol: Protocol) -> bool:
    """Say whether any drawn schedule of a study is sealed still.

    Parameters
    ----------
    study : StudyPaths
        Where the study is.
    protocol : Protocol
        The study's protocol.

    Returns
    -------
    bool
        Whether there is one; one that is damaged is none.
    """
    drawn = _read_drawn(study, protocol.rater_sessions, skips_damaged=True)
    return any(schedule.is_closed for _, schedule in drawn)


def as_far_as_known(
    protocol: Protocol, ratings: "Ratings"
) -> "tuple[Protocol, Ratings]":
    """Return what a report can be made of: of sealed ratings no plan and no rating.

    Parameters
    ----------
    protocol : Protocol
        The study's protocol.
    ratings : Ratings
        Its ratings.

    Returns
    -------
    tuple of Protocol and Ratings
        These, or what is left of them where they say no models.
    """
    if all(row.model != _SEALED for row in ratings.rows):
        return protocol, ratings
    report = msgspec.structs.replace(protocol.report, gates=())
    planless = msgspec.structs.replace(protocol, analysis=Analysis(), report=report)
    return planless, replace(ratings, rows=())


def unseal_study(
    study: StudyPaths,
    protocol: Protocol,
    *,
    who: str,
    why: str,
    now: Callable[[], datetime] = utc_now,
) -> int:
    """Write the models of sealed schedules beside them, once every session is over.

    Who asked for it and why is on disk before. A call that was cut off is finished by
    the same call, and leaves no second event.

    Parameters
    ----------
    study : StudyPaths
        Where the study is, with its secret.
    protocol : Protocol
        The study's protocol.
    who, why : str
        Who is to know, and for what reason.
    now : callable, optional
        Gives the time of day, aware.

    Returns
    -------
    int
        How many schedules are open now.

    Raises
    ------
    ParameterError
        If a session is neither complete nor its rater withdrawn or excluded, or `who`
        or `why` is blank.
    ScheduleError
        If a schedule is damaged, or the secret is not that of the schedules.
    SessionLogError
        If a log is damaged.
    OSError
        If a file cannot be written.
    """
    sessions = session_progress(study, protocol)
    absent = {
        each.rater
        for each in rater_progress(study, protocol, sessions)
        if each.status in ("withdrawn", "excluded")
    }
    going_on = [
        f"{each.rater} in session {each.session}"
        for each in sessions
        if each.stage != "complete" and each.rater not in absent
    ]
    if going_on:
        raise ParameterError(
            "study: needed every session complete or its rater withdrawn, "
            f"{listed(going_on)} {'is' if len(going_on) == 1 else 'are'} not"
        )
    texts = {
        study.opened_file(each.rater, each.session): _schedule_text(
            _open_schedule(study, protocol, each)
        )
        for _, each in _read_drawn(study, protocol.rater_sessions)
    }
    request = {"rater": None, "session": None, "code": None, "who": who, "why": why}
    if not any(dict(event.fields) == request for event in read_conduct(study)):
        record_unblinding(study, protocol, None, who=who, why=why, now=now)
    write_files(texts, within=study.root)
    return len(texts)
