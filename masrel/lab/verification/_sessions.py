"""Logs of sessions, rehearsals and trainings, and the recordings that they name."""

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from masrel.errors import ParameterError, ScheduleError
from masrel.lab._event_log import Event, read_log
from masrel.lab._study_files import MAX_SMALL, read_regular, sha256_of
from masrel.lab.conduct._calibrations import calibration_hashes
from masrel.lab.protocol import Protocol, Question, StudyPaths, presented_hash
from masrel.lab.protocol._values import checked_answer
from masrel.lab.run._rehearsal import (
    RehearsalPaths,
    drawn_rehearsal,
    practice_presentations,
)
from masrel.lab.run._state import SessionState, read_session
from masrel.lab.schedule.presentation import Presentation, Schedule, read_schedule
from masrel.lab.verification._log_findings import (
    Finding,
    broken,
    checked_log,
    doubt,
    hashed_facts,
    recording_findings,
    time_findings,
    unlike,
)


@dataclass(frozen=True, slots=True, kw_only=True)
class SessionRecord:
    """One rater's session, rehearsal or training, as its log has it.

    Attributes
    ----------
    session, rater : str
        Whose session; that of a training is ``"training"``.
    stage : {"not begun", "begun", "complete", "passed", "not passed", "unreadable"}
        How far it came; a training is passed or not.
    n_presentations, n_graded, n_skipped, n_corrections : int
        Presentations of the schedule or in a training, those with a grade, those
        skipped after a fault, and corrections.
    n_recordings : int
        Recordings that the log names.
    rehearsal : int or None
        Which rehearsal of the session it is; None of the session itself.
    """

    session: str
    rater: str
    stage: Literal[
        "not begun", "begun", "complete", "passed", "not passed", "unreadable"
    ]
    n_presentations: int = 0
    n_graded: int = 0
    n_skipped: int = 0
    n_corrections: int = 0
    n_recordings: int = 0
    rehearsal: int | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class CheckedLog:
    """How far a log came, what is wrong with it, and the recordings it speaks for."""

    record: SessionRecord
    findings: Sequence[Finding]
    log: Path
    recordings: Sequence[Path] = ()


def check_session(
    study: StudyPaths, protocol: Protocol, session: str, rater: str
) -> CheckedLog:
    """Hold a log against its schedule, and its recordings against the log."""
    file, log = study.schedule_file(rater, session), study.log_file(rater, session)
    schedule, findings = None, []
    if file.exists():
        with suppress(ScheduleError):  # which `schedule_problems` has
            schedule = read_schedule(file)
    elif log.exists():
        needed = "needed the schedule of a session that has begun, got no file"
        findings.append(broken(file, needed))
    events, state, problem = checked_log(log, read_session)
    if problem is not None:
        findings.append(problem)
    if state is None or schedule is None:
        is_none = problem is None and not events
        return CheckedLog(
            record=SessionRecord(
                session=session,
                rater=rater,
                stage="not begun" if is_none else "unreadable",
            ),
            findings=findings,
            log=log,
        )
    checksum = sha256_of(read_regular(file, most=MAX_SMALL))
    return _against_schedule(study, protocol, schedule, events, state, checksum)


