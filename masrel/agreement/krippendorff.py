"""Krippendorff's alpha, and his difference functions δ² of two grades.

Sums over the n ratings of items with a pair are a, Σ_kl v_kl n_ik n_il / (n_i - 1) in
`WHOLE` parts, and n_k: α = 1 - (n - 1) a / B with B = n'Vn.
"""

import re
from ast import literal_eval
from collections.abc import Sequence
from dataclasses import replace
from typing import Any, Literal, get_args

import numpy as np

from masrel._input import check_option, refuse, shown
from masrel.agreement._codes import CountedRatings, count_ratings, item_counts
from masrel.agreement._engine import (
    WHOLE,
    Features,
    Floats,
    Formula,
    Integers,
    estimate,
)
from masrel.agreement._labels import EMPTY_SET, Codes, Label, SetText
from masrel.agreement._weights import (
    MANY,
    Line,
    Weights,
    WeightsLike,
    declared_weights,
    ratio,
    spread_values,
    sums_to_zero,
)
from masrel.agreement.kappas import _item_features
from masrel.errors import ParameterError
from masrel.estimates import Estimate

Metric = Literal["nominal", "ordinal", "interval", "ratio", "jaccard", "masi"]
"""Names of the difference functions; the last two are for sets of labels."""

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


def _features(codes: Codes, v: Any, repeats: Integers | None = None) -> Features:
    chosen = np.asarray(codes >= 0 if repeats is None else repeats, dtype=np.float64)
    size = chosen.sum(axis=1)
    a = _item_features(codes, v, repeats).dense[0] * size
    chosen[size < 2] = 0.0
    return Features(a[None], np.maximum(codes, 0), chosen, len(v))


def _disagreements(sums: Floats, v: Any) -> tuple[Floats, Floats, Floats]:
    a, n_k = sums[..., :1] / WHOLE, sums[..., 1:]
    n, others = n_k.sum(axis=-1, keepdims=True), n_k @ v
    b = (others * n_k).sum(axis=-1, keepdims=True)
    of_n = (n - 1.0) * a / (b * b)
    of_k = 2.0 * of_n * others - a / b
    of_a = (1.0 - n) / (WHOLE * b)
    return a / n, b / (n * (n - 1.0)), np.concatenate([of_a, of_k], axis=-1)


_ALPHA = Formula(
    name="krippendorff_alpha",
    title="Krippendorff's alpha",
    features=_features,
    disagreements=_disagreements,
)

# With the ordinal metric v is found in the ratings: sums are coincidences of grades,
# o_kl = n_ik (n_il - [k = l]) / (n_i - 1), and v is made anew from every sum.


def _ordinal_features(
    codes: Codes, v: Any, repeats: Integers | None = None
) -> Features:
    counts = item_counts(codes, len(v), repeats).astype(np.float64)
    size = counts.sum(axis=1)
    pairs = counts[:, :, None] * counts[:, None, :]
    k = np.arange(counts.shape[1])
    pairs[:, k, k] -= counts
    pairs /= np.maximum(size - 1.0, 1.0)[:, None, None]
    pairs[size < 2] = 0.0
    none = np.empty((len(counts), 0))
    return Features(
        pairs.reshape(len(counts), k.size**2).T, none.astype(np.int64), none, 0
    )


def _ordinal_disagreements(sums: Floats, v: Any) -> tuple[Floats, Floats, Floats]:
    o_kl = sums.reshape(*sums.shape[:-1], len(v), len(v))
    n_k = o_kl.sum(axis=-1)
    # distances m_k - m_l of the middles m_k = Σ_{g<k} n_g + n_k/2
    middles = np.cumsum(n_k, axis=-1) - n_k / 2.0
    gaps = middles[..., :, None] - middles[..., None, :]
    n = n_k.sum(axis=-1, keepdims=True)
    o = (o_kl * gaps**2).sum(axis=(-1, -2))[..., None]
    others = np.einsum("...kl,...l->...k", gaps**2, n_k)
    e = (others * n_k).sum(axis=-1, keepdims=True)
    both = o_kl + np.swapaxes(o_kl, -1, -2)
    of_o = _by_middles(2.0 * (both * gaps).sum(axis=-1))
    of_e = _by_middles(4.0 * n_k * np.einsum("...kl,...l->...k", gaps, n_k))
    of_e += 2.0 * others
    of_k = (n - 1.0) * o / (e * e) * of_e - (o + (n - 1.0) * of_o) / e
    slope = of_k[..., None] - ((n - 1.0) / e)[..., None] * gaps**2
    return o / n, e / (n * (n - 1.0)), slope.reshape(sums.shape)


