"""Estimates as the rows of tables and figures, with texts and remarks."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from masrel.analysis import PlannedEstimate
from masrel.estimates import Estimate, Interval
from masrel.report._tables import counted
from masrel.report.estimate_words import (
    TARGETS,
    as_words,
    coefficient_name,
    has_zero,
)
from masrel.report.meaning import aside, meaning

__all__ = ["EstimateRow", "estimate_rows", "meanings"]


@dataclass(frozen=True, slots=True, kw_only=True)
class EstimateRow:
    """One row: an estimate, or why there is none."""

    name: str  # id of the line of the plan, and the rater if it is one rater's
    coefficient: str  # name of the coefficient for a reader
    # models, sessions: what it was estimated from
    models: str
    sessions: str
    estimate: Estimate | None  # the estimate
    reason: str | None  # why there is none
    is_own: bool = False  # whether it is one rater's agreement with him- or herself

    @property
    def n_raters(self) -> int | None:
        """Raters it rests on: one, where a rater is compared with him- or herself."""
        if self.estimate is None:
            return None
        return 1 if self.is_own else self.estimate.n_raters

    @property
    def interval(self) -> Interval | None:
        """The interval, if one was asked for."""
        return None if self.estimate is None else self.estimate.interval

    @property
    def has_zero(self) -> bool:
        """Whether 0 is what chance gives."""
        name = None if self.estimate is None else self.estimate.coefficient
        return has_zero(name)

    @property
    def text(self) -> str:
        """The value with its interval, or that there is none."""
        return "not in these data" if self.estimate is None else as_words(self.estimate)

    @property
    def detail(self) -> str:
        """How much it rests on, and what its interval speaks of."""
        if self.estimate is None:
            return f"{self.models} models, {self.sessions}"
        size = counted(self.estimate.n_items, "model")
        size += (
            ", twice" if self.is_own else f", {counted(self.n_raters or 0, 'rater')}"
        )
        if self.interval is None:
            return size
        said = (self.interval.kind, aside(self.interval))
        how = ", ".join(text for text in said if text)
        return f"{size}; {how}, {TARGETS[self.interval.target]}"

    @property
    def remarks(self) -> tuple[str, ...]:
        """What a reader must know before relying on it, each once."""
        said = [self.reason]
        if self.estimate is not None:
            said.append(self.estimate.reason)
        if self.interval is not None:
            said.extend((*self.interval.notes, self.interval.reason))
            if self.interval.n_undefined:
                said.append(f"undefined on {self.interval.n_undefined} resamples")
        return tuple(dict.fromkeys(text for text in said if text))


def estimate_rows(planned: Sequence[PlannedEstimate]) -> tuple[EstimateRow, ...]:
    """Lay out planned estimates, each followed by those of its raters."""
    return tuple(row for entry in planned for row in _rows(entry))


def _rows(entry: PlannedEstimate) -> Iterator[EstimateRow]:
    line = entry.line
    sessions = " and ".join(line.sessions)
    if entry.estimate is not None or not entry.by_rater:
        yield EstimateRow(
            name=line.id,
            coefficient=coefficient_name(line.coefficient, line.weights),
            models=line.models,
            sessions=sessions,
            estimate=entry.estimate,
            reason=entry.reason,
        )
    for own in entry.by_rater:
        yield EstimateRow(
            name=f"{line.id}: {own.rater}",
            coefficient=coefficient_name(own.estimate.coefficient, line.weights),
            models=line.models,
            sessions=sessions,
            estimate=own.estimate,
            reason=None,
            is_own=True,
        )


def meanings(rows: Sequence[EstimateRow]) -> tuple[str, ...]:
    """Say in one plain sentence each what the intervals of some rows mean."""
    intervals = (row.interval for row in rows if row.interval is not None)
    return tuple(dict.fromkeys(meaning(interval, "model") for interval in intervals))
