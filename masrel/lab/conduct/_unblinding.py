"""Codes that somebody learns the models of: recorded before they are said."""

from collections.abc import Callable, Iterator
from datetime import datetime
from typing import TYPE_CHECKING

from masrel.errors import ScheduleError
from masrel.lab._event_log import utc_now
from masrel.lab.conduct._study_log import append_event, stated
from masrel.lab.protocol import Protocol, StudyPaths
from masrel.lab.schedule import Presentation, Schedule, read_schedule

if TYPE_CHECKING:
    from masrel.lab.recording import _Fact  # loads numpy


def record_unblinding(
    study: StudyPaths,
    protocol: Protocol,
    code: str | None,
    *,
    who: str,
    why: str,
    rater: str | None = None,
    session: str | None = None,
    now: Callable[[], datetime] = utc_now,
) -> tuple[tuple[Schedule, Presentation], ...]:
    """Record that somebody learns which model a code stands for, and return it.

    Parameters
    ----------
    study : StudyPaths
        Where the study is.
    protocol : Protocol
        The study's protocol.
    code : str or None
        A code of a schedule; None for all of them.
    who, why : str
        Who is to know, and for what reason.
    rater, session : str, optional
        Whose schedules alone; where two sheets have one code, one has to be named.
    now : callable, optional
        Gives the time of day, aware.

    Returns
    -------
    tuple of (Schedule, Presentation)
        Every presentation that is unblinded; the event is on disk by then.

    Raises
    ------
    ParameterError
        If `who` or `why` is blank.
    ScheduleError
        If no drawn schedule has the code, several have it, or one is damaged.
    SessionLogError
        If the log of the study's conduct is damaged.
    OSError
        If it cannot be written.
    """
    reasons = stated(who=who, why=why)
    revealed = tuple(
        (schedule, shown)
        for schedule in _schedules(study, protocol, rater, session)
        for shown in schedule.presentations
        if code in (None, shown.code)
    )
    if not revealed:
        raise ScheduleError(
            f"code: needed one of a drawn schedule in {study.schedules}, got "
            f"{'none' if code is None else repr(code)}"
        )
    if code is not None and len(revealed) > 1:
        places = " and ".join(f"{s.rater} in session {s.session}" for s, _ in revealed)
        raise ScheduleError(
            f"code: needed one of a single sheet, {code} is on those of {places}: say "
            "which with --rater and --session"
        )
    where: dict[str, _Fact] = {"rater": rater, "session": session, "code": code}
    if code is not None:
        ((schedule, _),) = revealed
        where |= {"rater": schedule.rater, "session": schedule.session}
    append_event(study, protocol, "unblinded", {**where, **reasons}, now=now)
    return revealed


def _schedules(
    study: StudyPaths, protocol: Protocol, rater: str | None, session: str | None
) -> Iterator[Schedule]:
    for each in protocol.sessions:
        for of_rater in each.raters:
            file = study.schedule_file(of_rater, each.id)
            is_meant = rater in (None, of_rater) and session in (None, each.id)
            if is_meant and file.exists():
                yield read_schedule(file)
