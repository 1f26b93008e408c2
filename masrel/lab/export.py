"""Write a study in a form that others read: as a data set of BIDS, or as it is.

BIDS has behavioural data of each rater and session, recordings as physiological ones:
version 1.10.0 of the standard, https://bids-specification.readthedocs.io. RO-Crate has
the files of a study as they are, their hashes, and what made which: version 1.1 of the
standard, https://w3id.org/ro/crate/1.1.
"""

import csv
import gzip
import json
import re
import tomllib
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass
from datetime import date
from itertools import dropwhile
from pathlib import Path, PurePosixPath
from typing import Any
from urllib.parse import quote

import numpy as np

import masrel
from masrel._files import write_files
from masrel._input import check_option, listed
from masrel.errors import ParameterError
from masrel.lab._event_log import read_log
from masrel.lab._study_files import (
    CUT_OFF,
    MANIFEST,
    MAX_RECORDING,
    MAX_SMALL,
    csv_text,
    is_cut_off,
    new_folder,
    parse_json,
    read_regular,
    sha256_of,
    toml_lines,
)
from masrel.lab.progress import raters_csv
from masrel.lab.protocol import Protocol, StudyPaths
from masrel.lab.ratings import (
    Ratings,
    StudyData,
    answers_csv,
    ratings_csv,
    read_study_data,
)
from masrel.lab.recording import (
    PHASES,
    RAMPS,
    RECORDING_COLUMNS,
    Recording,
    read_recording,
)

__all__ = ["EXPORT_FORMS", "export_study"]

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
    dataset = _gather_dataset(study, protocol, include, day or date.today())
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
_MISSING = "NA"  # as tables of masrel show a missing value

_Column = dict[str, object]  # what a column of a table is, by the keys of BIDS


def _column(title: str, unit: str = "", levels: Collection[str] = ()) -> _Column:
    """Describe a column; `levels` are the texts that it may have, in order."""
    described: _Column = {"Description": title}
    if unit:
        described["Units"] = unit
    if levels:
        described["Levels"] = {level: level for level in levels}
    return described


@dataclass(frozen=True, slots=True, kw_only=True)
class _DataTable:
    """A table as texts."""

    # both by the names of columns, in their order
    columns: dict[str, _Column]
    rows: list[dict[str, str]]

    def as_csv(self) -> bytes:
        """Return the table as CSV, names of columns in its first line."""
        rows = ([row[name] for name in self.columns] for row in self.rows)
        return csv_text([self.columns, *rows]).encode()


def _json_bytes(document: object) -> bytes:
    """Return a document as the bytes of a JSON file."""
    return (json.dumps(document, indent=1, ensure_ascii=False) + "\n").encode()


@dataclass(frozen=True, slots=True, kw_only=True)
class _Dataset:
    """Everything of a study that is exported."""

    paths: StudyPaths
    protocol: Protocol
    ratings: _DataTable
    raters: _DataTable
    answers: _DataTable | None  # None where nothing is asked, or may leave
    # raters, sessions and files, whose stems are codes, with the attempt of several
    recordings: list[tuple[str, str, Path]]
    # files of the study by their place in it, as they leave it
    files: dict[str, bytes]
    # those of the report, where it shows nothing that may not leave
    report: list[Path]
    description: str
    day: date  # of the export
    left_out: tuple[str, ...]


def _gather_dataset(
    paths: StudyPaths, protocol: Protocol, include: Collection[str], day: date
) -> _Dataset:
    """Read everything of a study that is exported; `include` names what is private."""
    # questions by questionnaire and question, with a dot between
    questions = {
        f"{questionnaire.id}.{question.id}": question
        for questionnaire in protocol.questionnaires
        for question in questionnaire.questions
    }
    fields = [name for name, field in protocol.rater_fields.items() if not field.public]
    private = [*fields, *(name for name in questions if not questions[name].public)]
    for name in include:
        check_option("include", name, ("notes", "logs", *private))
    hidden = [name for name in private if name not in include]
    data = read_study_data(paths, protocol)
    text, left_out = _protocol_text(paths, hidden, has_notes="notes" in include)
    left_out += [f"answers to {name} ({name})" for name in hidden if name in questions]
    files = {"protocol.toml": text}
    if data.in_person is not None:
        files["ratings/in_person.csv"] = _bytes(paths.in_person_file)
    logs = [*paths.conduct_logs(), *paths.logs()]
    # who is excluded is not known without the logs
    excluded = () if "logs" in include else data.excluded
    if "logs" in include:
        files |= {log.relative_to(paths.root).as_posix(): _bytes(log) for log in logs}
    elif logs:
        left_out.append(f"{len(logs)} logs, which name who did what and why (logs)")
    if excluded:
        left_out.append(f"ratings of {listed(excluded)}, who are excluded (logs)")
    shown = [name for name in _shown_in_report(paths) if name not in include]
    if shown:
        left_out.append(f"the report, which shows what is private ({listed(shown)})")
    answers = tuple(
        each
        for each in data.answers
        if each.rater not in excluded
        and f"{each.questionnaire}.{each.question}" not in hidden
    )
    return _Dataset(
        paths=paths,
        protocol=protocol,
        ratings=_ratings_table(protocol, data.ratings, excluded),
        raters=_raters_table(paths, protocol, hidden),
        answers=_DataTable(columns=_OF_ANSWERS, rows=[*_records(answers_csv(answers))])
        if answers
        else None,
        recordings=[
            each for each in _recordings(paths, protocol) if each[0] not in excluded
        ],
        files=files,
        report=[] if shown else sorted(paths.report.rglob("*")),
        description=_description(data),
        day=day,
        left_out=tuple(left_out),
    )


