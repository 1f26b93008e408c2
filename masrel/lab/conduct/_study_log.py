"""The log of a study: what happened beside its sessions, and rows that it allots.

``conduct.jsonl`` is a chain of events as a session log is one.
"""

import json
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from datetime import date, datetime
from functools import partial
from heapq import merge
from operator import itemgetter
from pathlib import Path

import masrel
from masrel._input import listed
from masrel.errors import ParameterError, SessionLogError
from masrel.lab._event_log import (
    Event,
    SessionLog,
    check_kinds,
    events_before_torn,
    line_hashes,
    read_log,
    timed_events,
    utc_now,
)
from masrel.lab._study_files import Fact, sha256_of
from masrel.lab.protocol import Protocol, StudyPaths, protocol_hash, scale_of
from masrel.lab.protocol._values import Answer
from masrel.lab.protocol.content import (
    _protocol_content,
    _refuse_unknown_coefficients,
)
from masrel.lab.schedule._orders import WITH_ROWS
from masrel.lab.schedule._secret import site_of
from masrel.lab.schedule.presentation import _read_drawn
from masrel.lab.schedule.sheets import write_schedules
from masrel.scales import published_scale

_FORMAT = 1

_WAIT_S = 5.0  # for somebody who records something else

# Every kind of event with the fields it has
_EVENTS = {
    "conduct": ("format", "study", "masrel_version"),
    "withdrawn": ("rater", "who", "why", "on"),
    "unblinded": ("rater", "session", "code", "who", "why"),
    "answered": ("rater", "questionnaire", "question", "answer"),
    "answer-correction": (
        "rater",
        "questionnaire",
        "question",
        "answer",
        "who",
        "why",
    ),
    "excluded": ("rater", "who", "why"),
    "included": ("rater", "who", "why"),
    "rater-set": ("rater", "field", "value", "who"),
    "rater-added": ("rater", "site", "who"),
    "noted": (
        "kind",
        "text",
        "who",
        "rater",
        "session",
        "on",
        "severity",
        "seriousness",
        "relatedness",
        "onset",
        "action",
        "outcome",
    ),
    "merged": ("name", "log", "n_lines", "sha256", "protocol_sha256"),
    "drawn": ("site", "protocol_sha256", "protocol", "texts_sha256"),
    "amended": ("protocol_sha256", "protocol", "texts_sha256", "who", "why"),
    "allotted": ("rater", "session", "site", "scheme", "row"),
    "recovered": ("line", "n_bytes", "sha256", "kept", "moved_to"),
}

# Fields that events had not before they had a day of their own
_LATER: dict[str, tuple[set[str], ...]] = {
    "withdrawn": ({"on"},),
    "noted": ({"on", "seriousness", "relatedness", "onset"},),
}

_SHOWN = (
    "withdrawn",
    "unblinded",
    "excluded",
    "included",
    "rater-set",
    "rater-added",
    "noted",
    "merged",
)


# Events that keep the protocol as it was
VERSIONS = ("drawn", "amended")


def read_conduct(study: StudyPaths) -> tuple[Event, ...]:
    """Read what happened to a study beside its sessions, and verify its chains.

    Parameters
    ----------
    study : StudyPaths
        Where the study is. One that was merged from others has their logs too.

    Returns
    -------
    tuple of Event
        In chronological order, with the fields that
        ``docs/reference/formats/conduct_log.md`` lists; None means all, or nothing.
        Empty if nothing happened.

    Raises
    ------
    SessionLogError
        If a log is damaged or holds something that is not such an event.
    """
    return tuple(e for _, e in events_of_logs(study) if e.kind in _SHOWN)


def conduct_hash(study: StudyPaths) -> str | None:
    """Return a hash of what `read_conduct` returns; None where that is nothing."""
    facts = [(e.time_utc, e.kind, dict(e.fields)) for e in read_conduct(study)]
    text = json.dumps(facts, sort_keys=True).encode()
    return sha256_of(text) if facts else None


def events_of_logs(study: StudyPaths) -> Iterator[tuple[Path, Event]]:
    """Yield every event of a study's logs, with its log, in order of time."""
    logs = study.conduct_logs()
    for log in logs:
        _check_events(log, read_log(log))
    for _, log, event in merge(*map(timed_events, logs), key=itemgetter(0)):
        yield log, event


def _check_events(log: Path, events: Iterable[Event]) -> None:
    check_kinds(log, events, _EVENTS, head="conduct", newest=_FORMAT, later=_LATER)


def append_event(
    study: StudyPaths,
    protocol: Protocol,
    kind: str,
    fields: Mapping[str, Fact],
    *,
    now: Callable[[], datetime] = utc_now,
) -> None:
    """Append an event to the log of a study; the first one comes after a head."""
    with open_conduct(study, protocol, now=now) as log:
        log.append(kind, fields)


