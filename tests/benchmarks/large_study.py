"""A whole study of any size, made of the recordings of a few presentations."""

import dataclasses
import hashlib
import json
from pathlib import Path
from unittest import mock

from masrel.lab._event_log import SessionLog, read_log
from masrel.lab.protocol import (
    Protocol,
    StudyPaths,
    copy_template,
    presented_hash,
    protocol_hash,
    read_protocol,
)
from masrel.lab.ratings import ratings_from_logs, write_ratings
from masrel.lab.recording import read_recording, write_recording
from masrel.lab.run._simulated_raters import SimulatedGrades
from masrel.lab.run.session import run_session
from masrel.lab.schedule.presentation import read_schedule
from masrel.lab.schedule.sheets import write_schedules

PER_RATER = 16  # four models, four times each


def large_study(root: Path, n_presentations: int) -> StudyPaths:
    """Make a study of so many presentations, complete and with its ratings."""
    study = StudyPaths(root)
    copy_template("small", root)
    raters = [f"R{number}" for number in range(1, n_presentations // PER_RATER + 1)]
    rows = "\n".join(f'[[raters]]\nid = "{rater}"\n' for rater in raters)
    text = study.protocol.read_text(encoding="utf-8")
    for old, new in (
        ('[[raters]]\nid = "R1"\nnote = ""\n\n[[raters]]\nid = "R2"\n', rows),
        ('\nraters = ["R1", "R2"]', f"\nraters = {json.dumps(raters)}"),
        ("\nrepeats = 1 ", "\nrepeats = 4 "),
    ):
        assert old in text
        text = text.replace(old, new)
    study.protocol.write_text(text, encoding="utf-8")
    protocol = read_protocol(study.protocol)
    write_schedules(protocol, study)
    run_session(
        *(study, protocol, raters[0], "test"),
        grades=SimulatedGrades(protocol),
        clock="simulated",
    )
    # Syncing every event and recording is what running, not verifying, costs.
    with mock.patch("os.fsync"):
        for rater in raters[1:]:
            _write_session(study, protocol, rater)
    write_ratings(ratings_from_logs(study, protocol), study.ratings_file)
    return study


def _write_session(study: StudyPaths, protocol: Protocol, rater: str) -> None:
    # of another rater, by the log and the recordings of the first
    first = protocol.raters[0].id
    events = read_log(study.log_file(first, "test"))
    presented = [event.fields for event in events if event.kind == "presented"]
    grades = [event.fields for event in events if event.kind == "grade"]
    file = study.schedule_file(rater, "test")
    schedule = read_schedule(file)
    head = {
        **events[0].fields,
        "rater": rater,
        "schedule_sha256": hashlib.sha256(file.read_bytes()).hexdigest(),
        "presented_sha256": presented_hash(protocol),
        "protocol_sha256": protocol_hash(protocol),
    }
    with SessionLog.open(study.log_file(rater, "test")) as log:
        log.append("session", head)
        for shown, fields, grade in zip(
            schedule.presentations, presented, grades, strict=True
        ):
            where = {"code": shown.code, "position": shown.position}
            recording = read_recording(study.sessions / str(fields["recording"]))
            path = study.log_file(rater, "test").with_suffix("") / f"{shown.code}.npz"
            facts = {
                **recording.facts,
                **where,
                **{"rater": rater, "model": shown.model, "repeat": shown.repeat},
            }
            checksum = write_recording(
                dataclasses.replace(recording, facts=facts), path
            )
            of_facts = path.with_suffix(".json").read_bytes()
            new = {
                **where,
                "recording": path.relative_to(study.sessions).as_posix(),
                "sha256": checksum,
                "facts_sha256": hashlib.sha256(of_facts).hexdigest(),
            }
            log.append("presented", {**fields, **new})
            log.append("grade", {**grade, **where})
        log.append("complete", {"n_presentations": len(schedule.presentations)})
