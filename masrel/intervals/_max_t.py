"""The largest of several correlated t-statistics: its probabilities and quantiles."""

import math

import numpy as np

from masrel.agreement._engine import Floats

_RANK = 1e-12  # singular values below it, of the largest, are rounding
_ANGLES = 1 << 13  # of a half turn
_DIRECTIONS = 1 << 15


class MaxT:
    """The distribution of max |T_k|, for T_k = a_k·Z / S with one S for all.

    Z is normal and S² a χ² over its degrees of freedom, so that |Z|²/(p S²) has an F
    distribution whatever the direction of Z: only directions are summed over. Of one
    or two dimensions that is exact; of more the directions are those of a lattice,
    the same every time.
    """

    def __init__(self, contrasts: Floats, df: float) -> None:
        """Take the coefficients of each statistic, of unit length or 0, and S's df."""
        # Takes contrasts (n_statistics, n_dimensions)
        _, sizes, turned = np.linalg.svd(contrasts, full_matrices=False)
        rank = int((sizes > _RANK * max(sizes.max(initial=0.0), 1.0)).sum())
        self.rank, self.df = rank, df
        directions = _directions(rank)  # (n, rank)
        largest = np.zeros(len(directions))
        for row in contrasts @ turned[:rank].T:
            np.maximum(largest, np.abs(directions @ row), out=largest)
        self._largest = largest

    def exceeded(self, quantile: float) -> float:
        """Return the probability of a larger one."""
        from scipy.special import fdtrc, stdtr

        if not quantile > 0.0:
            return 1.0
        if self.rank == 1:  # Student's t
            return min(1.0, 2.0 * float(stdtr(self.df, -quantile)))
        with np.errstate(divide="ignore"):
            ratios = (quantile / self._largest) ** 2 / self.rank
        return float(fdtrc(self.rank, self.df, ratios).mean())

    def quantile(self, level: float) -> float:
        """Return what it is at most with this probability."""
        from scipy.optimize import brentq
        from scipy.special import fdtri, stdtrit

        # between that of one statistic and that of every contrast there is
        low = float(stdtrit(self.df, 0.5 + 0.5 * level))
        if self.rank == 1:
            return low
        high = math.sqrt(self.rank * float(fdtri(self.rank, self.df, level)))

        def excess(quantile: float) -> float:
            return self.exceeded(quantile) - (1.0 - level)

        if excess(low) <= 0.0:  # all statistics are one, but for rounding
            return low
        return float(brentq(excess, low, max(high, low), xtol=1e-9))


def _directions(rank: int) -> Floats:
    # points spread evenly over the unit sphere, or half of it: (n, rank)
    if rank <= 1:
        return np.ones((1, rank))
    if rank == 2:
        angles = (np.arange(_ANGLES) + 0.5) * (math.pi / _ANGLES)
        return np.column_stack([np.cos(angles), np.sin(angles)])
    from scipy.special import ndtri

    # a Kronecker lattice: multiples of the powers of the root of x^(rank + 1) = x + 1
    root = 1.0
    for _ in range(64):
        root = (1.0 + root) ** (1.0 / (rank + 1))
    steps = root ** -np.arange(1.0, rank + 1.0)
    places = (0.5 + np.arange(1, _DIRECTIONS + 1)[:, None] * steps) % 1.0
    normal = ndtri(np.clip(places, 1e-12, 1.0 - 1e-12))
    return np.asarray(normal / np.linalg.norm(normal, axis=1, keepdims=True))
