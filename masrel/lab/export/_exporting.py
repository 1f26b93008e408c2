"""Write a study in a form that others read: as a data set of BIDS, or as it is.

BIDS has behavioural data of each rater and session, recordings as physiological ones:
version 1.10.0 of the standard, https://bids-specification.readthedocs.io. RO-Crate has
the files of a study as they are, their hashes, and what made which: version 1.1 of the
standard, https://w3id.org/ro/crate/1.1.
"""

import gzip
import re
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from datetime import date
from pathlib import Path, PurePosixPath
from urllib.parse import quote

import numpy as np

import masrel
from masrel._files import write_files
from masrel._input import check_option
from masrel.errors import ParameterError
from masrel.lab._study_files import MAX_RECORDING, new_folder, read_regular, sha256_of
from masrel.lab.export._dataset import (
    MISSING,
    Dataset,
    column,
    gather_dataset,
    json_bytes,
)
from masrel.lab.protocol import Protocol, StudyPaths
from masrel.lab.recording import (
    PHASES,
    RAMPS,
    RECORDING_COLUMNS,
    Recording,
    read_recording,
)

EXPORT_FORMS = ("bids", "ro-crate")
"""Names of the forms of an export."""


def export_study(
    study: StudyPaths,
    protocol: Protocol,
    form: str,
    folder: Path,
    *,
    include: Collection[str] = (),
    day: date | None = None,
    progress: Callable[[str], object] | None = None,
) -> tuple[str, ...]:
    """Write a study in a form that archives and other programs read.

    Parameters
    ----------
    study : StudyPaths
        Where the study is; it has ratings.
    protocol : Protocol
        Its protocol.
    form : {"bids", "ro-crate"}
        A data set of BIDS, or an RO-Crate.
    folder : Path
        The folder to make; it must not exist, or be empty. It has its name once it is
        whole.
    include : collection of str
        What is private and exported all the same: ``"notes"`` on raters; ``"logs"``, in
        which people and their reasons stand; fields of raters that are not public, by
        their names; questions that are not, as ``"QUESTIONNAIRE.QUESTION"``.
    day : date, optional
        The day of the export, today unless given; an RO-Crate has it.
    progress : callable, optional
        Called with the place of each file once it is written.

    Returns
    -------
    tuple of str
        What was left out.

    Raises
    ------
    ParameterError
        If `form` or a name in `include` is unknown, the folder is there already, or ids
        cannot be told apart in the form.
    RatingsError, SessionLogError, ScheduleError
        If the study's ratings cannot be read.
    OSError
        If a file cannot be written; there is no such folder then.
    """
    check_option("form", form, EXPORT_FORMS)
    dataset = gather_dataset(study, protocol, include, day or date.today())
    files_of = _bids_files if form == "bids" else _ro_crate_files
    with new_folder(folder) as part:
        for place, content in files_of(dataset):
            # what is private stays its owner's alone until it is handed on
            write_files({part / place: content}, mode=0o600 if include else None)
            if progress is not None:
                progress(place)
    return dataset.left_out


# BIDS: a rater is a participant, a presentation one row of ``*_beh.tsv``
_BIDS_VERSION = "1.10.0"
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
_WHOLE = ("phase", "ramp", "stretch")  # columns of a recording that hold whole numbers


def _bids_files(dataset: Dataset) -> Iterator[tuple[str, bytes]]:
    protocol, ratings, raters = dataset.protocol, dataset.ratings, dataset.raters
    head = {
        "Name": protocol.study.title,
        "BIDSVersion": _BIDS_VERSION,
        "DatasetType": "raw",
        "GeneratedBy": [{"Name": "masrel", "Version": masrel.__version__}],
    }
    yield "dataset_description.json", json_bytes(head)
    yield "README.md", f"# {protocol.study.title}\n\n{dataset.description}\n".encode()
    subjects = _labels([rater.id for rater in protocol.raters])
    sessions = _labels([session.id for session in protocol.sessions])
    participants = [
        [f"sub-{subjects[row['rater']]}", *row.values()] for row in raters.rows
    ]
    yield "participants.tsv", _tsv([["participant_id", *raters.columns], *participants])
    yield "participants.json", json_bytes(raters.columns)
    task = _label(protocol.scale.name)
    task_name: dict[str, object] = {"TaskName": protocol.scale.name}
    yield f"task-{task}_beh.json", json_bytes(task_name | ratings.columns)
    for rater, subject in subjects.items():
        for session, name in sessions.items():
            rows = [
                [*row.values()]
                for row in ratings.rows
                if (row["rater"], row["session"]) == (rater, session)
            ]
            if rows:
                stem = f"sub-{subject}/ses-{name}/beh/sub-{subject}_ses-{name}"
                yield f"{stem}_task-{task}_beh.tsv", _tsv([[*ratings.columns], *rows])
    for rater, session, file in dataset.recordings:
        subject, name = subjects[rater], sessions[session]
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
    file: Path, stem: str, task_name: dict[str, object]
) -> Iterator[tuple[str, bytes]]:
    recording = read_recording(file)
    place = f"{stem}_recording-{_label(file.stem)}_physio"
    names = [*RECORDING_COLUMNS, *(channel.column for channel in recording.channels)]
    samples = "".join("\t".join(row) + "\n" for row in _sample_rows(recording, names))
    # the same bytes every time
    yield f"{place}.tsv.gz", gzip.compress(samples.encode(), 6, mtime=0)
    facts: dict[str, object] = {
        "SamplingFrequency": recording.facts["rate_hz"],
        "StartTime": 0,
        "Columns": names,
    }
    units = {
        name: next((unit for end, unit in _UNITS.items() if name.endswith(end)), "")
        for name in names
    }
    described = {
        name: column(_TITLES.get(name, "Measured beside the angle"), unit)
        for name, unit in units.items()
    }
    yield f"{place}.json", json_bytes({**facts, **task_name, **described})


