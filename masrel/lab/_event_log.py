"""The session log: a chain of events, each on disk before anything follows.

Every line carries the hash of the line before.
``docs/reference/formats/session_log.md`` has the format, how to verify it without
masrel, and what happens after a crash.
"""

import errno
import json
import math
import os
import sys
import time
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from datetime import UTC, datetime
from itertools import accumulate
from pathlib import Path
from types import MappingProxyType, TracebackType
from typing import Self

from masrel._files import make_folder, naming, sync_folder
from masrel.errors import SessionLogError, SessionLogInUseError
from masrel.lab._study_files import (
    MAX_TABLE,
    Fact,
    Facts,
    as_then,
    format_problem,
    lines_then,
    no_follow,
    once,
    parse_json,
    read_regular,
    sha256_of,
)

if sys.platform != "win32":
    import fcntl

# What the first line carries in place of the hash of a line before it
_FIRST_PREVIOUS = "0" * 64

_LOOK_S = 0.02  # between two looks whether a log is free

_KEYS = ("event", "time_utc", "previous", "fields")


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
        The facts of the event; that of stretches is a list of such mappings.
    """

    line: int
    kind: str
    time_utc: str
    fields: Mapping[str, Facts] = field(hash=False)


@once
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
    if (n_lines := lines_then(path)) is not None:
        return as_then({}, read_log, path)[:n_lines]
    lines, torn = _split_lines(_read(path))
    if torn:
        raise SessionLogError(
            f"{path}: line {len(lines) + 1}: ends without a newline, its writing was "
            "interrupted; the command that wrote it recovers the log when called again"
        )
    return _verify(path, lines)


def timed_events(log: Path) -> list[tuple[str, Path, Event]]:
    """Return the events of a log, each with its time and the log.

    Where a clock was set back it is the latest time so far, so that no order changes.
    """
    events = read_log(log)
    latest = accumulate((event.time_utc for event in events), max)
    return [(time, log, event) for time, event in zip(latest, events, strict=True)]


def events_before_torn(path: Path) -> tuple[Event, ...] | None:
    """Return the events of a log's whole lines; None unless a torn line follows."""
    lines, torn = _split_lines(_read(path))
    return _verify(path, lines) if torn else None


def _read(path: Path) -> bytes:
    try:
        return read_regular(path, most=MAX_TABLE, follows=False)
    except FileNotFoundError as error:
        raise SessionLogError(f"{path}: no such session log") from error
    except OSError as error:
        if error.errno == errno.ELOOP:  # it would show what is not the study's
            raise SessionLogError(f"{path}: needed a log, got a link") from error
        raise


def _split_lines(data: bytes) -> tuple[list[bytes], bytes]:
    """Return the lines without their newlines, and what follows the last newline."""
    *lines, torn = data.split(b"\n")
    return lines, torn


def line_hashes(path: Path) -> tuple[str, ...]:
    """Return the SHA-256 of every whole line of a log, whatever is in it."""
    return tuple(sha256_of(line) for line in _split_lines(_read(path))[0])


def _verify(path: Path, lines: list[bytes]) -> tuple[Event, ...]:
    """Return the events of a chain that holds from its first line on."""
    previous = _FIRST_PREVIOUS
    events = []
    for number, line in enumerate(lines, start=1):
        event, claimed = _parse_line(path, number, line)
        events.append(event)
        if claimed != previous:
            raise SessionLogError(
                f"{path}: line {number}: needed previous = {previous}"
                + (f" (the hash of line {number - 1})" if number > 1 else "")
                + f", got {claimed}: a line before was changed, removed or added"
            )
        previous = sha256_of(line)
    return tuple(events)


def _parse_line(path: Path, number: int, line: bytes) -> tuple[Event, object]:
    """Return the event of one line, and what it carries as the hash before it."""
    try:
        document = parse_json(line.decode("utf-8"))
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
    for name, entry in fields.items():
        for fact in _facts_of(entry):
            if isinstance(fact, dict | list):
                raise SessionLogError(
                    f"{path}: line {number}: {name} needs text, a number, true, false "
                    f"or null, or objects of these, got {entry!r}"
                )
    event = Event(
        line=number, kind=kind, time_utc=time_utc, fields=MappingProxyType(fields)
    )
    return event, document["previous"]


