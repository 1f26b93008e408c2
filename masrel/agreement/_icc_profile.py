"""The interval of an intraclass correlation from a table with gaps.

In: variance components by restricted maximum likelihood. Out: where the profile of the
likelihood has fallen as far as the level allows.
"""

import math
from dataclasses import dataclass
from statistics import NormalDist

import numpy as np
from numpy.typing import NDArray

from masrel.agreement._reml import Components, Fit, lowest, solved

_Floats = NDArray[np.float64]

_STEPS = 100
"""Newton's steps, of which a few are the rule."""

_MANY = 100
"""Raters from which on the profile is taken to have one valley: looking costs much."""

_LOW, _LOWEST = -7.0, -50.0
"""Logits of a correlation of next to nothing, and of one as good as 0."""

_RATIOS = (0.0, *np.geomspace(1e-3, 1e3, 10))
"""Ratios of raters to the residual, among which the way down to a valley begins."""


def icc_ends(
    components: Components, *, absolute: bool, level: float
) -> tuple[float, float]:
    """Return the ends of the interval of a single rating's intraclass correlation."""
    # absolute: whether the variance of raters counts as error
    fit = components.fit
    if fit is None:
        return _ends_without_residual(components, absolute, level)
    profile = _Profile(
        fit=fit,
        absolute=absolute,
        has_raters=components.has_raters,
        last=float(fit.ratios[1]),
    )
    height = NormalDist().inv_cdf(0.5 + 0.5 * level)
    return profile.end(height, -1.0), profile.end(height, 1.0)


def _ends_without_residual(
    components: Components, absolute: bool, level: float
) -> tuple[float, float]:
    # of two variances that are known but for their degrees of freedom
    if not absolute or components.raters == 0.0:
        return 1.0, 1.0
    from scipy.special import fdtri

    of_items, of_raters = components.n_items - 1, components.n_raters - 1
    upper = 0.5 + 0.5 * level
    ratio = components.items / components.raters
    low = ratio / float(fdtri(of_items, of_raters, upper))
    high = ratio * float(fdtri(of_raters, of_items, upper))
    return low / (1.0 + low), high / (1.0 + high)


@dataclass(slots=True, kw_only=True)
class _Profile:
    # The highest likelihood of each intraclass correlation ρ, by its logit: the log
    # ratio of items to error.
    fit: Fit
    absolute: bool
    has_raters: bool
    last: float  # ratio of raters that was likeliest last

    def end(self, height: float, side: float) -> float:
        """Return ρ where the root of the deviance above the least is so high."""
        if side < 0.0 and self._root(-math.inf)[0] <= height:
            return 0.0
        # from where the likelihood is highest, outwards until it is low enough
        of_items, of_raters = self.fit.ratios
        best = of_items / (1.0 + of_raters * self.absolute)
        inner = math.log(best) if best > 0.0 else -math.inf
        outer = max(inner, _LOW) + 1.0 if side > 0.0 else inner - 1.0
        root, slope = self._root(outer)
        step = side
        while root < height:
            inner, step = outer, 2.0 * step
            outer += step
            root, slope = self._root(outer)
        # Newton's steps, and halves where they leave the bracket
        at, inner = outer, max(inner, _LOWEST)
        for _ in range(_STEPS):
            step = (height - root) / slope if slope else math.nan
            if abs(step) < 1e-7:  # the next would be some 1e-14
                at += step
                break
            if not min(inner, outer) < at + step < max(inner, outer):
                step = 0.5 * (inner + outer) - at
            at += step
            root, slope = self._root(at)
            inner, outer = (inner, at) if root >= height else (at, outer)
        return 1.0 / (1.0 + math.exp(-at))

    def _root(self, logit: float) -> tuple[float, float]:
        # √(deviance - least), whatever raters are likeliest, and its slope
        odds = math.exp(logit)
        base = np.array([odds, 0.0])
        way = np.array([[odds * self.absolute], [1.0]])[:, : int(self.has_raters)]
        x, point = lowest(self.fit.sums, base, way, self._start(base, way))
        self.last = float((base + way @ x)[1])
        above = math.sqrt(max(point.deviance - self.fit.deviance, 0.0))
        slope = point.slopes[:, 0].sum() * (base + way @ x)[0]
        return above, slope / (2.0 * above) if above else 0.0

    def _start(self, base: _Floats, way: _Floats) -> _Floats:
        # the best of some ratios of raters: there may be more than one valley
        if not self.has_raters or len(self.fit.sums.levels) > _MANY:
            return np.full(way.shape[1], self.last)
        starts = np.array([[*_RATIOS, self.last]]).T
        heights = solved(self.fit.sums, base + starts @ way.T).deviances
        return np.asarray(starts[np.argmin(heights)])
