"""What can be wrong with any log and its recordings, and anchors kept elsewhere.

An anchor is the hash of a log's last line, kept where the study is not.
"""

import json
import re
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from typing import Literal, TypeVar

from masrel._files import write_file
from masrel.errors import ParameterError, SessionLogError
from masrel.lab._event_log import Event, line_hashes, read_log
from masrel.lab._study_files import (
    MAX_RECORDING,
    MAX_SMALL,
    MAX_TABLE,
    csv_format,
    format_problem,
    parse_json,
    read_regular,
    sha256_of,
)
from masrel.lab.protocol import StudyPaths
from masrel.lab.recording import _FORMAT as _RECORDING_FORMAT
from masrel.lab.schedule.presentation import _SEALED, Presentation, _hidden

_Checked = TypeVar("_Checked")

# Facts of a recording that the schedule has too, and those that the log has
_FROM_SCHEDULE = ("code", "position", "model", "repeat")
_FROM_LOG = ("attempt", "mean_speed_deg_s", "n_missed_ticks", "fault", "simulated")

_FORMAT = 1
_LINE = re.compile(r"([0-9a-f]{64})  (\d{1,9})  (\S.*)")
_HEAD = (
    f"# format: {_FORMAT}\n"
    "# SHA-256 of a line of a log, the line's number, and the log.\n"
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Finding:
    """One thing that is not as it should be.

    Attributes
    ----------
    weight : {"broken", "stale", "doubt"}
        Broken is what no state of the record can have been or made. What is stale was
        made of an earlier state, or of something that no log keeps; a doubt may have an
        innocent reason.
    path : Path
        The file or folder that it is about.
    message : str
        What was needed and what is there; it begins with the path.
    """

    weight: Literal["broken", "stale", "doubt"]
    path: Path
    message: str


def broken(path: Path, message: str) -> Finding:
    """Return a finding whose message does not begin with its path yet."""
    return Finding(weight="broken", path=path, message=f"{path}: {message}")


def stale(path: Path, message: str) -> Finding:
    """Return a finding of what was made before the record became what it is."""
    return Finding(weight="stale", path=path, message=f"{path}: {message}")


def doubt(path: Path, message: str) -> Finding:
    """Return a finding that may have an innocent reason."""
    return Finding(weight="doubt", path=path, message=f"{path}: {message}")


def unlike(
    path: Path, where: str, needed: Mapping[str, object], got: Mapping[str, object]
) -> Iterator[Finding]:
    """Yield what a line of a log says otherwise than it has to."""
    for name, value in needed.items():
        if got.get(name) != value:
            message = f"{where}: {name}: needed {value}, got {got.get(name)!r}"
            yield broken(path, message)


def checked_log(
    log: Path, read: Callable[[Path], tuple[tuple[Event, ...], _Checked]]
) -> tuple[tuple[Event, ...], _Checked | None, Finding | None]:
    """Return a log's events and what reading makes of them, or what is wrong."""
    if not log.exists():
        return (), None, None
    try:
        events, checked = read(log)
    except (SessionLogError, OSError) as error:
        return (), None, Finding(weight="broken", path=log, message=str(error))
    if not events:
        return (), None, broken(log, "needed a log, got an empty file")
    return events, checked, None


def time_findings(events: Sequence[Event], log: Path) -> Iterator[Finding]:
    """Yield events whose time is not a time, or before that of the last one."""
    before = None
    for event in events:
        where = f"line {event.line}: {event.kind}"
        try:
            time = datetime.fromisoformat(event.time_utc)
        except ValueError:
            time = datetime.min  # has no zone either
        if time.tzinfo is None:
            yield broken(log, f"{where}: needed a time in UTC, got {event.time_utc!r}")
            continue
        if before is not None and time < before:
            yield doubt(
                log,
                f"{where}: at {event.time_utc}, earlier than the line before: has the "
                "clock been set back?",
            )
        before = time


def hashed_facts(
    path: Path, event: Event, where: str
) -> tuple[bytes | None, list[Finding]]:
    """Return the facts of a recording, and whether both files have their hashes."""
    data = b""
    findings: list[Finding] = []
    for file, most, sha256 in (
        (path, MAX_RECORDING, event.fields["sha256"]),
        (path.with_suffix(".json"), MAX_SMALL, event.fields.get("facts_sha256")),
    ):
        try:
            data = read_regular(file, most=most)
        except OSError:
            if file.is_file():
                raise
            needed = f"needed a recording that {where} names, got no file"
            return None, [*findings, broken(file, needed)]
        if sha256 not in (None, sha256_of(data)):
            findings.append(broken(file, f"is not the file whose SHA-256 {where} has"))
    return data, findings


def recording_findings(
    path: Path,
    code: str,
    shown: Mapping[str, Presentation],
    of: Mapping[str, object],
    event: Event,
    log: Path,
    calibrations: Collection[str],
) -> Iterator[Finding]:
    """Yield what is wrong with the recording that an event of a log names."""
    # it has to lie beside its log, under its code; of: study, rater and session;
    # calibrations: hashes of those of the study
    attempt = event.fields["attempt"]
    name = code if attempt == 1 else f"{code}-{attempt}"
    if code not in shown or path != log.with_suffix("") / f"{name}.npz":
        yield broken(log, f"line {event.line}: {path} is not where {name} is recorded")
        return
    where = f"line {event.line} of {log}"
    data, findings = hashed_facts(path, event, where)
    yield from findings
    if data is None:
        return
    path = path.with_suffix(".json")
    # what a file says that was not hashed once must at least agree with what was
    try:
        facts = parse_json(data)
    except ValueError:
        facts = None
    if not isinstance(facts, dict):
        yield broken(path, "needed a JSON object, got none")
        return
    problem = format_problem(facts.get("format", 1), newest=_RECORDING_FORMAT)
    if problem is not None:
        yield broken(path, problem)
    as_shown = shown[code]
    if facts.get("model") == _SEALED:  # as it was recorded
        as_shown = _hidden(as_shown)
    needed: dict[str, object] = {
        **of,
        "sha256": event.fields["sha256"],
        **{name: getattr(as_shown, name) for name in _FROM_SCHEDULE},
        **{name: event.fields[name] for name in _FROM_LOG if name in event.fields},
    }
    for name, value in needed.items():
        got = facts.get(name)
        if got != value or type(got) is not type(value):
            yield broken(
                path,
                f"{name}: needed {json.dumps(value)}, as {where} and its "
                f"schedule have it, got {json.dumps(got)}",
            )
    calibration = facts.get("calibration_sha256")
    if calibration is not None and calibration not in calibrations:
        yield broken(
            path, f"calibration_sha256: no file in calibrations/ has it: {calibration}"
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Anchor:
    """The hash of one line of a log: all lines up to it follow from it.

    Attributes
    ----------
    log : str
        The log, as a path below the study with forward slashes.
    line : int
        The line, from 1.
    sha256 : str
        SHA-256 of the line without its newline, 64 hexadecimal digits.
    """

    log: str
    line: int
    sha256: str

    def __str__(self) -> str:
        return f"{self.sha256}  {self.line}  {self.log}"


def anchors_of(study: StudyPaths) -> tuple[Anchor, ...]:
    """Return an anchor for every log of a study that has a line and a chain that holds.

    Parameters
    ----------
    study : StudyPaths
        Where the study is.

    Returns
    -------
    tuple of Anchor
        Of the last line of each: of the study's conduct, then of every session, then of
        every training and rehearsal. A log whose chain does not hold has none.

    Raises
    ------
    OSError
        If a log cannot be read.
    """
    anchors = []
    for log in _logs(study):
        try:
            read_log(log)
        except SessionLogError:
            continue  # its last line says nothing of those before it
        hashes = line_hashes(log)
        if hashes:
            name = log.relative_to(study.root).as_posix()
            anchors.append(Anchor(log=name, line=len(hashes), sha256=hashes[-1]))
    return tuple(anchors)


def _logs(study: StudyPaths) -> list[Path]:
    beside = [
        *sorted(study.training.glob("*.jsonl")),
        *sorted(study.rehearsals.glob("*/*.jsonl")),
    ]
    logs = (*study.conduct_logs(), *study.logs(), *beside)
    return [log for log in logs if log.is_file() and not log.is_symlink()]


def read_anchors(path: Path) -> tuple[Anchor, ...]:
    """Read a file of anchors.

    Parameters
    ----------
    path : Path
        A file that `write_anchors` wrote, or several of them one after another.

    Returns
    -------
    tuple of Anchor
        In the order of the file.

    Raises
    ------
    ParameterError
        If a line is not an anchor, or there are no anchors.
    OSError
        If the file cannot be read.
    """
    anchors = []
    text = read_regular(path, most=MAX_TABLE).decode("utf-8", errors="replace")
    for number, line in enumerate(text.splitlines(), start=1):
        problem = format_problem(csv_format(line), newest=_FORMAT)
        if problem is not None:
            raise ParameterError(f"{path}: line {number}: {problem}")
        if line.startswith("#") or not line.strip():
            continue
        match = _LINE.fullmatch(line.strip())
        if match is None:
            raise ParameterError(
                f"{path}: line {number}: needed a SHA-256, the number of a line and a "
                f"log, two blanks between them, got {line[:80]!r}"
            )
        sha256, place, log = match.groups()
        anchors.append(Anchor(log=log, line=int(place), sha256=sha256))
    if not anchors:
        raise ParameterError(f"{path}: needed anchors, got none")
    return tuple(anchors)


def write_anchors(anchors: Iterable[Anchor], path: Path) -> None:
    """Write anchors, a line each, for a place that the study's coordinator cannot edit.

    Parameters
    ----------
    anchors : iterable of Anchor
        What `anchors_of` returned.
    path : Path
        The file.

    Raises
    ------
    OSError
        If the file cannot be written.
    """
    write_file(path, _HEAD + "".join(f"{anchor}\n" for anchor in anchors))


def anchor_findings(study: StudyPaths, anchors: Iterable[Anchor]) -> Iterator[Finding]:
    """Hold the logs of a study against hashes that were kept elsewhere.

    Parameters
    ----------
    study : StudyPaths
        Where the study is.
    anchors : iterable of Anchor
        The hashes.

    Yields
    ------
    Finding
        A log that is gone, is shorter than it was, or has another line there. Logs
        that have grown since are fine, and so is that of a study's conduct in a study
        that it was merged into.

    Raises
    ------
    OSError
        If a log cannot be read.
    """
    hashes = {
        log.relative_to(study.root).as_posix(): line_hashes(log) for log in _logs(study)
    }
    for anchor in anchors:
        path = study.root / anchor.log
        if (
            path == study.conduct_file
            and any(  # that of a site is elsewhere now
                anchor.sha256 in line_hashes(log)[anchor.line - 1 :][:1]
                for log in study.conduct_logs()
            )
        ):
            continue
        if anchor.log not in hashes:
            yield broken(path, "needed the log that an anchor names, got no file")
            continue
        of_log = hashes[anchor.log]
        if len(of_log) < anchor.line:
            yield broken(
                path, f"needed {anchor.line} lines, as anchored, got {len(of_log)}"
            )
        elif of_log[anchor.line - 1] != anchor.sha256:
            yield broken(
                path,
                f"line {anchor.line}: needed the anchored SHA-256 {anchor.sha256}, "
                f"got {of_log[anchor.line - 1]}: this line or one before it was "
                "changed, and the chain computed again",
            )
