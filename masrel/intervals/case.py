"""One question put to an interval method, checked once."""

import math
import warnings
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from masrel.agreement import (
    CodedRatings,
    Coefficient,
    Label,
    WeightName,
    declared_weights,
)
from masrel.agreement._counts import distinct_rows
from masrel.agreement._kernel import Floats, Kernel
from masrel.errors import ParameterError, UndefinedStatisticWarning
from masrel.estimates import Interval, Target, Unit
from masrel.intervals.features import features_of
from masrel.intervals.statistic import Statistic, find_entry, kernel_of

__all__ = [
    "Case",
    "open_case",
]


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """A coefficient, its data as sums of features, and what was asked."""

    entry: Coefficient  # the coefficient
    coded: CodedRatings  # the ratings
    # the distinct rows of ratings, rater by rater, of items with any rating
    patterns: CodedRatings
    # (n_patterns,): how often each occurs
    times: NDArray[np.int64] = field(compare=False, repr=False)
    # (n_patterns, n_features): features of each
    rows: Floats = field(compare=False, repr=False)
    # (n_categories, n_categories): disagreement of two categories
    v: Floats = field(compare=False, repr=False)
    value: float  # the estimate; ``nan`` when undefined
    target: Target  # the population asked for
    level: float  # nominal level

    @property
    def n_items(self) -> int:
        """Items with at least one rating."""
        return int(self.times.sum())

    @property
    def features(self) -> Floats:
        """Features of every item with a rating, in order, (n_items, n_features)."""
        rated = (self.coded.codes >= 0).any(axis=1)
        return features_of(self.kernel, self.coded, self.v)[rated]

    @property
    def sums(self) -> Floats:
        """Sums of the features over all items, (n_features,)."""
        return np.asarray(self.times @ self.rows)

    def values(self, sums: Floats) -> Floats:
        """Return the coefficient for sums of shape (..., n_features)."""
        return self.kernel.value(sums, self.v)

    @property
    def lowest(self) -> float:
        """Where intervals are cut: -∞ for an estimate below the usual least value."""
        # Weights, or items of a single rating, can bring a coefficient below -1.
        return self.entry.lowest if self.value >= self.entry.lowest else -math.inf

    @property
    def kernel(self) -> Kernel:
        """The coefficient from sums over items."""
        return kernel_of(self.entry)

    def closed(
        self,
        low: float,
        high: float,
        *,
        method: str,
        unit: Unit | None,
        notes: Sequence[str] = (),
    ) -> Interval:
        """Return a confidence interval, cut at the ends of the parameter space."""
        said = list(notes)
        lowest = self.lowest
        if low < lowest or high > 1.0:
            said.append(f"cut at the end of the parameter space [{lowest:g}, 1]")
        return Interval(
            low=max(low, lowest),
            high=min(high, 1.0),
            level=self.level,
            kind="confidence",
            method=method,
            target=self.target,
            unit=unit,
            notes=tuple(said),
        )

    def undefined(self, reason: str, *, method: str, unit: Unit | None) -> Interval:
        """Return an interval of ``nan`` that says why, with a warning."""
        warnings.warn(
            f"{method} interval of {self.entry.title} is undefined: {reason}",
            UndefinedStatisticWarning,
            stacklevel=3,
        )
        return Interval(
            low=math.nan,
            high=math.nan,
            level=self.level,
            kind="confidence",
            method=method,
            target=self.target,
            unit=unit,
            reason=reason,
        )


def open_case(
    statistic: Statistic,
    ratings: object,
    *,
    target: Target,
    categories: Sequence[Label] | None,
    weights: "WeightName | ArrayLike",
    level: float,
) -> Case:
    """Check a question and prepare its data."""
    entry = find_entry(statistic)
    if target not in get_args(Target):
        raise ParameterError(
            f"target: needs one of {', '.join(get_args(Target))}, got {target!r}"
        )
    if not 0.0 < level < 1.0:
        raise ParameterError(f"level: needs (0, 1), got {level}")
    coded = entry.code(ratings, categories)
    _check_raters(entry, coded)
    kernel = kernel_of(entry)
    v = declared_weights(weights, coded.categories, declared=coded.declared).as_floats()
    codes, times = distinct_rows(coded.codes, coded.n_categories)
    if (codes[0] < 0).all():  # the first of them, if any, has no rating
        codes, times = codes[1:], times[1:]
    patterns = replace(coded, codes=codes)
    rows = features_of(kernel, patterns, v)
    return Case(
        entry=entry,
        coded=coded,
        patterns=patterns,
        times=times,
        rows=rows,
        v=v,
        value=float(kernel.value(times @ rows, v)),
        target=target,
        level=level,
    )


def _check_raters(entry: Coefficient, coded: CodedRatings) -> None:
    fewest, most = entry.n_raters
    columns = coded.codes.shape[1]
    if entry.shape == "ratings" and (
        columns < fewest or (most is not None and columns > most)
    ):
        wanted = f"{fewest}" if most == fewest else f"at least {fewest}"
        raise ParameterError(f"{entry.title} needs {wanted} raters, got {columns}")
