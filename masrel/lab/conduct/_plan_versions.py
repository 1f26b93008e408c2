"""The plan of a study: what its schedules were drawn from, and what has changed since.

Every draw and amendment leaves a copy of the protocol in the log of the study.
"""

import json
import sys
from bisect import bisect_left
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from datetime import datetime
from functools import partial
from itertools import chain, pairwise, takewhile
from operator import itemgetter
from pathlib import Path
from typing import Any

import msgspec

import masrel
from masrel._input import refuse
from masrel.errors import MasrelError, SessionLogError
from masrel.lab._event_log import Event, timed_events, utc_now
from masrel.lab._study_files import as_then, sha256_of
from masrel.lab.conduct._study_log import (
    VERSIONS,
    events_of_logs,
    last_version,
    open_conduct,
    recover_conduct,
    stated,
    version_of,
)
from masrel.lab.protocol import Protocol, StudyPaths, protocol_hash
from masrel.lab.protocol.content import _content_differences, _protocol_content
from masrel.lab.schedule._secret import find_secret, new_secret

# What decides what is rated, computed and required. The rest are words, or are held by
# the schedules; and who takes part has its own place in the record.
_PLANNED = (
    *("scale", "models", "sessions", "presentation", "blinding", "questionnaires"),
    "training",
    *("analysis", "report.gates", "texts of the scale"),
)


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanChange:
    """A key of the plan that does not say any more what it said at the first draw.

    Attributes
    ----------
    key : str
        Which, such as ``analysis.estimates.kappa.coefficient``.
    before, after : str or None
        What it said, as JSON; None where it said nothing.
    time_utc : str or None
        When the change was recorded; None where it has not been.
    who, why : str or None
        Who amended the plan, and for what reason; None of a change that no more than a
        later draw has recorded.
    """

    key: str
    before: str | None
    after: str | None
    time_utc: str | None
    who: str | None
    why: str | None

    def __str__(self) -> str:
        was, is_ = self.before or "not planned", self.after or "gone"
        when = "not recorded yet"
        if self.time_utc is not None:
            when = f"recorded on {self.time_utc[:10]}"
        return f"Change of the plan: {self.key} was {was}, then {is_}; {when}"


def plan_changes(study: StudyPaths, protocol: Protocol) -> tuple[PlanChange, ...]:
    """Return what has changed in the plan since the first schedules were drawn.

    Parameters
    ----------
    study : StudyPaths
        Where the study is.
    protocol : Protocol
        The study's protocol, as it is now.

    Returns
    -------
    tuple of PlanChange
        In chronological order, unrecorded ones last. Empty if nothing has been drawn,
        or if it was drawn before draws kept a copy of their protocol.

    Raises
    ------
    SessionLogError
        If a log of the study is damaged.
    """
    contents: list[tuple[object, Event | None]] = [
        (_content(then, str(event.fields["texts_sha256"])), event)
        for then, event in plan_versions(study)
    ]
    contents.append((_content(protocol, version_of(protocol)["texts_sha256"]), None))
    return tuple(
        change
        for (before, _), (after, event) in pairwise(contents)
        for change in _between(before, after, event)
    )


def _content(protocol: Protocol, texts_sha256: str) -> dict[str, Any]:
    content: dict[str, Any] = json.loads(_protocol_content(protocol))
    return {**content, "texts of the scale": texts_sha256}


def plan_versions(study: StudyPaths) -> list[tuple[Protocol, Event]]:
    """Return each protocol that was kept, that of the first draw first, with the event.

    A copy that does not match its hash, or is not a protocol, is refused.
    """
    return [
        (_copy_of(log, event), event)
        for log, event in events_of_logs(study)
        if event.kind in VERSIONS
    ]


def _copy_of(log: Path, event: Event) -> Protocol:
    text, copy = str(event.fields["protocol"]).encode(), None
    with suppress(msgspec.DecodeError):
        copy = msgspec.json.decode(text, type=Protocol)
    got, needed = sha256_of(text), event.fields["protocol_sha256"]
    if copy is None or got != needed:
        raise SessionLogError(
            f"{log}: line {event.line}: {event.kind}: needed the protocol with SHA-256 "
            f"{needed}, got {'another text' if copy is None else got}"
        )
    return copy


# after these there may be less of what else only grows: of grades, answers, raters
_TAKE_BACK = ("restarted", "answer-correction", "excluded", "included")