def check_kinds(
    path: Path,
    events: Iterable[Event],
    kinds: Mapping[str, tuple[str, ...]],
    *,
    head: str,
    newest: int,
    later: Mapping[str, tuple[set[str], ...]] = MappingProxyType({}),
) -> None:
    """Refuse events that are not of these kinds, each with its fields.

    The event `head` says which format it is; `later` has fields of a kind that events
    of earlier versions lack, those that came together in one set.
    """
    for event in events:
        problem = None
        if event.kind not in kinds:
            problem = f"needed an event of {', '.join(kinds)}"
        elif event.kind == head:  # first: another format has other fields
            problem = format_problem(event.fields.get("format"), newest=newest)
        if problem is None:
            fields, got = set(kinds[event.kind]), set(event.fields)
            absent = fields - got
            old = (each for each in later.get(event.kind, ()) if each <= absent)
            if got - fields or absent != set().union(*old):
                problem = (
                    f"needed the fields {', '.join(kinds[event.kind])}, "
                    f"got {', '.join(event.fields)}"
                )
        if problem is not None:
            raise SessionLogError(f"{path}: line {event.line}: {event.kind}: {problem}")


def _facts_of(entry: object) -> list[object]:
    """Return the facts of a field: itself, or the values of a list of objects."""
    if isinstance(entry, list) and all(isinstance(item, dict) for item in entry):
        return [fact for item in entry for fact in item.values()]
    return [entry]


def utc_now() -> datetime:
    """Return the time of day in UTC."""
    return datetime.now(UTC)


