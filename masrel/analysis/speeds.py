"""How fast the raters stretched: mean speeds per model and per rater."""

import math
import statistics
from collections.abc import Sequence

from masrel.analysis.results import Speed, Speeds, SpeedSummary
from masrel.protocol import Protocol
from masrel.ratings import Ratings

__all__ = ["stretching_speeds"]


def stretching_speeds(protocol: Protocol, ratings: Ratings) -> Speeds:
    """Summarize the mean speeds of the stretches."""
    table = ratings.table
    known = table[table["mean_speed_deg_s"].notna()]
    values = tuple(
        Speed(session=s, rater=r, model=m, mean_speed_deg_s=float(speed))
        for s, r, m, speed in zip(
            known["session"],
            known["rater"],
            known["model"],
            known["mean_speed_deg_s"],
            strict=True,
        )
    )
    sessions = [session.id for session in protocol.sessions]
    models = [model.id for model in protocol.models]
    raters = [rater.id for rater in protocol.raters]
    return Speeds(
        values=values,
        by_model=_summaries(values, sessions, models, "model"),
        by_rater=_summaries(values, sessions, raters, "rater"),
        n_missing=len(table) - len(values),
        reason=None if values else "no rating comes with a stretching speed",
    )


def _summaries(
    values: Sequence[Speed], sessions: Sequence[str], names: Sequence[str], by: str
) -> tuple[SpeedSummary, ...]:
    groups: dict[tuple[str, str], list[float]] = {}
    for value in values:
        key = (value.session, value.model if by == "model" else value.rater)
        groups.setdefault(key, []).append(value.mean_speed_deg_s)
    ordered = [(s, n) for s in sessions for n in names if (s, n) in groups]
    return tuple(
        _summary(session, name, groups[session, name]) for session, name in ordered
    )


def _summary(session: str, name: str, speeds: Sequence[float]) -> SpeedSummary:
    return SpeedSummary(
        session=session,
        name=name,
        n=len(speeds),
        mean=statistics.fmean(speeds),
        sd=statistics.stdev(speeds) if len(speeds) > 1 else math.nan,
        least=min(speeds),
        most=max(speeds),
    )
