"""The record of a study, from protocol to report, each file held against the last."""

import csv
import hashlib
import os
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING

import masrel
from masrel.errors import MasrelError, MasrelWarning, ProtocolError, SessionLogError
from masrel.lab._event_log import read_log
from masrel.lab._study_files import (
    MAX_RECORDING,
    MAX_TABLE,
    format_problem,
    leaves,
    parse_json,
    read_once,
    read_regular,
)
from masrel.lab.conduct import excluded_raters, plan_changes
from masrel.lab.conduct._plan_versions import version_problems
from masrel.lab.conduct._study_log import (
    allotment_problems,
    conduct_hash,
    earlier_conduct_hashes,
    merged_log_problems,
)
from masrel.lab.protocol import Protocol, StudyPaths, read_protocol
from masrel.lab.schedule import schedule_problems
from masrel.lab.schedule.presentation import _SEALED
from masrel.lab.verification._log_findings import (
    Finding,
    broken,
    doubt,
    stale,
    time_findings,
)
from masrel.lab.verification._sessions import (
    CheckedLog,
    SessionRecord,
    check_rehearsal,
    check_session,
    check_training,
)

if TYPE_CHECKING:
    from masrel.lab.analysis import Analysis
    from masrel.lab.ratings import Ratings

_REPORT_FORMAT = "masrel report 1"  # what the manifest of a report says its format is

_SHOWN = 20  # differences of the table that are listed


@dataclass(frozen=True, slots=True, kw_only=True)
class Verification:
    """What verification of a study found.

    Attributes
    ----------
    sessions : tuple of SessionRecord
        Every session of the protocol, one line a rater.
    trainings : tuple of SessionRecord
        Every training that has a log, by rater.
    rehearsals : tuple of SessionRecord
        Every rehearsal that has a log.
    findings : tuple of Finding
        In the order of the record: protocol, schedules, logs and recordings of
        sessions, trainings and rehearsals, tables, analysis, report.
    """

    sessions: tuple[SessionRecord, ...]
    trainings: tuple[SessionRecord, ...] = ()
    rehearsals: tuple[SessionRecord, ...] = ()
    findings: tuple[Finding, ...]

    @property
    def is_whole(self) -> bool:
        """Whether nothing is broken; there may be doubts."""
        return not any(finding.weight == "broken" for finding in self.findings)


def verify_study(study: StudyPaths) -> Verification:
    """Verify the record of a study: every file against the one it was made from.

    Parameters
    ----------
    study : StudyPaths
        Where the study is. Nothing in it is changed.

    Returns
    -------
    Verification
        Every session, and every finding.

    Raises
    ------
    OSError
        If a file that is there cannot be read.

    Examples
    --------
    >>> import tempfile
    >>> from masrel.lab.protocol import copy_template
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     copy_template("small", Path(folder))
    ...     verification = verify_study(StudyPaths(Path(folder)))
    >>> verification.is_whole, len(verification.sessions)
    (True, 2)
    """
    try:
        protocol = read_protocol(study.protocol)
    except ProtocolError as error:
        return Verification(
            sessions=(), findings=_of_problems(study.protocol, error.problems)
        )
    with read_once():
        record = verify_sessions(study, protocol)
        findings = (
            *_of_problems(study.schedules, schedule_problems(protocol, study)),
            *record.findings,
            *_output_findings(study, protocol),
        )
    return replace(record, findings=findings)