def is_of_earlier(
    study: StudyPaths,
    protocol: Protocol,
    compare: Callable[[Protocol], tuple[object, int]],
    amount: int | None,
) -> bool:
    """Say whether something was made of a state that the record had earlier.

    `compare` makes it of a protocol, and of what logs say while it is called. It
    returns how that differs, if it does, and how much it has of something that grows as
    events are logged. Only states with `amount` of that are tried, or all for None.
    """
    logs = map(timed_events, [*study.conduct_logs(), *study.logs()])
    timed = sorted(chain(*logs), key=itemgetter(0))
    less = [n for n, (*_, event) in enumerate(timed, 1) if _takes_back(event)]

    def made(then: Protocol, n_events: int) -> tuple[object, int]:
        lines = _lines_after(timed, n_events, study, protocol)
        with suppress(MasrelError):
            return as_then(lines, compare, then)
        begun = (lines.get(str(study.log_file(*of))) for of in then.rater_sessions)
        return True, sys.maxsize if any(begun) else -1  # too much, or nothing yet

    def is_in(stretch: range, then: Protocol) -> bool:
        first, of = 0, partial(made, then)
        # by another scale a grade may be wrong until it is corrected
        target = amount if then.scale == protocol.scale else None
        if target is not None:
            first = bisect_left(stretch, target, key=lambda n_events: of(n_events)[1])
        tried = takewhile(lambda it: target in (None, it[1]), map(of, stretch[first:]))
        return any(not difference for difference, _ in tried)

    versions = {protocol_hash(each): each for each, _ in plan_versions(study)}
    return any(
        is_in(range(*stretch), then)
        for then in ({protocol_hash(protocol): protocol} | versions).values()
        for stretch in pairwise([0, *less, len(timed) + 1])
    )


def _takes_back(event: Event) -> bool:
    is_correction = event.kind == "correction" and event.fields.get("grade") is None
    return is_correction or event.kind in _TAKE_BACK


def _lines_after(
    timed: Sequence[tuple[str, Path, Event]],
    n_events: int,
    study: StudyPaths,
    protocol: Protocol,
) -> dict[str, int]:
    # in how many lines each log says what it said after so many events
    lines = dict.fromkeys((str(log) for _, log, _ in timed), 0)
    lines |= Counter(str(log) for _, log, _ in timed[:n_events])
    if any(event.kind == "unblinded" for *_, event in timed[n_events:]):
        # a sealed study was sealed before
        sealed = (study.schedule_file(*of) for of in protocol.rater_sessions)
        lines |= dict.fromkeys(map(str, sealed), 0)
    return lines


def _between(before: Any, after: Any, event: Event | None) -> Iterator[PlanChange]:
    fields = {} if event is None else event.fields
    who, why = (str(fields[key]) if key in fields else None for key in ("who", "why"))
    for key, was, is_ in _content_differences(before, after):
        if key.startswith(_PLANNED) and not key.endswith((".raters", ".title")):
            yield PlanChange(
                key=key,
                before=None if was is None else json.dumps(was, ensure_ascii=False),
                after=None if is_ is None else json.dumps(is_, ensure_ascii=False),
                time_utc=None if event is None else event.time_utc,
                who=who,
                why=why,
            )


def registration(study: StudyPaths, protocol: Protocol) -> dict[str, object]:
    """Return what a registry keeps of a study: its plan, and what no order can escape.

    Parameters
    ----------
    study : StudyPaths
        Where the study is; its secret is drawn if it has none yet.
    protocol : Protocol
        The study's protocol.

    Returns
    -------
    dict
        The protocol with its hash, that of the scale's texts, and the commitment to the
        secret that orders are drawn from; it says nothing of the orders.

    Raises
    ------
    ScheduleError
        If the file of the secret is damaged.
    OSError
        If the secret cannot be written.
    """
    key = find_secret(study) or new_secret(study)
    version = version_of(protocol)
    return {
        "format": "masrel registration 1",
        "study": protocol.study.id,
        "title": protocol.study.title,
        "masrel_version": masrel.__version__,
        "commitment": key.commitment,
        **version,
        "protocol": json.loads(version["protocol"]),
    }


def record_amendment(
    study: StudyPaths,
    protocol: Protocol,
    *,
    who: str,
    why: str,
    now: Callable[[], datetime] = utc_now,
) -> tuple[PlanChange, ...]:
    """Record that the plan was changed, with a copy of the protocol as it is now.

    Parameters
    ----------
    study : StudyPaths
        Where the study is.
    protocol : Protocol
        The study's protocol, which says already what it is to say.
    who, why : str
        Who amended it, and for what reason.
    now : callable, optional
        Gives the time of day, aware.

    Returns
    -------
    tuple of PlanChange
        What has been recorded.

    Raises
    ------
    ParameterError
        If nothing has been drawn yet, the protocol is that of the last draw or
        amendment, or `who` or `why` is blank.
    SessionLogError
        If a log of the study is damaged.
    OSError
        If it cannot be written.
    """
    reasons = stated(who=who, why=why)
    recover_conduct(study)
    before = last_version(event for _, event in events_of_logs(study))
    refuse(
        (
            before is None,
            "study: needed one with drawn schedules, got none: until then the protocol "
            "is the plan",
        ),
        (
            before == protocol_hash(protocol),
            f"protocol: needed another than is recorded, {study.protocol} says the "
            "same",
        ),
    )
    with open_conduct(study, protocol, now=now) as log:
        log.append("amended", {**version_of(protocol), **reasons})
    return plan_changes(study, protocol)
