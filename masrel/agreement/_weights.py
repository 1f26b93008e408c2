"""Weights of disagreement between the categories of a declared scale.

In: a name or a matrix, and the declared categories. Out: `Weights`, which hold
v = 1 - w as a matrix, or as an operator of categories so many that none is made.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from masrel.agreement._distances import (
    Differing,
    Distances,
    Line,
    small_enough,
)
from masrel.agreement._labels import Label, is_row, shown
from masrel.errors import ParameterError, RatingsError

Floats = NDArray[np.float64]

WeightName = Literal[
    "identity",
    "linear",
    "quadratic",
    "ordinal",
    "radical",
    "ratio",
    "circular",
    "bipolar",
]
"""Names of the weights there are."""

MANY = 2000
"""Categories of which a matrix is made; of more, none is."""

NO_PAIR = "no item has ratings of two raters"

NO_RATIO = "division by 0: ratio weights divide by sums of two values of the scale"

NO_CHANCE = "0/0: chance agreement is 1, all ratings are in one category"

NO_CHANCE_BY_WEIGHTS = (
    "0/0: chance agreement is 1, to the weights all ratings are alike"
)

_NAMES = get_args(WeightName)

# What irr, psych, vcd, scikit-learn and multiagree call some of them.
_ALIASES: dict[str, WeightName] = {
    "unweighted": "identity",
    "nominal": "identity",
    "equal": "linear",
    "squared": "quadratic",
}


@dataclass(frozen=True, kw_only=True, eq=False)
class Weights:
    """How much two categories disagree: v_kl = 1 - w_kl.

    Attributes
    ----------
    name : str
        Name of the weights; ``"custom"`` for a matrix of the caller.
    n_categories : int
        Declared categories.
    v : ndarray, shape (n_categories, n_categories), or Distances
        The disagreement of every two; an operator in its place where categories are
        more than 2000.
    reason : str or None
        Why the scale has no such weights, or None; no coefficient is defined then.
    """

    name: str
    n_categories: int
    v: Any
    reason: str | None = None

    @property
    def counts_misses(self) -> bool:
        """Whether two different categories are a full miss, whichever they are."""
        return self.name in ("identity", "nominal")

    @property
    def no_chance(self) -> str:
        """Why chance agreement is 1, if it is."""
        if isinstance(self.v, Distances) or (self.v == 0.0).sum() <= self.n_categories:
            return NO_CHANCE
        return NO_CHANCE_BY_WEIGHTS

    def as_floats(self) -> Floats:
        """Return w, a matrix as `weights=` takes it; ``nan`` for a reason."""
        if isinstance(self.v, Distances):
            return 1.0 - self.v.matrix()
        return np.asarray(1.0 - self.v)


WeightsLike = Weights | WeightName | ArrayLike | None
"""What `weights=` takes: a name or a matrix, or what they made; None for identity."""


def plain_name(name: str) -> str:
    """Return the name here of weights that have another one elsewhere."""
    return _ALIASES[name] if name in _ALIASES else name


def is_identity(weights: "WeightsLike") -> bool:
    """Return whether weights count every miss in full."""
    if isinstance(weights, Weights):
        return weights.counts_misses
    return weights is None or (
        isinstance(weights, str) and plain_name(weights) == "identity"
    )


def _needs_no_order(weights: "WeightsLike") -> bool:
    # sets have none to begin with
    is_of_sets = isinstance(weights, Weights) and weights.name in ("jaccard", "masi")
    return is_of_sets or is_identity(weights)


def identity_weights(n_categories: int, name: str = "identity") -> Weights:
    """Return the weights that count two different categories as a full miss."""
    if n_categories > MANY:
        v: Any = Differing(n_categories)
    else:
        v = 1.0 - np.eye(n_categories)
    return Weights(name=name, n_categories=n_categories, v=v)


def declared_weights(
    weights: "WeightsLike",
    categories: Sequence[Label],
    *,
    declared: bool = True,
) -> Weights:
    r"""Make the weights of a declared scale.

    Parameters
    ----------
    weights : str, array_like, Weights or None
        A name (see Notes), or the weights w themselves, shape (n_categories,
        n_categories): symmetric, 1 on the diagonal, elsewhere at most 1. Weights that
        are made are returned; None are identity weights.
    categories : sequence of str, int or float
        The declared scale in order. Numbers weigh by value, text by rank.
    declared : bool, optional
        False if nobody declared it, and it is the labels met.

    Returns
    -------
    Weights
        The weights.

    Raises
    ------
    ParameterError
        If the name is unknown, the matrix is not such a matrix, the values of the
        categories do not fit the weights, or text was not declared: its order is not
        known.

    Notes
    -----
    With x the values, R their range and ranks counted from 1, w is 1 minus

    - linear: \|x_k - x_l\| / R
    - quadratic: (x_k - x_l)² / R²
    - radical: √(\|x_k - x_l\| / R)
    - ordinal: C(\|k - l\| + 1, 2) / C(q, 2), by rank
    - ratio: [(x_k - x_l)/(x_k + x_l)]², over its largest value
    - circular: sin²(π (x_k - x_l) / (R + 1)), over its largest value
    - bipolar: (x_k - x_l)² / [(x_k + x_l - 2 min)(2 max - x_k - x_l)], over its
      largest value

    "unweighted" and "nominal" are other names of "identity", "equal" is one of
    "linear", "squared" of "quadratic"; the result has the name here. Identity, linear,
    quadratic and ordinal weights are there for any number of categories, the others up
    to 2000.

    References
    ----------
    .. [1] Gwet, K. L. (2014). Handbook of Inter-Rater Reliability, 4th ed., ch. 3.

    Examples
    --------
    >>> declared_weights("linear", ["1", "1+", "2"]).v
    array([[0. , 0.5, 1. ],
           [0.5, 0. , 0.5],
           [1. , 0.5, 0. ]])
    """
    if type(categories) is not tuple:
        if not is_row(categories):
            raise RatingsError(
                "categories: needs a sequence of at least one label, got "
                f"{shown(categories)}"
            )
        categories = tuple(categories)
    if weights is None or isinstance(weights, str):
        name = "identity" if weights is None else weights
        return _named(name, categories, declared)
    if not _needs_no_order(weights):
        _check_order(categories, declared)
    if isinstance(weights, Weights):
        if weights.n_categories != len(categories):
            raise ParameterError(
                f"weights: needs those of {len(categories)} categories, got weights "
                f'"{weights.name}" of {weights.n_categories}'
            )
        return weights
    return Weights(
        name="custom",
        n_categories=len(categories),
        v=1.0 - _checked_matrix(weights, len(categories)),
    )


def _checked_matrix(weights: Any, n_categories: int) -> Floats:
    try:
        table = np.asarray(weights)
    except ValueError as error:
        raise ParameterError("weights: needs rows of the same length") from error
    if table.shape != (n_categories, n_categories) or table.dtype.kind not in "iufb":
        raise ParameterError(
            f"weights: needs {n_categories} × {n_categories} numbers, one per pair of "
            f"categories, got shape {table.shape} of {table.dtype}"
        )
    if not np.isfinite(table).all() or (table > 1).any():
        raise ParameterError("weights: needs finite numbers of at most 1")
    if (table != table.T).any() or (np.diagonal(table) != 1).any():
        raise ParameterError("weights: needs a symmetric matrix with 1 on its diagonal")
    return table.astype(np.float64)


def _named(name: str, categories: tuple[Label, ...], declared: bool) -> Weights:
    n, name = len(categories), plain_name(name)
    if name not in _NAMES:
        raise ParameterError(
            f"weights: needs one of {', '.join(_NAMES)} or a matrix, got {name!r}"
        )
    if name == "identity":
        return identity_weights(n)
    reason, v = None, np.empty((0, 0))
    if n:  # else nobody rated anything
        _check_order(categories, declared)
        values = category_values(categories)
        reason = _why_none(name, values)
    if n > MANY and reason is None:
        return Weights(name=name, n_categories=n, v=_of_many(name, categories))
    if n:
        v = np.full((n, n), math.nan)
    if n and reason is None:
        v = _MATRICES[name](values if name == "ratio" else positions(categories))
        np.fill_diagonal(v, 0.0)  # also where a formula would be 0/0
        largest = v.max()
        if not largest:  # a sine of π, of values without end
            reason = f"0/0: the values lie too far apart for {name} weights"
        v = v / largest if largest else np.full((n, n), math.nan)
    return Weights(name=name, n_categories=n, v=v, reason=reason)


def _check_order(categories: Sequence[Label], declared: bool) -> None:
    if not declared and len(categories) > 1 and isinstance(categories[0], str):
        raise ParameterError(
            "categories: weights need the declared scale in order, the ratings are "
            f"text: {', '.join(map(str, categories))}"
        )


def _why_none(name: str, values: Floats) -> str | None:
    if len(values) == 1:
        return "0/0: a scale of one category has no weights but identity"
    return NO_RATIO if name == "ratio" and sums_to_zero(values, itself=True) else None


def sums_to_zero(values: Floats, *, itself: bool) -> bool:
    """Return whether two different values, or one and itself, sum to 0."""
    has_zero = itself and bool((values == 0.0).any())
    return has_zero or len(np.intersect1d(values[values > 0.0], -values)) > 0


def category_values(categories: Sequence[Label]) -> Floats:
    """Return what categories weigh: numbers by value, text by rank from 1."""
    if isinstance(categories[0], str):
        return np.arange(1.0, len(categories) + 1.0)
    try:
        values = np.array(categories, dtype=np.float64)
    except OverflowError:  # a whole number that no float holds
        values = np.array([math.inf])
    if not np.isfinite(values).all():
        wrong = next(x for x in categories if not _is_finite(x))
        raise ParameterError(
            f"categories: weights need finite numbers, got {_shortened(wrong)}"
        )
    return values


def _is_finite(value: Any) -> bool:
    try:
        return math.isfinite(float(value))
    except OverflowError:
        return False


def _shortened(value: Label) -> str:
    # whole numbers of thousands of digits are no part of a sentence
    if isinstance(value, int) and abs(value) >= 10**20:
        return f"a whole number of {value.bit_length()} bits"
    return repr(value)


def positions(categories: Sequence[Label]) -> Floats:
    """Return the values up to a shift and a power of two, which weights do not notice.

    Squares of their differences are floats.
    """
    values = category_values(categories)
    if len(np.unique(values)) < len(values):  # large whole numbers that floats merge
        low: Any = min(categories, key=float)
        values = np.array([float(x - low) for x in categories])
    return small_enough(values)


def _of_many(name: str, categories: Sequence[Label]) -> Distances:
    x, n = positions(categories), len(categories)
    span = float(x.max() - x.min())
    if name == "linear":
        return Line(x, linear=1.0 / span)
    if name == "quadratic":
        return Line(x / span, square=1.0)
    if name == "ordinal":  # d (d + 1) / (n (n - 1)) of ranks d apart
        factor = 1.0 / (n * (n - 1.0))
        return Line(np.arange(float(n)), linear=factor, square=factor)
    raise ParameterError(
        f"weights: {name} needs a matrix of every two categories, which is made of at "
        f"most {MANY}, got {n}; identity, linear, quadratic and ordinal need none"
    )


def as_line(weights: Weights, categories: Sequence[Label]) -> Line | None:
    """Return weights as an operator of distances on a line, if they are one."""
    if isinstance(weights.v, Line):
        return weights.v
    if weights.name not in ("quadratic", "interval") or weights.reason is not None:
        return None
    x = positions(categories)
    return Line(x if weights.name == "interval" else x / np.ptp(x), square=1.0)


def _gaps(x: Floats) -> Floats:
    return np.asarray(abs(x[:, None] - x))


def _linear(x: Floats) -> Floats:
    return _gaps(x)


def quadratic(x: Floats) -> Floats:
    """Return the squares of differences."""
    return np.asarray(_gaps(x) ** 2)


def _radical(x: Floats) -> Floats:
    return np.asarray(np.sqrt(_gaps(x)))


def _ordinal(x: Floats) -> Floats:
    # of ranks d apart, C(d + 1, 2) pairs of ranks lie between, both included
    d = _gaps(np.arange(float(len(x))))
    return np.asarray(d * (d + 1.0) / 2.0)


def ratio(x: Floats) -> Floats:
    """Return the squares of differences over sums."""
    sums = x[:, None] + x
    np.fill_diagonal(sums, 1.0)  # 0 by definition, also of 0 and itself
    return np.asarray((_gaps(x) / sums) ** 2)


def _circular(x: Floats) -> Floats:
    turn = _gaps(x) / (x.max() - x.min() + 1.0)
    # sin² is the same on both sides of a half turn
    return np.asarray(np.sin(np.pi * np.minimum(turn, 1.0 - turn)) ** 2)


def _bipolar(x: Floats) -> Floats:
    sums = x[:, None] + x
    ends = (sums - 2.0 * x.min()) * (2.0 * x.max() - sums)
    np.fill_diagonal(ends, 1.0)
    return np.asarray(_gaps(x) ** 2 / ends)


# From the values to the disagreement of every two, up to a common factor.
_MATRICES: dict[str, Callable[[Floats], Floats]] = {
    "linear": _linear,
    "quadratic": quadratic,
    "ordinal": _ordinal,
    "radical": _radical,
    "ratio": ratio,
    "circular": _circular,
    "bipolar": _bipolar,
}
