"""Logs of trainings, what they say happened, and the recordings they name."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from masrel.lab._event_log import Event, read_log
from masrel.lab.protocol import Protocol, StudyPaths, presented_hash
from masrel.lab.schedule import Presentation
from masrel.lab.verification._finding import Finding, broken, doubt
from masrel.lab.verification._log_findings import (
    checked_log,
    recording_findings,
    time_findings,
)

_Stage = Literal["begun", "passed", "not passed", "unreadable"]


@dataclass(frozen=True, slots=True, kw_only=True)
class VerifiedTraining:
    """One rater's training, as its log has it.

    Attributes
    ----------
    rater : str
        Whose training.
    stage : {"begun", "passed", "not passed", "unreadable"}
        How far it came.
    n_graded, n_recordings : int
        Presentations with a grade, and recordings that the log names.
    """

    rater: str
    stage: _Stage
    n_graded: int = 0
    n_recordings: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class CheckedTraining:
    """A training, what is wrong with it, and the files it speaks for."""

    record: VerifiedTraining
    findings: tuple[Finding, ...]
    files: frozenset[Path]


def _read_training(log: Path) -> tuple[tuple[Event, ...], None]:
    from masrel.lab.training._lessons import check_events  # loads scipy

    events = read_log(log)
    check_events(log, events)
    return events, None


def check_training(study: StudyPaths, protocol: Protocol, log: Path) -> CheckedTraining:
    """Hold a training's log against the protocol, and its recordings against it."""
    rater = log.stem
    events, _, finding = checked_log(log, _read_training)
    if finding is not None:
        return CheckedTraining(
            record=VerifiedTraining(rater=rater, stage="unreadable"),
            findings=(finding,),
            files=frozenset([log]),
        )
    presented = [event for event in events if event.kind == "presented"]
    recordings = [study.training / str(e.fields["recording"]) for e in presented]
    findings = [
        *_head_findings(protocol, events[0], log),
        *_event_findings(protocol, events, log),
        *time_findings(events, log),
    ]
    for event, recording in zip(presented, recordings, strict=True):
        findings += _recording_findings(protocol, log, event, recording)
    record = VerifiedTraining(
        rater=rater,
        stage=_stage(events),
        n_graded=sum(event.kind == "grade" for event in events),
        n_recordings=len(presented),
    )
    facts = (recording.with_suffix(".json") for recording in recordings)
    files = frozenset([log, *recordings, *facts])
    return CheckedTraining(record=record, findings=tuple(findings), files=files)


def _stage(events: Sequence[Event]) -> _Stage:
    for event in events:
        if event.kind == "complete":
            return "passed" if event.fields["passed"] else "not passed"
    return "begun"


def _head_findings(protocol: Protocol, head: Event, log: Path) -> Iterator[Finding]:
    for name, value in {"study": protocol.study.id, "rater": log.stem}.items():
        if head.fields[name] != value:
            yield broken(
                log, f"line 1: {name}: needed {value}, got {head.fields[name]!r}"
            )
    if head.fields["presented_sha256"] != presented_hash(protocol):
        yield doubt(
            log, "is of models or settings that the protocol had before a change"
        )


def _event_findings(
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
                grades = ", ".join(protocol.scale.grades)
                yield broken(
                    log, f"{where}: needed one of {grades}, got {fields['grade']!r}"
                )
        elif event.kind == "complete":
            needed = {"n_presentations": position}
        for name, value in needed.items():
            if fields[name] != value:
                yield broken(
                    log, f"{where}: {name}: needed {value}, got {fields[name]!r}"
                )


def _recording_findings(
    protocol: Protocol, log: Path, event: Event, path: Path
) -> Iterator[Finding]:
    fields, where = event.fields, f"line {event.line} of {log}"
    position, attempt = fields["position"], fields["attempt"]
    if not isinstance(position, int):
        return  # said of the event
    code = f"{position:03d}"
    name = code if attempt == 1 else f"{code}-{attempt}"
    if path != log.with_suffix("") / f"{name}.npz":
        yield broken(log, f"line {event.line}: {path} is not where {name} is recorded")
        return
    shown = Presentation(
        position=position, code=code, model=str(fields["model"]), repeat=position
    )
    of = {"study": protocol.study.id, "rater": log.stem, "session": "training"}
    yield from recording_findings(path, shown, of, event, where)
