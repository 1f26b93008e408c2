"""What leaves a study: tables with described variables, recordings, files as they are.

Every format is written from this one description.
"""

import csv
import json
import tomllib
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from datetime import date
from itertools import dropwhile
from pathlib import Path
from typing import Any

from masrel._input import check_option, listed
from masrel.errors import ParameterError
from masrel.lab._event_log import read_log
from masrel.lab._study_files import (
    CUT_OFF,
    MANIFEST,
    MAX_SMALL,
    csv_text,
    is_cut_off,
    parse_json,
    read_regular,
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

MISSING = "NA"
"""How tables of masrel show a missing value."""

Column = dict[str, object]
"""What a column of a table is, by the keys of BIDS."""


def column(title: str, unit: str = "", levels: Collection[str] = ()) -> Column:
    """Describe a column; `levels` are the texts that it may have, in order."""
    described: Column = {"Description": title}
    if unit:
        described["Units"] = unit
    if levels:
        described["Levels"] = {level: level for level in levels}
    return described


@dataclass(frozen=True, slots=True, kw_only=True)
class DataTable:
    """A table as texts."""

    # both by the names of columns, in their order
    columns: dict[str, Column]
    rows: list[dict[str, str]]

    def as_csv(self) -> bytes:
        """Return the table as CSV, names of columns in its first line."""
        rows = ([row[name] for name in self.columns] for row in self.rows)
        return csv_text([self.columns, *rows]).encode()


def json_bytes(document: object) -> bytes:
    """Return a document as the bytes of a JSON file."""
    return (json.dumps(document, indent=1, ensure_ascii=False) + "\n").encode()


@dataclass(frozen=True, slots=True, kw_only=True)
class Dataset:
    """Everything of a study that is exported."""

    paths: StudyPaths
    protocol: Protocol
    ratings: DataTable
    raters: DataTable
    answers: DataTable | None  # None where nothing is asked, or may leave
    # raters, sessions and files, whose stems are codes, with the attempt of several
    recordings: list[tuple[str, str, Path]]
    # files of the study by their place in it, as they leave it
    files: dict[str, bytes]
    # those of the report, where it shows nothing that may not leave
    report: list[Path]
    description: str
    day: date  # of the export
    left_out: tuple[str, ...]


def gather_dataset(
    paths: StudyPaths, protocol: Protocol, include: Collection[str], day: date
) -> Dataset:
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
    return Dataset(
        paths=paths,
        protocol=protocol,
        ratings=_ratings_table(protocol, data.ratings, excluded),
        raters=_raters_table(paths, protocol, hidden),
        answers=DataTable(columns=_OF_ANSWERS, rows=[*_records(answers_csv(answers))])
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
    "session": column("Session"),
    "rater": column("Rater"),
    "model": column(_MODEL),
    "repeat": column("Which presentation of the model in the session"),
    "grade": column("Grade"),
    "mean_speed_deg_s": column("Mean speed before the catch", "deg/s"),
    "source": column("Where the rating comes from"),
    "n_stretches": column("Stretches before the grade"),
    "min_speed_deg_s": column("Mean speed of the slowest stretch", "deg/s"),
    "max_speed_deg_s": column("Mean speed of the fastest stretch", "deg/s"),
    # what has units is read as a number
    "speeds_deg_s": column("Mean speed of each stretch, deg/s, with ; between"),
    "graded_stretch": column("Stretch on which the grade rests"),
    "felt": column("Whether what the model has could be felt"),
    "grades_from": column("Where the grade comes from"),
    "device": column("Device that presented the model"),
    "position": column("Place of the presentation in the session"),
    "code": column("Blinded code by which the rater knew it"),
    "n_attempts": column("How often it was presented"),
    "first_grade": column("Grade as the rater gave it, before corrections"),
    "graded_at": column("When the first grade was given, UTC"),
    "grip_lost": column("Whether the arm came loose and the model let go"),
}


def _ratings_table(
    protocol: Protocol, ratings: Ratings, excluded: Collection[str]
) -> DataTable:
    rows = _records(ratings_csv(ratings))
    models = column(_MODEL, levels=[model.id for model in protocol.models])
    described = _OF_RATINGS | {
        "model": models,
        "grade": column("Grade", levels=protocol.scale.grades),
    }
    return DataTable(
        columns={name: described[name] for name in rows.fieldnames or ()},
        rows=[row for row in rows if row["rater"] not in excluded],
    )


def _records(text: str) -> "csv.DictReader[str]":
    # those of a table of masrel, without the comments above it; a line of an answer may
    # begin as they do
    lines = text.splitlines(keepends=True)
    return csv.DictReader(dropwhile(lambda line: line.startswith("#"), lines))


_OF_RATERS = {
    "rater": column("Rater"),
    "site": column("Site"),
    "status": column("What became of the rater in the study"),
    "late": column("Joined after the first draw", levels=("yes", "no")),
}


def _raters_table(
    paths: StudyPaths, protocol: Protocol, hidden: Collection[str]
) -> DataTable:
    rows = _records(raters_csv(paths, protocol))
    # of ratings that were published nobody knows how they came about
    known = [*_OF_RATERS] if paths.logs() else ["rater", "site"]
    described = {name: _OF_RATERS[name] for name in known}
    described |= {
        name: column(field.title or name, field.unit, field.choices)
        for name, field in protocol.rater_fields.items()
        if name not in hidden
    }
    return DataTable(
        columns=described,
        rows=[{name: row[name] for name in described} for row in rows],
    )


_OF_ANSWERS = {
    "session": column("Session; empty for a question about the study"),
    "rater": column("Rater; empty where it is not known whose answer it is"),
    "questionnaire": column("Questionnaire"),
    "question": column("Question"),
    "model": column("Haptic model that the question was about"),
    "repeat": column("Which presentation of the model"),
    "answer": column("Answer"),
    "grades_from": column("Where the answer comes from"),
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
