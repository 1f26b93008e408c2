"""How far a study is: every session, every rater, and what to do next.

In: a protocol, its schedules and logs. Out: where each session stands, what became of
each rater, and one next step.
"""

import json
import shlex
from collections import Counter
from collections.abc import Callable, Container, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import datetime
from operator import itemgetter
from pathlib import Path
from typing import Literal

from masrel.errors import SessionLogError
from masrel.lab._event_log import Event, events_before_torn, utc_now
from masrel.lab._study_files import table_csv
from masrel.lab.conduct import excluded_raters, rater_values, read_conduct
from masrel.lab.conduct._study_log import events_of_logs
from masrel.lab.protocol import Protocol, StudyPaths, protocol_hash
from masrel.lab.protocol._values import FieldValue
from masrel.lab.run._days import Due, due_of
from masrel.lab.run._state import FROM_PAPER, SessionState, read_session, replay
from masrel.lab.schedule import site_of_copy
from masrel.lab.schedule._secret import rater_sessions_at
from masrel.lab.schedule.presentation import _read_drawn

__all__ = [
    "NextStep",
    "RaterProgress",
    "SessionProgress",
    "next_step",
    "open_sessions",
    "rater_progress",
    "raters_csv",
    "session_progress",
]

# How far a session came
_SessionStage = Literal["not drawn", "drawn", "begun", "complete", "unreadable"]


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
    n_presented : int
        Of them those that were presented without a fault.
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
    due_from, due_to : str or None
        First and last day on which it may begin, ISO 8601, where the protocol has an
        interval to the session before and that is complete.
    is_overdue : bool
        Whether it has not begun, and its last day is over.
    refused : str or None
        What it would be refused for today; None where it may begin or go on.
    """

    session: str
    rater: str
    stage: _SessionStage
    n_presentations: int
    n_presented: int = 0
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
    due_from: str | None = None
    due_to: str | None = None
    is_overdue: bool = False
    refused: str | None = None


def session_progress(
    study: StudyPaths, protocol: Protocol, *, now: Callable[[], datetime] = utc_now
) -> tuple[SessionProgress, ...]:
    """Say where every session of a study stands.

    Parameters
    ----------
    study : StudyPaths
        Where the study is.
    protocol : Protocol
        The study's protocol.
    now : callable, optional
        Gives the time of day, aware: what is due today.

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
    pairs = rater_sessions_at(protocol, site_of_copy(study))
    return tuple(_progress(study, protocol, *pair, now) for pair in pairs)


def _progress(
    study: StudyPaths,
    protocol: Protocol,
    rater: str,
    session: str,
    now: Callable[[], datetime],
) -> SessionProgress:
    events, state, problem = _events(study.log_file(rater, session))
    stage: _SessionStage = "not drawn"
    if state.header:
        stage = "complete" if state.is_complete else "begun"
    elif problem is not None and not events:
        stage = "unreadable"
    elif study.schedule_file(rater, session).exists():
        stage = "drawn"
    due = Due()
    if not state.header and problem is None:
        due = due_of(study, protocol, rater, session, now)
    counts = Counter(event.kind for event in events)
    presented = [event for of_code in state.presented.values() for event in of_code]
    return SessionProgress(
        session=session,
        rater=rater,
        stage=stage,
        n_presentations=len(protocol.models) * protocol.schedule.repeats,
        n_presented=sum(
            bool(of_code) and of_code[-1].fields["fault"] is None
            for of_code in state.presented.values()
        ),
        n_graded=len(state.grades),
        n_skipped=len(state.skipped),
        n_faults=sum(event.fields["fault"] is not None for event in presented),
        n_corrections=counts["correction"],
        n_practised=counts["practised"],
        n_breaks=counts["break"],
        n_answers=counts["answered"],
        last_event=events[-1].kind if events else None,
        last_time_utc=events[-1].time_utc if events else None,
        grades_from=state.source or _typed_from(study, rater, session),
        simulated=bool(state.header.get("simulated"))
        or any(event.fields["simulated"] for event in presented),
        problem=problem,
        due_from=None if due.first is None else due.first.isoformat(),
        due_to=None if due.last is None else due.last.isoformat(),
        is_overdue=due.is_overdue,
        refused=due.refused,
    )


