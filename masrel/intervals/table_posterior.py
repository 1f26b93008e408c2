"""The distribution of a coefficient of two raters, given a Dirichlet on their table.

Given what agreeing pairs agree on, and how the others are apart, it is exact: the
coefficient is at most a value where a quadratic in the share of pairs that are apart is
positive, and that share is a Beta. What is given is summed over nodes.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.special import betainc, betaln, xlog1py, xlogy

from masrel.agreement.kernel import Floats
from masrel.estimates import Distribution
from masrel.intervals.table_chances import Nodes

__all__ = ["TablePosterior"]

_SHOWN = 101  # points of a distribution


@dataclass(frozen=True, slots=True, kw_only=True)
class TablePosterior:
    """The distribution of a coefficient.

    Attributes
    ----------
    nodes : callable
        A value to what agreeing and other pairs may be, with weights, for the
        coefficient to be at most that value.
    shown : callable
        The same of fewer nodes, as many as a density that is looked at needs.
    apart, agreed : float
        The share of pairs that are apart is Beta(apart, agreed).
    n_draws : int or None
        How many nodes were drawn; None if none were.
    """

    nodes: Callable[[float], Nodes]
    shown: Callable[[float], Nodes]
    apart: float
    agreed: float
    n_draws: int | None = None

    def probability(self, value: float) -> float:
        """Return the probability that the coefficient is at most a value."""
        nodes = self.nodes(value)
        return float(nodes.weights @ self._given(nodes, value))

    def density(self, value: float) -> float:
        """Return the density of the coefficient at a value."""
        nodes = self.nodes(value)
        return float(nodes.weights @ self._densities(nodes, value))

    def quantile(self, share: float, start: float) -> float:
        """Solve for a quantile.

        Parameters
        ----------
        share : float
            Probability, within (0, 1).
        start : float
            Where it is expected, below 1.

        Returns
        -------
        float
            By Newton's method, and by halving where that leaves what is known.
        """
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
        """Return the density between two values.

        Parameters
        ----------
        low, high : float
            Where it begins and ends.
        words : str
            What it is.

        Returns
        -------
        Distribution
            Continuous, at equally spaced points.
        """
        values = np.linspace(low, high, _SHOWN + 2)[1:-1]
        density = np.zeros(_SHOWN)
        for i, at in enumerate(values.tolist()):
            nodes = self.shown(at)
            density[i] = nodes.weights @ self._densities(nodes, at)
        return Distribution(
            values=values, weights=density, continuous=True, words=words
        )

    def _given(self, nodes: Nodes, value: float) -> Floats:
        # (n,): P(coefficient <= value) at each node
        up, down, _ = _crossings(nodes, value)
        below_down = betainc(self.apart, self.agreed, np.minimum(down, 1.0))
        below_up = betainc(self.apart, self.agreed, np.minimum(up, 1.0))
        return np.asarray(below_down - below_up)

    def _densities(self, nodes: Nodes, value: float) -> Floats:
        # (n,): the density of t at each crossing, times how fast that moves
        up, down, slope = _crossings(nodes, value)
        out = np.zeros(up.size)
        for t in (up, down):
            inside = (t < 1.0) & (t > 0.0) & (slope > 0.0)
            at = t[inside]
            log = xlogy(self.apart - 1.0, at) + xlog1py(self.agreed - 1.0, -at)
            of_t = np.exp(log - betaln(self.apart, self.agreed))
            chance = (
                (1.0 - at) ** 2 * nodes.e_agreed[inside]
                + at * (1.0 - at) * nodes.e_mixed[inside]
                + at**2 * nodes.e_apart[inside]
            )
            out[inside] += of_t * chance / slope[inside]
        return out


def _crossings(nodes: Nodes, value: float) -> tuple[Floats, Floats, Floats]:
    # The coefficient is at most value where t apart - (1 - value) D_e(t) >= 0, a
    # quadratic a2 t² + a1 t + a0 with a0 <= 0: from `up` to `down`, where its slope is
    # ± `slope`. Both are 1 where that is nowhere, and `down` infinite where it stays.
    rest = 1.0 - value
    a0 = -rest * nodes.e_agreed
    a1 = nodes.apart - rest * (nodes.e_mixed - 2.0 * nodes.e_agreed)
    a2 = -rest * (nodes.e_agreed - nodes.e_mixed + nodes.e_apart)
    inside = a1 * a1 - 4.0 * a2 * a0
    slope = np.sqrt(np.maximum(inside, 0.0))
    with np.errstate(divide="ignore", invalid="ignore"):
        up = np.where(a1 > 0.0, -2.0 * a0 / (a1 + slope), (slope - a1) / (2.0 * a2))
        down = np.where(a2 < 0.0, (a1 + slope) / (-2.0 * a2), np.inf)
    nowhere = (inside < 0.0) | ((a1 <= 0.0) & (a2 <= 0.0))
    return np.where(nowhere, 1.0, up), np.where(nowhere, 1.0, down), slope
