"""How much each item moves a coefficient of unnamed raters, in whole numbers."""

import math
from collections.abc import Mapping, Sequence
from operator import mul
from typing import NamedTuple

from masrel.agreement.tally import Observed, Tally

__all__ = [
    "Expected",
    "Linear",
    "RoundedLinear",
    "Slopes",
    "as_irrcac",
    "pooled_influence",
    "rounded_influence",
]


class Expected(NamedTuple):
    """Disagreement by chance, D_e = numerator / denominator."""

    numerator: int
    denominator: int


class Slopes(NamedTuple):
    """Slopes of D_e in each share, ∂D_e / ∂p_k = numerators_k / denominator."""

    # Without numerators, D_e does not depend on the shares.

    numerators: Sequence[int] = ()
    denominator: int = 1


class Linear(NamedTuple):
    """A linear function of an item: a[n] V + b[n] + e[n] Σ_k slopes_k n_k."""

    # V is the item's disagreement Σ_kl v_kl n_k n_l and n its number of ratings. All
    # numbers are integers, to be divided by `denominator`.

    by_size: Mapping[int, tuple[int, int, int]]  # n to a, b and e
    # (n_categories,): the slopes; may be empty where every e is 0
    slopes: Sequence[int]
    denominator: int  # what all is divided by


class RoundedLinear(NamedTuple):
    """A linear function of an item as `Linear`, in floats, and V as it is."""

    by_size: Mapping[int, tuple[float, float, float]]  # n to a, b and e
    # (n_categories,): the slopes; may be empty where every e is 0
    slopes: Sequence[float]


def pooled_influence(
    tally: Tally, observed: Observed, chance: Expected, slopes: Slopes
) -> Linear:
    """Return how much an item moves 1 - D_o / D_e, times the number of items."""
    # -u_i of item i. With d_i its disagreement, s_i = 1 if it has a pair, x_ik its
    # shares and h_k = ∂D_e/∂p_k, -D_e u_i is (n/n') (d_i - D_o s_i) - (D_o/D_e) Σ_k h_k
    # (x_ik - p_k).
    n, shares, h = tally.n_rated, tally.shares, slopes.numerators
    over_h = slopes.denominator * shares.total if h else 1
    mean_h = sum(map(mul, h, shares.numerators))
    # All of it times n' · D_o's denominator · over_h · D_e's numerator is whole.
    scale = over_h * chance.numerator
    raised = observed.numerator * observed.n_usable * chance.denominator
    by_size = {}
    for group in tally.groups:
        size = group.size
        a, b, e = 0, raised * mean_h, 0
        if size > 1:
            pairs = observed.multiple // (size * (size - 1))
            a = n * observed.n_usable * scale * pairs
            b -= n * observed.numerator * scale
        if h:  # x_ik = n_ik / size, and the shares' total divides by every size
            e = -raised * (shares.total // size)
        by_size[size] = (a, b, e)
    denominator = observed.n_usable * observed.denominator * scale * chance.numerator
    return _reduced(Linear(by_size, h, denominator), chance.denominator)


def _reduced(function: Linear, numerator: int) -> Linear:
    # the function times `numerator`, in the smallest integers
    common = math.gcd(*[part for parts in function.by_size.values() for part in parts])
    numerator *= common
    less = math.gcd(numerator, function.denominator)
    factor, common = numerator // less, common or 1
    by_size = {
        size: (a // common * factor, b // common * factor, e // common * factor)
        for size, (a, b, e) in function.by_size.items()
    }
    return Linear(by_size, function.slopes, function.denominator // less)


def as_irrcac(
    influence: Linear, tally: Tally, observed: Observed, chance: Expected
) -> Linear:
    """Return what irrCAC takes in place of the influence of an item."""
    # -u_i - κ (s_i n/n' - 1): an item without a pair counts as one with a κ of 0.
    n_usable = observed.n_usable
    kappa = chance.numerator * observed.denominator
    below = kappa * n_usable
    kappa -= observed.numerator * chance.denominator
    by_size = {}
    for size, (a, b, e) in influence.by_size.items():
        moved = (tally.n_rated if size > 1 else 0) - n_usable
        moved *= kappa * influence.denominator
        by_size[size] = (a * below, b * below - moved, e * below)
    return Linear(by_size, influence.slopes, influence.denominator * below)


def rounded_influence(
    tally: Tally, observed: Observed, chance: Expected, slopes: Slopes, as_irrcac: bool
) -> RoundedLinear:
    """Return how much an item moves 1 - D_o / D_e, from floats."""
    n, n_usable = tally.n_rated, observed.n_usable
    d_e = chance.numerator / chance.denominator
    ratio = (observed.numerator * chance.denominator) / (
        observed.denominator * chance.numerator
    )
    h = [slope / slopes.denominator for slope in slopes.numerators]
    p = [share / tally.shares.total for share in tally.shares.numerators]
    mean_h = sum(map(mul, h, p))
    by_size = {}
    for size, *_ in tally.groups:
        a, b = 0.0, ratio * mean_h / d_e
        if size > 1:
            a = n / n_usable / (size * (size - 1)) / d_e
            b -= n / n_usable * ratio
        if as_irrcac:
            b -= (1.0 - ratio) * ((n / n_usable if size > 1 else 0.0) - 1.0)
        by_size[size] = (a, b, -ratio / (size * d_e) if h else 0.0)
    return RoundedLinear(by_size, h)
