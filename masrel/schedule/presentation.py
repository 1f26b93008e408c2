"""One presentation, the schedule of one rater in one session, and its checks."""

from collections import Counter
from dataclasses import dataclass

from masrel.errors import ScheduleError
from masrel.protocol import Protocol, presented_hash

__all__ = ["Presentation", "Schedule", "check_schedule", "require_place"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Presentation:
    """One model put to one rater once.

    Attributes
    ----------
    position : int
        Place in the session, from 1.
    code : str
        Blinded name, all that the rater sees; unique in the session.
    model : str
        Id of the haptic model.
    repeat : int
        Which of the model's presentations in the session, from 1.
    """

    position: int
    code: str
    model: str
    repeat: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Schedule:
    """What one rater meets in one session, in order, and where it comes from.

    Attributes
    ----------
    study, rater, session : str
        Their ids.
    seed : int
        The protocol's seed at drawing.
    scheme : str
        The protocol's scheme at drawing.
    protocol_sha256 : str
        Hash of the whole protocol at drawing.
    presented_sha256 : str
        Hash of what decides what a rater meets; when it differs from the
        protocol's, the schedule is stale.
    masrel_version : str
        Version that drew it.
    presentations : tuple of Presentation
        In order of presentation.
    """

    study: str
    rater: str
    session: str
    seed: int
    scheme: str
    protocol_sha256: str
    presented_sha256: str
    masrel_version: str
    presentations: tuple[Presentation, ...]


def check_schedule(schedule: Schedule, protocol: Protocol) -> None:
    """Refuse a schedule that was not drawn from what the protocol presents now.

    Parameters
    ----------
    schedule : Schedule
        A schedule.
    protocol : Protocol
        The study's protocol.

    Raises
    ------
    ScheduleError
        If study, rater or session are not the protocol's, what is presented has
        changed since the draw, or the rows are not every model as often as asked.

    Notes
    -----
    A protocol may still change in its texts, raters, sessions, plan and report;
    :func:`masrel.protocol.presented_hash` has the rest. The stored order is not
    drawn again for comparison: the file is the schedule, the seed its provenance.
    """
    where = f"schedule of rater {schedule.rater} in session {schedule.session}"
    if schedule.study != protocol.study.id:
        raise ScheduleError(
            f"{where}: needed study {protocol.study.id}, got {schedule.study}"
        )
    require_place(protocol, schedule.rater, schedule.session)
    now = presented_hash(protocol)
    if schedule.presented_sha256 != now:
        raise ScheduleError(
            f"{where}: needed one drawn from the protocol as it is, got one from "
            "before a change in its study id, scale, elbow, models, schedule, stretch "
            f"or device (presented_sha256 {now[:12]} and "
            f"{schedule.presented_sha256[:12]})"
        )
    asked = Counter(
        (model.id, repeat)
        for model in protocol.models
        for repeat in range(1, protocol.schedule.repeats + 1)
    )
    found = Counter((shown.model, shown.repeat) for shown in schedule.presentations)
    if asked != found:
        wrong = sorted((asked - found) + (found - asked))
        named = ", ".join(f"{model} repeat {repeat}" for model, repeat in wrong)
        raise ScheduleError(
            f"{where}: needed every model of the protocol once per repeat, "
            f"got a difference in {named}"
        )


def require_place(protocol: Protocol, rater: str, session: str) -> None:
    """Refuse a rater and session the protocol does not bring together."""
    raters = {each.id: each.raters for each in protocol.sessions}
    if session not in raters:
        raise ScheduleError(
            f"session: needed one of {', '.join(raters)}, got {session!r}"
        )
    if rater not in raters[session]:
        raise ScheduleError(
            f"rater: needed one of {', '.join(raters[session])} for session "
            f"{session}, got {rater!r}"
        )