def check_rehearsal(study: StudyPaths, protocol: Protocol, log: Path) -> CheckedLog:
    """Hold a rehearsal's log against its draw, and its recordings against the log."""
    number = int(log.parent.name) if log.parent.name.isdecimal() else 0
    paths = RehearsalPaths(study.root, number)
    events, state, problem = checked_log(log, read_session)
    if state is not None:
        rater, session = str(state.header["rater"]), str(state.header["session"])
        header = {"rehearsal": False, **state.header}
        needed = {"study": protocol.study.id, "rehearsal": True}
        problem = next(unlike(log, "line 1", needed, header), None)
        if problem is None and log != paths.log_file(rater, session):
            problem = broken(
                log,
                f"is the log of a rehearsal of rater {rater} in session {session} by "
                "its first event: needed the one its name and folder say",
            )
    if state is None or problem is not None:
        name = log.stem.removeprefix("rehearsal_")
        return CheckedLog(
            record=SessionRecord(
                session=name, rater="", rehearsal=number, stage="unreadable"
            ),
            findings=[] if problem is None else [problem],
            log=log,
        )
    is_changed = state.header["presented_sha256"] != presented_hash(protocol)
    try:
        drawn = None if is_changed else drawn_rehearsal(paths, protocol, rater, session)
    except ScheduleError:  # such as of a rater who was taken off
        drawn = None
    if drawn is not None and drawn[1] == state.header["schedule_sha256"]:
        return _against_schedule(paths, protocol, drawn[0], events, state, drawn[1])
    why = (
        "models or settings that the protocol had before a change"
        if is_changed
        else "a secret, a rater or a session that the study does not have now"
    )
    findings = [
        doubt(log, f"is of {why}: what was presented when cannot be drawn again"),
        *time_findings(events, log),
    ]
    for event in state.all_presented:
        path = paths.sessions / str(event.fields["recording"])
        findings += hashed_facts(path, event, f"line {event.line} of {log}")[1]
    return _checked_session(paths, events, state, findings, len(state.presented))


def _against_schedule(
    study: StudyPaths,
    protocol: Protocol,
    schedule: Schedule,
    events: Sequence[Event],
    state: SessionState,
    checksum: str,
) -> CheckedLog:
    # checksum: of the schedule's file
    log = study.log_file(schedule.rater, schedule.session)
    needed = {
        "study": protocol.study.id,
        "rater": schedule.rater,
        "session": schedule.session,
        "presented_sha256": schedule.presented_sha256,
        "schedule_sha256": checksum,
    }
    findings = [*unlike(log, "line 1", needed, state.header)]
    n_presentations = len(schedule.presentations)
    if state.is_complete and len(state.settled) != n_presentations:
        findings.append(
            broken(
                log,
                f"is complete: needed {n_presentations} presentations graded or "
                f"skipped, got {len(state.settled)}",
            )
        )
    # every presentation by its code, also for practice
    every = (*practice_presentations(protocol), *schedule.presentations)
    shown = {presentation.code: presentation for presentation in every}
    findings += _event_findings(protocol, shown, events, log)
    findings += time_findings(events, log)
    of = {name: needed[name] for name in ("study", "rater", "session")}
    known = calibration_hashes(study)
    for event in state.all_presented:
        code = str(event.fields["code"])
        path = study.sessions / str(event.fields["recording"])
        findings += recording_findings(path, code, shown, of, event, log, known)
    return _checked_session(study, events, state, findings, n_presentations)


def _checked_session(
    study: StudyPaths,
    events: Sequence[Event],
    state: SessionState,
    findings: Sequence[Finding],
    n_presentations: int,
) -> CheckedLog:
    rater, session = str(state.header["rater"]), str(state.header["session"])
    recordings = [
        study.sessions / str(event.fields["recording"]) for event in state.all_presented
    ]
    return CheckedLog(
        record=SessionRecord(
            session=session,
            rater=rater,
            stage="complete" if state.is_complete else "begun",
            n_presentations=n_presentations,
            n_graded=len(state.grades),
            n_skipped=len(state.skipped),
            n_corrections=sum(event.kind == "correction" for event in events),
            n_recordings=len(recordings),
            rehearsal=study.number if isinstance(study, RehearsalPaths) else None,
        ),
        findings=findings,
        log=study.log_file(rater, session),
        recordings=recordings,
    )