def _typed_from(study: StudyPaths, rater: str, session: str) -> str | None:
    # a sheet that was printed for it is waited for
    is_printed = study.typed_file(rater, session).exists()
    return FROM_PAPER if is_printed else None


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


# What became of a rater; of two that hold the later one
_RaterStatus = Literal["planned", "begun", "complete", "withdrawn", "excluded"]


@dataclass(frozen=True, slots=True, kw_only=True)
class RaterProgress:
    """What became of one rater, and what is known of him or her.

    Attributes
    ----------
    rater : str
        Who.
    site : str or None
        Where, if the protocol says so.
    status : {"planned", "begun", "complete", "withdrawn", "excluded"}
        Whether a session has begun, and all of them are complete; or whether the rater
        has left, or is left out of the analysis.
    is_late : bool
        Whether the rater joined after the site's first draw of schedules;
        ``docs/conduct.md`` says how that is known.
    values : mapping of str to (str, int, float or None)
        What every field of the protocol holds; None where nothing is known.
    """

    rater: str
    site: str | None
    status: _RaterStatus
    is_late: bool
    values: Mapping[str, FieldValue | None] = field(hash=False)


def rater_progress(
    study: StudyPaths, protocol: Protocol, sessions: Sequence[SessionProgress]
) -> tuple[RaterProgress, ...]:
    """Say what became of every rater of a study.

    Parameters
    ----------
    study : StudyPaths
        Where the study is.
    protocol : Protocol
        The study's protocol.
    sessions : sequence of SessionProgress
        What `session_progress` returned.

    Returns
    -------
    tuple of RaterProgress
        In the protocol's order.

    Raises
    ------
    SessionLogError
        If the log of the study's conduct is damaged.
    """
    values, late = rater_values(study, protocol), _late_raters(study, protocol)
    withdrawn = {
        event.fields["rater"]
        for event in read_conduct(study)
        if event.kind == "withdrawn"
    }
    open_ = {each.rater for each in sessions if each.stage != "complete"}
    idle = ("drawn", "not drawn")
    begun = {each.rater for each in sessions if each.stage not in idle}
    # the last that holds
    statuses: tuple[tuple[_RaterStatus, Container[object]], ...] = (
        ("begun", begun),
        ("complete", begun - open_),
        ("withdrawn", withdrawn),
        ("excluded", excluded_raters(study)),
    )
    return tuple(
        RaterProgress(
            rater=rater.id,
            site=rater.site,
            status=next(
                (status for status, of in reversed(statuses) if rater.id in of),
                "planned",
            ),
            is_late=rater.id in late,
            values=values[rater.id],
        )
        for rater in protocol.raters
    )


def _late_raters(study: StudyPaths, protocol: Protocol) -> set[str]:
    # A rater who joins is put into the protocol, whose hash the schedules carry that
    # are drawn from then on.
    drawn_from: dict[str, str] = {}
    # what is damaged masrel check says
    for _, drawn in _read_drawn(study, protocol.rater_sessions, skips_damaged=True):
        drawn_from.setdefault(drawn.rater, drawn.protocol_sha256)
    logged = [e.fields for _, e in events_of_logs(study) if e.kind == "drawn"]
    in_force = _protocols_in_force(study, protocol)
    late = set()
    for site in {rater.site for rater in protocol.raters}:
        of_site = {rater.id for rater in protocol.raters if rater.site == site}
        draws = {rater: drawn_from[rater] for rater in drawn_from if rater in of_site}
        if set(draws.values()) <= {event["protocol_sha256"] for event in logged}:
            # whose schedules were drawn anew since has joined no later
            of_draws = (_raters_of(event, site) for event in logged)
            late |= draws.keys() - next(filter(None, of_draws), set())
        else:  # drawn before the log of the study had its draws
            first = _first_draw(draws, [pair for pair in in_force if pair[0] in draws])
            late |= {rater for rater, sha256 in draws.items() if sha256 != first}
    return late


