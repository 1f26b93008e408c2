"""What leaves a study: tables with described variables, recordings, files as they are.

Every format is written from this one description.
"""

import csv
import io
import json
import tomllib
from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass
from datetime import date
from importlib import import_module
from pathlib import Path
from typing import Any, Literal

from masrel._input import listed
from masrel.errors import ParameterError
from masrel.lab._bounded_files import MAX_SMALL, parse_json, read_regular
from masrel.lab.progress import rater_progress, raters_csv, session_progress
from masrel.lab.protocol import Protocol, Question, StudyPaths
from masrel.lab.ratings import (
    Ratings,
    StudyData,
    answers_csv,
    answers_of,
    ratings_csv,
    read_study_data,
)
from masrel.lab.run import read_log

Kind = Literal["text", "whole", "number", "list"]
"""What a cell holds; a list is numbers with semicolons between them."""

MISSING = "NA"
"""What stands for a missing value in tables of masrel."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Variable:
    """One column of a table."""

    name: str
    title: str
    kind: Kind = "text"
    unit: str = ""
    levels: tuple[str, ...] = ()  # the texts that it may have, in order


@dataclass(frozen=True, slots=True, kw_only=True)
class DataTable:
    """A table as texts."""

    name: str
    title: str
    variables: tuple[Variable, ...]
    rows: tuple[tuple[str, ...], ...]
    keys: tuple[str, ...]  # variables that together name a row
    nothing: str = MISSING  # what stands where there is nothing

    def column(self, name: str) -> tuple[str, ...]:
        """Return the cells of a column."""
        place = [variable.name for variable in self.variables].index(name)
        return tuple(row[place] for row in self.rows)

    def as_csv(self) -> bytes:
        """Return the table as CSV, names of variables in its first line."""
        return csv_bytes([[v.name for v in self.variables], *self.rows])


def csv_bytes(rows: Iterable[Sequence[str]]) -> bytes:
    """Return rows of texts as CSV."""
    out = io.StringIO(newline="")
    csv.writer(out, lineterminator="\n").writerows(rows)
    return out.getvalue().encode()


def json_bytes(document: object) -> bytes:
    """Return a document as the bytes of a JSON file."""
    return (json.dumps(document, indent=1, ensure_ascii=False) + "\n").encode()


@dataclass(frozen=True, slots=True, kw_only=True)
class RecordingFile:
    """The recording of one presentation, and what it is of."""

    rater: str
    session: str
    name: str  # its code, with the attempt where there were several
    path: Path


@dataclass(frozen=True, slots=True, kw_only=True)
class Dataset:
    """Everything of a study that is exported."""

    paths: StudyPaths
    protocol: Protocol
    ratings: DataTable
    raters: DataTable
    answers: DataTable | None  # None where nothing is asked, or may leave
    recordings: tuple[RecordingFile, ...]
    # files of the study by their place in it, as they leave it
    files: dict[str, bytes]
    # those of the report, where it shows nothing that may not leave
    report: tuple[Path, ...]
    description: str
    day: date  # of the export
    left_out: tuple[str, ...]

    @property
    def tables(self) -> tuple[DataTable, ...]:
        """The tables."""
        answers = () if self.answers is None else (self.answers,)
        return (self.ratings, self.raters, *answers)


def gather_dataset(
    paths: StudyPaths, protocol: Protocol, include: Collection[str], day: date
) -> Dataset:
    """Read everything of a study that is exported; `include` names what is private."""
    _check_names(protocol, include)
    data = read_study_data(paths, protocol)
    fields = [
        name
        for name, field in protocol.rater_fields.items()
        if field.public or name in include
    ]
    text, left_out = _protocol_text(paths, protocol, fields, "notes" in include)
    questions = [
        name
        for name, question in _questions(protocol).items()
        if question.public or name in include
    ]
    left_out += tuple(
        f"answers to {name} ({name})"
        for name in _questions(protocol)
        if name not in questions
    )
    files = {"protocol.toml": text}
    if data.in_person is not None:
        files["ratings/in_person.csv"] = _bytes(paths.in_person_file)
    logs = [*paths.conduct_logs(), *paths.logs()]
    # who is excluded is not known without the logs
    excluded = () if "logs" in include else data.excluded
    if "logs" in include:
        files |= {log.relative_to(paths.root).as_posix(): _bytes(log) for log in logs}
    elif logs:
        left_out += (f"{len(logs)} logs, which name who did what and why (logs)",)
    if excluded:
        left_out += (f"ratings of {listed(excluded)}, who are excluded (logs)",)
    shown = [name for name in _shown_in_report(paths) if name not in include]
    if shown:
        left_out += (f"the report, which shows what is private ({listed(shown)})",)
    return Dataset(
        paths=paths,
        protocol=protocol,
        ratings=_ratings_table(protocol, data.ratings, excluded),
        raters=_raters_table(paths, protocol, fields),
        answers=_answers_table(data, questions, excluded),
        recordings=tuple(
            recording
            for recording in _recordings(paths, protocol)
            if recording.rater not in excluded
        ),
        files=files,
        report=() if shown else tuple(sorted(paths.report.rglob("*"))),
        description=_description(protocol, data.ratings),
        day=day,
        left_out=left_out,
    )


_PRIVATE = ("notes", "logs")
"""What is private in every study."""


def _check_names(protocol: Protocol, include: Collection[str]) -> None:
    fields = [name for name, field in protocol.rater_fields.items() if not field.public]
    questions = [name for name, each in _questions(protocol).items() if not each.public]
    known = (*_PRIVATE, *fields, *questions)
    for name in include:
        if name not in known:
            raise ParameterError(
                f"include: needed one of {', '.join(known)}, got {name!r}"
            )


def _questions(protocol: Protocol) -> dict[str, Question]:
    # by questionnaire and question, with a dot between
    return {
        f"{questionnaire.id}.{question.id}": question
        for questionnaire in protocol.questionnaires
        for question in questionnaire.questions
    }


def _shown_in_report(paths: StudyPaths) -> list[str]:
    # what a report names though it is private, by the names of an export
    manifest = paths.report / "manifest.json"
    if not manifest.is_file():
        return []
    try:
        shown = str(parse_json(_bytes(manifest))["inputs"].get("include", ""))
    except (ValueError, TypeError, KeyError, AttributeError):
        raise ParameterError(
            f"{manifest}: needed the manifest of a report, got another file; masrel "
            "report writes it anew"
        ) from None
    in_logs = {"who": "logs", "notes": "logs"}
    return sorted({in_logs.get(name, name) for name in shown.split()})


def _bytes(path: Path) -> bytes:
    return read_regular(path, most=MAX_SMALL)


def _protocol_text(
    paths: StudyPaths, protocol: Protocol, fields: Sequence[str], has_notes: bool
) -> tuple[bytes, tuple[str, ...]]:
    # the protocol without what is private, and what that was
    text = _bytes(paths.protocol)
    document: dict[str, Any] = tomllib.loads(text.decode())
    hidden = [name for name in protocol.rater_fields if name not in fields]
    n_notes = n_values = 0
    for rater in document["raters"]:
        if not has_notes and rater.pop("note", ""):
            n_notes += 1
        for name in hidden:
            n_values += rater.get("fields", {}).pop(name, None) is not None
    left_out = [f"the field {name} of raters ({name})" for name in hidden]
    if n_notes:
        left_out.append(f"notes on {n_notes} raters in the protocol (notes)")
    if n_notes or n_values:
        text = _toml(document).encode()
    return text, tuple(left_out)


def _toml(document: dict[str, Any]) -> str:
    try:
        tomli_w = import_module("tomli_w")
    except ModuleNotFoundError as error:
        raise ParameterError(
            "export: leaving what is private out of a protocol needs tomli-w; install "
            "it with: pip install 'masrel[export]', or keep it by --include"
        ) from error
    text: str = tomli_w.dumps(document)
    return text


_OF_RATINGS: dict[str, tuple[str, Kind, str]] = {
    "session": ("Session", "text", ""),
    "rater": ("Rater", "text", ""),
    "model": ("Haptic model that was presented", "text", ""),
    "repeat": ("Which presentation of the model in the session", "whole", ""),
    "grade": ("Grade", "text", ""),
    "mean_speed_deg_s": ("Mean speed before the catch", "number", "deg/s"),
    "source": ("Where the rating comes from", "text", ""),
    "n_stretches": ("Stretches before the grade", "whole", ""),
    "min_speed_deg_s": ("Mean speed of the slowest stretch", "number", "deg/s"),
    "max_speed_deg_s": ("Mean speed of the fastest stretch", "number", "deg/s"),
    "speeds_deg_s": ("Mean speed of each stretch", "list", "deg/s"),
    "graded_stretch": ("Stretch on which the grade rests", "whole", ""),
    "felt": ("Whether what the model has could be felt", "text", ""),
    "grades_from": ("Where the grade comes from", "text", ""),
    "device": ("Device that presented the model", "text", ""),
    "position": ("Place of the presentation in the session", "whole", ""),
    "code": ("Blinded code by which the rater knew it", "text", ""),
    "n_attempts": ("How often it was presented", "whole", ""),
    "first_grade": ("Grade as the rater gave it, before corrections", "text", ""),
    "graded_at": ("When the first grade was given, UTC", "text", ""),
    "grip_lost": ("Whether the arm came loose and the model let go", "text", ""),
}


def _ratings_table(
    protocol: Protocol, ratings: Ratings, excluded: Collection[str]
) -> DataTable:
    names, *rows = _records(ratings_csv(ratings))
    rater = names.index("rater")
    levels = {
        "grade": protocol.scale.grades,
        "model": tuple(model.id for model in protocol.models),
    }
    return DataTable(
        name="ratings",
        title="Ratings, one row a rating",
        variables=tuple(
            Variable(
                name=name,
                title=_OF_RATINGS[name][0],
                kind=_OF_RATINGS[name][1],
                unit=_OF_RATINGS[name][2],
                levels=levels.get(name, ()),
            )
            for name in names
        ),
        rows=tuple(tuple(row) for row in rows if row[rater] not in excluded),
        keys=("session", "rater", "model", "repeat"),
    )


def _records(text: str) -> list[list[str]]:
    # those of a table of masrel, without the comments above it
    lines = text.splitlines(keepends=True)
    body = "".join(line for line in lines if not line.startswith("#"))
    return list(csv.reader(io.StringIO(body)))


_KINDS: dict[str, Kind] = {"whole": "whole", "number": "number"}


_OF_RATERS = {
    "rater": Variable(name="rater", title="Rater"),
    "site": Variable(name="site", title="Site"),
    "status": Variable(name="status", title="What became of the rater in the study"),
    "late": Variable(
        name="late", title="Joined after the first draw", levels=("yes", "no")
    ),
}


def _raters_table(
    paths: StudyPaths, protocol: Protocol, fields: Sequence[str]
) -> DataTable:
    sessions = session_progress(paths, protocol)
    raters = rater_progress(paths, protocol, sessions)
    names, *rows = _records(raters_csv(raters, protocol, simulated=False))
    # of ratings that were published nobody knows how they came about
    known = [*_OF_RATERS] if paths.logs() else ["rater", "site"]
    places = [i for i, name in enumerate(names) if name in (*known, *fields)]
    return DataTable(
        name="raters",
        title="Raters",
        variables=tuple(
            _OF_RATERS.get(names[i]) or _field_variable(protocol, names[i])
            for i in places
        ),
        rows=tuple(tuple(row[i] for i in places) for row in rows),
        keys=("rater",),
    )


def _field_variable(protocol: Protocol, name: str) -> Variable:
    field = protocol.rater_fields[name]
    return Variable(
        name=name,
        title=field.title or name,
        kind=_KINDS.get(field.type, "text"),
        unit=field.unit,
        levels=field.choices,
    )


_OF_ANSWERS = {
    "session": "Session; empty for a question about the study",
    "rater": "Rater; empty where it is not known whose answer it is",
    "questionnaire": "Questionnaire",
    "question": "Question",
    "model": "Haptic model that the question was about",
    "repeat": "Which presentation of the model",
    "answer": "Answer",
    "grades_from": "Where the answer comes from",
}


def _answers_table(
    data: StudyData, questions: Collection[str], excluded: Collection[str]
) -> DataTable | None:
    answers = tuple(
        each
        for each in answers_of(data.paths, data.protocol)
        if f"{each.questionnaire}.{each.question}" in questions
        and each.rater not in excluded
    )
    if not answers:
        return None
    names, *rows = _records(answers_csv(answers))
    return DataTable(
        name="answers",
        title="Answers to questionnaires, one row a question",
        variables=tuple(Variable(name=name, title=_OF_ANSWERS[name]) for name in names),
        rows=tuple(map(tuple, rows)),
        keys=(),
        nothing="",
    )


def _recordings(paths: StudyPaths, protocol: Protocol) -> Iterator[RecordingFile]:
    # those that a log names, in its order
    for session in protocol.sessions:
        for rater in session.raters:
            log = paths.log_file(rater, session.id)
            if not log.is_file():
                continue
            for event in read_log(log):
                if event.kind != "presented":
                    continue
                path = paths.sessions / str(event.fields["recording"])
                if path.is_file():
                    yield RecordingFile(
                        rater=rater, session=session.id, name=path.stem, path=path
                    )


def _description(protocol: Protocol, ratings: Ratings) -> str:
    sentences = [f"{protocol.study.title}."]
    if protocol.study.source:
        sentences.append(f"Source: {protocol.study.source}.")
    grades = ", ".join(protocol.scale.grades)
    sentences.append(f"Scale {protocol.scale.name}: {grades}.")
    if ratings.simulated and ratings.n_from_persons:
        sentences.append("SIMULATED DEVICE: not all grades were given on hardware.")
    elif ratings.simulated:
        sentences.append("SIMULATED DATA: no person gave these grades.")
    return " ".join(sentences)
