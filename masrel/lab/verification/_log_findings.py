"""What can be wrong with any log, of a session or a training, and its recordings."""

import hashlib
import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from datetime import datetime
from pathlib import Path
from typing import TypeVar

from masrel.errors import SessionLogError
from masrel.lab._bounded_files import (
    MAX_RECORDING,
    MAX_SMALL,
    format_problem,
    parse_json,
    read_regular,
)
from masrel.lab._event_log import Event
from masrel.lab.recording import _FORMAT
from masrel.lab.schedule import Presentation
from masrel.lab.verification._finding import Finding, broken, doubt

_Checked = TypeVar("_Checked")

# Facts of a recording that the schedule has too, and those that the log has
_FROM_SCHEDULE = ("code", "position", "model", "repeat")
_FROM_LOG = ("attempt", "mean_speed_deg_s", "n_missed_ticks", "fault", "simulated")


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
    """Yield events whose time of day is none, or before that of the last one."""
    before = None
    for event in events:
        where, time = f"line {event.line}: {event.kind}", _time(event)
        if time is None:
            yield broken(log, f"{where}: needed a time in UTC, got {event.time_utc!r}")
        elif before is not None and time < before:
            yield doubt(
                log,
                f"{where}: at {event.time_utc}, earlier than the line before: has the "
                "clock been set back?",
            )
        before = time or before


def _time(event: Event) -> datetime | None:
    try:
        time = datetime.fromisoformat(event.time_utc)
    except ValueError:
        return None
    return time if time.tzinfo is not None else None


def recording_findings(
    path: Path, shown: Presentation, of: Mapping[str, str], event: Event, where: str
) -> Iterator[Finding]:
    """Yield what is wrong with the recording that an event names."""
    # of: study, rater and session; where: the event's line and log, in words
    facts, findings = hashed_facts(path, event, where)
    yield from findings
    if facts is not None:
        path = path.with_suffix(".json")
        yield from _fact_findings(path, facts, shown, of, event, where)


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
        if sha256 not in (None, hashlib.sha256(data).hexdigest()):
            findings.append(broken(file, f"is not the file whose SHA-256 {where} has"))
    return data, findings


def _fact_findings(
    path: Path,
    data: bytes,
    shown: Presentation,
    of: Mapping[str, str],
    event: Event,
    where: str,
) -> Iterator[Finding]:
    # what a file says that was not hashed once must at least agree with what was
    try:
        facts = parse_json(data)
    except ValueError:
        facts = None
    if not isinstance(facts, dict):
        yield broken(path, "needed a JSON object, got none")
        return
    problem = format_problem(facts.get("format", 1), newest=_FORMAT)
    if problem is not None:
        yield broken(path, problem)
    needed: dict[str, object] = {
        **of,
        "sha256": event.fields["sha256"],
        **{name: getattr(shown, name) for name in _FROM_SCHEDULE},
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