def _by_middles(of_middles: Floats) -> Floats:
    # from slopes in the middles to slopes in the totals: n_k moves its own by a half,
    # and all that follow by 1
    later = np.flip(np.cumsum(np.flip(of_middles, axis=-1), axis=-1), axis=-1)
    return np.asarray(later - 0.5 * of_middles)


_ORDINAL_ALPHA = replace(
    _ALPHA, features=_ordinal_features, disagreements=_ordinal_disagreements
)


def krippendorff_alpha(
    ratings: object,
    *,
    categories: Sequence[Label] | None = None,
    weights: "WeightsLike" = None,
    metric: Metric | None = None,
    level_of_measurement: Metric | None = None,
    population: int | None = None,
) -> Estimate:
    """Estimate Krippendorff's alpha from an item × rater table.

    Parameters
    ----------
    ratings : nested sequence, array_like or DataFrame, shape (n_items, n_raters)
        Labels or numbers; None and ``nan`` are missing.
    categories : sequence of str, int or float, optional
        The declared scale in order; the labels met when not given.
    weights : str or array_like, shape (n_categories, n_categories), optional
        How much two categories agree, as for the other coefficients; see
        `declared_weights`. Identity unless `metric` is given.
    metric : {"nominal", "ordinal", "interval", "ratio", "jaccard", "masi"}, optional
        Krippendorff's own difference function instead of weights. His ordinal metric
        counts the ratings between two grades and is not the weights "ordinal". The last
        two are distances of sets: of ratings that are sets of labels, or text with
        semicolons between labels.
    level_of_measurement : str, optional
        What the krippendorff package calls `metric`. Its rows are raters, and ours are
        items: a table with fewer rows than columns is refused.
    population : int, optional
        Items there are in all, for the finite-population correction.

    Returns
    -------
    Estimate
        The coefficient with its standard error over items with at least two
        ratings; `n_items` counts those. With the ordinal metric, which depends on
        the ratings, the error takes it as it was found.

    Raises
    ------
    RatingsError
        If the ratings are not such a table.
    ParameterError
        If an option is invalid, more than one of `weights`, `metric` and
        `level_of_measurement` is given, or they do not fit the categories.

    Warns
    -----
    UndefinedStatisticWarning
        If no item has ratings of two raters, or all ratings are in one category;
        the value is then ``nan``.

    Notes
    -----
    Items with fewer than two ratings are left out altogether. Chance draws two
    ratings without replacement, so duplicating all items changes the value; with
    many items it tends to Fleiss' kappa.

    References
    ----------
    .. [1] Krippendorff, K. (2004). Content Analysis, 2nd ed., ch. 11.
    .. [2] Hayes, A. F., Krippendorff, K. (2007). Answering the call for a standard
       reliability measure for coding data. Communication Methods and Measures,
       1(1), 77-89. https://doi.org/10.1080/19312450709336664
    .. [3] Passonneau, R. (2006). Measuring agreement on set-valued items (MASI) for
       semantic and pragmatic annotation. LREC 2006.

    Examples
    --------
    Two raters agree on two items and differ on a third:

    >>> round(krippendorff_alpha([["a", "a"], ["b", "b"], ["a", "b"]]).value, 3)
    0.444
    """
    names = (weights, metric, level_of_measurement)
    has_two = sum(name is not None for name in names) > 1
    refuse((has_two, "weights, metric: needs one of them, got both"))
    counted = count_ratings(ratings, categories)
    if level_of_measurement is not None:
        metric, (n_rows, n_columns) = level_of_measurement, counted.coded.codes.shape
        refuse(
            (
                n_rows < n_columns,
                f"level_of_measurement: {n_rows} rows and {n_columns} columns may be "
                "raters by items, as the krippendorff package takes them, but here "
                "rows are items: transpose the table, or use metric if it is right as "
                "it is",
            )
        )
    made = weights if metric is None else _metric_weights(metric, counted)
    # items with fewer than two ratings are no part of the sample
    paired = counted.chosen(rows=counted.size > 1)
    return estimate(
        _ALPHA, paired, None, made, n_raters=counted.n_raters, population=population
    )


