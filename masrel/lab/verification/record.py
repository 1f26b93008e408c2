"""The record of a study, from protocol to report, each file compared with the last."""

import os
import warnings
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import chain, starmap
from pathlib import Path
from typing import Any

import masrel
from masrel.errors import (
    MasrelError,
    MasrelWarning,
    ProtocolError,
    SessionLogError,
)
from masrel.lab._event_log import read_log
from masrel.lab._study_files import (
    CUT_OFF,
    MANIFEST,
    MAX_RECORDING,
    format_problem,
    is_cut_off,
    leaves,
    read_object,
    read_once,
    read_regular,
    sha256_of,
)
from masrel.lab.conduct import excluded_raters, plan_changes, read_conduct
from masrel.lab.conduct._plan_versions import is_of_earlier, plan_versions
from masrel.lab.conduct._study_log import (
    allotment_problems,
    conduct_hash,
    merged_log_problems,
)
from masrel.lab.protocol import Protocol, StudyPaths, read_protocol
from masrel.lab.protocol.study import _OPENED
from masrel.lab.schedule.presentation import _read_drawn
from masrel.lab.schedule.sheets import _of_another_secret, schedule_problems
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

_REPORT_FORMAT = "masrel report 2"  # what the manifest of a report says its format is
_HASHED_NAMES = "masrel report 1"  # whose tables and figures have hashes in their names

