"""The record of a study, from protocol to analysis, each file held against the last."""

import os
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from masrel.errors import ProtocolError, SessionLogError
from masrel.lab._once import read_once
from masrel.lab.conduct._study_log import allotment_problems, merged_log_problems
from masrel.lab.protocol import Protocol, StudyPaths, read_protocol
from masrel.lab.schedule import schedule_problems
from masrel.lab.verification._log_findings import Finding, broken, doubt
from masrel.lab.verification._outputs import output_findings
from masrel.lab.verification._sessions import (
    CheckedLog,
    SessionRecord,
    VerifiedTraining,
    check_rehearsal,
    check_session,
    check_training,
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Verification:
    """What verification of a study found.

    Attributes
    ----------
    sessions : tuple of SessionRecord
        Every session of the protocol, one line a rater.
    trainings : tuple of VerifiedTraining
        Every training that has a log, by rater.
    rehearsals : tuple of SessionRecord
        Every rehearsal that has a log.
    findings : tuple of Finding
        In the order of the record: protocol, schedules, logs and recordings of
        sessions, trainings and rehearsals, tables, analysis, report.
    """

    sessions: tuple[SessionRecord, ...]
    trainings: tuple[VerifiedTraining, ...] = ()
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
        return Verification(
            sessions=record.sessions,
            trainings=record.trainings,
            rehearsals=record.rehearsals,
            findings=(
                *_of_problems(study.schedules, schedule_problems(protocol, study)),
                *record.findings,
                *output_findings(study, protocol),
            ),
        )


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
        check_session(study, protocol, session.id, rater)
        for session in protocol.sessions
        for rater in session.raters
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
            *(finding for of_session in checked for finding in of_session.findings),
            *_unnamed(study.sessions, checked, "rater in a session"),
            *(finding for of_rater in trained for finding in of_rater.findings),
            *_unnamed(study.training, trained, "rater"),
            *(finding for rehearsal in rehearsed for finding in rehearsal.findings),
            *_unnamed(study.rehearsals, rehearsed, "rehearsal"),
            *_conduct_findings(study, protocol),
        ),
    )


def _conduct_findings(study: StudyPaths, protocol: Protocol) -> tuple[Finding, ...]:
    try:
        return (
            *(broken(*problem) for problem in merged_log_problems(study)),
            *(broken(*problem) for problem in allotment_problems(study, protocol)),
        )
    except SessionLogError as error:
        return _of_problems(study.conduct_file, [str(error)])


def _of_problems(path: Path, problems: Iterable[str]) -> tuple[Finding, ...]:
    return tuple(
        Finding(weight="broken", path=path, message=problem) for problem in problems
    )


def _unnamed(
    folder: Path, checked: Sequence[CheckedLog[Any]], whose: str
) -> Iterator[Finding]:
    # what lies in a folder of logs and no log speaks for
    named = {str(path) for of_log in checked for path in of_log.files}
    # what a log that cannot be read names, nobody can say
    unknown = {
        path
        for of_log in checked
        if of_log.record.stage == "unreadable"
        for path in of_log.files
    }
    # where a process may have died, or is, between a recording and the log
    going_on = {
        path.with_suffix("")
        for of_log in checked
        if of_log.record.stage == "begun"
        for path in of_log.files
        if path.suffix == ".jsonl"
    }
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
