"""Run one session, from its schedule to the last grade.

Started again, a session goes on where its log ends: what has a grade keeps it, and
what was presented but not graded is presented again and logged as another attempt.
"""

import hashlib
from collections.abc import Callable, Container, Sequence
from datetime import datetime
from pathlib import Path

from masrel._files import check_inside
from masrel.errors import (
    ParameterError,
    ProtocolError,
    SessionLogError,
)
from masrel.lab._event_log import Event, SessionLog, utc_now
from masrel.lab.conduct._standing import refuse_withdrawn
from masrel.lab.conduct._study_answers import study_answers
from masrel.lab.conduct._study_log import append_event
from masrel.lab.protocol import Protocol, StudyPaths
from masrel.lab.protocol._questions import questions_of
from masrel.lab.run._days import is_complete
from masrel.lab.run._grade_sources import GradeCorrection, GradeSource, with_occasions
from masrel.lab.run._practice import practice_presentations
from masrel.lab.run._present import spool_of
from masrel.lab.run._presenter import CLOCKS, ClockName
from masrel.lab.run._questionnaires import ask_questions
from masrel.lab.run._rehearsal import begin_rehearsal
from masrel.lab.run._runner import SessionRunner, SessionSummary
from masrel.lab.run._settings import (
    check_backend,
    check_button,
    has_simulated_hand,
    torque_problems,
)
from masrel.lab.schedule import Presentation
from masrel.lab.schedule.sheets import _drawn_schedule


def run_session(
    study: StudyPaths,
    protocol: Protocol,
    rater: str,
    session: str,
    *,
    grades: GradeSource,
    clock: ClockName,
    rehearsal: bool = False,
    progress: Callable[[Presentation], object] | None = None,
    now: Callable[[], datetime] = utc_now,
) -> SessionSummary:
    """Run one rater's session to its end, or go on with it.

    A rehearsal has an order and codes of its own, and leaves its log and recordings in
    ``rehearsals/``: nothing of it enters the study's ratings. When it is complete, the
    next one is another.

    Parameters
    ----------
    study : StudyPaths
        Where the study is; its schedules are drawn.
    protocol : Protocol
        The study's protocol.
    rater, session : str
        Whose session.
    grades : GradeSource
        Where grades come from.
    clock : {"real", "simulated"}
        The clock of the control loop; "simulated" needs a simulated hand.
    rehearsal : bool, optional
        Whether to rehearse; no schedule need be drawn.
    progress : callable, optional
        Called with each presentation once it has its grade; at once for those
        that have it already.
    now : callable, optional
        Gives the time of day for the log, aware.

    Returns
    -------
    SessionSummary
        What came of it. A complete session is left as it is.

    Raises
    ------
    ScheduleError
        If the schedule is missing, damaged, foreign, or stale.
    SessionLogError
        If the log is damaged, of another schedule or protocol, was begun with
        another device or source of grades (console and browser go on with one
        another's), was left on another day and may not be gone on with, or is open
        elsewhere, or if there are recordings of the session that it does not name.
    ProtocolError
        If a model asks for more torque than the device may send.
    ParameterError
        If the device or `clock` is unknown or they do not fit each other, the rater
        was withdrawn, the session may not begin yet or any more, or the source lacks a
        method that the protocol needs, or gives a grade or an answer that cannot be.
    DeviceError
        If the device cannot be used, or faults are not to be tried again.
    SessionStoppedError
        If the person stops. As after all of these but the first two, the same
        call goes on where this one ended.
    OSError
        If log or recording cannot be written.

    Warns
    -----
    OverrunWarning
        If the control loop missed ticks.
    MasrelWarning
        If the session begins out of order, and the protocol lets it.
    """
    _check_device(clock, protocol)
    refuse_withdrawn(study, rater)
    if rehearsal:
        begun = begin_rehearsal(study, protocol, rater, session)
        study, schedule, checksum = begun
    else:
        schedule = _drawn_schedule(study, protocol, rater, session)
        file = study.schedule_file(rater, session)
        checksum = hashlib.sha256(file.read_bytes()).hexdigest()
    log_file = study.log_file(rater, session)
    check_inside(log_file.parent, study.root)
    both = (*schedule.presentations, *practice_presentations(protocol))
    codes = {presentation.code for presentation in both}
    if not log_file.exists():
        _check_recordings(codes, log_file, ())  # before an empty log is made
    with SessionLog.open(log_file, now=now) as log:
        _check_recordings(codes, log_file, log.events)
        runner = SessionRunner(study, protocol, schedule, grades, clock, log, now)
        runner.begin(checksum)
        summary = runner.run(progress)
        if not rehearsal:
            _ask_about_study(
                study, protocol, rater, session, grades, runner.correct, now
            )
        return summary


def _ask_about_study(
    study: StudyPaths,
    protocol: Protocol,
    rater: str,
    session: str,
    grades: GradeSource,
    correct: Callable[[GradeCorrection], None],
    now: Callable[[], datetime],
) -> None:
    # once a rater has completed every session; the answers are the study's
    sessions = [each.id for each in protocol.sessions if rater in each.raters]
    if not questions_of(protocol, "study"):
        return
    if all(is_complete(study, rater, each) for each in sessions):
        ask_questions(
            protocol,
            "study",
            with_occasions(grades, protocol),
            rater=rater,
            session=session,
            answered=study_answers(study).get(rater, {}),
            correct=correct,
            log=lambda fields: append_event(
                study, protocol, "answered", {"rater": rater, **fields}, now=now
            ),
        )


def _check_recordings(
    codes: Container[str], log_file: Path, events: Sequence[Event]
) -> None:
    # What the log does not name was graded, perhaps, in a log that is lost.
    named = {Path(str(event.fields.get("recording"))).name for event in events}
    folder = log_file.with_suffix("")
    unnamed = sorted(
        file.name
        for file in folder.glob("*.npz")
        if file.stem.partition("-")[0] in codes and file.name not in named
    )
    begun = any(event.kind == "session" for event in events)
    if begun:  # the one whose process died before it could log it is recovered
        unnamed = [name for name in unnamed if not spool_of(folder / name).exists()]
    if unnamed:
        what = "does not name" if begun else "is gone or empty, and there are"
        more = f" and {len(unnamed) - 1} more" if len(unnamed) > 1 else ""
        raise SessionLogError(
            f"{log_file}: {what} recordings in {folder} ({unnamed[0]}{more}): put the "
            "whole log back from a copy, or move these recordings away to present "
            "their models again"
        )


def _check_device(clock: str, protocol: Protocol) -> None:
    if clock not in CLOCKS:
        raise ParameterError(f"clock: needed one of {', '.join(CLOCKS)}, got {clock!r}")
    device = protocol.device
    check_backend(device)
    check_button(protocol)
    if clock == "simulated" and not has_simulated_hand(device):
        raise ParameterError(
            f"clock: needed the real one for device {device.backend!r}, got 'simulated'"
        )
    problems = tuple(torque_problems(protocol))
    if problems:
        raise ProtocolError(*problems)
