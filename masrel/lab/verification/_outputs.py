"""Table of ratings, analysis and report, held against what they were made from."""

import hashlib
import json
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import masrel
from masrel.errors import MasrelError, MasrelWarning
from masrel.lab._bounded_files import (
    MAX_RECORDING,
    MAX_TABLE,
    format_problem,
    parse_json,
    read_regular,
)
from masrel.lab.conduct import excluded_raters
from masrel.lab.conduct._study_log import conduct_hash
from masrel.lab.protocol import Protocol, StudyPaths
from masrel.lab.verification._log_findings import Finding, broken, doubt

if TYPE_CHECKING:
    from masrel.lab.analysis import Analysis
    from masrel.lab.ratings import Ratings

REPORT_FORMAT = "masrel report 1"
"""What the manifest of a report says its format is."""

_SHOWN = 20  # differences of the table that are listed


def output_findings(study: StudyPaths, protocol: Protocol) -> Iterator[Finding]:
    """Yield what is wrong with everything that was made from the logs."""
    table, manifest = study.ratings_file, study.report / "manifest.json"
    tables = (table, study.answers_file, study.raters_file)
    outputs = (*tables, study.analysis_file, manifest)
    files = [file for file in outputs if file.is_file()]
    if not files:
        return  # nothing is loaded for it
    from masrel.lab.analysis import analyze
    from masrel.lab.ratings import answers_of, in_person_of, read_study_data
    from masrel.lab.ratings.study_data import _of_logs

    try:
        if study.logs():
            # recordings have been held against the logs before
            ratings = _of_logs(study, protocol, check_recordings=False)
            yield from _table_findings(study, protocol, ratings)
        else:
            ratings = read_study_data(study, protocol).ratings
            if table.is_file():
                yield doubt(table, "no session log stands behind this table")
        if not {study.analysis_file, manifest} & {*files}:
            return
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", MasrelWarning)  # of statistics
            analysis = analyze(
                protocol,
                ratings,
                in_person=in_person_of(study, ratings),
                answers=answers_of(study, protocol),
                excluded=excluded_raters(study),
            )
    except MasrelError as error:
        for path in files:
            yield broken(path, f"cannot be held against what it is made from: {error}")
        return
    if study.analysis_file.is_file():
        yield from _analysis_findings(study.analysis_file, analysis, ratings)
    if manifest.is_file():
        yield from _report_findings(study, manifest, analysis, ratings)


def _table_findings(
    study: StudyPaths, protocol: Protocol, ratings: "Ratings"
) -> Iterator[Finding]:
    from masrel.lab.progress import _raters_text
    from masrel.lab.ratings import answers_csv, answers_from_logs
    from masrel.lab.ratings.study_data import _table_differences
    from masrel.lab.ratings.table import _FORMAT, _texts

    made: dict[Path, tuple[Callable[[], Iterable[str]], int]] = {
        study.ratings_file: (lambda: _texts(ratings), _FORMAT),
        study.answers_file: (
            lambda: [answers_csv(answers_from_logs(study, protocol))],
            1,
        ),
        study.raters_file: (lambda: [_raters_text(study, protocol)], 1),
    }
    for path, (texts, newest) in made.items():
        if not path.is_file():
            continue
        differences = list(_table_differences(path, texts(), newest=newest))
        for difference in differences[:_SHOWN]:
            yield broken(path, f"{difference}; masrel ratings writes it anew")
        if len(differences) > _SHOWN:
            yield broken(
                path, f"there are {len(differences) - _SHOWN} more differences"
            )


def _of_same_table(
    analysis: "Analysis", ratings: "Ratings", inputs: Mapping[str, object]
) -> "Analysis":
    # with the hash that was written if it is of the same table in an earlier format
    from masrel.lab.ratings.table import _texts

    texts = _texts(ratings) if ratings.source_path is None else ()
    for text in texts:
        sha256 = hashlib.sha256(text.encode()).hexdigest()
        if sha256 == inputs.get("ratings_sha256"):
            changed = {**analysis.inputs, "ratings_sha256": sha256}
            return replace(analysis, inputs=changed)
    return analysis


