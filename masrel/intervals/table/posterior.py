"""The distribution of a coefficient of two raters, given a Dirichlet on their table.

Given what agreeing pairs agree on, and how the others are apart, it is exact: the
coefficient is at most a value where a quadratic in the share of pairs that are apart is
positive, and that share is a Beta. What is given is summed over nodes.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.special import betainc, betaln, xlogy

from masrel.agreement._kernel import Floats
from masrel.estimates import Distribution
from masrel.intervals.table.chances import Nodes

__all__ = ["TablePosterior"]

_SHOWN = 101  # points of a distribution


@dataclass(frozen=True, slots=True, kw_only=True)
class TablePosterior:
    """The distribution of a coefficient."""

    # A value to what agreeing and other pairs may be, with weights, for the coefficient
    # to be at most that value
    nodes: Callable[[float], Nodes]
    # the same of fewer nodes, as many as a density that is looked at needs
    shown: Callable[[float], Nodes]
    # apart, agreed: the share of pairs that are apart is Beta(apart, agreed)
    apart: float
    agreed: float
    n_draws: int | None = None  # how many nodes were drawn; None if none were

    def probability(self, value: float) -> float:
        """Return the probability that the coefficient is at most a value."""
        nodes = self.nodes(value)
        return float(nodes.weights @ self._given(nodes, value))

    def density(self, value: float) -> float:
        """Return the density of the coefficient at a value."""
        nodes = self.nodes(value)
        return float(nodes.weights @ self._densities(nodes, value))

    def quantile(self, share: float, start: float) -> float:
        """Solve for a quantile."""
        low, high = -1.0, 1.0
        while self.probability(low) > share:
            low = 2.0 * low - 1.0  # weighted it can be below -1
        at = start if low < start < high else 0.5 * (low + high)
        for _ in range(200):
            missing = self.probability(at) - share
            low, high = (low, at) if missing > 0.0 else (at, high)
            slope = self.density(at)
            ahead = at - missing / slope if slope > 0.0 else low
            if not low < ahead < high:
                ahead = 0.5 * (low + high)
            if abs(ahead - at) < 1e-11:
                return ahead
            at = ahead
        return at

    def quantile_error(self, at: float) -> float:
        """Return the Monte Carlo standard error of the quantile found at a value."""
        given = self._given(self.nodes(at), at)
        return float(given.std() / np.sqrt(given.size)) / self.density(at)

    def distribution(self, low: float, high: float, words: str) -> Distribution:
        """Return the density between two values."""
        values = np.linspace(low, high, _SHOWN + 2)[1:-1]
        density = np.zeros(_SHOWN)
        for i, at in enumerate(values.tolist()):
            nodes = self.shown(at)
            density[i] = nodes.weights @ self._densities(nodes, at)
        return Distribution(
            values=values, weights=density, continuous=True, words=words
        )

    def _given(self, nodes: Nodes, value: float) -> Floats:
        # (n,): P(coefficient <= value) at each node; from the nearer end of t, so that
        # a small parameter there keeps its digits
        up, up_rest, down, _ = _crossings(nodes, value)
        near = up < 0.5
        a = np.where(near, self.apart, self.agreed)
        b = np.where(near, self.agreed, self.apart)
        part = betainc(a, b, np.where(near, up, up_rest))
        out = np.where(near, 1.0 - part, part)
        ends = down < 1.0
        out[ends] -= betainc(self.agreed, self.apart, 1.0 - down[ends])
        return out

    def _densities(self, nodes: Nodes, value: float) -> Floats:
        # (n,): the density of t at each crossing, times how fast that moves in value,
        # D_e / slope, where (1 - value) D_e = t apart
        up, up_rest, down, slope = _crossings(nodes, value)
        out = np.zeros(up.size)
        for t, rest in ((up, up_rest), (down, 1.0 - down)):
            inside = (t > 0.0) & (rest > 0.0) & (slope > 0.0)
            log = xlogy(self.apart, t[inside]) + xlogy(self.agreed - 1.0, rest[inside])
            of_t = np.exp(log - betaln(self.apart, self.agreed))  # density times t
            out[inside] += of_t * nodes.apart[inside] / slope[inside]
        return out / (1.0 - value)


def _crossings(nodes: Nodes, value: float) -> tuple[Floats, Floats, Floats, Floats]:
    # The coefficient is at most value where t apart - (1 - value) D_e(t) >= 0: a
    # quadratic in t that is -`low` <= 0 at t = 0 and `high` at t = 1. It rises through
    # 0 at t = `up`; with `high` < 0 it falls again at `down`, or is nowhere 0. Its
    # roots are written so that nothing cancels at either end of t.
    # Returned, each (n,): up, 1 - up, down (1 if none), and the slope at either.
    rest = 1.0 - value
    low = rest * nodes.agreed
    high = value * nodes.apart + rest * nodes.less_apart
    h = value * nodes.apart + rest * nodes.less_mixed
    falls = high < 0.0
    cross = 2.0 * np.sqrt(low) * np.sqrt(np.abs(high))
    inside = np.where(falls, (h - cross) * (h + cross), 0.0)
    slope = np.where(falls, np.sqrt(np.maximum(inside, 0.0)), np.hypot(h, cross))
    near = slope + np.abs(h)
    with np.errstate(divide="ignore", invalid="ignore"):
        of_low, of_high = near / (near + 2.0 * low), near / (near + 2.0 * high)
        up = np.where(h >= 0.0, 2.0 * low / (near + 2.0 * low), of_high)
        up_rest = np.where(h >= 0.0, of_low, 2.0 * high / (near + 2.0 * high))
        down = near / (near - 2.0 * high)
    twice = falls & (inside > 0.0) & (h > 0.0)
    nowhere = falls & ~twice
    up[nowhere], up_rest[nowhere] = 1.0, 0.0
    lost = np.isnan(up)  # both ends are 0 in floating point
    up[lost], up_rest[lost] = 0.0, 1.0
    return up, up_rest, np.where(twice, down, 1.0), slope