def verify_sessions(study: StudyPaths, protocol: Protocol) -> Verification:
    """Verify the logs of a study and the recordings they name.

    Parameters
    ----------
    study : StudyPaths
        Where the study is.
    protocol : Protocol
        Its protocol.

    Returns
    -------
    Verification
        Every session of the protocol, every training and rehearsal, and what is wrong
        in their folders and in the log of what happened beside them.

    Raises
    ------
    OSError
        If a file that is there cannot be read.
    """
    checked = [
        check_session(study, protocol, session, rater)
        for rater, session in protocol.rater_sessions
    ]
    training_logs = [study.training_log_file(rater.id) for rater in protocol.raters]
    trained = [
        check_training(study, protocol, log) for log in training_logs if log.is_file()
    ]
    rehearsed = [
        check_rehearsal(study, protocol, log)
        for log in sorted(study.rehearsals.glob("*/*.jsonl"))
    ]
    return Verification(
        sessions=tuple(of_session.record for of_session in checked),
        trainings=tuple(of_rater.record for of_rater in trained),
        rehearsals=tuple(rehearsal.record for rehearsal in rehearsed),
        findings=(
            *_of_logs(study.sessions, checked, "rater in a session"),
            *_of_logs(study.training, trained, "rater"),
            *_of_logs(study.rehearsals, rehearsed, "rehearsal"),
            *_conduct_findings(study, protocol),
        ),
    )


def _conduct_findings(study: StudyPaths, protocol: Protocol) -> tuple[Finding, ...]:
    try:
        return (
            *(broken(*problem) for problem in merged_log_problems(study)),
            *(broken(*problem) for problem in allotment_problems(study, protocol)),
            *(broken(*problem) for problem in version_problems(study)),
            *(
                finding
                for log in study.conduct_logs()
                for finding in time_findings(read_log(log), log)
            ),
            *(
                doubt(study.protocol, str(change))
                for change in plan_changes(study, protocol)
            ),
        )
    except SessionLogError as error:
        return _of_problems(study.conduct_file, [str(error)])


def _of_problems(path: Path, problems: Iterable[str]) -> tuple[Finding, ...]:
    return tuple(
        Finding(weight="broken", path=path, message=problem) for problem in problems
    )


def _of_logs(
    folder: Path, checked: Sequence[CheckedLog], whose: str
) -> Iterator[Finding]:
    # of a folder of logs: of each, then what lies there and no log speaks for
    yield from chain.from_iterable(of_log.findings for of_log in checked)
    recordings = [path for of_log in checked for path in of_log.recordings]
    facts = [path.with_suffix(".json") for path in recordings]
    logs = {of_log.log: of_log.record.stage for of_log in checked}
    named = {*map(str, (*logs, *recordings, *facts))}
    # what a log that cannot be read names, nobody can say
    unknown = {log for log, stage in logs.items() if stage == "unreadable"}
    # where a process may have died, or is, between a recording and the log
    going_on = {log.with_suffix("") for log in logs if logs[log] == "begun"}
    there = (
        f"{parent}{os.sep}{name}"
        for parent, folders, files in os.walk(folder)
        for name in (*folders, *files)
    )
    for path in sorted(Path(name) for name in there if name not in named):
        if path.parent.with_name(f"{path.parent.name}.jsonl") in unknown:
            continue
        if path.is_dir() and any(path.iterdir()):
            continue
        if path.name.endswith(".jsonl.torn") and str(path.with_suffix("")) in named:
            yield doubt(path, "bytes of a line that was not finished; the log says so")
        elif path.suffix == ".partial":
            yield doubt(
                path,
                "a presentation that goes on, or was cut off; going on recovers it",
            )
        elif path.parent in going_on and path.with_suffix(".partial").exists():
            yield doubt(path, "is not in its log yet; going on with it logs it")
        elif path.suffix == ".jsonl":
            yield broken(path, f"is the log of no {whose} of the protocol")
        elif path.suffix in {".npz", ".json"}:
            yield broken(path, "is a recording that no log of the protocol names")
        else:
            yield doubt(path, f"is in {folder.name}/, and no log names it")


