"""Weights of disagreement between the categories of a declared scale.

In: a name or a matrix, and the declared categories. Out: `Weights`, which hold
v = 1 - w as a matrix, or as an operator if there are too many categories for one.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from masrel._input import refuse, shown
from masrel.agreement._labels import Codes, Label, check_kinds, is_row
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
"""Names of the weights."""

MANY = 2000
"""The most categories for which a matrix is made."""

NO_PAIR = "no item has ratings of two raters"

NO_RATIO = "division by 0: ratio weights divide by sums of two values of the scale"

NO_CHANCE = "0/0: chance agreement is 1, because all ratings are in one category"

NO_CHANCE_BY_WEIGHTS = (
    "0/0: chance agreement is 1, because the weights treat all ratings as the same"
)

# What irr, psych, vcd, scikit-learn and multiagree call some of them.
_ALIASES: dict[str, WeightName] = {
    "unweighted": "identity",
    "nominal": "identity",
    "equal": "linear",
    "squared": "quadratic",
}


_NEED_NO_ORDER = ("identity", "nominal", "jaccard", "masi")


class Distances:
    """v of every two categories as an operator: 1 where they differ.

    It takes the place of a matrix in `p @ v` of masses p, and v of pairs of categories.
    """

    __array_ufunc__ = None  # `p @ v` is left to `__rmatmul__`

    def __init__(self, n_categories: int) -> None:
        self.n = n_categories

    def __len__(self) -> int:
        return self.n

    def __rmatmul__(self, masses: Floats) -> Floats:
        """Return Σ_l m_l v_lk, (..., n_categories)."""
        return np.asarray(masses.sum(axis=-1, keepdims=True) - masses)

    def __getitem__(self, pair: tuple[Codes, Codes]) -> Floats:
        """Return v of pairs of categories."""
        return np.asarray(pair[0] != pair[1], dtype=np.float64)

    def sum(self) -> float:
        """Return Σ_kl v_kl."""
        return float((np.ones(self.n) @ self).sum())

    def matrix(self) -> Floats:
        """Return every v_kl."""
        k = np.arange(self.n)
        return self[k[:, None], k]


class Line(Distances):
    """Distances d on a line: v = (linear d + square d²) / scale."""

    def __init__(
        self, values: Floats, *, linear: float, square: float, scale: float = 1.0
    ) -> None:
        super().__init__(len(values))
        # from the middle, so that sums of squares lose few digits
        self.values = values - 0.5 * (values.min() + values.max())
        self.linear, self.square, self.scale = linear, square, scale
        self._order = np.argsort(values)

    def __rmatmul__(self, masses: Floats) -> Floats:
        # Σ_l m_l |x_k - x_l| = x_k (2 M_k - M) + S - 2 S_k of sums up to x_k, which are
        # many: with some digits to spare where the machine has them
        x, m = self.values[self._order], masses[..., self._order]
        mass, mean = (y.sum(axis=-1, keepdims=True) for y in (m, m * x))
        between = np.zeros(m.shape)
        if self.linear:
            up_to = np.cumsum(m, axis=-1, dtype=np.longdouble)
            moment = np.cumsum(m * x, axis=-1, dtype=np.longdouble)
            between += self.linear * (x * (2.0 * up_to - mass) + mean - 2.0 * moment)
        if self.square:
            squares = (m * x * x).sum(axis=-1, keepdims=True)
            between += self.square * (x * (x * mass - 2.0 * mean) + squares)
        dot = np.empty(m.shape)
        dot[..., self._order] = between / self.scale
        return dot

    def __getitem__(self, pair: tuple[Codes, Codes]) -> Floats:
        d = np.abs(self.values[pair[0]] - self.values[pair[1]])
        return np.asarray(d * (self.linear + self.square * d) / self.scale)

    def nodes(self) -> tuple[Floats, Floats] | None:
        """Return shares L of every value in three nodes, and v of the nodes, if any.

        Squares of distances are polynomials of second degree in either value, so that
        with Lagrange's shares L_j(x), v(x, y) = Σ_ij L_i(x) v_ij L_j(y) for all x, y.
        """
        # -> (n_categories, 3), (3, 3)
        half = float(abs(self.values).max())
        if self.linear or not half:
            return None
        t = self.values / half
        shares = np.stack([t * (t - 1.0) / 2.0, 1.0 - t * t, t * (t + 1.0) / 2.0])
        at = half * np.arange(-1.0, 2.0)
        return shares.T, self.square / self.scale * (at[:, None] - at) ** 2


@dataclass(frozen=True, kw_only=True, eq=False)
class Weights:
    """How much two categories disagree: v_kl = 1 - w_kl.

    Attributes
    ----------
    name : str
        Name of the weights; ``"custom"`` for a matrix of the caller, and that of its
        file where the command line read one.
    n_categories : int
        Declared categories.
    v : ndarray, shape (n_categories, n_categories), or Distances
        The disagreement of every two; an operator instead if there are more than 2000
        categories.
    reason : str or None
        Why the scale has no such weights, or None; no coefficient is defined then.
    counts_misses : bool
        Whether two different categories are a full miss, whichever they are.
    line : Line or None
        The same as an operator, where v are distances on a line.
    """

    name: str
    n_categories: int
    v: Any
    reason: str | None = None
    counts_misses: bool = False
    line: Line | None = None

    @property
    def tells_apart(self) -> bool:
        """Whether every two categories disagree, if only in part."""
        is_operator = isinstance(self.v, Distances)
        return is_operator or int((self.v == 0.0).sum()) <= self.n_categories

    @property
    def no_chance(self) -> str:
        """Why chance agreement is 1, if it is."""
        return NO_CHANCE if self.tells_apart else NO_CHANCE_BY_WEIGHTS

    def __str__(self) -> str:
        return self.name

    def as_floats(self) -> Floats:
        """Return w, a matrix as `weights=` takes it; ``nan`` for a reason."""
        v = self.v.matrix() if isinstance(self.v, Distances) else self.v
        return np.asarray(1.0 - v)


WeightsLike = Weights | WeightName | ArrayLike | None
"""What `weights=` takes: a name or a matrix, or what they made; None for identity."""


def plain_name(name: str) -> str:
    """Return the name here of weights that have another one elsewhere."""
    return _ALIASES.get(name, name)


def is_identity(weights: "WeightsLike") -> bool:
    """Return whether weights count every miss in full."""
    if isinstance(weights, Weights):
        return weights.counts_misses
    return weights is None or (
        isinstance(weights, str) and plain_name(weights) == "identity"
    )


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
    if type(categories) is not tuple and not is_row(categories):
        raise RatingsError(
            "categories: needs a sequence of at least one label, got "
            f"{shown(categories)}"
        )
    categories = tuple(categories)
    name = "identity" if weights is None else weights
    if isinstance(name, str):
        name = _ALIASES.get(name, name)
        if name == "identity":
            q = max(len(categories), 1)  # of no ratings, one category without any
            v: Any = 1.0 - np.eye(q) if q <= MANY else Distances(q)
            n = len(categories)
            return Weights(name=name, n_categories=n, v=v, counts_misses=True)
        known = ", ".join(get_args(WeightName))
        needed = f"weights: needs one of {known} or a matrix, got {name!r}"
        refuse((name not in get_args(WeightName), needed))
    made = weights if isinstance(weights, Weights) else None
    if made is None or made.name not in _NEED_NO_ORDER:
        _check_order(categories, declared)
    if isinstance(name, str):
        return _named(name, categories)
    if isinstance(weights, Weights):
        refuse(
            (
                weights.n_categories != len(categories),
                f"weights: needs weights for {len(categories)} categories, got "
                f'weights "{weights.name}" of {weights.n_categories}',
            )
        )
        return weights
    v = 1.0 - _checked_matrix(weights, categories)
    return Weights(name="custom", n_categories=len(categories), v=v)


def _check_order(categories: Sequence[Label], declared: bool) -> None:
    check_kinds(categories, "categories")
    if not declared and len(categories) > 1 and isinstance(categories[0], str):
        raise ParameterError(
            "categories: weights need the declared scale in order, because the "
            f"ratings are text: {', '.join(map(str, categories))}"
        )


def _checked_matrix(weights: Any, categories: Sequence[Label]) -> Floats:
    try:
        table = np.asarray(weights)
    except ValueError as error:
        raise ParameterError("weights: needs rows of the same length") from error
    refuse(
        (
            table.shape != (len(categories),) * 2 or table.dtype.kind not in "iufb",
            f"weights: needs {len(categories)} × {len(categories)} numbers, one per "
            f"pair of categories, got shape {table.shape} of {table.dtype}",
        )
    )
    for needed, is_wrong in (
        ("finite numbers of at most 1", ~np.isfinite(table) | (table > 1)),
        ("1 on the diagonal", np.eye(len(categories), dtype=bool) & (table != 1)),
        ("a symmetric matrix", table != table.T),
    ):
        for k, m in np.argwhere(is_wrong):
            raise ParameterError(
                f"weights: needs {needed}, got {table[k, m]:g} in the row of "
                f"{categories[k]} and the column of {categories[m]}"
            )
    return table.astype(np.float64)


def _named(name: str, categories: tuple[Label, ...]) -> Weights:
    n, reason, line = len(categories), None, None
    v: Any = np.full((1, 1), math.nan)  # of a scale that has none
    if n == 1:
        reason = "0/0: a scale of one category has only identity weights"
    elif n and name in _LINES:
        x = np.arange(float(n)) if name == "ordinal" else spread_values(categories)
        (linear, square), span = _LINES[name], float(np.ptp(x))
        scale = span * (linear + square * span)  # the largest is 1
        line = Line(x, linear=linear, square=square, scale=scale)
        v = line.matrix() if n <= MANY else line
    elif n > MANY:
        raise ParameterError(
            f"weights: {name} needs a matrix of all categories, for which there can "
            f"be at most {MANY}, got {n}; identity, linear, quadratic and ordinal "
            "need no matrix"
        )
    elif n:
        values = spread_values(categories)
        v = np.full((n, n), math.nan)
        if name == "ratio" and (sums_to_zero(values) or 0.0 in values):
            reason = NO_RATIO
        else:
            matrix = _MATRICES[name](values)
            np.fill_diagonal(matrix, 0.0)  # also where a formula would be 0/0
            if matrix.any():
                v = matrix / matrix.max()
            else:  # a sine of π
                reason = f"0/0: the values lie too far apart for {name} weights"
    return Weights(name=name, n_categories=n, v=v, reason=reason, line=line)


def sums_to_zero(values: Floats) -> bool:
    """Return whether two different values sum to 0."""
    return len(np.intersect1d(values[values > 0.0], -values)) > 0


def category_values(categories: Sequence[Label]) -> Floats:
    """Return what categories weigh: numbers by value, text by rank from 1."""
    if isinstance(categories[0], str):
        return np.arange(1.0, len(categories) + 1.0)
    try:
        return np.array(categories, dtype=np.float64)
    except (OverflowError, TypeError, ValueError) as error:
        raise ParameterError(
            f"categories: needs numbers that fit into floats, got {shown(categories)}"
        ) from error


def spread_values(categories: Sequence[Label]) -> Floats:
    """Return the values of categories that weights can tell apart."""
    values = category_values(categories)
    span = float(values.max()) - float(values.min()) if len(values) > 1 else 1.0
    if len(set(values.tolist())) < len(values) or not 1e-75 < span < 1e75:
        raise ParameterError(
            "categories: weights need finite numbers that differ as floats, with a "
            f"range of 1e-75 to 1e75, got {shown(categories)}"
        )
    return values


def _gaps(x: Floats) -> Floats:
    return np.asarray(abs(x[:, None] - x))


def _radical(x: Floats) -> Floats:
    return np.asarray(np.sqrt(_gaps(x)))


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


# v of two values d apart is as linear d + square d²; of ranks d apart, C(d + 1, 2)
# pairs of ranks lie between, both included.
_LINES = {"linear": (1.0, 0.0), "quadratic": (0.0, 1.0), "ordinal": (1.0, 1.0)}

# From the values to the disagreement of every two, up to a common factor.
_MATRICES: dict[str, Callable[[Floats], Floats]] = {
    "radical": _radical,
    "ratio": ratio,
    "circular": _circular,
    "bipolar": _bipolar,
}
