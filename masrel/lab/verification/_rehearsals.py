"""Logs of rehearsals, what they say happened, and the recordings they name."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from masrel.errors import ScheduleError
from masrel.lab._event_log import Event
from masrel.lab.protocol import Protocol, StudyPaths, presented_hash
from masrel.lab.run._rehearsal import RehearsalPaths, drawn_rehearsal
from masrel.lab.run._state import SessionState, read_session
from masrel.lab.verification._finding import Finding, broken, doubt
from masrel.lab.verification._log_findings import (
    checked_log,
    hashed_facts,
    time_findings,
)
from masrel.lab.verification._sessions import (
    CheckedSession,
    SessionRecord,
    check_against_schedule,
    checked_session,
)


def check_rehearsal(study: StudyPaths, protocol: Protocol, log: Path) -> CheckedSession:
    """Hold a rehearsal's log against its draw, and its recordings against the log."""
    number = int(log.parent.name) if log.parent.name.isdecimal() else 0
    paths = RehearsalPaths(study.root, number)
    events, state, finding = checked_log(log, read_session)
    if state is not None:
        finding = _head_finding(paths, protocol, state, log)
    if state is None or finding is not None:
        name = log.stem.removeprefix("rehearsal_")
        record = SessionRecord(
            session=name, rater="", rehearsal=number, stage="unreadable"
        )
        findings = () if finding is None else (finding,)
        return CheckedSession(record=record, findings=findings, files=frozenset([log]))
    checked = _checked(paths, protocol, events, state, log)
    return replace(checked, record=replace(checked.record, rehearsal=number))


def _head_finding(
    paths: RehearsalPaths, protocol: Protocol, state: SessionState, log: Path
) -> Finding | None:
    rater, session = str(state.header["rater"]), str(state.header["session"])
    for name, value in {"study": protocol.study.id, "rehearsal": True}.items():
        got = state.header.get(name, False)
        if got != value:
            return broken(log, f"line 1: {name}: needed {value}, got {got}")
    if log != paths.log_file(rater, session):
        return broken(
            log,
            f"is the log of a rehearsal of rater {rater} in session {session} by its "
            "first event: needed the one its name and folder say",
        )
    return None


def _checked(
    paths: RehearsalPaths,
    protocol: Protocol,
    events: Sequence[Event],
    state: SessionState,
    log: Path,
) -> CheckedSession:
    rater, session = str(state.header["rater"]), str(state.header["session"])
    changed = state.header["presented_sha256"] != presented_hash(protocol)
    try:
        drawn = None if changed else drawn_rehearsal(paths, protocol, rater, session)
    except ScheduleError:  # such as of a rater who was taken off
        drawn = None
    if drawn is not None and drawn[1] == state.header["schedule_sha256"]:
        schedule, checksum = drawn
        return check_against_schedule(
            paths, protocol, schedule, events, state, schedule_sha256=checksum
        )
    why = (
        "models or settings that the protocol had before a change"
        if changed
        else "a secret, a rater or a session that the study does not have now"
    )
    findings = [
        doubt(log, f"is of {why}: what was presented when cannot be drawn again"),
        *time_findings(events, log),
    ]
    for event in state.all_presented:
        path = paths.sessions / str(event.fields["recording"])
        findings += hashed_facts(path, event, f"line {event.line} of {log}")[1]
    return checked_session(
        paths, events, state, findings, n_presentations=len(state.presented)
    )
