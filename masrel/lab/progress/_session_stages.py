"""Where every session of a study stands, by its log: no recording is read."""

from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from masrel.errors import SessionLogError
from masrel.lab._event_log import Event, events_before_torn
from masrel.lab.protocol import Protocol, StudyPaths
from masrel.lab.run._state import SessionState, read_session, replay
from masrel.lab.schedule import site_of_copy
from masrel.lab.schedule._sites import site_of

SessionStage = Literal["not drawn", "drawn", "begun", "complete", "unreadable"]
"""How far a session came."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SessionProgress:
    """Where one rater's session stands. No model is named.

    Attributes
    ----------
    session, rater : str
        Whose session.
    stage : {"not drawn", "drawn", "begun", "complete", "unreadable"}
        How far it came.
    n_presentations : int
        Presentations that the protocol has for a session.
    n_graded, n_skipped, n_faults, n_corrections : int
        Of them those with a grade and those left without one; presentations that a
        fault stopped; corrections.
    n_practised, n_breaks, n_answers : int
        Practice presentations, breaks, and answers to questionnaires.
    last_event, last_time_utc : str or None
        What happened last in it, and when; None before it has begun.
    grades_from : str or None
        Where its grades come from, the last of them where it went on with another
        source; None before it has begun.
    simulated : bool
        Whether grades or device are simulated.
    problem : str or None
        Why its log cannot be read, or None.
    """

    session: str
    rater: str
    stage: SessionStage
    n_presentations: int
    n_graded: int = 0
    n_skipped: int = 0
    n_faults: int = 0
    n_corrections: int = 0
    n_practised: int = 0
    n_breaks: int = 0
    n_answers: int = 0
    last_event: str | None = None
    last_time_utc: str | None = None
    grades_from: str | None = None
    simulated: bool = False
    problem: str | None = None


def session_progress(
    study: StudyPaths, protocol: Protocol
) -> tuple[SessionProgress, ...]:
    """Say where every session of a study stands.

    Parameters
    ----------
    study : StudyPaths
        Where the study is.
    protocol : Protocol
        The study's protocol.

    Returns
    -------
    tuple of SessionProgress
        Sessions and raters in the protocol's order; in the copy of a site, those of its
        raters. Of a log that is damaged the stage is ``"unreadable"``.

    Raises
    ------
    ScheduleError
        If the file of the study's secret is damaged.
    OSError
        If a log that is there cannot be read.
    """
    site = site_of_copy(study)
    return tuple(
        _progress(study, protocol, rater, session.id)
        for session in protocol.sessions
        for rater in session.raters
        if site in (None, site_of(protocol, rater))
    )


def _progress(
    study: StudyPaths, protocol: Protocol, rater: str, session: str
) -> SessionProgress:
    n_presentations = len(protocol.models) * protocol.schedule.repeats
    log = study.log_file(rater, session)
    stage: SessionStage = "not drawn"
    if study.schedule_file(rater, session).exists():
        stage = "drawn"
    events, state, problem = _events(log)
    if problem is not None and not events:
        stage = "unreadable"
    if state.header:
        stage = "complete" if state.is_complete else "begun"
    counts = Counter(event.kind for event in events)
    presented = [event for of_code in state.presented.values() for event in of_code]
    return SessionProgress(
        session=session,
        rater=rater,
        stage=stage,
        n_presentations=n_presentations,
        n_graded=len(state.grades),
        n_skipped=len(state.skipped),
        n_faults=sum(event.fields["fault"] is not None for event in presented),
        n_corrections=counts["correction"],
        n_practised=counts["practised"],
        n_breaks=counts["break"],
        n_answers=counts["answered"],
        last_event=events[-1].kind if events else None,
        last_time_utc=events[-1].time_utc if events else None,
        grades_from=state.source,
        simulated=bool(state.header.get("simulated"))
        or any(event.fields["simulated"] for event in presented),
        problem=problem,
    )


def _events(log: Path) -> tuple[tuple[Event, ...], SessionState, str | None]:
    # what a log says, or why it cannot be read; of one whose last line a kill cut off,
    # which masrel run takes out again, both
    if not log.exists():
        return (), SessionState(), None
    try:
        return *read_session(log), None
    except SessionLogError as error:
        problem = str(error)
    try:
        events = events_before_torn(log) or ()
        return events, replay(log, events), problem
    except SessionLogError:
        return (), SessionState(), problem