def _metric_weights(metric: Metric, counted: CountedRatings) -> Weights:
    # the δ² of a metric, which grow without bound
    # Krippendorff (2004), Content Analysis, 2nd ed., pp. 232-236
    check_option("metric", metric, get_args(Metric))
    categories = counted.categories
    n = len(categories)
    if metric == "nominal" or n == 0:  # nobody rated anything
        return replace(declared_weights("identity", categories), name=metric)
    if metric in ("jaccard", "masi"):
        return Weights(name=metric, n_categories=n, v=_of_sets(metric, categories))
    if not counted.declared and isinstance(categories[0], str):
        raise ParameterError(
            f"categories: the {metric} metric needs the declared scale in order, "
            f"because the ratings are text: {', '.join(map(str, categories))}"
        )
    if metric == "ratio":
        return Weights(name="ratio metric", n_categories=n, v=_ratio(categories))
    if metric == "ordinal":
        name, values = "ordinal metric", _middles(counted)
    else:
        name, values = "interval", spread_values(categories)
    line = Line(values, linear=0.0, square=1.0)
    v = line if n > MANY else line.matrix()
    return Weights(name=name, n_categories=n, v=v, line=line)


def _ratio(categories: Sequence[Label]) -> Floats:
    values = spread_values(categories)
    refuse(
        (
            len(values) > MANY,
            "metric: ratio needs a matrix of all categories, for which there can be "
            f"at most {MANY}, got {len(values)}; interval needs no matrix",
        ),
        (
            sums_to_zero(values),
            "metric: ratio needs values that never sum to 0 in pairs, got "
            f"{', '.join(map(str, values.tolist()))}",
        ),
    )
    return ratio(values)


def _middles(counted: CountedRatings) -> Floats:
    # Σ_{g<k} n_g + n_k/2: ratings up to the middle of each grade, of items with a pair
    paired = counted.chosen(rows=counted.size > 1)
    counts = item_counts(paired.codes, paired.n_categories, paired.repeats)
    totals = paired.freq @ counts
    return np.asarray(np.cumsum(totals) - totals / 2.0)


def _of_sets(metric: str, categories: Sequence[Label]) -> Floats:
    # sets, and text of several labels, as "a; b"
    mark = _mark_between(metric, categories)
    sets = [_elements(label, mark) for label in categories]
    distance = _jaccard if metric == "jaccard" else _masi
    return np.array([[distance(a, b) for b in sets] for a in sets])


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
            f"metric: {metric} needs sets of labels, or text that holds several in "
            "one of these ways, x;y or x|y or ['x', 'y'] (for a file, --set-separator "
            f"names another separator), got {', '.join(map(shown, plain[:3]))}; if "
            "each has only one label, the nominal metric gives the same value"
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


def _jaccard(a: frozenset[str], b: frozenset[str]) -> float:
    # 1 - |A ∩ B| / |A ∪ B|; two empty sets are the same
    return 0.0 if a == b else 1.0 - len(a & b) / len(a | b)


def _masi(a: frozenset[str], b: frozenset[str]) -> float:
    # Passonneau (2006), Measuring agreement on set-valued items: 1 - J M, with M = 2/3
    # if one set holds the other, 1/3 if each has something to itself, 0 without overlap
    if a == b:
        return 0.0
    thirds = 2.0 if a <= b or b <= a else 1.0
    return 1.0 - thirds * len(a & b) / (3.0 * len(a | b))