def _raters_of(drawn: Mapping[str, object], site: str | None) -> set[str]:
    # the raters of a site in the protocol that a draw kept, if it was of the site
    if drawn["site"] not in (None, site):
        return set()
    raters = json.loads(str(drawn["protocol"]))["raters"]
    return {rater["id"] for rater in raters if rater.get("site") == site}


def _protocols_in_force(study: StudyPaths, protocol: Protocol) -> list[tuple[str, str]]:
    # raters, each with the hash of the protocol under which a session of theirs began,
    # in order of time; then every rater with that of the protocol as it is now
    begun: list[tuple[str, str, str]] = []
    for rater, session in protocol.rater_sessions:
        events, state, _ = _events(study.log_file(rater, session))
        if (sha256 := state.header.get("protocol_sha256")) is not None:
            begun.append((events[0].time_utc, rater, str(sha256)))
    begun.sort(key=itemgetter(0))
    in_force = [(rater, sha256) for _, rater, sha256 in begun]
    return in_force + [(each.id, protocol_hash(protocol)) for each in protocol.raters]


def _first_draw(
    draws: Mapping[str, str], in_force: Sequence[tuple[str, str]]
) -> str | None:
    # the hash of the protocol from which the first schedules of a site were drawn
    hashes = [sha256 for _, sha256 in in_force]

    def is_later(sha256: str) -> bool:
        # A schedule is drawn before its session begins: one of another protocol whose
        # session began under this one, or earlier, was drawn before this one's.
        return sha256 in hashes and any(
            draws[rater] != sha256 and hashes.index(other) <= hashes.index(sha256)
            for rater, other in in_force
        )

    # Of several that may be the first it is that of the rater who is named first.
    return min(dict.fromkeys(draws.values()), key=is_later, default=None)


def raters_csv(study: StudyPaths, protocol: Protocol) -> str:
    """Return the table of raters as the text of its file, ``ratings/raters.csv``.

    Parameters
    ----------
    study : StudyPaths
        Where the study is.
    protocol : Protocol
        The study's protocol.

    Returns
    -------
    str
        One row a rater, as protocol and logs have it now, with a column for every
        field; NA where nothing is known.

    Raises
    ------
    SessionLogError
        If the log of the study's conduct is damaged.
    """
    sessions = session_progress(study, protocol)
    raters = rater_progress(study, protocol, sessions)
    simulated = any(session.simulated for session in sessions)
    head = ["SIMULATED: not sessions of persons on hardware."] * simulated
    head += ["Raters, one row each, as they stand in the study; NA is not known."]
    columns = ["rater", "site", "status", "late", *protocol.rater_fields]
    rows = (
        (each.rater, each.site, each.status, each.is_late, *each.values.values())
        for each in raters
    )
    return table_csv(columns, rows, head=[*head, "format: 1"])


@dataclass(frozen=True, slots=True, kw_only=True)
class NextStep:
    """What is to be done next.

    Attributes
    ----------
    command : str
        The command.
    why : str
        What it is for.
    verb : str
        The verb of the command: ``"run"``, say.
    rater, session : str or None
        Whose session the verb is about; None where it is about the study.
    """

    command: str
    why: str
    verb: str
    rater: str | None = None
    session: str | None = None


