"""What is known of each rater: from the protocol, and from what was recorded since."""

from collections.abc import Callable, Mapping
from datetime import datetime

from masrel._input import listed
from masrel.errors import ParameterError, SessionLogError
from masrel.lab._event_log import utc_now
from masrel.lab.conduct._study_log import (
    append_event,
    check_rater,
    read_conduct,
    stated,
)
from masrel.lab.protocol import Protocol, RaterField, StudyPaths
from masrel.lab.protocol._rater_fields import (
    FieldValue,
    field_value,
    needed_of,
    parsed_value,
)


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
        where nothing is known. What was recorded last goes before the protocol.

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
                    "masrel rater set records another"
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
        Field to value, as text; an empty text stands for nothing known.
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


def _checked_value(
    study: StudyPaths, fields: Mapping[str, RaterField], name: str, text: str
) -> FieldValue | None:
    if name not in fields:
        known = listed(fields) if fields else "there is none"
        raise ParameterError(
            f"field: needed one of [rater_fields] of {study.protocol} ({known}), got "
            f"{name!r}"
        )
    value = parsed_value(fields[name], text)
    if value is None and text.strip():
        raise ParameterError(f"{name}: needed {needed_of(fields[name])}, got {text!r}")
    return value