def _event_findings(
    protocol: Protocol,
    shown: dict[str, Presentation],
    events: Sequence[Event],
    log: Path,
) -> Iterator[Finding]:
    attempts = dict.fromkeys(shown, 0)
    # one that the protocol had once cannot be held against it
    questions: dict[tuple[object, object], Question] = {
        (questionnaire.id, question.id): question
        for questionnaire in protocol.questionnaires
        for question in questionnaire.questions
    }
    for event in events:
        fields, where = event.fields, f"line {event.line}: {event.kind}"
        code, grade = fields.get("code"), fields.get("grade")
        question = questions.get((fields.get("questionnaire"), fields.get("question")))
        answer: Any = fields.get("answer")
        if question is not None and answer is not None:
            try:
                checked_answer(question, answer, where=f"{where}: answer")
            except ParameterError as error:
                yield broken(log, str(error))
        if code is not None and code not in shown:
            yield broken(log, f"{where}: needed a code of the schedule, got {code!r}")
            continue
        needed: dict[str, object] = {}
        if "position" in fields:
            needed["position"] = shown[str(code)].position
        if event.kind in ("presented", "practised"):
            attempts[str(code)] += 1
            needed["attempt"] = attempts[str(code)]
        yield from unlike(log, f"{where}: {code}", needed, fields)
        if grade is not None and grade not in protocol.scale.grades:
            yield _off_scale(protocol, log, f"{where}: grade of {code}", grade)


def _off_scale(protocol: Protocol, log: Path, where: str, grade: object) -> Finding:
    grades = ", ".join(protocol.scale.grades)
    return broken(log, f"{where}: needed one of {grades}, got {grade!r}")


def check_training(study: StudyPaths, protocol: Protocol, log: Path) -> CheckedLog:
    """Hold a training's log against the protocol, and its recordings against it."""
    rater = log.stem
    events, _, problem = checked_log(log, _read_training)
    if problem is not None:
        return CheckedLog(
            record=SessionRecord(session="training", rater=rater, stage="unreadable"),
            findings=[problem],
            log=log,
        )
    head, of_study = events[0].fields, {"study": protocol.study.id, "rater": rater}
    findings = [*unlike(log, "line 1", of_study, head)]
    if head["presented_sha256"] != presented_hash(protocol):
        message = "is of models or settings that the protocol had before a change"
        findings.append(doubt(log, message))
    findings += _training_findings(protocol, events, log)
    findings += time_findings(events, log)
    presented = [event for event in events if event.kind == "presented"]
    recordings = [study.training / str(e.fields["recording"]) for e in presented]
    of = {**of_study, "session": "training"}
    known = calibration_hashes(study)
    for event, path in zip(presented, recordings, strict=True):
        place = event.fields["position"]
        if not isinstance(place, int):
            continue  # said of the event
        code, model = f"{place:03d}", str(event.fields["model"])
        one = Presentation(position=place, code=code, model=model, repeat=place)
        shown = {code: one}
        findings += recording_findings(path, code, shown, of, event, log, known)
    ends = [event.fields["passed"] for event in events if event.kind == "complete"]
    return CheckedLog(
        record=SessionRecord(
            session="training",
            rater=rater,
            stage="begun" if not ends else "passed" if ends[0] else "not passed",
            n_presentations=len({str(event.fields["position"]) for event in presented}),
            n_graded=sum(event.kind == "grade" for event in events),
            n_recordings=len(presented),
        ),
        findings=findings,
        log=log,
        recordings=recordings,
    )


def _read_training(log: Path) -> tuple[tuple[Event, ...], None]:
    from masrel.lab.training._lessons import check_events  # loads scipy

    events = read_log(log)
    check_events(log, events)
    return events, None


def _training_findings(
    protocol: Protocol, events: Sequence[Event], log: Path
) -> Iterator[Finding]:
    # of models that have changed since, only what does not depend on them
    intended = {model.id: model.intended_grade for model in protocol.models}
    is_same = events[0].fields["presented_sha256"] == presented_hash(protocol)
    position, attempt, model = 0, 0, None
    for event in events:
        fields, where = event.fields, f"line {event.line}: {event.kind}"
        needed: dict[str, object] = {}
        if event.kind == "presented":
            is_new = fields["position"] != position
            position, attempt = position + is_new, 1 if is_new else attempt + 1
            model = fields["model"] if is_new else model
            needed = {"position": position, "attempt": attempt, "model": model}
        elif event.kind == "grade":
            needed = {"position": position, "model": model}
            if is_same:
                needed["intended"] = intended.get(str(model))
            if is_same and fields["grade"] not in protocol.scale.grades:
                yield _off_scale(protocol, log, where, fields["grade"])
        elif event.kind == "complete":
            needed = {"n_presentations": position}
        yield from unlike(log, where, needed, fields)