def next_step(
    study: StudyPaths,
    sessions: Sequence[SessionProgress],
    raters: Sequence[RaterProgress],
) -> NextStep:
    """Say what is to be done next in a study.

    Parameters
    ----------
    study : StudyPaths
        Where the study is.
    sessions : sequence of SessionProgress
        What `session_progress` returned.
    raters : sequence of RaterProgress
        What `rater_progress` returned.

    Returns
    -------
    NextStep
        A command: what is damaged first, then what has begun, then what has not, and
        what is made of complete sessions.
    """
    root = shlex.quote(str(study.root))
    open_ = open_sessions(sessions, raters)
    ready = [session for session in open_ if session.refused is None]
    by_stage = {session.stage: session for session in reversed(ready)}
    if "unreadable" in by_stage:
        session = by_stage["unreadable"]
        why = f"the log of {session.rater} in session {session.session} is damaged"
        return _of_study("verify", root, why)
    if "not drawn" in by_stage and "begun" not in by_stage:
        n_absent = sum(session.stage == "not drawn" for session in open_)
        why = f"{n_absent} of {len(sessions)} schedules are not drawn"
        return _of_study("schedule", root, why)
    for stage in ("begun", "drawn"):
        if stage in by_stage:
            return _to_run(root, by_stage[stage], sessions)
    places = [(session.rater, session.session) for session in sessions]
    drawn = _read_drawn(study, places, skips_damaged=True)
    if not open_ and any(schedule.is_closed for _, schedule in drawn):
        command = f"masrel record unblind {root} --all --who WHO --why WHY"
        why = "all sessions are complete, and which models were met is sealed"
        return NextStep(command=command, why=why, verb="unblind")
    return _to_await(root, open_) or _to_make(study, root)


def open_sessions(
    sessions: Sequence[SessionProgress], raters: Sequence[RaterProgress]
) -> list[SessionProgress]:
    """Return the sessions that are neither complete nor of a rater who has left.

    Parameters
    ----------
    sessions : sequence of SessionProgress
        What `session_progress` returned.
    raters : sequence of RaterProgress
        What `rater_progress` returned.

    Returns
    -------
    list of SessionProgress
        In their order; those of raters who are withdrawn or excluded are not there.
    """
    absent = {r.rater for r in raters if r.status in ("withdrawn", "excluded")}
    return [s for s in sessions if s.stage != "complete" and s.rater not in absent]


def _of_study(verb: str, root: str, why: str) -> NextStep:
    return NextStep(command=f"masrel {verb} {root}", why=why, verb=verb)


def _to_run(
    root: str, session: SessionProgress, sessions: Sequence[SessionProgress]
) -> NextStep:
    # by the way of the session, or of the rater's last one
    place = f"--rater {session.rater} --session {session.session}"
    ways = [each.grades_from for each in sessions if each.rater == session.rater]
    way = session.grades_from or next(filter(None, reversed(ways)), None)
    verb, command = "run", f"masrel run {root} {place}"
    if way == FROM_PAPER and 0 < session.n_presented < session.n_presentations:
        command = f"{command} --grades paper"
    elif way == FROM_PAPER:
        verb, command = "enter", f"masrel paper enter {root} FILE {place} --who WHO"
    elif way == "browser":
        verb, command = "serve", f"masrel serve {root}"
    return NextStep(
        command=command,
        why=f"{session.n_graded} of {session.n_presentations} graded",
        verb=verb,
        rater=session.rater,
        session=session.session,
    )


def _to_await(root: str, open_: Sequence[SessionProgress]) -> NextStep | None:
    # what begins on another day is asked for then; what is overdue, never
    coming = [s for s in open_ if s.due_from is not None and not s.is_overdue]
    if not coming:
        return None
    session = min(coming, key=lambda each: str(each.due_from))
    why = f"{session.rater} begins session {session.session} from {session.due_from} on"
    return _of_study("status", root, why)


def _to_make(study: StudyPaths, root: str) -> NextStep:
    # of sessions that are complete: each output is made after what it is made of
    logs = [*study.logs(), *study.conduct_logs()]
    manifest = study.report / "manifest.json"
    newest = max((log.stat().st_mtime_ns for log in logs), default=0)
    for verb, file in (("ratings", study.ratings_file), ("report", manifest)):
        made = file.stat().st_mtime_ns if file.exists() else -1
        if made < newest:
            why = f"all sessions are complete; {file.name} is "
            why += "not there yet" if made < 0 else "older than the logs"
            return _of_study(verb, root, why)
    why = "all sessions are complete, and their report is written"
    return _of_study("verify", root, why)
