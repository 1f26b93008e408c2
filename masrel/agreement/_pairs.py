"""Tables of pairs of two ratings, and kappa as a ratio of their sums."""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from masrel.agreement._kernel import NO_CHANCE, NO_PAIR, undefined
from masrel.agreement._labels import Codes
from masrel.agreement.weights import Weights
from masrel.estimates import Estimate

Table = NDArray[np.int64]


def pair_table(codes: Codes, n_categories: int) -> Table:
    """Count the pairs of two columns of codes."""
    # codes (n_items, 2) -> (n_categories, n_categories)
    side = n_categories + 1
    # Missing, -1, becomes the last row and column, which is cut off.
    flat = codes[:, 0].astype(np.int32) * side + codes[:, 1] + side + 1
    times = np.bincount(flat, minlength=side * side).reshape(side, side)
    return times[1:, 1:].astype(np.int64)


@dataclass(frozen=True, slots=True)
class PairSums:
    """What kappa of a table of pairs is made of, in integers."""

    # With t the table and n its sum, D_o = `above` / (n · w) and D_e = `below` / (n² ·
    # w), where w is the denominator of the weights.

    cells: list[list[int]]
    n: int
    above: int  # Σ_kl v_kl t_kl
    below: int  # Σ_kl v_kl t_k. t_.l
    to_second: list[int]  # Σ_l v_kl t_.l
    to_first: list[int]  # Σ_k v_kl t_k.

    @classmethod
    def of(cls, table: Table, v: Weights) -> "PairSums":
        """Sum a table of pairs."""
        # Takes table (n_categories, n_categories)
        cells: list[list[int]] = table.tolist()
        first = [sum(row) for row in cells]
        second = [sum(column) for column in zip(*cells, strict=True)]
        n = sum(first)
        to_second = v.products(second)
        if v.numerators is None:
            above = n - sum([cells[k][k] for k in range(len(cells))])
        else:
            above = sum(
                [
                    sum([x * t for x, t in zip(of_v, row, strict=True) if t])
                    for of_v, row in zip(v.numerators, cells, strict=True)
                ]
            )
        below = sum([t * vt for t, vt in zip(first, to_second, strict=True)])
        return cls(cells, n, above, below, to_second, v.products(first))

    def influence(self, k: int, l: int, v: Weights) -> int:  # noqa: E741 - as in the formula
        """Return the influence of an item in cell (k, l), times `below`² / n."""
        # An item moves D_o by v_kl - D_o, and D_e by Σ_m (v_km p_.m + v_ml p_m.) - 2
        # D_e.
        if v.numerators is None:
            own = 0 if k == l else 1
        else:
            own = v.numerators[k][l]
        margins = self.to_second[k] + self.to_first[l]
        raised = self.n * self.above * margins
        return raised - self.n * own * self.below - self.above * self.below


def kappa_of_sums(
    found: PairSums,
    v: Weights,
    name: str,
    title: str,
    error: Callable[[], float],
    *,
    n_items: int,
    n_raters: int,
) -> Estimate:
    """Make kappa of a table of pairs, 1 - D_o / D_e, with one division."""
    n, reason = found.n, None
    if n == 0:
        reason = undefined(title, NO_PAIR)
    elif v.reason is not None:
        reason = undefined(title, v.reason)
    elif found.below == 0:
        reason = undefined(title, NO_CHANCE)
    value = observed = chance = math.nan
    if n and v.reason is None:
        w = v.denominator
        observed = (n * w - found.above) / (n * w)
        chance = (n * n * w - found.below) / (n * n * w)
    if reason is None:
        value = (found.below - n * found.above) / found.below
    return Estimate(
        coefficient=name,
        weights=v.name,
        value=value,
        standard_error=math.nan if reason else error,
        observed=observed,
        chance=chance,
        n_items=n_items,
        n_raters=n_raters,
        n_categories=v.n_categories,
        reason=reason,
    )