def _analysis_findings(
    path: Path, analysis: "Analysis", ratings: "Ratings"
) -> Iterator[Finding]:
    from masrel.lab.analysis import as_analysis_document
    from masrel.lab.analysis._results import ANALYSIS_FORMAT

    document = _document(path)
    if document is None:
        yield broken(path, "needed a JSON object, got none")
        return
    document = {"format": 1, **document}  # which was not said once
    problem = format_problem(document["format"], newest=ANALYSIS_FORMAT)
    if problem is not None:
        yield broken(path, problem)
        return
    inputs = document.get("inputs")
    if isinstance(inputs, dict):
        analysis = _of_same_table(analysis, ratings, inputs)
    needed = as_analysis_document(analysis)
    if document.get("masrel_version") != analysis.masrel_version:
        yield _not_rebuilt(path, document)
        document, needed = {"inputs": inputs}, {"inputs": needed["inputs"]}
    leaves, needed_leaves = dict(_leaves(document)), dict(_leaves(needed))
    for place in (*needed_leaves, *leaves):
        got, value = (each.get(place, "absent") for each in (leaves, needed_leaves))
        if got != value:
            message = f"{place} is {got:.60}, but {value:.60} when it is computed again"
            yield broken(path, message)
            return


def _not_rebuilt(path: Path, document: Mapping[str, object]) -> Finding:
    version = document.get("masrel_version")
    return doubt(
        path,
        f"made by masrel {version}, not rebuilt by this, {masrel.__version__}: only "
        "what it was made from is looked at",
    )


def _leaves(value: object, place: str = "") -> Iterator[tuple[str, str]]:
    # the places of a document, and the JSON of what stands there
    if isinstance(value, dict | list) and value:
        pairs = value.items() if isinstance(value, dict) else enumerate(value)
        for name, part in pairs:
            yield from _leaves(part, f"{place}.{name}".lstrip("."))
    else:
        yield place, json.dumps(value)


def _report_findings(
    study: StudyPaths, manifest: Path, analysis: "Analysis", ratings: "Ratings"
) -> Iterator[Finding]:
    # of the pages and assets that a report consists of, and what it was made from
    document = _document(manifest)
    files = None if document is None else document.get("files")
    if document is None or not isinstance(files, dict):
        yield broken(manifest, "needed the manifest of a report, got none")
        return
    if document.get("format") != REPORT_FORMAT:
        got = document.get("format")
        yield broken(manifest, f"needed format {REPORT_FORMAT!r}, got {got!r}")
        return
    numbers = manifest.with_name("analysis.json")
    made = _document(numbers) if numbers.is_file() else None
    if made is not None and made.get("masrel_version") != masrel.__version__:
        yield _not_rebuilt(numbers, made)
    inputs = document.get("inputs")
    of = dict(inputs) if isinstance(inputs, dict) else {}
    of.pop("include", None)  # what is shown of the same
    of_conduct = of.pop("conduct_sha256", None)
    of_claims = of.pop("claims_sha256", None)
    if of != _of_same_table(analysis, ratings, of).inputs:
        yield broken(
            manifest, "the report is of another protocol or of other ratings: make anew"
        )
    if of_conduct != conduct_hash(study):
        yield broken(
            manifest,
            "the report is not of what has happened beside the sessions, by "
            f"{study.conduct_file.name}: make anew",
        )
    claims = study.claims_file
    if of_claims and of_claims != (_sha256(claims) if claims.is_file() else None):
        yield broken(manifest, f"the report is of other claims than {claims.name}")
    yield from _file_findings(manifest, files)


def _file_findings(manifest: Path, files: Mapping[str, object]) -> Iterator[Finding]:
    for name, needed in files.items():
        path = manifest.parent / name
        if not path.resolve().is_relative_to(manifest.parent.resolve()):
            yield broken(manifest, f"names a file outside the report, {name}")
        elif not path.is_file():
            yield broken(path, "needed a file of the report, got none")
        elif _sha256(path) != needed:
            yield broken(path, "is not the file that the report was written with")


def _sha256(path: Path) -> str:
    return hashlib.sha256(read_regular(path, most=MAX_RECORDING)).hexdigest()


def _document(path: Path) -> dict[str, object] | None:
    try:
        document = parse_json(read_regular(path, most=MAX_TABLE))
    except ValueError:
        return None
    return document if isinstance(document, dict) else None
