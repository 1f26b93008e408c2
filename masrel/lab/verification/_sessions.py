"""Session logs, what they say happened, and the recordings they name."""

import hashlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from masrel.errors import ParameterError
from masrel.lab._bounded_files import MAX_SMALL, read_regular
from masrel.lab._event_log import Event
from masrel.lab.protocol import Protocol, StudyPaths
from masrel.lab.protocol._values import checked_answer
from masrel.lab.run._rehearsal import practice_presentations
from masrel.lab.run._state import SessionState, read_session
from masrel.lab.schedule import Presentation, Schedule
from masrel.lab.verification._finding import Finding, broken
from masrel.lab.verification._log_findings import (
    checked_log,
    recording_findings,
    time_findings,
)

Stage = Literal["not begun", "begun", "complete", "unreadable"]


@dataclass(frozen=True, slots=True, kw_only=True)
class SessionRecord:
    """One rater's session, as its log has it.

    Attributes
    ----------
    session, rater : str
        Whose session.
    stage : {"not begun", "begun", "complete", "unreadable"}
        How far it came.
    n_presentations, n_graded, n_skipped, n_corrections : int
        Presentations of the schedule, those with a grade, those skipped after a
        fault, and corrections.
    n_recordings : int
        Recordings that the log names.
    rehearsal : int or None
        Which rehearsal of the session it is; None of the session itself.
    """

    session: str
    rater: str
    stage: Stage
    n_presentations: int = 0
    n_graded: int = 0
    n_skipped: int = 0
    n_corrections: int = 0
    n_recordings: int = 0
    rehearsal: int | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class CheckedSession:
    """A session, what is wrong with it, and the files it speaks for."""

    record: SessionRecord
    findings: tuple[Finding, ...]
    files: frozenset[Path]


def check_session(
    study: StudyPaths,
    protocol: Protocol,
    schedule: Schedule | None,
    session: str,
    rater: str,
) -> CheckedSession:
    """Hold a log against its schedule, and its recordings against the log."""
    log = study.log_file(rater, session)
    events, state, finding = checked_log(log, read_session)
    if state is None or schedule is None:
        stage: Stage = "not begun" if finding is None and not events else "unreadable"
        return CheckedSession(
            record=SessionRecord(session=session, rater=rater, stage=stage),
            findings=() if finding is None else (finding,),
            files=frozenset([log]),
        )
    file = study.schedule_file(rater, session)
    checksum = hashlib.sha256(read_regular(file, most=MAX_SMALL)).hexdigest()
    return check_against_schedule(
        study, protocol, schedule, events, state, schedule_sha256=checksum
    )


def check_against_schedule(
    study: StudyPaths,
    protocol: Protocol,
    schedule: Schedule,
    events: Sequence[Event],
    state: SessionState,
    *,
    schedule_sha256: str,
) -> CheckedSession:
    """Hold the events of a log against a schedule that has this hash."""
    log = study.log_file(schedule.rater, schedule.session)
    findings = [
        *_head_findings(protocol, schedule, state, log, schedule_sha256),
        *_event_findings(protocol, schedule, events, log),
        *_answer_findings(protocol, events, log),
        *time_findings(events, log),
    ]
    shown = _all_shown(protocol, schedule)
    for event in state.all_presented:
        findings += _recording_findings(study, schedule, shown, log, event)
    return checked_session(
        study, events, state, findings, n_presentations=len(schedule.presentations)
    )


def checked_session(
    study: StudyPaths,
    events: Sequence[Event],
    state: SessionState,
    findings: Sequence[Finding],
    *,
    n_presentations: int,
) -> CheckedSession:
    """Return how far a session came by its log, with what is wrong with it."""
    rater, session = str(state.header["rater"]), str(state.header["session"])
    recordings = [
        study.sessions / str(event.fields["recording"]) for event in state.all_presented
    ]
    record = SessionRecord(
        session=session,
        rater=rater,
        stage="complete" if state.is_complete else "begun",
        n_presentations=n_presentations,
        n_graded=len(state.grades),
        n_skipped=len(state.skipped),
        n_corrections=sum(event.kind == "correction" for event in events),
        n_recordings=len(recordings),
    )
    facts = (recording.with_suffix(".json") for recording in recordings)
    files = frozenset([study.log_file(rater, session), *recordings, *facts])
    return CheckedSession(record=record, findings=tuple(findings), files=files)