class SessionLog:
    """A session log open for appending; every event is on disk when `append` returns.

    Use `SessionLog.open`. A context manager; closing twice is harmless.

    Attributes
    ----------
    path : Path
        The file.
    """

    def __init__(
        self,
        path: Path,
        descriptor: int,
        events: list[Event],
        previous: str,
        now: Callable[[], datetime],
    ) -> None:
        self.path = path
        self._descriptor: int | None = descriptor
        self._events = events
        self._previous = previous
        self._now = now

    @classmethod
    def open(
        cls,
        path: Path,
        *,
        now: Callable[[], datetime] = utc_now,
        wait_s: float = 0.0,
    ) -> Self:
        """Open a log for appending, verify it, and recover a torn last line.

        A torn line goes to ``<name>.torn`` beside the log, and an event
        ``"recovered"`` takes its place. A last line that lacks only its newline is
        a whole event: it stays, and the event says so.

        Parameters
        ----------
        path : Path
            The log; made with its folder when missing.
        now : callable, optional
            Gives the time of day, aware.
        wait_s : float, optional
            How long to wait while another process has the log open, in seconds.

        Returns
        -------
        SessionLog
            The open log.

        Raises
        ------
        SessionLogError
            If the log is damaged, or another process has it open.
        OSError
            If the file cannot be opened.
        """
        make_folder(path.parent, mode=0o700)  # recordings in it name their models
        # that of conduct is in a folder that others may read
        descriptor = no_follow(str(path), os.O_RDWR | os.O_CREAT)
        # It closes its descriptor once, also when the disk refuses what is recovered.
        log = cls(path, descriptor, [], _FIRST_PREVIOUS, now)
        try:
            _lock(descriptor, path, wait_s)
            sync_folder(path.parent)  # also of a log that a dead process made
            log._recover(descriptor)
        except BaseException:
            log.close()
            raise
        return log

    def _recover(self, descriptor: int) -> None:
        data = _read(self.path)
        lines, torn = _split_lines(data)
        self._events += _verify(self.path, lines)
        if lines:
            self._previous = sha256_of(lines[-1])
        os.lseek(descriptor, len(data) - len(torn), os.SEEK_SET)
        if torn:
            self._take_in(torn, len(lines) + 1)

    def _take_in(self, torn: bytes, line: int) -> None:
        facts: dict[str, Fact] = {
            "line": line,
            "n_bytes": len(torn),
            "sha256": sha256_of(torn),
        }
        # A line's closing brace is its last byte: what parses is a whole event.
        if _is_event(self.path, line, torn, self._previous):
            self._write(torn)
            self.append("recovered", {**facts, "kept": True, "moved_to": None})
            return
        torn_file = self.path.with_name(self.path.name + ".torn")
        with naming(torn_file), open(torn_file, "ab", opener=no_follow) as file:
            file.write(torn + b"\n")
            file.flush()
            os.fsync(file.fileno())
        sync_folder(torn_file.parent)
        # The event overwrites the torn bytes, so that no crash here can lose both.
        self.append("recovered", {**facts, "kept": False, "moved_to": torn_file.name})

    @property
    def events(self) -> tuple[Event, ...]:
        """Every event, those read and those appended."""
        return tuple(self._events)

    def append(self, kind: str, fields: Mapping[str, Facts]) -> Event:
        """Append one event and wait until it is on disk.

        Parameters
        ----------
        kind : str
            What happened.
        fields : mapping of str to str, int, float, bool or None
            Its facts, or lists of mappings of such facts; numbers finite.

        Returns
        -------
        Event
            The event as it is in the file.

        Raises
        ------
        SessionLogError
            If the log is closed or a fact cannot be written as JSON text.
        OSError
            If the disk refuses; the log is then closed, and opening it again
            recovers what was written.
        """
        time_utc = self._now().astimezone(UTC).isoformat(timespec="milliseconds")
        for name, entry in fields.items():
            for fact in _facts_of(entry):
                _check_fact(self.path, kind, name, fact)
        document = {
            "event": kind,
            "time_utc": time_utc.replace("+00:00", "Z"),
            "previous": self._previous,
            "fields": dict(fields),
        }
        self._write(json.dumps(document, ensure_ascii=False).encode("utf-8"))
        return self._events[-1]

    def _write(self, line: bytes) -> None:
        if self._descriptor is None:
            raise SessionLogError(f"{self.path}: the log is closed")
        descriptor, self._descriptor = self._descriptor, None
        is_written = False
        try:
            with naming(self.path):
                remaining = memoryview(line + b"\n")
                while remaining:
                    remaining = remaining[os.write(descriptor, remaining) :]
                os.ftruncate(descriptor, os.lseek(descriptor, 0, os.SEEK_CUR))
                os.fsync(descriptor)
            is_written = True
        finally:
            # After a failed or interrupted write nothing may follow on this line.
            if not is_written:
                os.close(descriptor)
        event, _ = _parse_line(self.path, len(self._events) + 1, line)
        self._events.append(event)
        self._previous = sha256_of(line)
        self._descriptor = descriptor

    def close(self) -> None:
        """Close the log; more than once is harmless."""
        descriptor, self._descriptor = self._descriptor, None
        if descriptor is not None:
            os.close(descriptor)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()


def _is_event(path: Path, number: int, line: bytes, previous: str) -> bool:
    try:
        _, claimed = _parse_line(path, number, line)
    except SessionLogError:
        return False
    return claimed == previous


def _check_fact(path: Path, kind: str, name: str, fact: object) -> None:
    rules = (
        (
            fact is not None and not isinstance(fact, str | int | float),
            f"text, a number, true, false or null, got {type(fact).__name__}",
        ),
        (
            isinstance(fact, float) and not math.isfinite(fact),
            f"a finite number, got {fact}",
        ),
        (
            isinstance(fact, str)
            and any("\ud800" <= sign <= "\udfff" for sign in fact),
            f"valid Unicode text, got {fact!a}",
        ),
    )
    for is_broken, needs in rules:
        if is_broken:
            raise SessionLogError(f"{path}: event {kind!r}: {name} needs {needs}")


def _lock(descriptor: int, path: Path, wait_s: float) -> None:
    # Released by the system when the process ends, killed or not.
    if sys.platform == "win32":
        return
    until = time.monotonic() + wait_s
    while True:
        try:
            return fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            if time.monotonic() >= until:
                waited = f", still after {wait_s:g} s: try again" if wait_s else ""
                raise SessionLogInUseError(
                    f"{path}: another process has this log open{waited}"
                ) from error
        except OSError as error:
            error.filename = str(path)  # such as a file system without locks
            raise
        time.sleep(_LOOK_S)
