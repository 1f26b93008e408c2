"""From session logs to the table of ratings."""

import hashlib
import math
import statistics
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from masrel.errors import RatingsError
from masrel.lab._bounded_files import MAX_RECORDING, MAX_SMALL, read_regular
from masrel.lab._event_log import Event
from masrel.lab.protocol import Protocol, StudyPaths, scale_of
from masrel.lab.ratings.table import _NEEDED_TIME, Ratings, _is_utc, ratings_from_rows
from masrel.lab.run._state import FROM_PAPER, FROM_PERSONS, SessionState, read_session
from masrel.lab.schedule import Schedule, check_schedule, read_schedule


def ratings_from_logs(study: StudyPaths, protocol: Protocol) -> Ratings:
    """Collect the ratings of a study from its session logs.

    Parameters
    ----------
    study : StudyPaths
        Where the study is.
    protocol : Protocol
        The study's protocol.

    Returns
    -------
    Ratings
        Sessions and raters in the protocol's order, models in the schedule's. A
        session that has begun has a row for every presentation, without grade
        where there is none yet; one that has no log has none. Corrections are in
        the place of the grades they correct; stretches are those of the last
        presentation before the grade, and the speed is the mean of theirs.

    Raises
    ------
    RatingsError
        If no session has begun, a log is of another schedule, a grade is not of
        the scale, or a recording is not the one its log has the checksum of.
        Recordings that are not there are not checked.
    SessionLogError
        If a log is damaged.
    ScheduleError
        If a schedule is missing, damaged or stale.
    """
    return _of_logs(study, protocol, check_recordings=True)


def _of_logs(
    study: StudyPaths, protocol: Protocol, *, check_recordings: bool
) -> Ratings:
    rows = [
        row
        for session in protocol.sessions
        for rater in session.raters
        if study.log_file(rater, session.id).exists()
        for row in _rows(
            study, protocol, rater, session.id, check_recordings=check_recordings
        )
    ]
    if not rows:
        raise RatingsError(
            f"{study.sessions}: needed a session log, got none; masrel run makes them"
        )
    return ratings_from_rows(rows, scale_of(protocol))


def _rows(
    study: StudyPaths,
    protocol: Protocol,
    rater: str,
    session: str,
    *,
    check_recordings: bool,
) -> Iterator[dict[str, object]]:
    log = study.log_file(rater, session)
    _, state = read_session(log)
    if not state.header:
        return
    if state.header.get("rehearsal"):
        raise RatingsError(
            f"{log}: needed the log of a session, got that of a rehearsal, whose "
            "grades are no ratings of the study: move it away"
        )
    schedule = _schedule(study, protocol, state, log)
    _check_codes(schedule, state, log)
    if check_recordings:
        for events in state.presented.values():
            for event in events:
                _check_recording(study, log, event)
    of_session = {
        "session": session,
        "rater": rater,
        "source": "simulated" if _is_simulated(state) else "recorded",
        "device": _device(state),
    }
    for shown in schedule.presentations:
        grade = state.grades.get(shown.code)
        if grade is not None and grade not in protocol.scale.grades:
            raise RatingsError(
                f"{log}: grade of {shown.code}: needed one of "
                f"{', '.join(protocol.scale.grades)}, got {grade!r}"
            )
        yield {
            **of_session,
            "grades_from": state.graded_from.get(shown.code, state.source),
            "model": shown.model,
            "repeat": shown.repeat,
            "grade": grade,
            "graded_stretch": state.graded_stretches.get(shown.code),
            "position": shown.position,
            "code": shown.code,
            "n_attempts": _n_attempts(state, shown.code),
            "first_grade": state.first_grades.get(shown.code),
            "graded_at": _graded_at(state, shown.code, log),
            **_of_stretches(state.presented.get(shown.code, [])),
        }


def _check_codes(schedule: Schedule, state: SessionState, log: Path) -> None:
    codes = {shown.code for shown in schedule.presentations}
    for code, events in state.presented.items():
        if code not in codes:
            line = f"line {events[0].line}: " if events else ""
            raise RatingsError(
                f"{log}: {line}needed a code of the schedule, got {code!r}"
            )


def _n_attempts(state: SessionState, code: str) -> int | None:
    # how often a device presented it; of a sheet nobody knows
    is_on_paper = state.header["grades"] == FROM_PAPER
    return None if is_on_paper else len(state.presented.get(code, []))


def _graded_at(state: SessionState, code: str, log: Path) -> str | None:
    # of a simulated grade it is when a computer came to it: it differs from run to run
    time = state.graded_at.get(code)
    if time is None or state.graded_from[code] not in FROM_PERSONS:
        return None
    if not _is_utc(time):
        raise RatingsError(f"{log}: grade of {code}: {_NEEDED_TIME}, got {time!r}")
    return time


def _schedule(
    study: StudyPaths, protocol: Protocol, state: SessionState, log: Path
) -> Schedule:
    rater, session = str(state.header["rater"]), str(state.header["session"])
    if log != study.log_file(rater, session):
        raise RatingsError(
            f"{log}: is the log of rater {rater} in session {session} by its first "
            "event: needed the one its name says"
        )
    path = study.schedule_file(rater, session)
    schedule = read_schedule(path)
    check_schedule(schedule, protocol)
    data = read_regular(path, most=MAX_SMALL)
    if state.header["schedule_sha256"] != hashlib.sha256(data).hexdigest():
        raise RatingsError(f"{log}: was recorded with another schedule than {path}")
    return schedule


def _check_recording(study: StudyPaths, log: Path, event: Event) -> None:
    path = study.sessions / str(event.fields["recording"])
    if not path.is_file():
        return
    data = read_regular(path, most=MAX_RECORDING)
    if hashlib.sha256(data).hexdigest() != event.fields["sha256"]:
        raise RatingsError(
            f"{log}: line {event.line}: {path} is not the recording whose checksum "
            "this line holds"
        )


def _of_stretches(presented: list[Event]) -> dict[str, object]:
    # what the table says of the stretches of the last presentation
    if not presented:
        return {}
    fields = presented[-1].fields
    one = [{"mean_speed_deg_s": fields["mean_speed_deg_s"]}]
    listed = fields.get("stretches")
    made: Any = one if listed is None else listed  # there once was one, and no list
    speeds = tuple(stretch["mean_speed_deg_s"] for stretch in made)
    moved = [speed for speed in speeds if speed is not None]
    return {
        "n_stretches": len(speeds),
        "mean_speed_deg_s": statistics.fmean(moved) if moved else math.nan,
        "min_speed_deg_s": min(moved, default=math.nan),
        "max_speed_deg_s": max(moved, default=math.nan),
        "speeds_deg_s": speeds,
        "felt": fields.get("felt"),
        "grip_lost": fields.get("grip_lost"),
    }


def _device(state: SessionState) -> str:
    name = str(state.header["device"])
    moved = [event for events in state.presented.values() for event in events]
    if name != "simulated" and any(event.fields["simulated"] for event in moved):
        return f"simulated {name}"  # such as an amplifier that is emulated
    return name


def _is_simulated(state: SessionState) -> bool:
    return bool(state.header["simulated"]) or any(
        event.fields["simulated"]
        for events in state.presented.values()
        for event in events
    )
