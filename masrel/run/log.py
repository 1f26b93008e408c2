"""The session log, open for appending: an event is on disk before anything follows.

``docs/session_log.md`` says what happens after a crash.
"""

import json
import math
import os
import sys
from collections.abc import Callable, Mapping
from datetime import UTC, datetime
from pathlib import Path
from types import TracebackType
from typing import Self

from masrel.errors import SessionLogError
from masrel.run.chain import (
    FIRST_PREVIOUS,
    Event,
    Fact,
    line_hash,
    parse_event,
    split_lines,
    verify,
)

if sys.platform != "win32":
    import fcntl

__all__ = ["SessionLog", "utc_now"]


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
    def open(cls, path: Path, *, now: Callable[[], datetime] = utc_now) -> Self:
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
        path.parent.mkdir(parents=True, exist_ok=True)
        is_new = not path.exists()
        descriptor = os.open(path, os.O_RDWR | os.O_CREAT, 0o644)
        try:
            _lock(descriptor, path)
            if is_new:
                _sync_folder(path.parent)
            return cls._recover(path, descriptor, now)
        except BaseException:
            os.close(descriptor)
            raise

    @classmethod
    def _recover(cls, path: Path, descriptor: int, now: Callable[[], datetime]) -> Self:
        data = path.read_bytes()
        lines, torn = split_lines(data)
        events = list(verify(path, lines))
        previous = line_hash(lines[-1]) if lines else FIRST_PREVIOUS
        log = cls(path, descriptor, events, previous, now)
        os.lseek(descriptor, len(data) - len(torn), os.SEEK_SET)
        if torn:
            log._take_in(torn, len(lines) + 1)
        return log

    def _take_in(self, torn: bytes, line: int) -> None:
        facts: dict[str, Fact] = {
            "line": line,
            "n_bytes": len(torn),
            "sha256": line_hash(torn),
        }
        # A line's closing brace is its last byte: what parses is a whole event.
        if _is_event(self.path, line, torn, self._previous):
            self._write(torn)
            self.append("recovered", {**facts, "kept": True, "moved_to": None})
            return
        beside = self.path.with_name(self.path.name + ".torn")
        with beside.open("ab") as file:
            file.write(torn + b"\n")
            file.flush()
            os.fsync(file.fileno())
        # The event overwrites the torn bytes, so that no crash here can lose both.
        self.append("recovered", {**facts, "kept": False, "moved_to": beside.name})

    @property
    def events(self) -> tuple[Event, ...]:
        """Every event, those read and those appended."""
        return tuple(self._events)

    @property
    def is_open(self) -> bool:
        """Whether events can be appended."""
        return self._descriptor is not None

    def append(self, kind: str, fields: Mapping[str, Fact]) -> Event:
        """Append one event and wait until it is on disk.

        Parameters
        ----------
        kind : str
            What happened.
        fields : mapping of str to str, int, float, bool or None
            Its facts; numbers finite.

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
        for name, fact in fields.items():
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
            rest = memoryview(line + b"\n")
            while rest:
                rest = rest[os.write(descriptor, rest) :]
            os.ftruncate(descriptor, os.lseek(descriptor, 0, os.SEEK_CUR))
            os.fsync(descriptor)
            is_written = True
        finally:
            # After a failed or interrupted write nothing may follow on this line.
            if not is_written:
                os.close(descriptor)
        self._events.append(parse_event(self.path, len(self._events) + 1, line))
        self._previous = line_hash(line)
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
        parse_event(path, number, line)
    except SessionLogError:
        return False
    return bool(json.loads(line)["previous"] == previous)


def _check_fact(path: Path, kind: str, name: str, fact: Fact) -> None:
    if fact is not None and not isinstance(fact, str | int | float):
        raise SessionLogError(
            f"{path}: event {kind!r}: {name} needs text, a number, true, false or "
            f"null, got {type(fact).__name__}"
        )
    if isinstance(fact, float) and not math.isfinite(fact):
        raise SessionLogError(
            f"{path}: event {kind!r}: {name} needs a finite number, got {fact}"
        )
    if isinstance(fact, str) and any("\ud800" <= sign <= "\udfff" for sign in fact):
        raise SessionLogError(
            f"{path}: event {kind!r}: {name} needs valid Unicode text, got {fact!a}"
        )


def _lock(descriptor: int, path: Path) -> None:
    # Released by the system when the process ends, killed or not.
    if sys.platform == "win32":
        return
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        raise SessionLogError(f"{path}: another process has this log open") from error


def _sync_folder(folder: Path) -> None:
    # A new file's name is on disk only when its folder is.
    if sys.platform == "win32":
        return
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(descriptor)
    finally:
        os.close(descriptor)
