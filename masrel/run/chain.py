"""The chain of a session log: every line carries the hash of the line before.

``docs/session_log.md`` has the format, and how to verify it without masrel.
"""

import hashlib
import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType

from masrel.errors import SessionLogError

__all__ = [
    "FIRST_PREVIOUS",
    "Event",
    "Fact",
    "line_hash",
    "parse_event",
    "read_log",
    "split_lines",
    "verify",
]

FIRST_PREVIOUS = "0" * 64
"""What the first line carries in place of the hash of a line before it."""

_KEYS = ("event", "time_utc", "previous", "fields")

Fact = str | int | float | bool | None


@dataclass(frozen=True, slots=True, kw_only=True)
class Event:
    """One line of a session log.

    Attributes
    ----------
    line : int
        Its number in the file, from 1.
    kind : str
        What happened: ``"session"``, ``"presented"``, ``"grade"`` and others.
    time_utc : str
        When, ISO 8601 in UTC.
    fields : mapping of str to str, int, float, bool or None
        The facts of the event.
    """

    line: int
    kind: str
    time_utc: str
    fields: Mapping[str, Fact] = field(hash=False)


def read_log(path: Path) -> tuple[Event, ...]:
    """Read a session log and verify its whole chain.

    Parameters
    ----------
    path : Path
        The log.

    Returns
    -------
    tuple of Event
        Every event in order; empty when the file is.

    Raises
    ------
    SessionLogError
        If the file is missing, a line is not an event, a line does not carry the
        hash of the line before, or the last line is torn.
    """
    if not path.is_file():
        raise SessionLogError(f"{path}: no such session log")
    lines, torn = split_lines(path.read_bytes())
    if torn:
        raise SessionLogError(
            f"{path}: line {len(lines) + 1}: ends without a newline, its writing was "
            "interrupted; masrel run for this rater and session recovers the log"
        )
    return verify(path, lines)


def split_lines(data: bytes) -> tuple[list[bytes], bytes]:
    """Return the lines without their newlines, and what follows the last newline."""
    *lines, torn = data.split(b"\n")
    return lines, torn


def line_hash(line: bytes) -> str:
    """Return the SHA-256 of a line without its newline, in hexadecimal."""
    return hashlib.sha256(line).hexdigest()


def verify(path: Path, lines: list[bytes]) -> tuple[Event, ...]:
    """Verify a chain from its first line on."""
    previous = FIRST_PREVIOUS
    events = []
    for number, line in enumerate(lines, start=1):
        events.append(parse_event(path, number, line))
        carried = json.loads(line)["previous"]
        if carried != previous:
            raise SessionLogError(
                f"{path}: line {number}: needed previous = {previous}"
                + (f" (the hash of line {number - 1})" if number > 1 else "")
                + f", got {carried}: a line before was changed, removed or added"
            )
        previous = line_hash(line)
    return tuple(events)


def parse_event(path: Path, number: int, line: bytes) -> Event:
    """Read one line, without regard to the chain."""
    try:
        document = json.loads(line.decode("utf-8"))
    except ValueError as error:
        raise SessionLogError(
            f"{path}: line {number}: needed one JSON object, got {line[:40]!r} "
            f"({error})"
        ) from error
    if not isinstance(document, dict) or tuple(document) != _KEYS:
        raise SessionLogError(
            f"{path}: line {number}: needed an object with the keys "
            f"{', '.join(_KEYS)}, got {line[:40]!r}"
        )
    kind, time_utc, fields = document["event"], document["time_utc"], document["fields"]
    if not (
        isinstance(kind, str) and isinstance(time_utc, str) and isinstance(fields, dict)
    ):
        raise SessionLogError(
            f"{path}: line {number}: needed text in event and time_utc and an object "
            "in fields"
        )
    for name, fact in fields.items():
        if isinstance(fact, dict | list):
            raise SessionLogError(
                f"{path}: line {number}: {name} needs text, a number, true, false or "
                f"null, got {fact!r}"
            )
    return Event(
        line=number, kind=kind, time_utc=time_utc, fields=MappingProxyType(fields)
    )