def _shown_in_report(paths: StudyPaths) -> list[str]:
    # what a report names though it is private, by the names of an export
    manifest = paths.report / MANIFEST
    if is_cut_off(paths.report):
        raise ParameterError(f"{paths.report}: {CUT_OFF}")
    if not manifest.is_file():
        return []
    try:
        shown = str(parse_json(_bytes(manifest))["inputs"].get("include", ""))
    except (ValueError, TypeError, KeyError, AttributeError):
        raise ParameterError(
            f"{manifest}: needed the manifest of a report, got another file; masrel "
            "report writes it again"
        ) from None
    in_logs = {"who": "logs", "notes": "logs"}
    return sorted({in_logs.get(name, name) for name in shown.split()})


def _bytes(path: Path) -> bytes:
    return read_regular(path, most=MAX_SMALL)


def _protocol_text(
    paths: StudyPaths, hidden: Sequence[str], *, has_notes: bool
) -> tuple[bytes, list[str]]:
    # the protocol without what is private, and what that was
    text = _bytes(paths.protocol)
    document: dict[str, Any] = tomllib.loads(text.decode())
    fields = [name for name in document.get("rater_fields", {}) if name in hidden]
    n_notes = n_values = 0
    for rater in document["raters"]:
        if not has_notes and rater.pop("note", ""):
            n_notes += 1
        for name in fields:
            n_values += rater.get("fields", {}).pop(name, None) is not None
    left_out = [f"the field {name} of raters ({name})" for name in fields]
    if n_notes:
        left_out.append(f"notes on {n_notes} raters in the protocol (notes)")
    if not n_notes and not n_values:
        return text, left_out
    return "\n".join((*toml_lines(document), "")).encode(), left_out


_MODEL = "Haptic model that was presented"
_OF_RATINGS = {
    "session": _column("Session"),
    "rater": _column("Rater"),
    "model": _column(_MODEL),
    "repeat": _column("Which presentation of the model in the session"),
    "grade": _column("Grade"),
    "mean_speed_deg_s": _column("Mean speed before the catch", "deg/s"),
    "source": _column("Where the rating comes from"),
    "n_stretches": _column("Stretches before the grade"),
    "min_speed_deg_s": _column("Mean speed of the slowest stretch", "deg/s"),
    "max_speed_deg_s": _column("Mean speed of the fastest stretch", "deg/s"),
    # what has units is read as a number
    "speeds_deg_s": _column("Mean speed of each stretch, deg/s, with ; between"),
    "graded_stretch": _column("Stretch on which the grade rests"),
    "felt": _column("Whether what the model has could be felt"),
    "grades_from": _column("Where the grade comes from"),
    "device": _column("Device that presented the model"),
    "position": _column("Place of the presentation in the session"),
    "code": _column("Blinded code by which the rater knew it"),
    "n_attempts": _column("How often it was presented"),
    "first_grade": _column("Grade as the rater gave it, before corrections"),
    "graded_at": _column("When the first grade was given, UTC"),
    "grip_lost": _column("Whether the arm came loose and the model let go"),
}


def _ratings_table(
    protocol: Protocol, ratings: Ratings, excluded: Collection[str]
) -> _DataTable:
    rows = _records(ratings_csv(ratings))
    models = _column(_MODEL, levels=[model.id for model in protocol.models])
    described = _OF_RATINGS | {
        "model": models,
        "grade": _column("Grade", levels=protocol.scale.grades),
    }
    return _DataTable(
        columns={name: described[name] for name in rows.fieldnames or ()},
        rows=[row for row in rows if row["rater"] not in excluded],
    )


