"""What somebody states of a study, with who says so: each one event of its log."""

from collections.abc import Callable, Collection, Mapping
from dataclasses import asdict, dataclass
from datetime import datetime
from types import MappingProxyType
from typing import Literal, get_args

from masrel._input import listed
from masrel.errors import ParameterError, ScheduleError, SessionLogError
from masrel.lab._event_log import utc_now
from masrel.lab._study_files import Fact
from masrel.lab.conduct._study_log import (
    append_event,
    check_choice,
    check_rater,
    open_conduct,
    past_day,
    read_conduct,
    recover_conduct,
    stated,
)
from masrel.lab.protocol import Protocol, RaterField, StudyPaths
from masrel.lab.protocol._values import (
    FieldValue,
    field_value,
    needed_of,
    parsed_value,
)
from masrel.lab.protocol.read import _write_rater
from masrel.lab.schedule.presentation import Presentation, Schedule, _read_drawn
from masrel.lab.schedule.sheets import _open_schedule

NoteKind = Literal["note", "adverse-event", "deviation"]
"""What a note is of."""

Severity = Literal["mild", "moderate", "severe"]
"""How severe an adverse event is."""

Seriousness = Literal["serious", "not serious"]
"""Whether an adverse event is serious, as ICH E2A means it."""

Relatedness = Literal["unrelated", "unlikely", "possible", "probable", "definite"]
"""How likely it is that the study caused an adverse event."""

# What may be said of a note, and of an adverse event alone
_CHOICES = {
    "kind": get_args(NoteKind),
    "severity": get_args(Severity),
    "seriousness": get_args(Seriousness),
    "relatedness": get_args(Relatedness),
}
_ADVERSE = ("severity", "seriousness", "relatedness", "onset", "action", "outcome")


@dataclass(frozen=True, slots=True, kw_only=True)
class Note:
    """A note, a deviation from the protocol, or an adverse event.

    Attributes
    ----------
    text : str
        What happened.
    who : str
        Who says so.
    kind : {"note", "adverse-event", "deviation"}
        What it is.
    rater, session : str or None
        To whom and in which session it happened; None for the study as a whole.
    on : str or None
        The day on which it happened, ISO 8601; None for the day of recording.
    severity : {"mild", "moderate", "severe"} or None
        Of an adverse event alone, as all that follows.
    seriousness : {"serious", "not serious"} or None
        Whether it is serious.
    relatedness : str or None
        Whether the study caused it: unrelated, unlikely, possible, probable, definite.
    onset : str or None
        The day on which it began, ISO 8601.
    action, outcome : str or None
        What was done, and what came of it.
    """

    text: str
    who: str
    kind: NoteKind = "note"
    rater: str | None = None
    session: str | None = None
    on: str | None = None
    severity: Severity | None = None
    seriousness: Seriousness | None = None
    relatedness: Relatedness | None = None
    onset: str | None = None
    action: str | None = None
    outcome: str | None = None


def record_note(
    study: StudyPaths,
    protocol: Protocol,
    note: Note,
    *,
    now: Callable[[], datetime] = utc_now,
) -> None:
    """Record a note, a deviation from the protocol, or an adverse event.

    Parameters
    ----------
    study : StudyPaths
        Where the study is.
    protocol : Protocol
        The study's protocol.
    note : Note
        What happened.
    now : callable, optional
        Gives the time of day, aware.

    Raises
    ------
    ParameterError
        If a text is blank, a choice is unknown, a date is invalid or in the future, the
        protocol has no such rater or session, or a field of adverse events is given for
        anything else.
    SessionLogError
        If the log of the study's conduct is damaged.
    OSError
        If it cannot be written.
    """
    known = {key: value for key, value in asdict(note).items() if value is not None}
    if note.rater is not None:
        check_rater(protocol, note.rater)
    if note.session is not None:
        check_choice("session", note.session, [each.id for each in protocol.sessions])
    for name in _ADVERSE:
        if name in known and note.kind != "adverse-event":
            raise ParameterError(
                f"{name}: needed with kind 'adverse-event' only, got it with "
                f"{note.kind!r}"
            )
    known = stated(**known)
    for name in _CHOICES.keys() & known.keys():
        check_choice(name, known[name], _CHOICES[name])
    days = {"on", "onset"} & known.keys()
    known |= {name: past_day(name, known[name], now) for name in days}
    append_event(study, protocol, "noted", {**asdict(note), **known}, now=now)