_EARLIER, _OTHER = (
    "is of an earlier state of the record",
    "was made of another protocol, other ratings or another log",
)

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
        """Whether nothing is broken; something may be stale, or a doubt."""
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
            *starmap(doubt, _of_another_secret(protocol, study)),
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
    trained = [
        check_training(study, protocol, log)
        for rater in protocol.raters
        if (log := study.training_log_file(rater.id)).is_file()
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
        hashes = {e.fields["protocol_sha256"] for _, e in plan_versions(study)}
        unblinded = [e.fields for e in read_conduct(study) if e.kind == "unblinded"]
        return (
            *(
                broken(path, "is open, and no log has who unblinded the study, and why")
                for path in sorted((study.schedules / _OPENED).glob("*.csv"))
                if all(fields["code"] for fields in unblinded)
            ),
            *(
                doubt(path, "was drawn from a protocol that no log of the study keeps")
                for path, each in _read_drawn(
                    study, protocol.rater_sessions, skips_damaged=True
                )
                if hashes and each.protocol_sha256 not in hashes
                if not each.masrel_version.startswith("0.1.")  # which kept none
            ),
            *(broken(*problem) for problem in merged_log_problems(study)),
            *(broken(*problem) for problem in allotment_problems(study, protocol)),
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
                "a presentation that goes on, or was cut off; resuming recovers it",
            )
        elif path.parent in going_on and path.with_suffix(".partial").exists():
            yield doubt(path, "is not in its log yet; resuming the session logs it")
        elif path.suffix == ".jsonl":
            yield broken(path, f"is the log of no {whose} of the protocol")
        elif path.suffix in {".npz", ".json"}:
            yield broken(path, "is a recording that no log of the protocol names")
        else:
            yield doubt(path, f"is in {folder.name}/, and no log names it")


def _output_findings(study: StudyPaths, protocol: Protocol) -> Iterator[Finding]:
    # of everything that was made from the logs
    if is_cut_off(study.report):
        yield stale(study.report, CUT_OFF)
    table, manifest = study.ratings_file, study.report / MANIFEST
    outputs = (table, study.answers_file, study.raters_file, study.analysis_file)
    files = [file for file in (*outputs, manifest) if file.is_file()]
    if not files:
        return  # nothing is loaded for it
    computed: dict[str, dict[str, str]] = {}
    try:
        if study.logs():
            yield from _table_findings(study, protocol)
        elif table.is_file():
            yield doubt(table, "no session log supports this table")
        if study.analysis_file.is_file():
            yield from _numbers_findings(study, protocol, study.analysis_file, computed)
        if manifest.is_file():
            yield from _report_findings(study, protocol, manifest, computed)
    except MasrelError as error:
        for path in files:
            yield broken(
                path, f"cannot be compared with what it was made from: {error}"
            )


def _table_findings(study: StudyPaths, protocol: Protocol) -> Iterator[Finding]:
    from masrel.lab.ratings.study_data import _table_differences

    for path in (study.ratings_file, study.answers_file, study.raters_file):
        is_stale, differences = _table_differences(study, protocol, path)
        for difference in differences[:_SHOWN]:
            yield (stale if is_stale else broken)(
                path, f"{difference}; masrel ratings writes it again"
            )
        if len(differences) > _SHOWN:
            yield broken(
                path, f"there are {len(differences) - _SHOWN} more differences"
            )


def _numbers_findings(
    study: StudyPaths,
    protocol: Protocol,
    path: Path,
    computed: dict[str, dict[str, str]],
    report: Mapping[str, object] | None = None,
) -> Iterator[Finding]:
    # of an analysis, that of a report with what the manifest says that this is made of
    from masrel.lab.analysis._results import ANALYSIS_FORMAT

    numbers = read_object(path)
    problem = (
        "needed a JSON object, got none"
        if numbers is None
        else format_problem(numbers.get("format", 1), newest=ANALYSIS_FORMAT)
    )
    if numbers is None or problem is not None:
        yield broken(path, str(problem))
        return
    if (version := numbers.get("masrel_version")) != masrel.__version__:
        yield doubt(
            path,
            f"made by masrel {version}, not rebuilt by this, {masrel.__version__}: "
            "only what it was made from is checked",
        )
    made_of = report or numbers.get("inputs")
    of = _Numbers(
        study=study,
        document=numbers,
        made_of=made_of if isinstance(made_of, Mapping) else {},
        is_of_report=report is not None,
        computed=computed,
    )
    difference, _ = of.compare(protocol)
    if difference is None:
        return
    is_earlier = is_of_earlier(study, protocol, of.compare, of.n_presentations)
    in_person = of.tried.get(str(of.made_of.get("protocol_sha256")), _OTHER)
    is_known = study.logs() and in_person == of.made_of.get("in_person_sha256")
    unknown = "" if is_known else ", which no log has: it may have been made up"
    place, verb = (
        (path, "analyze") if report is None else (path.with_name(MANIFEST), "report")
    )
    words = _EARLIER if is_earlier else difference + unknown
    yield (broken if is_known and not is_earlier else stale)(
        place, f"{words}; masrel {verb} makes it again"
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class _Numbers:
    """An analysis, and what its file, or the manifest of its report, says it is of."""

    study: StudyPaths
    document: Mapping[str, object]
    made_of: Mapping[str, object]
    is_of_report: bool  # which is of what the log of the study says, too
    computed: dict[str, dict[str, str]]
    # in-person grades beside each protocol that was tried, by hashes
    tried: dict[str, object] = field(default_factory=dict)

    @property
    def n_presentations(self) -> int | None:
        """Of how many presentations it is, as it says; None where it does not."""
        match self.document:
            case {"presentations": None}:
                return 0
            case {"presentations": {"n_presentations": int(n_presentations)}}:
                return n_presentations
        return None

    def compare(self, then: Protocol) -> tuple[str | None, int]:
        """Return how it differs from what comes out, and of how many presentations."""
        # an earlier version may have written ratings in another format
        former = self.made_of.get("ratings_sha256")
        material, inputs = _material(self.study, then, former)
        self.tried[inputs["protocol_sha256"]] = inputs.get("in_person_sha256")
        ratings = material["ratings"].without(excluded_raters(self.study))
        known = [row for row in ratings.rows if row.n_stretches is not None]
        n = 0 if material["ratings"].is_sealed else len(known)
        beside = {"conduct_sha256": self.is_of_report and conduct_hash(self.study)}
        if inputs | {k: v for k, v in beside.items() if v} != self.made_of:
            return _OTHER, n
        if self.document.get("masrel_version") != masrel.__version__:
            return None, n
        needed = _leaves(self.study, material, inputs, self.computed)
        return _unlike(self.document, needed), n


def _unlike(numbers: Mapping[str, object], needed: Mapping[str, str]) -> str | None:
    # at what place, and how, an analysis differs from one that was computed again
    made = dict(leaves({"format": 1, **numbers}, within=(dict, list)))
    return next(
        (
            f"{place} is {made.get(place, 'absent'):.60}, but "
            f"{needed.get(place, 'absent'):.60} when it is computed again"
            for place in (*needed, *made)
            if made.get(place) != needed.get(place)
        ),
        None,
    )


def _material(
    study: StudyPaths, protocol: Protocol, former: object
) -> tuple[dict[str, Any], dict[str, str]]:
    """Return what a study is analysed from, by what its logs say, and the hashes of it.

    Of ratings it is `former` where that is of the same table in another format.
    """
    from masrel.lab.analysis._plan import _inputs
    from masrel.lab.ratings import (
        answers_of,
        in_person_of,
        ratings_from_logs,
        read_study_data,
    )
    from masrel.lab.ratings.table import _texts

    if study.logs():  # recordings have been held against these before
        ratings = ratings_from_logs(study, protocol, check_recordings=False)
    else:
        ratings = read_study_data(study, protocol, allows_sealed=True).ratings
    in_person, answers = in_person_of(study, ratings), answers_of(study, protocol)
    inputs = _inputs(protocol, ratings, in_person, answers)
    is_other = former not in (None, inputs["ratings_sha256"])
    texts = _texts(ratings) if is_other and not ratings.source_path else ()
    if former in {sha256_of(text.encode()) for text in texts}:
        inputs["ratings_sha256"] = str(former)
    return {
        "protocol": protocol,
        "ratings": ratings,
        "in_person": in_person,
        "answers": answers,
    }, inputs


def _leaves(
    study: StudyPaths,
    material: dict[str, Any],
    inputs: Mapping[str, str],
    computed: dict[str, dict[str, str]],
) -> dict[str, str]:
    """Return every place of the analysis of a study, computed once of what it is of."""
    from masrel.lab.analysis import analyze, as_analysis_document

    beside: dict[str, Any] = {
        "excluded": excluded_raters(study),
        "changes": plan_changes(study, material["protocol"]),
    }
    of = repr((inputs, beside))
    if of not in computed:
        with warnings.catch_warnings(action="ignore", category=MasrelWarning):
            analysis = replace(analyze(**material, **beside), inputs=inputs)
        computed[of] = dict(leaves(as_analysis_document(analysis), within=(dict, list)))
    return computed[of]


def _report_findings(
    study: StudyPaths,
    protocol: Protocol,
    manifest: Path,
    computed: dict[str, dict[str, str]],
) -> Iterator[Finding]:
    # of the pages and assets that a report consists of, and what it was made from
    document = read_object(manifest) or {}
    files, inputs = document.get("files"), document.get("inputs")
    if not isinstance(files, dict) or not isinstance(inputs, dict):
        yield broken(manifest, "needed the manifest of a report, got none")
        return
    if document.get("format") not in (_REPORT_FORMAT, _HASHED_NAMES):
        needed = f"needed format {_REPORT_FORMAT!r}, got {document.get('format')!r}"
        yield broken(manifest, needed)
        return
    if document["format"] == _HASHED_NAMES:
        yield doubt(manifest, "is of an earlier version; masrel report makes it again")
    beside = ("include", "claims_sha256")  # what is shown of the same, and of others
    of = {key: value for key, value in inputs.items() if key not in beside}
    yield from _numbers_findings(
        study, protocol, manifest.with_name("analysis.json"), computed, of
    )
    claims, of_claims = study.claims_file, inputs.get("claims_sha256")
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
    return sha256_of(read_regular(path, most=MAX_RECORDING))
