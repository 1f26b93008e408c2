"""Krippendorff's own difference functions, which grow without bound."""

from collections.abc import Sequence
from fractions import Fraction
from typing import Literal, get_args

from masrel.agreement._counts import CountedRatings
from masrel.agreement.weights import (
    Weights,
    category_values,
    every_pair,
    identity_weights,
    over_one_denominator,
)
from masrel.errors import ParameterError

__all__ = ["Metric", "metric_weights"]

Metric = Literal["nominal", "ordinal", "interval", "ratio"]
"""Names of the difference functions."""


def metric_weights(metric: Metric, counted: CountedRatings) -> Weights:
    """Return squared differences of categories as weights of disagreement."""
    # δ² of every pair of categories, exact.
    # [1] Krippendorff, K. (2004). Content Analysis, 2nd ed., pp. 232-236.
    if metric not in get_args(Metric):
        raise ParameterError(
            f"metric: needs one of {', '.join(get_args(Metric))}, got {metric!r}"
        )
    if metric == "nominal":
        return Weights(name="nominal", n_categories=len(counted.categories))
    if not counted.declared and isinstance(counted.categories[0], str):
        raise ParameterError(
            f"categories: the {metric} metric needs the declared scale in order, the "
            f"ratings are text: {', '.join(map(str, counted.categories))}"
        )
    if metric == "ordinal":
        return over_one_denominator("ordinal metric", _ordinal(_pairable(counted)))
    values = category_values(counted.categories)
    if metric == "interval":
        squares = every_pair(values, lambda x, y: (x - y) ** 2)
        return over_one_denominator("interval", squares)
    if any(x + y == 0 for i, x in enumerate(values) for y in values[:i]):
        raise ParameterError(
            "metric: ratio needs values of which no two sum to 0, got "
            f"{', '.join(str(float(value)) for value in values)}"
        )
    ratios = every_pair(values, lambda x, y: ((x - y) / (x + y)) ** 2)
    return over_one_denominator("ratio metric", ratios)


def _pairable(counted: CountedRatings) -> list[int]:
    # ratings per category of the items that have at least two
    totals = [0] * len(counted.categories)
    for group in counted.items.tally(identity_weights(len(totals))).groups:
        if group.size > 1:
            totals = [a + b for a, b in zip(totals, group.totals, strict=True)]
    return totals


def _ordinal(totals: Sequence[int]) -> list[list[Fraction]]:
    # (Σ_{g=c}^{k} n_g - (n_c + n_k)/2)²: ratings up to the middle of each grade
    middles, below = [], 0
    for total in totals:
        middles.append(Fraction(2 * below + total, 2))
        below += total
    return every_pair(middles, lambda x, y: (x - y) ** 2)
