"""Krippendorff's difference functions δ² of two grades, and distances of sets.

In: the name of a metric, and ratings that are counted. Out: `Weights`, which hold δ² as
it is, without a largest value.
"""

import math
import re
from ast import literal_eval
from collections.abc import Sequence
from fractions import Fraction
from typing import Literal, get_args

import numpy as np

from masrel.agreement._counts import CountedRatings, DistinctItems, item_counts
from masrel.agreement._data import CodedRatings
from masrel.agreement._distances import MAX_EXPONENT, Squared, centred
from masrel.agreement._kernel import Floats, Kernel, divide
from masrel.agreement._labels import EMPTY_SET, Label, SetText, shown
from masrel.agreement._weights import (
    MANY,
    ManyWeights,
    Weights,
    category_values,
    every_pair,
    identity_weights,
    over_one_denominator,
    ratio_weights,
    squared_ratio,
    value_array,
)
from masrel.errors import ParameterError

Metric = Literal["nominal", "ordinal", "interval", "ratio", "jaccard", "masi"]
"""Names of the difference functions; the last two are of sets of labels."""

_MARKS = (";", "|")  # between labels in text; that of sets is the first
# Text or a number in a list or set as Python and JSON write them.
_ITEM = re.compile(
    r"""'(?:[^'\\\x00-\x1f]|\\[\\'"bfnrt]|\\u[0-9a-fA-F]{4})*'"""
    r"""|"(?:[^"\\\x00-\x1f]|\\[\\'"bfnrt]|\\u[0-9a-fA-F]{4})*"|[+-]?\d[\d.]*"""
)
_ITEMS = rf"\s*(?:(?:{_ITEM.pattern})\s*(?:,\s*(?:{_ITEM.pattern})\s*)*)?"
_LIST = re.compile(
    rf"\[{_ITEMS}\]|(?:frozenset\()?\{{{_ITEMS}\}}\)?|(?:frozen)?set\(\)"
)


def check_metric(metric: str) -> None:
    """Check the name of a metric."""
    if metric not in get_args(Metric):
        raise ParameterError(
            f"metric: needs one of {', '.join(get_args(Metric))}, got {metric!r}"
        )


def metric_weights(metric: Metric, counted: CountedRatings) -> Weights:
    """Return the δ² of a metric, exact; they grow without bound."""
    # Krippendorff (2004), Content Analysis, 2nd ed., pp. 232-236
    check_metric(metric)
    if metric == "nominal" or len(counted.categories) == 0:  # nobody rated anything
        return Weights(name=metric, n_categories=len(counted.categories))
    if metric in ("jaccard", "masi"):
        return _of_sets(metric, counted.categories)
    if not counted.declared and isinstance(counted.categories[0], str):
        raise ParameterError(
            f"categories: the {metric} metric needs the declared scale in order, the "
            f"ratings are text: {', '.join(map(str, counted.categories))}"
        )
    if len(counted.categories) > MANY:
        return _of_many(metric, counted)
    if metric == "ordinal":
        squares = every_pair(_middles(counted), lambda x, y: (x - y) ** 2)
        return over_one_denominator("ordinal metric", squares)
    values = category_values(counted.categories)
    if metric == "interval":
        squares = every_pair(_in_range(values), lambda x, y: (x - y) ** 2)
        return over_one_denominator("interval", squares)
    if any(x + y == 0 for i, x in enumerate(values) for y in values[:i]):
        raise ParameterError(
            "metric: ratio needs values of which no two sum to 0, got "
            f"{', '.join(str(float(value)) for value in values)}"
        )
    return over_one_denominator("ratio metric", every_pair(values, squared_ratio))


def _of_many(metric: Metric, counted: CountedRatings) -> Weights:
    if metric == "ratio":
        return ratio_weights("ratio metric", counted.categories, factor=1.0)
    if metric == "ordinal":
        name, values = "ordinal metric", _middles_of_many(counted)
    else:
        name, values = "interval", value_array(counted.categories)
    distances = Squared(centred(values)[0][:, None])
    return ManyWeights(
        name=name, n_categories=len(values), numerators=(), distances=distances
    )


def _in_range(values: list[Fraction]) -> list[Fraction]:
    # over a power of two, which α does not notice, where squares would be no floats
    range_ = max(values) - min(values)
    if range_ == 0:
        return values
    exponent = range_.numerator.bit_length() - range_.denominator.bit_length()
    if abs(exponent) <= MAX_EXPONENT:
        return values
    return [value / Fraction(2) ** exponent for value in values]


def _middles_of_many(counted: CountedRatings) -> Floats:
    # as floats, which are exact to 2^52 ratings
    if isinstance(counted.items, DistinctItems):
        return np.array(_middles(counted), dtype=np.float64)
    totals = counted.items.totals_of_pairs()
    return np.cumsum(totals) - totals / 2.0


