"""Weights of disagreement between categories, exact, from the declared scale.

In: a name or a matrix, and the declared categories. Out: `Weights`, which hold
1 - w as integers over one denominator, so that sums over them are exact.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cache
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from masrel.agreement._labels import Label
from masrel.agreement.irrational import sine_squared, square_root
from masrel.errors import ParameterError

__all__ = ["WeightName", "Weights", "declared_weights", "identity_weights"]

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

_NAMES = get_args(WeightName)


@dataclass(frozen=True, slots=True, kw_only=True)
class Weights:
    """How much two categories disagree: v_kl = 1 - w_kl = numerators / denominator.

    Attributes
    ----------
    name : str
        Name of the weights; ``"custom"`` for a matrix of the caller.
    n_categories : int
        Declared categories.
    numerators : tuple of tuple of int, shape (n_categories, n_categories), or None
        None for identity weights, of which no matrix is ever made.
    denominator : int
        What the numerators are divided by.
    reason : str or None
        Why the scale has no such weights, or None; no coefficient is defined then.
    """

    name: str
    n_categories: int
    numerators: tuple[tuple[int, ...], ...] | None = None
    denominator: int = 1
    reason: str | None = None

    def disagreement(self, counts: Sequence[int], size: int) -> int:
        """Return Σ_kl v_kl n_k n_l of the counts of one item, times the denominator."""
        if self.numerators is None:
            return size * size - sum([n * n for n in counts])
        return sum([n * v for n, v in zip(counts, self.products(counts), strict=True)])

    def products(self, vector: Sequence[int]) -> list[int]:
        """Return Σ_l v_kl x_l for every k, times the denominator."""
        if self.numerators is None:
            total = sum(vector)
            return [total - x for x in vector]
        return [
            sum([v * x for v, x in zip(row, vector, strict=True) if x])
            for row in self.numerators
        ]

    def total(self) -> int:
        """Return Σ_kl v_kl, times the denominator."""
        if self.numerators is None:
            return self.n_categories * (self.n_categories - 1)
        return sum(map(sum, self.numerators))

    def as_floats(self) -> NDArray[np.float64]:
        """Return v as floats, (n_categories, n_categories); ``nan`` for a reason."""
        if self.reason is not None:
            return np.full((self.n_categories, self.n_categories), np.nan)
        if self.numerators is None:
            return 1.0 - np.eye(self.n_categories)
        return np.array(
            [[v / self.denominator for v in row] for row in self.numerators]
        )


@cache
def identity_weights(n_categories: int) -> Weights:
    """Return the weights that count two different categories as a full miss."""
    return Weights(name="identity", n_categories=n_categories)


def declared_weights(
    weights: "WeightName | ArrayLike",
    categories: Sequence[Label],
    *,
    declared: bool = True,
) -> Weights:
    r"""Make the weights of a declared scale.

    Parameters
    ----------
    weights : str or array_like, shape (n_categories, n_categories)
        A name (see Notes), or the weights w themselves: symmetric, 1 on the diagonal,
        elsewhere at most 1. A number is taken as the exact binary value it is.
    categories : sequence of str, int or float
        The declared scale in order. Numbers weigh by value, text by rank.
    declared : bool, optional
        False if nobody declared it, and it is the labels met.

    Returns
    -------
    Weights
        The weights, exact; irrational ones to 40 digits.

    Raises
    ------
    ParameterError
        If the name is none, the matrix is no such matrix, the values of the
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

    References
    ----------
    .. [1] Gwet, K. L. (2014). Handbook of Inter-Rater Reliability, 4th ed., ch. 3.

    Examples
    --------
    >>> made = declared_weights("linear", ["1", "1+", "2"])
    >>> made.numerators, made.denominator
    (((0, 1, 2), (1, 0, 1), (2, 1, 0)), 2)
    """
    n = len(categories)
    named = isinstance(weights, str)
    if named and weights not in _NAMES:
        raise ParameterError(
            f"weights: needs one of {', '.join(_NAMES)} or a matrix, got {weights!r}"
        )
    if named and weights == "identity":
        return identity_weights(n)
    if not declared and n > 1 and isinstance(categories[0], str):
        raise ParameterError(
            "categories: weights need the declared scale in order, the ratings are "
            f"text: {', '.join(map(str, categories))}"
        )
    if not isinstance(weights, str):
        return _given(weights, n)
    values = category_values(categories)
    if (reason := _absence(weights, values)) is not None:
        return Weights(name=weights, n_categories=n, reason=reason)
    if weights == "ordinal":
        values = [Fraction(rank) for rank in range(1, n + 1)]
    matrix = _MAKERS[weights](values)
    largest = max(map(max, matrix))
    return over_one_denominator(
        weights, [[value / largest for value in row] for row in matrix]
    )


def category_values(categories: Sequence[Label]) -> list[Fraction]:
    """Return what categories weigh: numbers by value, text by rank from 1."""
    if isinstance(categories[0], str):
        return [Fraction(rank) for rank in range(1, len(categories) + 1)]
    found = []
    for value in categories:
        if not math.isfinite(float(value)):
            raise ParameterError(
                f"categories: weights need finite numbers, got {value!r}"
            )
        found.append(Fraction(value))
    return found


def _absence(weights: str, values: list[Fraction]) -> str | None:
    if len(values) == 1:
        return "0/0: a scale of one category has no weights but identity"
    if weights == "ratio" and any(
        x + y == 0 for i, x in enumerate(values) for y in values[: i + 1]
    ):
        return "division by 0: ratio weights divide by sums of two values of the scale"
    return None


_Matrix = list[list[Fraction]]


def every_pair(
    values: list[Fraction], distance: Callable[[Fraction, Fraction], Fraction]
) -> _Matrix:
    # 0 on the diagonal by definition, also where a formula would be 0/0
    return [
        [Fraction(0) if k == l else distance(x, y) for l, y in enumerate(values)]  # noqa: E741 - k, l as in the formulas
        for k, x in enumerate(values)
    ]


def _linear(values: list[Fraction]) -> _Matrix:
    return every_pair(values, lambda x, y: abs(x - y))


def _quadratic(values: list[Fraction]) -> _Matrix:
    return every_pair(values, lambda x, y: (x - y) ** 2)


def _radical(values: list[Fraction]) -> _Matrix:
    # √ of the share of the range, so that the largest is 1 exactly
    span = max(values) - min(values)
    return every_pair(values, lambda x, y: square_root(abs(x - y) / span))


def _ordinal(ranks: list[Fraction]) -> _Matrix:
    # C(d + 1, 2) pairs of ranks lie between two ranks d apart, both included
    return every_pair(ranks, lambda x, y: abs(x - y) * (abs(x - y) + 1) / 2)


def _ratio(values: list[Fraction]) -> _Matrix:
    return every_pair(values, lambda x, y: ((x - y) / (x + y)) ** 2)


def _circular(values: list[Fraction]) -> _Matrix:
    turn = max(values) - min(values) + 1
    return every_pair(values, lambda x, y: sine_squared(abs(x - y) / turn))


def _bipolar(values: list[Fraction]) -> _Matrix:
    low, high = min(values), max(values)

    def distance(x: Fraction, y: Fraction) -> Fraction:
        return (x - y) ** 2 / ((x + y - 2 * low) * (2 * high - x - y))

    return every_pair(values, distance)


_MAKERS: dict[str, Callable[[list[Fraction]], _Matrix]] = {
    "linear": _linear,
    "quadratic": _quadratic,
    "ordinal": _ordinal,
    "radical": _radical,
    "ratio": _ratio,
    "circular": _circular,
    "bipolar": _bipolar,
}


def over_one_denominator(name: str, matrix: _Matrix) -> Weights:
    denominator = math.lcm(*(value.denominator for row in matrix for value in row))
    return Weights(
        name=name,
        n_categories=len(matrix),
        numerators=tuple(
            tuple(v.numerator * (denominator // v.denominator) for v in row)
            for row in matrix
        ),
        denominator=denominator,
    )


def _given(weights: Any, n_categories: int) -> Weights:
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
    exact = [[1 - Fraction(value) for value in row] for row in table.tolist()]
    return over_one_denominator("custom", exact)