def _output_findings(study: StudyPaths, protocol: Protocol) -> Iterator[Finding]:
    # of everything that was made from the logs
    table, manifest = study.ratings_file, study.report / "manifest.json"
    tables = (table, study.answers_file, study.raters_file)
    outputs = (*tables, study.analysis_file, manifest)
    files = [file for file in outputs if file.is_file()]
    if not files:
        return  # nothing is loaded for it
    from masrel.lab.analysis import analyze
    from masrel.lab.ratings import (
        answers_of,
        in_person_of,
        ratings_from_logs,
        read_study_data,
    )

    try:
        if study.logs():
            # recordings have been held against the logs before
            ratings = ratings_from_logs(study, protocol, check_recordings=False)
            yield from _table_findings(study, protocol, ratings)
        else:
            ratings = read_study_data(study, protocol).ratings
            if table.is_file():
                yield doubt(table, "no session log stands behind this table")
        if not {study.analysis_file, manifest} & {*files}:
            return
        # of statistics
        with warnings.catch_warnings(action="ignore", category=MasrelWarning):
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
    from masrel.lab.progress import raters_csv
    from masrel.lab.ratings import answers_csv, answers_from_logs
    from masrel.lab.ratings.study_data import _table_differences
    from masrel.lab.ratings.table import _FORMAT, _texts

    made: dict[Path, tuple[Callable[[], Iterable[str]], int]] = {
        study.ratings_file: (lambda: _texts(ratings), _FORMAT),
        study.answers_file: (
            lambda: [answers_csv(answers_from_logs(study, protocol))],
            1,
        ),
        study.raters_file: (lambda: [raters_csv(study, protocol)], 1),
    }
    for path, (texts, newest) in made.items():
        if not path.is_file():
            continue
        differences = list(_table_differences(path, texts(), newest=newest))
        if differences and any(_is_from_before(path, text) for text in texts()):
            message = "was made before the study was unblinded"
            yield stale(path, f"{message}; masrel ratings writes it anew")
            continue
        for difference in differences[:_SHOWN]:
            yield broken(path, f"{difference}; masrel ratings writes it anew")
        if len(differences) > _SHOWN:
            yield broken(
                path, f"there are {len(differences) - _SHOWN} more differences"
            )


def _is_from_before(path: Path, text: str) -> bool:
    # whether a table differs from it in nothing but models that were sealed still
    old = read_regular(path, most=MAX_TABLE).decode("utf-8", errors="replace")
    made, known = (
        [*csv.DictReader(line for line in table.splitlines() if line[:1] != "#")]
        for table in (old, text)
    )
    for row, now in zip(made, known, strict=False):
        if row.get("model") == _SEALED:
            now |= {key: row[key] for key in ("model", "repeat")}
    return made == known


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
    if isinstance(inputs, dict) and inputs != needed["inputs"]:
        made_of = "another protocol or other ratings"
        yield stale(path, f"was made of {made_of}; masrel analyze makes it anew")
        return
    if document.get("masrel_version") != analysis.masrel_version:
        yield _not_rebuilt(path, document)
        document, needed = {"inputs": inputs}, {"inputs": needed["inputs"]}
    made, of_now = (
        dict(leaves(each, within=(dict, list))) for each in (document, needed)
    )
    for place in (*of_now, *made):
        got, value = (each.get(place, "absent") for each in (made, of_now))
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


def _report_findings(
    study: StudyPaths, manifest: Path, analysis: "Analysis", ratings: "Ratings"
) -> Iterator[Finding]:
    # of the pages and assets that a report consists of, and what it was made from
    document = _document(manifest)
    files = None if document is None else document.get("files")
    if document is None or not isinstance(files, dict):
        yield broken(manifest, "needed the manifest of a report, got none")
        return
    if document.get("format") != _REPORT_FORMAT:
        got = document.get("format")
        yield broken(manifest, f"needed format {_REPORT_FORMAT!r}, got {got!r}")
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
        yield stale(
            manifest, "the report is of another protocol or of other ratings: make anew"
        )
    if of_conduct != conduct_hash(study):
        is_earlier = of_conduct in earlier_conduct_hashes(study)
        yield (stale if is_earlier else broken)(
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
