"""Anchors: the last hashes of a study's logs, kept where the study is not."""

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

from masrel._files import write_file
from masrel.errors import ParameterError, SessionLogError
from masrel.lab._bounded_files import (
    MAX_TABLE,
    csv_format,
    format_problem,
    read_regular,
)
from masrel.lab._event_log import line_hashes, read_log
from masrel.lab.protocol import StudyPaths
from masrel.lab.verification._finding import Finding, broken

_FORMAT = 1
_LINE = re.compile(r"([0-9a-f]{64})  (\d{1,9})  (\S.*)")
_HEAD = (
    f"# format: {_FORMAT}\n"
    "# SHA-256 of a line of a log, the line's number, and the log.\n"
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
    logs = [log for log in beside if log.is_file()]
    return [*study.conduct_logs(), *study.logs(), *logs]


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
        If a line is not an anchor, or there is none.
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


def anchor_findings(
    study: StudyPaths, anchors: Iterable[Anchor]
) -> tuple[Finding, ...]:
    """Hold the logs of a study against hashes that were kept elsewhere.

    Parameters
    ----------
    study : StudyPaths
        Where the study is.
    anchors : iterable of Anchor
        The hashes.

    Returns
    -------
    tuple of Finding
        A log that is gone, is shorter than it was, or has another line there. Logs
        that have grown since are fine.

    Raises
    ------
    OSError
        If a log cannot be read.
    """
    return tuple(_findings(study, anchors))


def _findings(study: StudyPaths, anchors: Iterable[Anchor]) -> Iterator[Finding]:
    logs = {log.relative_to(study.root).as_posix(): log for log in _logs(study)}
    hashes: dict[str, tuple[str, ...]] = {}
    for anchor in anchors:
        path = study.root / anchor.log
        if anchor.log not in logs:
            yield broken(path, "needed the log that an anchor names, got no file")
            continue
        if anchor.log not in hashes:
            hashes[anchor.log] = line_hashes(logs[anchor.log])
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
                "changed, and the chain computed anew",
            )
