"""Estimates as the rows of tables and figures: their names, texts and remarks."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from masrel.agreement import COEFFICIENTS
from masrel.analysis import PlannedEstimate
from masrel.estimates import Estimate, Interval
from masrel.report.meaning import aside, meaning
from masrel.report.tables import UNDEFINED, counted, interval_words, number, percent

__all__ = [
    "TARGETS",
    "EstimateRow",
    "as_words",
    "coefficient_name",
    "estimate_rows",
    "has_zero",
    "interval_name",
    "meanings",
]

TARGETS = {
    "raters": "other raters",
    "items": "other models",
    "both": "other raters and models",
}
"""Target of an interval to what it speaks of."""


@dataclass(frozen=True, slots=True, kw_only=True)
class EstimateRow:
    """One row: an estimate, or why there is none.

    Attributes
    ----------
    name : str
        Id of the line of the plan, and the rater if it is one rater's.
    coefficient : str
        Name of the coefficient for a reader.
    models, sessions : str
        What it was estimated from.
    estimate : Estimate or None
        The estimate.
    reason : str or None
        Why there is none.
    is_own : bool
        Whether it is one rater's agreement with him- or herself.
    """

    name: str
    coefficient: str
    models: str
    sessions: str
    estimate: Estimate | None
    reason: str | None
    is_own: bool = False

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


def has_zero(coefficient: str | None) -> bool:
    """Return whether 0 is what chance gives of a coefficient.

    Parameters
    ----------
    coefficient : str or None
        Its name in an estimate; of none there is no zero.

    Returns
    -------
    bool
        Not of a share, nor of a measure of order; of an ICC and a κ.
    """
    if coefficient is None:
        return False
    entry = COEFFICIENTS.get(coefficient)  # the forms of ICC have entries of their own
    return entry is None or entry.chance_corrected


def as_words(estimate: Estimate) -> str:
    """Return a value with its interval, as shown.

    Parameters
    ----------
    estimate : Estimate
        The estimate.

    Returns
    -------
    str
        Such as ``"0.626 [0.320, 0.933]"``, or that it is undefined.
    """
    if not math.isfinite(estimate.value):
        return UNDEFINED
    value, interval = number(estimate.value, 3), estimate.interval
    if interval is None:
        return value
    return f"{value} {interval_words(interval.low, interval.high)}"


def coefficient_name(coefficient: str, weights: str = "identity") -> str:
    """Return a coefficient's name for a reader.

    Parameters
    ----------
    coefficient : str
        Its name in code.
    weights : str, optional
        Name of its weights.

    Returns
    -------
    str
        Its name in print.

    Examples
    --------
    >>> coefficient_name("fleiss_kappa", "quadratic")
    "Fleiss' κ, quadratic weights"
    """
    title = COEFFICIENTS[coefficient].title
    if weights != "identity":
        title = f"{title}, {weights} weights"
    # A share as all others are: 1 is all, not 100.
    return f"{title} (0–1)" if coefficient == "percent_agreement" else title


def interval_name(interval: Interval) -> str:
    """Return level, kind and method of an interval.

    Parameters
    ----------
    interval : Interval
        The interval.

    Returns
    -------
    str
        Such as ``"95 % confidence, rater jackknife, t(7)"``.
    """
    return f"{percent(interval.level)} % {interval.kind}, {interval.method}"


def estimate_rows(planned: Sequence[PlannedEstimate]) -> tuple[EstimateRow, ...]:
    """Lay out planned estimates, each followed by those of its raters.

    Parameters
    ----------
    planned : sequence of PlannedEstimate
        Lines of the plan and what came of them.

    Returns
    -------
    tuple of EstimateRow
        The rows. A line with estimates per rater only has no row of its own.
    """
    rows = []
    for entry in planned:
        sessions = " and ".join(entry.line.sessions)
        if entry.estimate is not None or not entry.by_rater:
            rows.append(
                EstimateRow(
                    name=entry.line.id,
                    coefficient=coefficient_name(
                        entry.line.coefficient, entry.line.weights
                    ),
                    models=entry.line.models,
                    sessions=sessions,
                    estimate=entry.estimate,
                    reason=entry.reason,
                )
            )
        rows.extend(
            EstimateRow(
                name=f"{entry.line.id}: {own.rater}",
                coefficient=coefficient_name(
                    own.estimate.coefficient, entry.line.weights
                ),
                models=entry.line.models,
                sessions=sessions,
                estimate=own.estimate,
                reason=None,
                is_own=True,
            )
            for own in entry.by_rater
        )
    return tuple(rows)


def meanings(rows: Sequence[EstimateRow]) -> tuple[str, ...]:
    """Say in one plain sentence each what the intervals of some rows mean.

    Parameters
    ----------
    rows : sequence of EstimateRow
        The rows.

    Returns
    -------
    tuple of str
        One sentence per kind of interval, target and origin there is.
    """
    intervals = (row.interval for row in rows if row.interval is not None)
    return tuple(dict.fromkeys(meaning(interval, "model") for interval in intervals))