def recover_conduct(study: StudyPaths) -> None:
    """Set aside what was written of a line, so that what reads the log can go on."""
    log = study.conduct_file
    if log.exists() and events_before_torn(log) is not None:
        SessionLog.open(log, wait_s=_WAIT_S).close()


@contextmanager
def open_conduct(
    study: StudyPaths, protocol: Protocol, *, now: Callable[[], datetime] = utc_now
) -> Iterator[SessionLog]:
    """Give the log of a study, verified and with its head, to append events to."""
    with SessionLog.open(study.conduct_file, now=now, wait_s=_WAIT_S) as log:
        _check_events(log.path, log.events)
        if not any(event.kind == "conduct" for event in log.events):
            head: dict[str, Fact] = {
                "format": _FORMAT,
                "study": protocol.study.id,
                "masrel_version": masrel.__version__,
            }
            log.append("conduct", head)
        yield log


def stated(**texts: str) -> dict[str, str]:
    """Return the texts without blanks around them; refuse one that is blank."""
    for name, text in texts.items():
        if not text.strip():
            raise ParameterError(f"{name}: needed text, got none")
    return {name: text.strip() for name, text in texts.items()}


def check_choice(name: str, value: str, choices: Iterable[str]) -> None:
    """Refuse a value that is not one of the choices."""
    if value not in (known := tuple(choices)):
        raise ParameterError(f"{name}: needed one of {listed(known)}, got {value!r}")


def past_day(name: str, text: str, now: Callable[[], datetime]) -> str:
    """Return a date in ISO 8601; refuse an invalid or a future one."""
    today = now().astimezone().date()
    try:
        day = date.fromisoformat(text)
    except ValueError:
        day = date.max
    if day > today:
        raise ParameterError(
            f"{name}: needed a day up to {today}, as {today} is written, got {text!r}"
        )
    return day.isoformat()


def check_rater(protocol: Protocol, rater: str) -> None:
    """Refuse a rater that the protocol does not have."""
    check_choice("rater", rater, [each.id for each in protocol.raters])


def study_answers(study: StudyPaths) -> dict[str, dict[tuple[str, str], Answer]]:
    """Return the last answer of each rater by questionnaire and question."""
    answers: dict[str, dict[tuple[str, str], Answer]] = {}
    for _, event in events_of_logs(study):
        if event.kind in ("answered", "answer-correction"):
            fields, answer = event.fields, event.fields["answer"]
            if not isinstance(answer, str | int | float | None):
                raise SessionLogError(
                    f"{study.conduct_file}: line {event.line}: {event.kind}: needed "
                    f"one answer, got {answer!r}"
                )
            key = str(fields["questionnaire"]), str(fields["question"])
            answers.setdefault(str(fields["rater"]), {})[key] = answer
    return answers


def merged_log_problems(study: StudyPaths) -> Iterator[tuple[Path, str]]:
    """Yield what is wrong with the logs in ``conduct/``, each with its file."""
    named = set()
    for event in read_conduct(study):
        if event.kind != "merged" or event.fields["log"] is None:
            continue
        log = study.root / str(event.fields["log"])
        named.add(log)
        if not log.is_file():
            yield log, "needed the log of a merged study, got no file"
            continue
        hashes = line_hashes(log)
        sha256 = hashes[-1] if hashes else None
        if (len(hashes), sha256) != (event.fields["n_lines"], event.fields["sha256"]):
            yield (
                log,
                f"needed {event.fields['n_lines']} lines, the last with SHA-256 "
                f"{event.fields['sha256']}, as they were merged, got {len(hashes)} and "
                f"{sha256}",
            )
    for log in sorted(study.merged_conduct.glob("*")):
        if log not in named:
            yield log, "is in conduct/, and no merged study has it"


def allot_schedules(
    study: StudyPaths,
    protocol: Protocol,
    *,
    site: str | None = None,
    redraw: bool = False,
    now: Callable[[], datetime] = utc_now,
) -> tuple[Path, ...]:
    """Draw every schedule that is not there yet, its row allotted by the study's log.

    Parameters
    ----------
    study : StudyPaths
        Where the study is.
    protocol : Protocol
        The study's protocol. If its scheme has no rows, nothing is logged.
    site : str, optional
        Of the raters of this site alone; sites must be strata.
    redraw : bool
        Draw stale or damaged schedules again; a rater's row stays the same.
    now : callable, optional
        Gives the time of day, aware.

    Returns
    -------
    tuple of Path
        The files written; empty when all were there.

    Raises
    ------
    ProtocolError
        If a line of the plan names no coefficient.
    ScheduleError
        As `write_schedules` does; no row is allotted then.
    SessionLogError
        If the log of the study's conduct is damaged.
    OSError
        If the system refuses a folder or file.
    """
    _refuse_unknown_coefficients(protocol, study.protocol)
    allot = partial(_allot, study, protocol, now, site)
    return write_schedules(protocol, study, redraw=redraw, site=site, allot=allot)