def rater_values(
    study: StudyPaths, protocol: Protocol
) -> dict[str, dict[str, FieldValue | None]]:
    """Return what the fields of a study's raters hold.

    Parameters
    ----------
    study : StudyPaths
        Where the study is.
    protocol : Protocol
        The study's protocol.

    Returns
    -------
    dict of str to dict
        By rater and field, every one of them: text (a date too), a number, or None
        where nothing is known. What was recorded last overrides the protocol.

    Raises
    ------
    SessionLogError
        If the log of the study's conduct is damaged, or what it says last of a rater is
        not what the field holds by the protocol.
    """
    fields = protocol.rater_fields
    latest = {
        (event.fields["rater"], event.fields["field"]): event.fields["value"]
        for event in read_conduct(study)
        if event.kind == "rater-set"
    }
    values: dict[str, dict[str, FieldValue | None]] = {}
    for rater in protocol.raters:
        of_rater = values[rater.id] = dict.fromkeys(fields)
        for name, field in fields.items():
            value = latest.get((rater.id, name), rater.fields.get(name))
            of_rater[name] = None if value is None else field_value(field, value)
            if value is not None and of_rater[name] is None:
                raise SessionLogError(
                    f"{study.conduct_file}: {name} of {rater.id}: needed "
                    f"{needed_of(field)}, as the protocol has it now, got {value!r}; "
                    "masrel record rater records another"
                )
    return values


def record_rater_values(
    study: StudyPaths,
    protocol: Protocol,
    rater: str,
    values: Mapping[str, str],
    *,
    who: str,
    now: Callable[[], datetime] = utc_now,
) -> None:
    """Record what is known of a rater; what was recorded before stays in the log.

    Parameters
    ----------
    study : StudyPaths
        Where the study is.
    protocol : Protocol
        The study's protocol, which declares the fields.
    rater : str
        Of whom.
    values : mapping of str to str
        Field to value, as text; an empty text means unknown.
    who : str
        Who says so.
    now : callable, optional
        Gives the time of day, aware.

    Raises
    ------
    ParameterError
        If the protocol has no such rater or field, a value is not of the field's type,
        or `who` is blank. Nothing is recorded then.
    SessionLogError
        If the log of the study's conduct is damaged.
    OSError
        If it cannot be written.
    """
    check_rater(protocol, rater)
    checked = {
        name: _checked_value(study, protocol.rater_fields, name, text)
        for name, text in values.items()
    }
    by = stated(who=who)
    for name, value in checked.items():
        fields = {"rater": rater, "field": name, "value": value, **by}
        append_event(study, protocol, "rater-set", fields, now=now)


def record_new_rater(
    study: StudyPaths,
    protocol: Protocol,
    rater: str,
    sessions: Collection[str],
    *,
    who: str,
    site: str | None = None,
    values: Mapping[str, str] = MappingProxyType({}),
    now: Callable[[], datetime] = utc_now,
) -> None:
    """Take another rater into a study: into its protocol, whose comments stay.

    Schedules that are drawn stay as they are; ``masrel schedule`` draws the rater's.

    Parameters
    ----------
    study : StudyPaths
        Where the study is.
    protocol : Protocol
        The study's protocol.
    rater : str
        Who joins.
    sessions : collection of str
        In which sessions.
    who : str
        Who says so.
    site : str, optional
        Where the rater is.
    values : mapping of str to str, optional
        What is known of the rater, field to value, as text.
    now : callable, optional
        Gives the time of day, aware.

    Raises
    ------
    ParameterError
        If the protocol has no such session or field, a value is not of the field's
        type, the rater was added before, or `who` is blank.
    ProtocolError
        If the protocol would be wrong with this rater; nothing is written then.
    SessionLogError
        If the log of the study's conduct is damaged.
    OSError
        If a file cannot be written.
    """
    for session in sessions:
        check_choice("session", session, [each.id for each in protocol.sessions])
    known = {
        name: _checked_value(study, protocol.rater_fields, name, text)
        for name, text in values.items()
        if text.strip()
    }
    entry: dict[str, object] = {"id": rater}
    entry |= {} if site is None else {"site": site}
    entry |= {"fields": known} if known else {}
    fields = {"rater": rater, "site": site, **stated(who=who)}
    with open_conduct(study, protocol, now=now) as log:  # nobody else adds meanwhile
        for event in log.events:
            if event.kind == "rater-added" and event.fields["rater"] == rater:
                raise ParameterError(
                    f"rater: needed one who was not added before, {rater} was on "
                    f"{event.time_utc[:10]} by {event.fields['who']}"
                )
        _write_rater(study.protocol, entry, sessions)
        log.append("rater-added", fields)


def _checked_value(
    study: StudyPaths, fields: Mapping[str, RaterField], name: str, text: str
) -> FieldValue | None:
    if name not in fields:
        raise ParameterError(
            f"field: needed one of [rater_fields] of {study.protocol} "
            f"({listed(fields) or 'there is none'}), got {name!r}"
        )
    value = parsed_value(fields[name], text)
    if value is None and text.strip():
        raise ParameterError(f"{name}: needed {needed_of(fields[name])}, got {text!r}")
    return value


