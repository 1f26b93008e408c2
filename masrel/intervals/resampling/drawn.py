"""Values of resamples that were drawn, and how certain their quantiles are."""

import math
from dataclasses import dataclass, field

import numpy as np

from masrel.agreement._kernel import Floats
from masrel.intervals.resampling.control import Control
from masrel.intervals.resampling.enumerated import near
from masrel.intervals.resampling.numerators import Integers

__all__ = ["Drawn"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Drawn:
    """Values that were drawn, with a control whose distribution is known."""

    # Let the values be at most x in a share F of the resamples, and the control at most
    # c in a share H. Of H the expected share is known, and so how far this sample is
    # off: F less β times that is a better share, with β the slope of the one indicator
    # on the other [1]_. The quantile at p is then the quantile of the sample at p + β
    # (H - E H).
    # [1] Davison, A. C., Hinkley, D. V. (1997). Bootstrap Methods and their
    # Application, section 9.3 (control methods).

    # (n_values,): as they were drawn, none undefined
    values: Floats = field(compare=False, repr=False)
    # (n_values,): the same, ascending
    ordered: Floats = field(compare=False, repr=False)
    # A linear function of the resample that goes with the values
    control: Control | None = field(default=None, compare=False, repr=False)
    # (n_values,): its values on the same resamples
    scores: Integers | None = field(default=None, compare=False, repr=False)

    @property
    def weights(self) -> Floats:
        """The probability of each value, all the same."""
        n = self.values.size
        return np.broadcast_to(1.0 / max(n, 1), (n,))

    def quantile(self, position: float) -> float:
        """Return the quantile at a position, as `quantile_of` has it."""
        return self._plain(position + self._miss(position)[0])

    def share_below(self, value: float) -> float:
        """Return the probability of less than a value, and half that of the value."""
        below = self._indicator(value)
        share = float(below.mean())
        return share - self._missed(below, share)[0]

    def error(self, position: float, pull: float, value: float) -> float:
        """Return the Monte Carlo error of a quantile."""
        miss, rest = self._miss(position)
        if pull:
            below = self._indicator(value)
            rest = rest - pull * self._missed(below, float(below.mean()))[1]
        n = self.values.size
        error = float(rest.std()) / math.sqrt(n)
        # The slope of the quantile, from twice as far as a plain sample is off.
        reach = 2.0 * math.sqrt(position * (1.0 - position) / n)
        ends = (max(position + miss - reach, 0.0), min(position + miss + reach, 1.0))
        low, high = (self._plain(end) for end in ends)
        if not low < high:
            return 0.0
        return error * (high - low) / (ends[1] - ends[0])

    def _plain(self, position: float) -> float:
        n = self.ordered.size
        at = min(max(position, 0.0), 1.0) * n
        first = min(max(math.ceil(at - 1e-6), 1), n) - 1
        value = float(self.ordered[first])
        if first + 1 < n and abs(first + 1 - at) <= 1e-6:
            return 0.5 * (value + float(self.ordered[first + 1]))
        return value

    def _indicator(self, value: float) -> Floats:
        low, high = near(value)
        below = (self.values < low).astype(np.float64)
        return np.asarray(0.5 * (below + (self.values <= high)), dtype=np.float64)

    def _miss(self, position: float) -> tuple[float, Floats]:
        below = (self.values <= self._plain(position)).astype(np.float64)
        return self._missed(below, position)

    def _missed(self, below: Floats, position: float) -> tuple[float, Floats]:
        # by how much the share below is off, and what the control does not say of each
        if self.control is None or self.scores is None:
            return 0.0, below
        cut, share = self.control.cut(position)
        hit = (self.scores <= cut).astype(np.float64)
        seen = float(hit.mean())
        spread = seen * (1.0 - seen)
        if spread == 0.0:
            return 0.0, below
        slope = (float(hit @ below) / hit.size - seen * float(below.mean())) / spread
        return slope * (seen - share), below - slope * hit