def _allot(
    study: StudyPaths,
    protocol: Protocol,
    now: Callable[[], datetime],
    site: str | None,
    places: Sequence[tuple[str, str]],
) -> dict[tuple[str, str], int]:
    """Record the draw, and return the rows of raters; those without one get the next.

    Of schemes without rows none.
    """
    scheme = protocol.schedule.scheme
    with open_conduct(study, protocol, now=now) as log:  # nobody else allots meanwhile
        if last_version(log.events) != protocol_hash(protocol):
            log.append("drawn", {"site": site, **version_of(protocol)})
        allotted: dict[tuple[str, str], int] = {}
        rows = _Rows(events_of_logs(study) if scheme in WITH_ROWS else ())
        for rater, session in places if scheme in WITH_ROWS else ():
            design = (session, site_of(protocol, rater), scheme)
            row, _ = rows.of_rater.get((rater, *design), (rows.n[design] + 1, None))
            if (rater, *design) not in rows.of_rater:
                names = ("rater", "session", "site", "scheme", "row")
                fields = dict(zip(names, (rater, *design, row), strict=True))
                rows.add(log.path, log.append("allotted", fields))
            allotted[rater, session] = row
    return allotted


def version_of(protocol: Protocol) -> dict[str, str]:
    """Return the fields of an event that keeps a protocol, and the scale's texts."""
    published = published_scale(scale_of(protocol))
    texts = {} if published is None else dict(published.meanings)
    return {
        "protocol_sha256": protocol_hash(protocol),
        "protocol": _protocol_content(protocol).decode(),
        "texts_sha256": sha256_of(json.dumps(texts).encode()),
    }


def last_version(events: Iterable[Event]) -> str | None:
    """Return the hash of the protocol that events kept last; None where none did."""
    hashes = [e.fields["protocol_sha256"] for e in events if e.kind in VERSIONS]
    return str(hashes[-1]) if hashes else None


_Design = tuple[str, str | None, str]  # session, site, scheme


class _Rows:
    """The rows that events of logs allotted, in order, and what is wrong with these.

    Nobody asks for a row: whoever comes next gets the next one that no event has, in
    the session and at the site; a row that was allotted once stays that rater's.
    """

    def __init__(self, events: Iterable[tuple[Path, Event]]) -> None:
        # row of a rater, and the log that has it; how many of each design there are
        self.of_rater: dict[tuple[str, str, str | None, str], tuple[int, Path]] = {}
        self.n: Counter[_Design] = Counter()
        self.problems: list[tuple[Path, str]] = []
        for log, event in events:
            if event.kind == "allotted":
                self.add(log, event)

    def add(self, log: Path, event: Event) -> None:
        """Take in an event, and note what is wrong with it."""
        fields = event.fields
        rater, session, scheme = (
            str(fields[k]) for k in ("rater", "session", "scheme")
        )
        design = session, str(fields["site"]) if fields["site"] else None, scheme
        prior, _ = self.of_rater.get((rater, *design), (None, None))
        if prior is not None and prior == fields["row"]:
            return  # the log of another copy of the study has it, too
        self.n[design] += 1
        row = self.n[design]
        where = f"line {event.line}: allotted: rater {rater} in session {session}"
        if fields["row"] != row:
            needed = f"needed row {row}, the next one, got {fields['row']}"
            self.problems.append((log, f"{where}: {needed}"))
        if prior is None:
            self.of_rater[rater, *design] = row, log
        else:
            needed = f"needed a rater without a row, got one with row {prior}"
            self.problems.append((log, f"{where}: {needed}"))


def allotment_problems(
    study: StudyPaths, protocol: Protocol
) -> Iterator[tuple[Path, str]]:
    """Yield where allotted rows, or rows of schedules, are not those of the logs."""
    # of a merged study the logs of its sites
    rows = _Rows(events_of_logs(study))
    yield from rows.problems
    logs = listed(map(str, study.conduct_logs() or [study.conduct_file]))
    drawn = _read_drawn(study, protocol.rater_sessions, skips_damaged=True)
    for path, schedule in drawn:
        design = (schedule.session, schedule.site, schedule.scheme)
        row, log = rows.of_rater.get((schedule.rater, *design), (None, logs))
        if schedule.row != row and schedule.scheme in WITH_ROWS:
            by = "a row that was allotted" if row is None else f"row {row}"
            yield path, f"needed {by}, by {log}, got row {schedule.row}"
