"""What happened to a study beside its sessions: raters withdrawn, codes unblinded.

Each is an event of ``conduct.jsonl``, a chain of events as a session log is one.
"""

from collections.abc import Callable, Iterator, Mapping
from datetime import datetime
from typing import TYPE_CHECKING

import masrel
from masrel.errors import ParameterError, ScheduleError, SessionLogError
from masrel.protocol import Protocol, StudyPaths
from masrel.run._log import Event, SessionLog, read_log, utc_now
from masrel.schedule import Presentation, Schedule, read_schedule

if TYPE_CHECKING:
    from masrel.recording import _Fact  # loads numpy

_FORMAT = 1

_EVENTS = {
    "conduct": ("format", "study", "masrel_version"),
    "withdrawn": ("rater", "who", "why"),
    "unblinded": ("rater", "session", "code", "who", "why"),
    "recovered": ("line", "n_bytes", "sha256", "kept", "moved_to"),
}
"""Every kind of event with the fields it has."""

_SHOWN = ("withdrawn", "unblinded")


def read_conduct(study: StudyPaths) -> tuple[Event, ...]:
    """Read what happened to a study beside its sessions, and verify its chain.

    Parameters
    ----------
    study : StudyPaths
        Where the study is.

    Returns
    -------
    tuple of Event
        In order of time: ``"withdrawn"`` with `rater`, `who` and `why`, and
        ``"unblinded"`` with `rater`, `session`, `code`, `who` and `why`, where None
        stands for all. Empty when nothing happened.

    Raises
    ------
    SessionLogError
        If the log is damaged or holds what is no such event.
    """
    path = study.conduct_file
    if not path.exists():
        return ()
    return tuple(e for e in _checked(study, read_log(path)) if e.kind in _SHOWN)


def record_withdrawal(
    study: StudyPaths,
    protocol: Protocol,
    rater: str,
    *,
    who: str,
    why: str,
    now: Callable[[], datetime] = utc_now,
) -> None:
    """Record that a rater has left the study; the grades given before stay in it.

    Parameters
    ----------
    study : StudyPaths
        Where the study is.
    protocol : Protocol
        The study's protocol, which goes on having the rater.
    rater : str
        Who has left.
    who, why : str
        Who says so, and for what reason.
    now : callable, optional
        Gives the time of day, aware.

    Raises
    ------
    ParameterError
        If the protocol has no such rater, he or she has left already, or `who` or
        `why` is blank.
    SessionLogError
        If the log of the study's conduct is damaged.
    OSError
        If it cannot be written.
    """
    known = [each.id for each in protocol.raters]
    if rater not in known:
        raise ParameterError(f"rater: needed one of {', '.join(known)}, got {rater!r}")
    refuse_withdrawn(study, rater)
    _append(study, protocol, "withdrawn", {"rater": rater}, who, why, now)


def refuse_withdrawn(study: StudyPaths, rater: str) -> None:
    """Refuse a rater who has left the study."""
    for event in read_conduct(study):
        if event.kind == "withdrawn" and event.fields["rater"] == rater:
            raise ParameterError(
                f"rater: needed one who takes part, {rater} was withdrawn on "
                f"{event.time_utc[:10]} by {event.fields['who']}: "
                f"{event.fields['why']}"
            )


def record_unblinding(
    study: StudyPaths,
    protocol: Protocol,
    code: str | None,
    *,
    who: str,
    why: str,
    rater: str | None = None,
    session: str | None = None,
    now: Callable[[], datetime] = utc_now,
) -> tuple[tuple[Schedule, Presentation], ...]:
    """Record that somebody learns which model a code stands for, and return it.

    Parameters
    ----------
    study : StudyPaths
        Where the study is.
    protocol : Protocol
        The study's protocol.
    code : str or None
        A code of a schedule; None for all of them.
    who, why : str
        Who is to know, and for what reason.
    rater, session : str, optional
        Whose schedules alone; where two sheets have one code, one has to be named.
    now : callable, optional
        Gives the time of day, aware.

    Returns
    -------
    tuple of (Schedule, Presentation)
        Every presentation that is unblinded; the event is on disk by then.

    Raises
    ------
    ParameterError
        If `who` or `why` is blank.
    ScheduleError
        If no drawn schedule has the code, several have it, or one is damaged.
    SessionLogError
        If the log of the study's conduct is damaged.
    OSError
        If it cannot be written.
    """
    revealed = tuple(
        (schedule, shown)
        for schedule in _schedules(study, protocol, rater, session)
        for shown in schedule.presentations
        if code in (None, shown.code)
    )
    if not revealed:
        raise ScheduleError(
            f"code: needed one of a drawn schedule in {study.schedules}, got "
            f"{'none' if code is None else repr(code)}"
        )
    if code is not None and len(revealed) > 1:
        places = " and ".join(f"{s.rater} in session {s.session}" for s, _ in revealed)
        raise ScheduleError(
            f"code: needed one of a single sheet, {code} is on those of {places}: say "
            "which with --rater and --session"
        )
    where: dict[str, _Fact] = {"rater": rater, "session": session, "code": code}
    if code is not None:
        ((schedule, _),) = revealed
        where |= {"rater": schedule.rater, "session": schedule.session}
    _append(study, protocol, "unblinded", where, who, why, now)
    return revealed


def _schedules(
    study: StudyPaths, protocol: Protocol, rater: str | None, session: str | None
) -> Iterator[Schedule]:
    for each in protocol.sessions:
        for of_rater in each.raters:
            file = study.schedule_file(of_rater, each.id)
            is_meant = rater in (None, of_rater) and session in (None, each.id)
            if is_meant and file.exists():
                yield read_schedule(file)


def _append(
    study: StudyPaths,
    protocol: Protocol,
    kind: str,
    fields: "Mapping[str, _Fact]",
    who: str,
    why: str,
    now: Callable[[], datetime],
) -> None:
    reasons = stated(who=who, why=why)
    with SessionLog.open(study.conduct_file, now=now) as log:
        _checked(study, log.events)
        if not any(event.kind == "conduct" for event in log.events):
            head: dict[str, _Fact] = {
                "format": _FORMAT,
                "study": protocol.study.id,
                "masrel_version": masrel.__version__,
            }
            log.append("conduct", head)
        log.append(kind, {**fields, **reasons})


def stated(**texts: str) -> dict[str, str]:
    """Return the texts without blanks around them; refuse one that is blank."""
    for name, text in texts.items():
        if not text.strip():
            raise ParameterError(f"{name}: needed text, got none")
    return {name: text.strip() for name, text in texts.items()}


def _checked(study: StudyPaths, events: tuple[Event, ...]) -> tuple[Event, ...]:
    """Return the events of a log of conduct; refuse any other."""
    for event in events:
        where = f"{study.conduct_file}: line {event.line}"
        if event.kind not in _EVENTS:
            raise SessionLogError(
                f"{where}: needed an event of {', '.join(_EVENTS)}, got {event.kind!r}"
            )
        if set(event.fields) != set(_EVENTS[event.kind]):
            raise SessionLogError(
                f"{where}: {event.kind}: needed the fields "
                f"{', '.join(_EVENTS[event.kind])}, got {', '.join(event.fields)}"
            )
    return events
