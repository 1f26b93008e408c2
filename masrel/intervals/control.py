"""A linear function of a resample, whose distribution is known without drawing."""

import math
from dataclasses import dataclass, field

import numpy as np

from masrel.agreement.kernel import Floats
from masrel.intervals.lattice import Integers, Lattice
from masrel.intervals.states import transformed_states

__all__ = ["Control", "control_of", "whole_scores"]

_SPAN = 1 << 18  # integers it spans at most


@dataclass(frozen=True, slots=True, kw_only=True)
class Control:
    """The sum of integer scores of what is drawn.

    Attributes
    ----------
    sums : ndarray of int64, shape (n_sums,)
        Sums of scores, ascending.
    upto : ndarray, shape (n_sums,)
        The probability of a sum at most as large.
    """

    sums: Integers = field(compare=False, repr=False)
    upto: Floats = field(compare=False, repr=False)

    def cut(self, position: float) -> tuple[int, float]:
        """Return the sum nearest to a position, and the probability up to it."""
        at = int(np.searchsorted(self.upto, position))
        at = min(max(at, 0), self.sums.size - 1)
        if at and position - self.upto[at - 1] < self.upto[at] - position:
            at -= 1
        return int(self.sums[at]), float(self.upto[at])


def control_of(scores: Integers, shares: Floats, n: int) -> Control:
    """Return the distribution of a sum of scores.

    Parameters
    ----------
    scores : ndarray of int64, shape (n_members,)
        Score of each member.
    shares : ndarray, shape (n_members,)
        Probability of each at a draw.
    n : int
        How many are drawn.

    Returns
    -------
    Control
        Probabilities within 1e-12.
    """
    least = int(scores.min())
    line = Lattice(
        steps=(scores - least)[:, None],
        origin=np.zeros(1, dtype=np.int64),
        basis=np.ones((1, 1), dtype=np.int64),
        denominators=np.ones(1),
    )
    steps, found = transformed_states(line, shares, n)
    order = np.argsort(steps[:, 0], kind="stable")  # two runs
    return Control(sums=steps[order, 0] + n * least, upto=np.cumsum(found[order]))


def whole_scores(slopes: Floats, spread: float, n: int) -> Integers:
    """Round slopes to integers that are fine enough, and few enough.

    Parameters
    ----------
    slopes : ndarray, shape (n,)
        How fast an estimate moves.
    spread : float
        The standard deviation of its linear part over one draw, above 0.
    n : int
        How many are drawn.

    Returns
    -------
    ndarray of int64, shape (n,)
        The slopes on a scale that fits a table of their sums.
    """
    # Fine enough is a hundredth of the spread; the sums span 17 of their deviations.
    scale = min(100.0, _SPAN / (17.0 * math.sqrt(n))) / spread
    return np.asarray(np.rint(slopes * scale), dtype=np.int64)