def _head_findings(
    protocol: Protocol,
    schedule: Schedule,
    state: SessionState,
    log: Path,
    schedule_sha256: str,
) -> Iterator[Finding]:
    needed = {
        "study": protocol.study.id,
        "rater": schedule.rater,
        "session": schedule.session,
        "presented_sha256": schedule.presented_sha256,
        "schedule_sha256": schedule_sha256,
    }
    for name, value in needed.items():
        if state.header[name] != value:
            yield broken(
                log, f"line 1: {name}: needed {value}, got {state.header[name]}"
            )
    n_presentations = len(schedule.presentations)
    if state.is_complete and len(state.settled) != n_presentations:
        yield broken(
            log,
            f"is complete: needed {n_presentations} presentations graded or skipped, "
            f"got {len(state.settled)}",
        )


def _all_shown(protocol: Protocol, schedule: Schedule) -> dict[str, Presentation]:
    # every presentation by its code, also for practice
    both = (*practice_presentations(protocol), *schedule.presentations)
    return {shown.code: shown for shown in both}


def _answer_findings(
    protocol: Protocol, events: Sequence[Event], log: Path
) -> Iterator[Finding]:
    # of questions that the protocol has; one that it had once cannot be held against it
    known = {
        (questionnaire.id, question.id): question
        for questionnaire in protocol.questionnaires
        for question in questionnaire.questions
    }
    for event in events:
        key = event.fields.get("questionnaire"), event.fields.get("question")
        answer: Any = event.fields.get("answer")
        if key not in known or answer is None:
            continue
        try:
            checked_answer(
                known[key], answer, where=f"line {event.line}: {event.kind}: answer"
            )
        except ParameterError as error:
            yield broken(log, str(error))


def _event_findings(
    protocol: Protocol, schedule: Schedule, events: Sequence[Event], log: Path
) -> Iterator[Finding]:
    codes = _all_shown(protocol, schedule)
    positions = {code: shown.position for code, shown in codes.items()}
    attempts = dict.fromkeys(positions, 0)
    for event in events:
        fields, where = event.fields, f"line {event.line}: {event.kind}"
        code, grade = fields.get("code"), fields.get("grade")
        if code is not None and code not in positions:
            yield broken(log, f"{where}: needed a code of the schedule, got {code!r}")
            continue
        if "position" in fields and fields["position"] != positions[str(code)]:
            yield broken(
                log,
                f"{where}: position of {code}: needed {positions[str(code)]}, "
                f"got {fields['position']!r}",
            )
        if event.kind in ("presented", "practised"):
            attempts[str(code)] += 1
            if fields["attempt"] != attempts[str(code)]:
                yield broken(
                    log,
                    f"{where}: attempt at {code}: needed {attempts[str(code)]}, "
                    f"got {fields['attempt']!r}",
                )
        if grade is not None and grade not in protocol.scale.grades:
            yield broken(
                log,
                f"{where}: grade of {code}: needed one of "
                f"{', '.join(protocol.scale.grades)}, got {grade!r}",
            )


def _recording_findings(
    study: StudyPaths,
    schedule: Schedule,
    all_shown: Mapping[str, Presentation],
    log: Path,
    event: Event,
) -> Iterator[Finding]:
    fields, where = event.fields, f"line {event.line} of {log}"
    path = study.sessions / str(fields["recording"])
    code, attempt = str(fields["code"]), fields["attempt"]
    shown = all_shown.get(code)
    name = code if attempt == 1 else f"{code}-{attempt}"
    folder = study.recording_file(schedule.rater, schedule.session, code).parent
    if shown is None or path != folder / f"{name}.npz":
        yield broken(log, f"line {event.line}: {path} is not where {name} is recorded")
        return
    of = {
        "study": schedule.study,
        "rater": schedule.rater,
        "session": schedule.session,
    }
    yield from recording_findings(path, shown, of, event, where)
