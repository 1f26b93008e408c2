"""The days of sessions: how many lie between two, and when one may begin."""

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import date, datetime, time, timedelta

import msgspec

from masrel.errors import MasrelWarning, ParameterError
from masrel.lab._event_log import Event, SessionLog, read_log
from masrel.lab._study_files import Fact
from masrel.lab.protocol import Protocol, Session, StudyPaths

# Events that do not say when a rater was there last
_NOT_THE_RATERS = ("recovered", "correction", "answer-correction", "stopped")


def days_since(time_utc: str, now: Callable[[], datetime]) -> int:
    """Return the calendar days, where the computer is, since a time of a log."""
    day = datetime.fromisoformat(time_utc).astimezone().date()
    return (now().astimezone().date() - day).days


def last_time(events: Sequence[Event]) -> str:
    """Return when a rater was last there, ISO 8601 in UTC."""
    return [e.time_utc for e in events if e.kind not in _NOT_THE_RATERS][-1]


def completed_at(study: StudyPaths, rater: str, session: str) -> str | None:
    """Return when a session came to its end, or None."""
    log = study.log_file(rater, session)
    events = read_log(log) if log.exists() else ()
    completed = next((e.time_utc for e in events if e.kind == "complete"), None)
    return None if completed is None else _own_day(events) or completed


def _own_day(events: Sequence[Event]) -> str | None:
    # that of a session whose log was written on another one
    days = [e.fields["on"] for e in events if e.kind in ("held", "day-correction")]
    return str(days[-1]) if days else None


def log_interval(
    study: StudyPaths, protocol: Protocol, rater: str, session: str, log: SessionLog
) -> None:
    """Log the days before a session that has been, and cannot be refused any more.

    What the log says last is not said again.
    """
    sessions = tuple(
        msgspec.structs.replace(each, order_policy="warn") for each in protocol.sessions
    )
    lenient = msgspec.structs.replace(protocol, sessions=sessions)
    began = _own_day(log.events) or log.events[0].time_utc
    day = datetime.fromisoformat(began).astimezone().date()
    noon = datetime.combine(day, time(12))
    interval = interval_fields(study, lenient, rater, session, lambda: noon)
    before = [e.fields for e in log.events if e.kind == "interval"]
    if interval is not None and interval not in before[-1:]:
        log.append("interval", interval)


def interval_fields(
    study: StudyPaths,
    protocol: Protocol,
    rater: str,
    session: str,
    now: Callable[[], datetime],
) -> dict[str, Fact] | None:
    """Return what a log says of the session before; None where none has to be.

    A session that begins out of order is refused, or warned of.
    """
    rules = _rules(protocol, rater, session)
    if rules is None:
        return None
    days, problem = _order(study, rules, rater, now)
    if problem is not None:
        message = (
            f"{study.protocol}: sessions.{session}: needed {problem} for rater {rater}"
        )
        if rules.order_policy == "refuse":
            raise ParameterError(message)
        warnings.warn(message, MasrelWarning, stacklevel=2)
    return {
        "after": rules.after,
        "days": days,
        "at_least_days": rules.at_least_days,
        "at_most_days": rules.at_most_days,
        "kept": problem is None,
    }


def _rules(protocol: Protocol, rater: str, session: str) -> Session | None:
    # a session that comes after another one of the rater's
    rules = next(each for each in protocol.sessions if each.id == session)
    before = [each for each in protocol.sessions if each.id == rules.after]
    return rules if before and rater in before[0].raters else None


def _order(
    study: StudyPaths, rules: Session, rater: str, now: Callable[[], datetime]
) -> tuple[int | None, str | None]:
    # days since the session before, and what of the order does not hold
    completed = completed_at(study, rater, str(rules.after))
    days = None if completed is None else days_since(completed, now)
    return days, _problem(rules, days)


@dataclass(frozen=True, slots=True, kw_only=True)
class Due:
    """When a session that has not begun may begin."""

    first: date | None = None  # None where any day will do, or nobody knows yet
    last: date | None = None
    refused: str | None = None  # why it does not begin today
    is_overdue: bool = False


def due_of(
    study: StudyPaths,
    protocol: Protocol,
    rater: str,
    session: str,
    now: Callable[[], datetime],
) -> Due:
    """Return when a session that has not begun is due."""
    rules = _rules(protocol, rater, session)
    if rules is None:
        return Due()
    days, problem = _order(study, rules, rater, now)
    refused = problem if rules.order_policy == "refuse" else None
    if days is None:
        return Due(refused=refused)
    day = now().astimezone().date() - timedelta(days)
    low, high = (
        None if n is None else day + timedelta(n)
        for n in (rules.at_least_days, rules.at_most_days)
    )
    is_overdue = rules.at_most_days is not None and days > rules.at_most_days
    return Due(first=low, last=high, refused=refused, is_overdue=is_overdue)


def _problem(rules: Session, days: int | None) -> str | None:
    # what of the order of two sessions does not hold, or None
    low, high = rules.at_least_days, rules.at_most_days
    if days is None:
        return f"session {rules.after} complete before it, got one that is not"
    for key, limit, is_kept in (
        ("at_least_days", low, low is None or days >= low),
        ("at_most_days", high, high is None or days <= high),
    ):
        if not is_kept:
            words = key.replace("_", " ").removesuffix(" days")
            unit = "day" if limit == 1 else "days"
            return f"{words} {limit} {unit} after session {rules.after}, got {days}"
    return None