def _middles(counted: CountedRatings) -> list[Fraction]:
    # Σ_{g<k} n_g + n_k/2: ratings up to the middle of each grade, of items with a pair
    q = len(counted.categories)
    groups = counted.items.sums(identity_weights(q)).groups
    usable = [group.totals for group in groups if group.size > 1]
    middles, lower = [], 0
    for total in map(sum, zip(*usable, strict=True)):
        middles.append(Fraction(2 * lower + total, 2))
        lower += total
    return middles or [Fraction(0)] * q


def _of_sets(metric: str, categories: Sequence[Label]) -> Weights:
    # sets, and text of several labels, as "a; b"
    mark = _mark_between(metric, categories)
    sets = [_elements(label, mark) for label in categories]
    distance = _jaccard if metric == "jaccard" else _masi
    matrix = [[distance(a, b) for b in sets] for a in sets]
    return over_one_denominator(metric, matrix)


def _mark_between(metric: str, categories: Sequence[Label]) -> str:
    """Return what stands between the labels of text, "" where each is a list."""
    plain = [x for x in categories if not isinstance(x, SetText) and x != EMPTY_SET]
    texts = [x for x in plain if isinstance(x, str)]
    n_lists = sum(_LIST.fullmatch(text) is not None for text in texts)
    if texts and n_lists == len(plain):
        return ""
    marks = {mark for mark in _MARKS for text in texts if mark in text}
    if len(plain) < len(categories):  # beside a set, text without a mark is one label
        marks.add(_MARKS[0])
    if n_lists or len(texts) < len(plain) or len(marks) != 1:
        raise ParameterError(
            f"metric: {metric} needs sets of labels, or text that holds several in one "
            "of these ways, x;y or x|y or ['x', 'y'], got "
            f"{', '.join(map(shown, plain[:3]))}; where each is one label, the nominal "
            "metric is the same"
        )
    return marks.pop()


def _elements(label: Label, mark: str) -> frozenset[str]:
    text = str(label)
    if isinstance(label, SetText) or mark:
        parts = text.split(_MARKS[0] if isinstance(label, SetText) else mark)
    else:  # numbers have no quotes
        parts = [
            x if x[0] not in "'\"" else literal_eval(x) for x in _ITEM.findall(text)
        ]
    return frozenset(map(str.strip, parts)) - {"", EMPTY_SET}


def _jaccard(a: frozenset[str], b: frozenset[str]) -> Fraction:
    # 1 - |A ∩ B| / |A ∪ B|; two empty sets are the same
    return Fraction(0) if a == b else 1 - Fraction(len(a & b), len(a | b))


def _masi(a: frozenset[str], b: frozenset[str]) -> Fraction:
    # Passonneau (2006), Measuring agreement on set-valued items: 1 - J M, with M = 2/3
    # if one set holds the other, 1/3 if each has something to itself, 0 without overlap
    if a == b:
        return Fraction(0)
    share = Fraction(2, 3) if a <= b or b <= a else Fraction(1, 3)
    return 1 - Fraction(len(a & b), len(a | b)) * share


def _ordinal_features(coded: CodedRatings, _v: Floats) -> Floats:
    # (n_items, q²): coincidences o_kl = n_ik (n_il - [k = l]) / (n_i - 1)
    counts = item_counts(coded).astype(np.float64)
    size = counts.sum(axis=1)
    pairs = counts[:, :, None] * counts[:, None, :]
    k = np.arange(counts.shape[1])
    pairs[:, k, k] -= counts
    pairs /= np.maximum(size - 1.0, 1.0)[:, None, None]
    pairs[size < 2] = 0.0
    return np.asarray(pairs.reshape(len(counts), -1))


def _ordinal_value(sums: Floats, _v: Floats) -> Floats:
    # sums (..., q²) -> (...): the middles are those of the ratings that are summed
    q = math.isqrt(sums.shape[-1])
    table = sums.reshape(*sums.shape[:-1], q, q)
    totals = table.sum(axis=-1)
    n = totals.sum(axis=-1)
    middles = np.cumsum(totals, axis=-1) - totals / 2.0
    between = (middles[..., :, None] - middles[..., None, :]) ** 2
    observed = (table * between).sum(axis=(-1, -2))
    expected = np.einsum("...k,...kl,...l->...", totals, between, totals)
    return 1.0 - divide((n - 1.0) * observed, expected)


ORDINAL_KERNEL = Kernel(features=_ordinal_features, value=_ordinal_value)
"""Krippendorff's alpha of the ordinal metric, which is made anew from every sum."""
