"""How far a study is: every session, every rater, and what to do next.

In: a protocol, its schedules and logs. Out: where each session stands, what became of
each rater, and one next step. A sealed study is opened once its sessions are over.
"""

import shlex
from collections import Counter
from collections.abc import Callable, Container, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, field, replace
from datetime import datetime
from pathlib import Path
from typing import Any, Literal

from masrel._files import write_files
from masrel._input import listed
from masrel.errors import MasrelError, ParameterError, SessionLogError
from masrel.lab._event_log import Event, events_before_torn, utc_now
from masrel.lab._study_files import MANIFEST, table_csv
from masrel.lab.conduct import (
    PlanChange,
    excluded_raters,
    plan_changes,
    rater_values,
    read_conduct,
)
from masrel.lab.conduct._plan_versions import plan_versions
from masrel.lab.conduct._study_log import (
    append_event,
    events_of_logs,
    recover_conduct,
    stated,
)
from masrel.lab.protocol import Protocol, StudyPaths, protocol_hash
from masrel.lab.protocol._values import FieldValue
from masrel.lab.run._days import Due, due_of, held_on
from masrel.lab.run._state import (
    FROM_PAPER,
    NO_DEVICE,
    SessionState,
    read_session,
    replay,
)
from masrel.lab.schedule._secret import find_secret, rater_sessions_at, site_of_copy
from masrel.lab.schedule.presentation import _read_drawn, _schedule_text
from masrel.lab.schedule.sheets import _open_schedule

