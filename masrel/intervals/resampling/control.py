"""A linear function of a resample, whose distribution is known without drawing."""

import math
from dataclasses import dataclass, field

import numpy as np

from masrel.agreement._kernel import Floats
from masrel.intervals.resampling.numerators import Integers
from masrel.intervals.resampling.states import line_of_sums

__all__ = ["Control", "control_of", "whole_scores"]

_FINE = 60.0  # integers in a standard deviation of one draw
_SPAN = 1 << 18  # integers that the sums span at most


@dataclass(frozen=True, slots=True, kw_only=True)
class Control:
    """The sum of integer scores of what is drawn."""

    least: int  # the least sum of the table
    # (n_sums,): the probability of a sum at most as large, for one after the other
    upto: Floats = field(compare=False, repr=False)

    def cut(self, position: float) -> tuple[int, float]:
        """Return the sum nearest to a position, and the probability up to it."""
        at = min(int(np.searchsorted(self.upto, position)), self.upto.size - 1)
        if at and position - self.upto[at - 1] < self.upto[at] - position:
            at -= 1
        return self.least + at, float(self.upto[at])


def control_of(scores: Integers, shares: Floats, n: int) -> Control:
    """Return the distribution of a sum of scores."""
    # Takes scores (n_members,), shares (n_members,)
    lowest = int(scores.min())
    least, found = line_of_sums(scores - lowest, shares, n)
    return Control(least=least + n * lowest, upto=np.cumsum(found))


def whole_scores(slopes: Floats, spread: float, n: int) -> Integers:
    """Round slopes to integers that are fine enough, and few enough."""
    # slopes (n,) -> (n,)
    # Fine enough is a part of the spread; the sums span 17 of their deviations.
    scale = min(_FINE, _SPAN / (17.0 * math.sqrt(n))) / spread
    return np.asarray(np.rint(slopes * scale), dtype=np.int64)