Standing = Literal["withdrawn", "excluded", "included"]
"""What is recorded of a rater: who has left, or is left out of the analysis, or not."""


def record_standing(
    study: StudyPaths,
    protocol: Protocol,
    rater: str,
    standing: Standing,
    *,
    who: str,
    why: str,
    on: str | None = None,
    now: Callable[[], datetime] = utc_now,
) -> None:
    """Record that a rater has left, or is excluded, or included again.

    The grades of the rater stay in the study, and the protocol goes on having him or
    her. Those of a rater who was withdrawn are counted, and no session goes on; those
    of one who is excluded enter no number.

    Parameters
    ----------
    study : StudyPaths
        Where the study is.
    protocol : Protocol
        The study's protocol.
    rater : str
        Who.
    standing : {"withdrawn", "excluded", "included"}
        What is recorded; who was excluded is included again.
    who, why : str
        Who says so, and for what reason.
    on : str, optional
        The day on which a rater left, ISO 8601, where it is not that of recording.
    now : callable, optional
        Gives the time of day, aware.

    Raises
    ------
    ParameterError
        If the protocol has no such rater, `standing` is unknown or what he or she has
        already, or `who` or `why` is blank.
    SessionLogError
        If the log of the study's conduct is damaged.
    OSError
        If it cannot be written.
    """
    check_rater(protocol, rater)
    check_choice("standing", standing, get_args(Standing))
    recover_conduct(study)
    is_excluded = rater in excluded_raters(study)
    if standing == "withdrawn":
        refuse_withdrawn(study, rater)
    elif standing == "excluded" and is_excluded:
        raise ParameterError(
            f"rater: needed one who is not excluded, {rater} is; masrel record include "
            "takes it back"
        )
    elif standing == "included" and not is_excluded:
        raise ParameterError(f"rater: needed one who is excluded, {rater} is not")
    fields: dict[str, Fact] = {"rater": rater, **stated(who=who, why=why)}
    if standing == "withdrawn":
        fields["on"] = None if on is None else past_day("on", on, now)
    append_event(study, protocol, standing, fields, now=now)


def excluded_raters(study: StudyPaths) -> tuple[str, ...]:
    """Return the raters who are excluded from the analysis of a study.

    Parameters
    ----------
    study : StudyPaths
        Where the study is.

    Returns
    -------
    tuple of str
        In the order in which they were excluded; those included again are not there.

    Raises
    ------
    SessionLogError
        If the log of the study's conduct is damaged.
    """
    excluded: dict[str, None] = {}
    for event in read_conduct(study):
        if event.kind == "excluded":
            excluded[str(event.fields["rater"])] = None
        elif event.kind == "included":
            excluded.pop(str(event.fields["rater"]), None)
    return tuple(excluded)


def refuse_withdrawn(study: StudyPaths, rater: str) -> None:
    """Refuse a rater who has left the study."""
    for event in read_conduct(study):
        if event.kind == "withdrawn" and event.fields["rater"] == rater:
            raise ParameterError(
                f"rater: needed one who takes part, {rater} was withdrawn on "
                f"{event.fields.get('on') or event.time_utc[:10]}"
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
    """Record that somebody learns which model a code is, and return it.

    Parameters
    ----------
    study : StudyPaths
        Where the study is.
    protocol : Protocol
        The study's protocol.
    code : str or None
        A code of a schedule; None for all of them, of a study that is not sealed.
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
        If no drawn schedule has the code, several have it, or one is damaged, or
        sealed where all are asked for.
    SessionLogError
        If the log of the study's conduct is damaged.
    OSError
        If it cannot be written.
    """
    reasons = stated(who=who, why=why)
    meant = [
        pair
        for pair in protocol.rater_sessions
        if rater in (None, pair[0]) and session in (None, pair[1])
    ]
    drawn = [schedule for _, schedule in _read_drawn(study, meant)]
    if code is None and any(schedule.is_closed for schedule in drawn):
        raise ScheduleError(
            f"code: needed one of {study.schedules}, which is sealed, got none: --all "
            "alone opens it, once every session is over"
        )
    revealed = tuple(
        (schedule, shown)
        for schedule in drawn
        for shown in _open_schedule(study, protocol, schedule).presentations
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
    where: dict[str, Fact] = {"rater": rater, "session": session, "code": code}
    if code is not None:
        ((schedule, _),) = revealed
        where |= {"rater": schedule.rater, "session": schedule.session}
    append_event(study, protocol, "unblinded", {**where, **reasons}, now=now)
    return revealed
