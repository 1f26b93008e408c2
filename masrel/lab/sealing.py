"""Sealed studies: which models were met stays unknown until every session is over.

Where one account holds the secret this stops curiosity, not intent.
"""

from collections.abc import Callable
from datetime import datetime

from masrel._files import write_files
from masrel._input import listed
from masrel.errors import ParameterError
from masrel.lab._event_log import utc_now
from masrel.lab.conduct._study_log import (
    append_event,
    events_of_logs,
    recover_conduct,
    stated,
)
from masrel.lab.progress import open_sessions, rater_progress, session_progress
from masrel.lab.protocol import Protocol, StudyPaths
from masrel.lab.schedule.presentation import _read_drawn, _schedule_text
from masrel.lab.schedule.sheets import _open_schedule

__all__ = ["is_sealed", "unseal_study"]


def is_sealed(study: StudyPaths, protocol: Protocol) -> bool:
    """Say whether any drawn schedule of a study is sealed still.

    Parameters
    ----------
    study : StudyPaths
        Where the study is.
    protocol : Protocol
        The study's protocol; what it says of sealing is for schedules to come.

    Returns
    -------
    bool
        Whether there is one; one that is damaged does not count.
    """
    drawn = _read_drawn(study, protocol.rater_sessions, skips_damaged=True)
    return any(schedule.is_closed for _, schedule in drawn)


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
        Where the study is, with its secret. The copy of a site is opened once the
        sessions of the site are over.
    protocol : Protocol
        The study's protocol.
    who, why : str
        Who is to know, and for what reason.
    now : callable, optional
        Gives the time of day, aware.

    Returns
    -------
    int
        How many sealed schedules are open now; 0 of a study that has none.

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
    reasons = stated(who=who, why=why)
    drawn = [each for _, each in _read_drawn(study, protocol.rater_sessions)]
    if not (sealed := [each for each in drawn if each.sealed]):
        return 0
    recover_conduct(study)
    sessions = session_progress(study, protocol)
    going_on = open_sessions(sessions, rater_progress(study, protocol, sessions))
    if going_on:
        names = listed(f"{each.rater} in session {each.session}" for each in going_on)
        raise ParameterError(
            "study: needed every session complete or its rater withdrawn, "
            f"{names} {'is' if len(going_on) == 1 else 'are'} not"
        )
    opened = [_open_schedule(study, protocol, each) for each in sealed]
    texts = {
        study.opened_file(each.rater, each.session): _schedule_text(each)
        for each in opened
    }
    request = {"rater": None, "session": None, "code": None, **reasons}
    # what is drawn later is opened by another event
    is_recorded = False
    for _, event in events_of_logs(study):
        is_asked = event.kind == "unblinded" and dict(event.fields) == request
        is_recorded = event.kind != "drawn" and (is_recorded or is_asked)
    if not is_recorded:
        append_event(study, protocol, "unblinded", request, now=now)
    write_files(texts, within=study.root)
    return len(sealed)
