"""What items add up to: observed disagreement and the shares of the categories.

Everything is whole numbers, which are divided where a coefficient is made of them.
"""

import math
from typing import NamedTuple

from masrel.agreement.weights import Weights

__all__ = ["Observed", "Shares", "SizeGroup", "Tally", "add_up"]


class SizeGroup(NamedTuple):
    """Sums over the items that have the same number of ratings."""

    size: int  # ratings of each item, at least 1
    n_items: int  # how many items
    totals: list[int]  # (n_categories,): ratings per category
    disagreement: int  # Σ_i Σ_kl v_kl n_ik n_il, times the denominator of the weights


class Observed(NamedTuple):
    """Disagreement observed, D_o = numerator / denominator, and what it is made of."""

    n_usable: int  # items with at least two ratings
    multiple: int  # A multiple of n (n - 1) for every number of ratings n
    # numerator, denominator: the mean over usable items of Σ_kl v_kl n_ik n_il / (n_i
    # (n_i - 1))
    numerator: int
    denominator: int


class Shares(NamedTuple):
    """Shares of the categories, p_k = numerators_k / total."""

    # A share is the mean over rated items of the part of an item's raters who chose it.

    numerators: list[int]
    total: int


class Tally(NamedTuple):
    """Sums over all items."""

    # items by their number of ratings; those without any are left out
    groups: list[SizeGroup]
    n_rated: int  # items with at least one rating
    observed: Observed | None  # none if no item has two ratings
    shares: Shares  # of the rated items


def add_up(groups: list[SizeGroup], weights: Weights) -> Tally:
    """Add groups of items up."""
    n_rated = sum([group.n_items for group in groups])
    return Tally(groups, n_rated, _observed(groups, weights), _shares(groups, n_rated))


def _observed(groups: list[SizeGroup], weights: Weights) -> Observed | None:
    n_usable, multiple, numerator = 0, 1, 0
    for size, n_items, _, disagreement in groups:
        if size > 1:
            pairs = size * (size - 1)
            common = math.lcm(multiple, pairs)
            numerator = numerator * (common // multiple)
            numerator += disagreement * (common // pairs)
            n_usable, multiple = n_usable + n_items, common
    if n_usable == 0:
        return None
    denominator = n_usable * multiple * weights.denominator
    return Observed(n_usable, multiple, numerator, denominator)


def _shares(groups: list[SizeGroup], n_rated: int) -> Shares:
    if len(groups) == 1:
        return Shares(groups[0].totals, n_rated * groups[0].size)
    common = math.lcm(*[group.size for group in groups])
    weighed = [[t * (common // g.size) for t in g.totals] for g in groups]
    numerators = [sum(parts) for parts in zip(*weighed, strict=True)]
    return Shares(numerators, n_rated * common)
