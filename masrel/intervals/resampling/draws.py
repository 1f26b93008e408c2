"""Resamples that are drawn, as many as the ends of an interval need."""

import math
from dataclasses import dataclass

import numpy as np

from masrel.agreement._kernel import Floats
from masrel.errors import ConvergenceError, ParameterError
from masrel.intervals.resampling.drawn import Drawn
from masrel.intervals.resampling.endpoints import Rule
from masrel.intervals.resampling.numerators import Integers
from masrel.intervals.resampling.resamples import Resamples
from masrel.intervals.resampling.samplers import Sampler

__all__ = ["Effort", "draw_resamples"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Effort:
    """How many resamples are drawn."""

    n_resamples: int  # how many at least
    # the largest Monte Carlo error of an end; None for any
    tolerance: float | None = None
    most_resamples: int  # how many at most

    def check(self) -> None:
        """Raise ParameterError if a number is out of its range."""
        if self.n_resamples < 100:
            raise ParameterError(
                f"n_resamples: needs at least 100, got {self.n_resamples}"
            )
        if self.tolerance is not None and not self.tolerance > 0.0:
            raise ParameterError(
                f"tolerance: needs a number above 0, got {self.tolerance}"
            )
        if self.most_resamples < self.n_resamples:
            raise ParameterError(
                f"most_resamples: needs at least the {self.n_resamples} of "
                f"n_resamples, got {self.most_resamples}"
            )

    def more(self, drawn: int, error: float, tolerance: float) -> int:
        """Return how many more a tolerance takes, after `drawn` with an error."""
        if error <= tolerance:
            return 0
        wanted = drawn * (error / tolerance) ** 2
        size = min(math.ceil(1.05 * wanted), self.most_resamples) - drawn
        if wanted > self.most_resamples or size <= 0:
            raise ConvergenceError(
                f"tolerance: with {drawn} resamples an end has an error of "
                f"{error:.2g}; {tolerance:g} takes about {wanted - drawn:.2g} "
                f"more, and most_resamples is {self.most_resamples}"
            )
        return size


def draw_resamples(
    sampler: Sampler,
    rule: Rule,
    effort: Effort,
    generator: np.random.Generator,
) -> Resamples:
    """Draw resamples, more of them while an end is less certain than asked for."""
    values, scores = sampler.batches(effort.n_resamples, generator)
    while True:
        found = _resamples(sampler, values, scores)
        if effort.tolerance is None:
            return found
        size = effort.more(values.size, _error(found, rule), effort.tolerance)
        if not size:
            return found
        more, more_scores = sampler.batches(size, generator)
        values = np.concatenate([values, more])
        if scores is not None and more_scores is not None:
            scores = np.concatenate([scores, more_scores])


def _error(found: Resamples, rule: Rule) -> float:
    # of the end that is less certain; 0 if there is no interval
    ends = rule.ends(found.source) if found.has_spread else None
    return 0.0 if ends is None or ends.errors is None else max(ends.errors)


def _resamples(sampler: Sampler, drawn: Floats, scores: Integers | None) -> Resamples:
    values, control = drawn, sampler.control
    lost = np.isnan(drawn)
    if lost.any():
        values = drawn[~lost]
        control = scores = None  # its distribution is that of all resamples
    return Resamples(
        source=Drawn(
            values=values, ordered=np.sort(values), control=control, scores=scores
        ),
        n_resamples=drawn.size,
        n_undefined=drawn.size - values.size,
        words=f"bootstrap distribution, {values.size} resamples",
    )
