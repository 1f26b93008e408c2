"""From resamples to the ends of an interval."""

import math
from dataclasses import dataclass
from statistics import NormalDist
from typing import Literal

from masrel.intervals.resampling.drawn import Drawn
from masrel.intervals.resampling.enumerated import Enumerated

__all__ = ["Ends", "Kind", "Rule", "bca_levels"]

Kind = Literal["percentile", "basic", "bca", "studentized"]
"""How the ends of an interval come from resamples."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Ends:
    """The ends of an interval."""

    # low, high: where it begins and ends
    low: float
    high: float
    # monte Carlo errors of both; None if nothing was drawn
    errors: tuple[float, float] | None


@dataclass(frozen=True, slots=True, kw_only=True)
class Rule:
    """How the ends come from resamples."""

    # [1] Efron, B., Tibshirani, R. J. (1993). An Introduction to the Bootstrap.
    # [2] Davison, A. C., Hinkley, D. V. (1997). Bootstrap Methods and their
    # Application.

    kind: Kind  # which way
    level: float  # nominal level
    value: float  # the estimate
    error: float = math.nan  # its standard error, where it is studentized
    skew: float = 0.0  # the acceleration of BCa

    def ends(self, source: Enumerated | Drawn) -> Ends | None:
        """Return the ends."""
        tail = 0.5 * (1.0 - self.level)
        levels, pulls = (tail, 1.0 - tail), (0.0, 0.0)
        if self.kind == "bca":
            share = source.share_below(self.value)
            if not 0.0 < share < 1.0:
                return None
            levels = bca_levels(self.level, share, self.skew)
            pulls = self._pulls(share)
        first, last = (source.quantile(at) for at in levels)
        errors = None
        if isinstance(source, Drawn):
            low, high = (
                source.error(at, pull, self.value)
                for at, pull in zip(levels, pulls, strict=True)
            )
            errors = (low, high)
        return self._turned(first, last, errors)

    def _pulls(self, share: float) -> tuple[float, float]:
        # how fast the levels move with the share below the estimate
        step = 1e-4 * min(share, 1.0 - share)
        above = bca_levels(self.level, share + step, self.skew)
        below = bca_levels(self.level, share - step, self.skew)
        low, high = ((a - b) / (2 * step) for a, b in zip(above, below, strict=True))
        return low, high

    def _turned(
        self, first: float, last: float, errors: tuple[float, float] | None
    ) -> Ends:
        if self.kind in ("percentile", "bca"):  # (13.3) and (14.9) of [1]
            return Ends(low=first, high=last, errors=errors)
        back = None if errors is None else errors[::-1]
        if self.kind == "basic":  # (5.6) of [2]
            return Ends(
                low=2 * self.value - last, high=2 * self.value - first, errors=back
            )
        return Ends(  # (12.22) of [1]
            low=self.value - self.error * last,
            high=self.value - self.error * first,
            errors=None
            if back is None
            else (self.error * back[0], self.error * back[1]),
        )


def bca_levels(level: float, share: float, skew: float) -> tuple[float, float]:
    """Return which quantiles of the resamples are the ends of a BCa interval."""
    # [1] Efron, B., Tibshirani, R. J. (1993). An Introduction to the Bootstrap, ch. 14.
    normal = NormalDist()
    bias = normal.inv_cdf(share)  # z0, (14.14) of [1]
    tail = 0.5 * (1.0 - level)
    ends = []
    for z in (normal.inv_cdf(tail), normal.inv_cdf(1.0 - tail)):
        stretch = 1.0 - skew * (bias + z)
        if stretch <= 0.0:  # beyond its pole (14.10) says nothing: the last value
            ends.append(0.0 if bias + z < 0.0 else 1.0)
            continue
        moved = bias + (bias + z) / stretch  # (14.10)
        ends.append(0.5 * math.erfc(-moved / math.sqrt(2.0)))
    return ends[0], ends[1]