__all__ = [
    "NextStep",
    "RaterProgress",
    "SessionProgress",
    "next_step",
    "open_sessions",
    "rater_progress",
    "raters_csv",
    "session_progress",
    "study_status",
    "unseal_study",
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
    held_on : str or None
        The day on which it was held, ISO 8601, as corrected; None before it has begun.
    clock : str or None
        Clock of the control loop; "none" where another program presented the models,
        None before it has begun.
    due : Due
        When it may begin; without anything once it has begun.
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
    held_on: str | None = None
    clock: str | None = None
    due: Due = field(default_factory=Due)


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
        raters. If a log is damaged, the stage is ``"unreadable"``.

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
        with suppress(SessionLogError):  # the session before says it
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
        grades_from=state.source,
        simulated=bool(state.header.get("simulated"))
        or any(event.fields["simulated"] for event in presented),
        problem=problem,
        held_on=None if (day := held_on(events, state)) is None else day.isoformat(),
        clock=str(state.header["clock"]) if state.header else None,
        due=due,
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
        ``docs/reference/formats/conduct_log.md`` says how that is known.
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
    logged = [each for each in plan_versions(study) if each[1].kind == "drawn"]
    in_force = _protocols_in_force(study, protocol)
    late = set()
    for site in {rater.site for rater in protocol.raters}:
        of_site = {rater.id for rater in protocol.raters if rater.site == site}
        draws = {rater: drawn_from[rater] for rater in drawn_from if rater in of_site}
        if set(draws.values()) <= {e.fields["protocol_sha256"] for _, e in logged}:
            # whose schedules were drawn anew since has joined no later
            of_draws = (
                {rater.id for rater in then.raters if rater.site == site}
                for then, event in logged
                if event.fields["site"] in (None, site)
            )
            late |= draws.keys() - next(filter(None, of_draws), set())
        else:  # drawn before the log of the study had its draws
            first = _first_draw(draws, [pair for pair in in_force if pair[0] in draws])
            late |= {rater for rater, sha256 in draws.items() if sha256 != first}
    return late


def _protocols_in_force(study: StudyPaths, protocol: Protocol) -> list[tuple[str, str]]:
    # raters, each with the hash of the protocol under which a session of theirs began,
    # in order of time; then every rater with that of the protocol as it is now
    begun: list[tuple[str, str, str]] = []
    for rater, session in protocol.rater_sessions:
        events, state, _ = _events(study.log_file(rater, session))
        if (sha256 := state.header.get("protocol_sha256")) is not None:
            begun.append((events[0].time_utc, rater, str(sha256)))
    in_force = [(rater, sha256) for _, rater, sha256 in sorted(begun)]
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
    head = [
        *["SIMULATED: not sessions of persons on hardware."] * simulated,
        "Raters, one row each, as they stand in the study; NA is not known.",
        "format: 1",
    ]
    columns = ["rater", "site", "status", "late", *protocol.rater_fields]
    rows = (
        (each.rater, each.site, each.status, each.is_late, *each.values.values())
        for each in raters
    )
    return table_csv(columns, rows, head=head)


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
    changes: Sequence[PlanChange] = (),
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
    changes : sequence of PlanChange, optional
        What has changed in the plan.

    Returns
    -------
    NextStep
        A command that would not be refused: first for what is damaged, then for an
        unrecorded change of the plan, then for sessions that have begun, then for those
        that have not, and last for what is made of complete sessions.
    """
    open_ = open_sessions(sessions, raters)
    ready = [session for session in open_ if session.due.not_today is None]
    by_stage = {session.stage: session for session in reversed(ready)}
    if session := by_stage.get("unreadable"):
        why = f"the log of {session.rater} in session {session.session} is damaged"
        return _step(study, "verify", why)
    if any(change.time_utc is None for change in changes):
        why = "the plan has changed since the draw, and the change is not recorded yet"
        return _step(study, "record amend", why, " --who WHO --why WHY")
    if "not drawn" in by_stage and "begun" not in by_stage:
        n_left = sum(each.stage == "not drawn" for each in open_)
        what = f"{n_left} of {len(sessions)} schedules are not drawn"
        return _step(study, "schedule", what)
    if session := by_stage.get("begun") or by_stage.get("drawn"):
        return _to_run(study, session, sessions)
    return _to_await(study, open_) or _to_make(study, sessions, len(open_))


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


def _step(study: StudyPaths, verb: str, why: str, options: str = "") -> NextStep:
    command = f"masrel {verb} {shlex.quote(str(study.root))}{options}"
    return NextStep(command=command, why=why, verb=verb.split()[-1])


def _to_run(
    study: StudyPaths, session: SessionProgress, sessions: Sequence[SessionProgress]
) -> NextStep:
    # by the way of the session, or of the rater's last one, or of somebody else's
    typed = study.typed_file(session.rater, session.session)
    others_first = sorted(sessions, key=lambda each: each.rater == session.rater)
    ways = [each.grades_from for each in (session, *reversed(others_first))]
    way = next(filter(None, ways), None)
    verb, options = "run", f" --rater {session.rater} --session {session.session}"
    if way == FROM_PAPER or (session.clock is None and typed.exists()):
        verb, what = _on_paper(typed, session, sessions)
        options = what + options
    elif way == "browser":
        verb, options = "serve", ""
    why = f"{session.n_graded} of {session.n_presentations} graded"
    step = _step(study, verb, why, options)
    return replace(step, rater=session.rater, session=session.session)


def _on_paper(
    typed: Path, session: SessionProgress, sessions: Sequence[SessionProgress]
) -> tuple[str, str]:
    # A sheet is printed, models are presented by masrel or by another program, as
    # those of other sheets were, and what was typed is entered.
    from masrel.lab.paper._form import has_answers  # loads numpy

    clock, n_left = session.clock, session.n_presentations - session.n_presented
    if clock is None:
        if not typed.exists():
            return "paper print", ""
        clocks = [each.clock for each in sessions if each.grades_from == FROM_PAPER]
        clock = NO_DEVICE if has_answers(typed) or NO_DEVICE in clocks else "real"
    if clock != NO_DEVICE and n_left:
        return "run", " --grades paper"
    file = shlex.quote(str(typed)) if typed.exists() else "FILE"
    return "paper enter", f" {file} --who WHO"


def _to_await(study: StudyPaths, open_: Sequence[SessionProgress]) -> NextStep | None:
    # what begins on another day is asked for then; what is overdue, never
    coming = [s for s in open_ if s.due.first is not None and not s.due.is_overdue]
    if not coming:
        return None
    session = min(coming, key=lambda each: str(each.due.first))
    what = f"{session.rater} begins session {session.session}"
    return _step(study, "status", f"{what} from {session.due.first} on")


def _to_make(
    study: StudyPaths, sessions: Sequence[SessionProgress], n_open: int
) -> NextStep:
    # of sessions that are complete: each output is made after what it is made of
    done = "all sessions are complete"
    if n_open:
        done = f"{n_open} of {len(sessions)} sessions can no longer begin"
    elif (secret := find_secret(study)) is not None and secret.site is None:
        places = [(each.rater, each.session) for each in sessions]
        drawn = _read_drawn(study, places, skips_damaged=True)
        if any(schedule.is_closed for _, schedule in drawn):
            how, done = " --all --who WHO --why WHY", f"{done}, and sealed"
            return _step(study, "record unblind", done, how)
    logs = [*study.logs(), *study.conduct_logs()]
    manifest = study.report / MANIFEST
    newest = max((log.stat().st_mtime_ns for log in logs), default=0)
    for verb, file in (("ratings", study.ratings_file), ("report", manifest)):
        made = file.stat().st_mtime_ns if file.exists() else -1
        if made < newest:
            why = f"{done}; {file.name} is "
            why += "not there yet" if made < 0 else "older than the logs"
            return _step(study, verb, why)
    return _step(study, "verify", f"{done}, and the report is written")


def study_status(study: StudyPaths, protocol: Protocol) -> dict[str, Any]:
    """Say where a study stands, as ``masrel status`` writes it as JSON.

    Parameters
    ----------
    study : StudyPaths
        Where the study is.
    protocol : Protocol
        The study's protocol.

    Returns
    -------
    dict
        Its sessions and raters, what happened beside them, what has changed in the
        plan, why a log of these cannot be read or None, and the next step.

    Raises
    ------
    ScheduleError
        If the file of the study's secret is damaged.
    OSError
        If a log that is there cannot be read.
    """
    sessions = session_progress(study, protocol)
    raters: tuple[RaterProgress, ...] = ()
    events: tuple[Event, ...] = ()
    changes: tuple[PlanChange, ...] = ()
    problem = None
    try:
        raters = rater_progress(study, protocol, sessions)
        events, changes = read_conduct(study), plan_changes(study, protocol)
    except MasrelError as error:  # hides no session
        problem = str(error)
    return {
        "study": protocol.study.id,
        "sessions": [asdict(session) for session in sessions],
        "raters": [
            {"rater": r.rater, "status": r.status, "is_late": r.is_late} for r in raters
        ],
        "events": [
            {"event": e.kind, "time_utc": e.time_utc, **e.fields} for e in events
        ],
        "plan_changes": [asdict(change) for change in changes],
        "problem": problem,
        "next": asdict(next_step(study, sessions, raters, changes)),
    }


def unseal_study(
    study: StudyPaths,
    protocol: Protocol,
    *,
    who: str,
    why: str,
    now: Callable[[], datetime] = utc_now,
) -> int:
    """Write the models of sealed schedules beside them, once every session is over.

    Where one account holds the secret, sealing stops curiosity, not intent.
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