def _sample_rows(recording: Recording, names: Sequence[str]) -> Iterator[list[str]]:
    # every sample as texts that give its numbers back to the last bit
    columns = [recording.columns[name].tolist() for name in names]
    whole = [name in _WHOLE for name in names]
    for row in zip(*columns, strict=True):
        yield [
            _ABSENT if np.isnan(value) else str(int(value)) if is_whole else repr(value)
            for value, is_whole in zip(row, whole, strict=True)
        ]


_CONTEXT = "https://w3id.org/ro/crate/1.1"
_MASREL = "#masrel"

_FORMATS = {
    ".csv": "text/csv",
    ".html": "text/html",
    ".json": "application/json",
    ".jsonl": "application/jsonl",
    ".md": "text/markdown",
    ".npz": "application/zip",
    ".png": "image/png",
    ".svg": "image/svg+xml",
    ".toml": "application/toml",
    ".txt": "text/plain",
}


def _ro_crate_files(dataset: Dataset) -> Iterator[tuple[str, bytes]]:
    entries: list[dict[str, object]] = []
    for place, content in _contents(dataset):
        yield place, content
        suffix = PurePosixPath(place).suffix
        entries.append(
            {
                "@id": quote(place),
                "@type": "File",
                "name": place,
                "contentSize": str(len(content)),
                "sha256": sha256_of(content),
                "encodingFormat": _FORMATS.get(suffix, "application/octet-stream"),
            }
        )
    yield "ro-crate-metadata.json", json_bytes(_metadata(dataset, entries))


def _contents(dataset: Dataset) -> Iterator[tuple[str, bytes]]:
    root = dataset.paths.root
    yield from dataset.files.items()
    yield "ratings/ratings.csv", dataset.ratings.as_csv()
    if dataset.answers is not None:
        yield "ratings/answers.csv", dataset.answers.as_csv()
    made = [*sorted(dataset.paths.schedules.glob("*.csv"))]
    made += [dataset.paths.analysis_file, *dataset.report]
    for _, _, recording in dataset.recordings:
        made += [recording, recording.with_suffix(".json")]
    for path in made:
        if path.is_file():
            content = read_regular(path, most=MAX_RECORDING)
            yield path.relative_to(root).as_posix(), content


def _metadata(dataset: Dataset, files: list[dict[str, object]]) -> dict[str, object]:
    parts = [{"@id": entry["@id"]} for entry in files]
    of_report = ("analysis.json", "report/")
    made = [part for part in parts if str(part["@id"]).startswith(of_report)]
    root: dict[str, object] = {
        "@id": "./",
        "@type": "Dataset",
        "name": dataset.protocol.study.title,
        "description": dataset.description,
        "license": "Not stated: to be added by the authors.",
        "datePublished": dataset.day.isoformat(),
        "hasPart": parts,
        "mentions": [{"@id": "#analysis"}],
    }
    run = {
        "@id": "#analysis",
        "@type": "CreateAction",
        "name": "Analysis and report by masrel",
        "instrument": {"@id": _MASREL},
        "object": [part for part in parts if part not in made],
        "result": made,
    }
    software = {
        "@id": _MASREL,
        "@type": "SoftwareApplication",
        "name": "masrel",
        "version": masrel.__version__,
    }
    descriptor = {
        "@id": "ro-crate-metadata.json",
        "@type": "CreativeWork",
        "conformsTo": {"@id": _CONTEXT},
        "about": {"@id": "./"},
    }
    terms = {"sha256": "https://w3id.org/ro/terms/workflow-run#sha256"}
    graph = [descriptor, root, run, software, *files]
    return {"@context": [f"{_CONTEXT}/context", terms], "@graph": graph}
