"""A rater who has left the study: recorded, and refused from then on."""

from collections.abc import Callable
from datetime import datetime

from masrel._event_log import utc_now
from masrel.conduct._study_log import append_event, check_rater, read_conduct, stated
from masrel.errors import ParameterError
from masrel.protocol import Protocol, StudyPaths


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
    check_rater(protocol, rater)
    refuse_withdrawn(study, rater)
    reasons = stated(who=who, why=why)
    append_event(study, protocol, "withdrawn", {"rater": rater, **reasons}, now=now)


def refuse_withdrawn(study: StudyPaths, rater: str) -> None:
    """Refuse a rater who has left the study."""
    for event in read_conduct(study):
        if event.kind == "withdrawn" and event.fields["rater"] == rater:
            raise ParameterError(
                f"rater: needed one who takes part, {rater} was withdrawn on "
                f"{event.time_utc[:10]} by {event.fields['who']}: "
                f"{event.fields['why']}"
            )