def _records(text: str) -> "csv.DictReader[str]":
    # those of a table of masrel, without the comments above it; a line of an answer may
    # begin as they do
    lines = text.splitlines(keepends=True)
    return csv.DictReader(dropwhile(lambda line: line.startswith("#"), lines))


_OF_RATERS = {
    "rater": _column("Rater"),
    "site": _column("Site"),
    "status": _column("What became of the rater in the study"),
    "late": _column("Joined after the first draw", levels=("yes", "no")),
}


def _raters_table(
    paths: StudyPaths, protocol: Protocol, hidden: Collection[str]
) -> _DataTable:
    rows = _records(raters_csv(paths, protocol))
    # of ratings that were published nobody knows how they came about
    known = [*_OF_RATERS] if paths.logs() else ["rater", "site"]
    described = {name: _OF_RATERS[name] for name in known}
    described |= {
        name: _column(field.title or name, field.unit, field.choices)
        for name, field in protocol.rater_fields.items()
        if name not in hidden
    }
    return _DataTable(
        columns=described,
        rows=[{name: row[name] for name in described} for row in rows],
    )


_OF_ANSWERS = {
    "session": _column("Session; empty for a question about the study"),
    "rater": _column("Rater; empty where it is not known whose answer it is"),
    "questionnaire": _column("Questionnaire"),
    "question": _column("Question"),
    "model": _column("Haptic model that the question was about"),
    "repeat": _column("Which presentation of the model"),
    "answer": _column("Answer"),
    "grades_from": _column("Where the answer comes from"),
}


def _recordings(
    paths: StudyPaths, protocol: Protocol
) -> Iterator[tuple[str, str, Path]]:
    # those that a log names, in its order
    for rater, session in protocol.rater_sessions:
        log = paths.log_file(rater, session)
        for event in read_log(log) if log.is_file() else ():
            if event.kind == "presented":
                path = paths.sessions / str(event.fields["recording"])
                if path.is_file():
                    yield rater, session, path


def _description(data: StudyData) -> str:
    protocol = data.protocol
    sentences = [f"{protocol.study.title}."]
    if protocol.study.source:
        sentences.append(f"Source: {protocol.study.source}.")
    grades = ", ".join(protocol.scale.grades)
    sentences.append(f"Scale {protocol.scale.name}: {grades}.")
    sentences += [f"{change}." for change in data.changes]
    return " ".join(filter(None, [*sentences, data.ratings.simulated_counts]))


def _bids_files(dataset: _Dataset) -> Iterator[tuple[str, bytes]]:
    protocol, ratings, raters = dataset.protocol, dataset.ratings, dataset.raters
    head = {
        "Name": protocol.study.title,
        "BIDSVersion": _BIDS_VERSION,
        "DatasetType": "raw",
        "GeneratedBy": [{"Name": "masrel", "Version": masrel.__version__}],
    }
    yield "dataset_description.json", _json_bytes(head)
    yield "README.md", f"# {protocol.study.title}\n\n{dataset.description}\n".encode()
    subjects = _labels([rater.id for rater in protocol.raters])
    sessions = _labels([session.id for session in protocol.sessions])
    participants = [
        [f"sub-{subjects[row['rater']]}", *row.values()] for row in raters.rows
    ]
    yield "participants.tsv", _tsv([["participant_id", *raters.columns], *participants])
    yield "participants.json", _json_bytes(raters.columns)
    task = _label(protocol.scale.name)
    task_name: dict[str, object] = {"TaskName": protocol.scale.name}
    yield f"task-{task}_beh.json", _json_bytes(task_name | ratings.columns)
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
        yield "sourcedata/ratings/answers.json", _json_bytes(dataset.answers.columns)
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
            _ABSENT if cell == _MISSING else " ".join(cell.split()) for cell in row
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
        name: _column(_TITLES.get(name, "Measured beside the angle"), unit)
        for name, unit in units.items()
    }
    yield f"{place}.json", _json_bytes({**facts, **task_name, **described})


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


def _ro_crate_files(dataset: _Dataset) -> Iterator[tuple[str, bytes]]:
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
    yield "ro-crate-metadata.json", _json_bytes(_metadata(dataset, entries))


def _contents(dataset: _Dataset) -> Iterator[tuple[str, bytes]]:
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


def _metadata(dataset: _Dataset, files: list[dict[str, object]]) -> dict[str, object]:
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
