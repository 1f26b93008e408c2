"""The plan of a study: what its schedules were drawn from, and what has changed since.

Every draw and amendment leaves a copy of the protocol in the log of the study.
"""

import hashlib
import json
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from datetime import datetime
from itertools import pairwise
from pathlib import Path
from typing import Any

import masrel
from masrel.errors import ParameterError
from masrel.lab._event_log import Event, utc_now
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
from masrel.lab.protocol.content import _content_differences
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
        when = "and nobody has recorded it"
        if self.time_utc is not None:
            when = f"recorded on {self.time_utc[:10]}"
        return f"{self.key} was {was} at the draw and is {is_} since, {when}"


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
        In order of time, those that nobody has recorded last. Empty where nothing has
        been drawn, or was drawn before draws left a copy of their protocol.

    Raises
    ------
    SessionLogError
        If a log of the study is damaged.
    """
    events = [event for _, event in events_of_logs(study) if event.kind in VERSIONS]
    if not events:
        return ()
    contents = [_content(event.fields) for event in events]
    contents.append(_content(version_of(protocol)))
    return tuple(
        change
        for (before, after), event in zip(
            pairwise(contents), [*events[1:], None], strict=True
        )
        for change in _between(before, after, event)
    )


def _content(version: Mapping[str, object]) -> dict[str, Any]:
    content: dict[str, Any] = json.loads(str(version["protocol"]))
    return {**content, "texts of the scale": version["texts_sha256"]}


def _between(before: Any, after: Any, event: Event | None) -> Iterator[PlanChange]:
    fields = {} if event is None else event.fields
    who, why = (str(fields[key]) if key in fields else None for key in ("who", "why"))
    for key, was, is_ in _content_differences(before, after):
        if key.startswith(_PLANNED) and not key.endswith(".raters"):
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
        Where the study is; its secret is drawn if there is none yet.
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


def version_problems(study: StudyPaths) -> Iterator[tuple[Path, str]]:
    """Yield where a log keeps another protocol than that whose hash it has."""
    for log, event in events_of_logs(study):
        if event.kind in VERSIONS:
            text = str(event.fields["protocol"]).encode()
            sha256, got = event.fields["protocol_sha256"], hashlib.sha256(text)
            if got.hexdigest() != sha256:
                yield (
                    log,
                    f"line {event.line}: {event.kind}: needed the protocol with "
                    f"SHA-256 {sha256}, got one with {got.hexdigest()}",
                )


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
    if before is None:
        raise ParameterError(
            "study: needed one with drawn schedules, got none: until then the protocol "
            "is the plan"
        )
    if before == protocol_hash(protocol):
        raise ParameterError(
            f"protocol: needed another than is recorded, {study.protocol} says the same"
        )
    with open_conduct(study, protocol, now=now) as log:
        log.append("amended", {**version_of(protocol), **reasons})
    return plan_changes(study, protocol)
