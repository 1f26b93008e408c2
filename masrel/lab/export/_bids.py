"""BIDS: behavioural data of each rater and session, recordings as physiological ones.

Version 1.10.0 of the standard, https://bids-specification.readthedocs.io. A rater is a
participant, a presentation one row of ``*_beh.tsv``.
"""

import re
from collections.abc import Iterator, Mapping, Sequence

import masrel
from masrel.errors import ParameterError
from masrel.lab.export._dataset import MISSING, Dataset, DataTable, Variable, json_bytes
from masrel.lab.export._samples import gzipped, sample_rows, sample_variables
from masrel.lab.recording import read_recording

_VERSION = "1.10.0"
_ABSENT = "n/a"


def bids_files(dataset: Dataset) -> Iterator[tuple[str, bytes]]:
    """Yield the files of a BIDS data set with their places."""
    protocol = dataset.protocol
    yield "dataset_description.json", json_bytes(_head(dataset))
    yield "README.md", f"# {protocol.study.title}\n\n{dataset.description}\n".encode()
    subjects = labels([rater.id for rater in protocol.raters])
    sessions = labels([session.id for session in protocol.sessions])
    yield from _participants(dataset.raters, subjects)
    task = label(protocol.scale.name)
    described = _described(dataset.ratings.variables)
    sidecar = {"TaskName": protocol.scale.name, **described}
    yield f"task-{task}_beh.json", json_bytes(sidecar)
    for rater, subject in subjects.items():
        for session, name in sessions.items():
            rows = _rows_of(dataset.ratings, rater, session)
            if rows:
                stem = f"sub-{subject}/ses-{name}/beh/sub-{subject}_ses-{name}"
                names = [variable.name for variable in dataset.ratings.variables]
                yield f"{stem}_task-{task}_beh.tsv", _tsv([names, *rows])
    for recording in dataset.recordings:
        subject, name = subjects[recording.rater], sessions[recording.session]
        stem = f"sub-{subject}/ses-{name}/beh/sub-{subject}_ses-{name}_task-{task}"
        place = f"{stem}_recording-{label(recording.name)}_physio"
        samples = read_recording(recording.path)
        variables = sample_variables(samples)
        lines = ("\t".join(r) + "\n" for r in sample_rows(samples, absent=_ABSENT))
        yield f"{place}.tsv.gz", gzipped("".join(lines))
        facts = {
            "SamplingFrequency": samples.facts["rate_hz"],
            "StartTime": 0,
            "Columns": [variable.name for variable in variables],
            "TaskName": protocol.scale.name,
        }
        yield f"{place}.json", json_bytes({**facts, **_described(variables)})
    # what masrel reads again, as it is
    yield "sourcedata/ratings/ratings.csv", dataset.ratings.as_csv()
    if dataset.answers is not None:
        yield "sourcedata/ratings/answers.csv", dataset.answers.as_csv()
        described = _described(dataset.answers.variables)
        yield "sourcedata/ratings/answers.json", json_bytes(described)
    for name, content in dataset.files.items():
        yield f"sourcedata/{name}", content


def label(text: str) -> str:
    """Return a text as a label of BIDS, which has letters and digits alone."""
    return re.sub("[^A-Za-z0-9]", "", text) or "0"


def labels(ids: Sequence[str]) -> dict[str, str]:
    """Return the label of each id; refuse ids that would have the same."""
    taken: dict[str, str] = {}
    for each in ids:
        other = taken.setdefault(label(each).lower(), each)
        if other != each:
            raise ParameterError(
                f"bids: needs ids that differ by letters and digits, got {other!r} "
                f"and {each!r}"
            )
    return {each: label(each) for each in ids}


def _head(dataset: Dataset) -> dict[str, object]:
    return {
        "Name": dataset.protocol.study.title,
        "BIDSVersion": _VERSION,
        "DatasetType": "raw",
        "GeneratedBy": [{"Name": "masrel", "Version": masrel.__version__}],
    }


def _participants(
    raters: DataTable, subjects: Mapping[str, str]
) -> Iterator[tuple[str, bytes]]:
    names = [variable.name for variable in raters.variables]
    rows = [
        [f"sub-{subjects[rater]}", *_present(row)]
        for rater, row in zip(raters.column("rater"), raters.rows, strict=True)
    ]
    yield "participants.tsv", _tsv([["participant_id", *names], *rows])
    yield "participants.json", json_bytes(_described(raters.variables))


def _described(variables: Sequence[Variable]) -> dict[str, object]:
    described: dict[str, object] = {}
    for variable in variables:
        entry: dict[str, object] = {"Description": variable.title}
        if variable.kind == "list":  # what has units is read as a number
            entry["Description"] = f"{variable.title}, {variable.unit}, with ; between"
        elif variable.unit:
            entry["Units"] = variable.unit
        if variable.levels:
            entry["Levels"] = {level: level for level in variable.levels}
        described[variable.name] = entry
    return described


def _rows_of(table: DataTable, rater: str, session: str) -> list[list[str]]:
    places = zip(table.column("rater"), table.column("session"), strict=True)
    return [
        _present(row)
        for row, place in zip(table.rows, places, strict=True)
        if place == (rater, session)
    ]


def _present(row: Sequence[str]) -> list[str]:
    return [_ABSENT if cell == MISSING else cell for cell in row]


def _tsv(rows: Sequence[Sequence[str]]) -> bytes:
    lines = ("\t".join(" ".join(cell.split()) for cell in row) for row in rows)
    return "".join(f"{line}\n" for line in lines).encode()
