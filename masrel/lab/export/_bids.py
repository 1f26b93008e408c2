"""BIDS: behavioural data of each rater and session, recordings as physiological ones.

Version 1.10.0 of the standard, https://bids-specification.readthedocs.io. A rater is a
participant, a presentation one row of ``*_beh.tsv``.
"""

import gzip
import re
from collections.abc import Iterable, Iterator, Sequence

import numpy as np

import masrel
from masrel.errors import ParameterError
from masrel.lab.export._dataset import (
    MISSING,
    Column,
    Dataset,
    RecordingFile,
    column,
    json_bytes,
)
from masrel.lab.recording import (
    PHASES,
    RAMPS,
    RECORDING_COLUMNS,
    Recording,
    read_recording,
)

_VERSION = "1.10.0"
_ABSENT = "n/a"

_TITLES = {
    "time_s": "Time since the presentation began",
    "angle_deg": "Angle of the elbow, 0 in full flexion",
    "velocity_deg_s": "Angular velocity, as the controller estimates it",
    "model_torque_nm": "Torque that the model asks for",
    "command_torque_nm": "Torque that was commanded",
    "phase": "Phase: " + ", ".join(f"{i} {name}" for i, name in enumerate(PHASES)),
    "ramp": "Why the torque is not the law's: "
    + ", ".join(f"{i} {name}" for i, name in enumerate(RAMPS)),
    "stretch": "Stretch that goes on, 0 before, between and after",
}
_UNITS = {"_deg_s": "deg/s", "_deg": "deg", "_nm": "N*m", "_mv": "mV", "_s": "s"}
_WHOLE = ("phase", "ramp", "stretch")
"""Columns of a recording that hold whole numbers."""


def bids_files(dataset: Dataset) -> Iterator[tuple[str, bytes]]:
    """Yield the files of a BIDS data set with their places."""
    protocol, ratings, raters = dataset.protocol, dataset.ratings, dataset.raters
    head = {
        "Name": protocol.study.title,
        "BIDSVersion": _VERSION,
        "DatasetType": "raw",
        "GeneratedBy": [{"Name": "masrel", "Version": masrel.__version__}],
    }
    yield "dataset_description.json", json_bytes(head)
    yield "README.md", f"# {protocol.study.title}\n\n{dataset.description}\n".encode()
    subjects = _labels([rater.id for rater in protocol.raters])
    sessions = _labels([session.id for session in protocol.sessions])
    participants = [
        [f"sub-{subjects[rater]}", *row]
        for rater, row in zip(raters.cells("rater"), raters.rows, strict=True)
    ]
    yield "participants.tsv", _tsv([["participant_id", *raters.columns], *participants])
    yield "participants.json", json_bytes(raters.columns)
    task = _label(protocol.scale.name)
    task_name: dict[str, object] = {"TaskName": protocol.scale.name}
    yield f"task-{task}_beh.json", json_bytes(task_name | ratings.columns)
    of_rows = [*zip(ratings.cells("rater"), ratings.cells("session"), strict=True)]
    for rater, subject in subjects.items():
        for session, name in sessions.items():
            of_both = zip(of_rows, ratings.rows, strict=True)
            rows = [row for place, row in of_both if place == (rater, session)]
            if rows:
                stem = f"sub-{subject}/ses-{name}/beh/sub-{subject}_ses-{name}"
                yield f"{stem}_task-{task}_beh.tsv", _tsv([[*ratings.columns], *rows])
    for file in dataset.recordings:
        subject, name = subjects[file.rater], sessions[file.session]
        stem = f"sub-{subject}/ses-{name}/beh/sub-{subject}_ses-{name}_task-{task}"
        yield from _recording_files(file, stem, task_name)
    # what masrel reads again, as it is
    yield "sourcedata/ratings/ratings.csv", ratings.as_csv()
    if dataset.answers is not None:
        yield "sourcedata/ratings/answers.csv", dataset.answers.as_csv()
        yield "sourcedata/ratings/answers.json", json_bytes(dataset.answers.columns)
    for name, content in dataset.files.items():
        yield f"sourcedata/{name}", content


def _label(text: str) -> str:
    # of BIDS, which has letters and digits alone
    return re.sub("[^A-Za-z0-9]", "", text) or "0"


def _labels(ids: Sequence[str]) -> dict[str, str]:
    # the label of each id; ids that would have the same are refused
    taken: dict[str, str] = {}
    for each in ids:
        other = taken.setdefault(_label(each).lower(), each)
        if other != each:
            raise ParameterError(
                f"bids: needs ids that differ by letters and digits, got {other!r} "
                f"and {each!r}"
            )
    return {each: _label(each) for each in ids}


def _tsv(rows: Iterable[Sequence[str]]) -> bytes:
    lines = (
        "\t".join(
            _ABSENT if cell == MISSING else " ".join(cell.split()) for cell in row
        )
        for row in rows
    )
    return "".join(f"{line}\n" for line in lines).encode()


def _recording_files(
    file: RecordingFile, stem: str, task_name: dict[str, object]
) -> Iterator[tuple[str, bytes]]:
    recording = read_recording(file.path)
    place = f"{stem}_recording-{_label(file.path.stem)}_physio"
    names = [*RECORDING_COLUMNS, *(channel.column for channel in recording.channels)]
    samples = "".join("\t".join(row) + "\n" for row in _sample_rows(recording, names))
    # the same bytes every time
    yield f"{place}.tsv.gz", gzip.compress(samples.encode(), 6, mtime=0)
    facts: dict[str, object] = {
        "SamplingFrequency": recording.facts["rate_hz"],
        "StartTime": 0,
        "Columns": names,
    }
    described = {name: _sample_column(name) for name in names}
    yield f"{place}.json", json_bytes({**facts, **task_name, **described})


def _sample_column(name: str) -> Column:
    unit = next((unit for end, unit in _UNITS.items() if name.endswith(end)), "")
    return column(_TITLES.get(name, "Measured beside the angle"), unit)


def _sample_rows(recording: Recording, names: Sequence[str]) -> Iterator[list[str]]:
    # every sample as texts that give its numbers back to the last bit
    columns = [recording.columns[name].tolist() for name in names]
    whole = [name in _WHOLE for name in names]
    for row in zip(*columns, strict=True):
        yield [
            _ABSENT if np.isnan(value) else str(int(value)) if is_whole else repr(value)
            for value, is_whole in zip(row, whole, strict=True)
        ]
