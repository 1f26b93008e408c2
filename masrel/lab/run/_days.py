"""The days of sessions: how many lie between two, and when one may begin."""

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import date, datetime, time, timedelta

import msgspec

from masrel.errors import MasrelWarning, ParameterError
from masrel.lab._event_log import Event, SessionLog
from masrel.lab._study_files import Fact
from masrel.lab.protocol import Protocol, Session, StudyPaths
from masrel.lab.run._state import SessionState, read_session, replay

# Events that do not say when a rater was there last
_NOT_THE_RATERS = ("recovered", "correction", "answer-correction", "stopped")


def days_since(time_utc: str, now: Callable[[], datetime]) -> int:
    """Return the calendar days, where the computer is, since a time of a log."""
    day = datetime.fromisoformat(time_utc).astimezone().date()
    return (now().astimezone().date() - day).days


def last_time(events: Sequence[Event]) -> str:
    """Return when a rater was last there, ISO 8601 in UTC."""
    return [e.time_utc for e in events if e.kind not in _NOT_THE_RATERS][-1]


def held_on(events: Sequence[Event], state: SessionState) -> date | None:
    """Return the day of a session by its log; None before it has begun."""
    if not events:
        return None
    completed = [event.time_utc for event in events if event.kind == "complete"]
    time = state.held_on or next(iter(completed), last_time(events))
    return datetime.fromisoformat(time).astimezone().date()


def completed_on(study: StudyPaths, rater: str, session: str) -> date | None:
    """Return the day of a session that has come to its end, or None."""
    log = study.log_file(rater, session)
    events, state = read_session(log) if log.exists() else ((), SessionState())
    return held_on(events, state) if state.is_complete else None


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
    began = replay(log.path, log.events).held_on or log.events[0].time_utc
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
    day = completed_on(study, rater, str(rules.after))
    days = None if day is None else days_since(day.isoformat(), now)
    return days, _problem(rules, days)


@dataclass(frozen=True, slots=True, kw_only=True)
class Due:
    """When a session that has not begun may begin.

    Attributes
    ----------
    first, last : str or None
        The first and the last day, ISO 8601; None where any day will do, or nobody
        knows yet.
    not_today : str or None
        Why it should not begin today: it would be refused, or its turn has not come.
    is_overdue : bool
        Whether its last day is over.
    """

    first: str | None = None
    last: str | None = None
    not_today: str | None = None
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
    if days is None:
        return Due(not_today=problem)
    day = now().astimezone().date() - timedelta(days)
    low, high = (
        None if n is None else (day + timedelta(n)).isoformat()
        for n in (rules.at_least_days, rules.at_most_days)
    )
    is_late = rules.at_most_days is not None and days > rules.at_most_days
    return Due(
        first=low,
        last=high,
        not_today=None if is_late and rules.order_policy == "warn" else problem,
        is_overdue=is_late,
    )


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
