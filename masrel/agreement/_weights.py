"""Weights of disagreement between categories, exact, from the declared scale.

In: a name or a matrix, and the declared categories. Out: `Weights`, which hold
1 - w as integers over one denominator, so that sums over them are exact.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cache, cached_property, lru_cache
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from masrel.agreement._distances import (
    Both,
    Differing,
    Distances,
    Linear,
    Ratio,
    Squared,
    centred,
    on_a_circle,
)
from masrel.agreement._labels import Label, is_row, shown
from masrel.errors import ParameterError, RatingsError

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

MANY = 128
"""Categories of which a matrix is made; of more, none is."""

_NO_RATIO = "division by 0: ratio weights divide by sums of two values of the scale"

NO_CHANCE = "0/0: chance agreement is 1, all ratings are in one category"

_NAMES = get_args(WeightName)

# What irr, psych, vcd, scikit-learn and multiagree call some of them.
_ALIASES: dict[str, WeightName] = {
    "unweighted": "identity",
    "nominal": "identity",
    "equal": "linear",
    "squared": "quadratic",
}


@dataclass(frozen=True, kw_only=True)
class Weights:
    """How much two categories disagree: v_kl = 1 - w_kl = numerators / denominator.

    Attributes
    ----------
    name : str
        Name of the weights; ``"custom"`` for a matrix of the caller.
    n_categories : int
        Declared categories.
    numerators : tuple of tuple of int, shape (n_categories, n_categories), or None
        None for identity weights, of which no matrix of integers is ever made.
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

    @cached_property
    def total(self) -> int:
        """Σ_kl v_kl, times the denominator."""
        if self.numerators is None:
            return self.n_categories * (self.n_categories - 1)
        return sum(map(sum, self.numerators))

    @property
    def has_matrix(self) -> bool:
        """Whether every v_kl is held."""
        return self.numerators is not None

    @property
    def is_exact(self) -> bool:
        """Whether the v_kl are fractions."""
        return True

    def dot(self, p: NDArray[Any], *, exact: bool) -> NDArray[Any]:
        """Return Σ_l v_kl p_l, (n_categories,)."""
        if self.numerators is None and (exact or self.n_categories > MANY):
            return np.asarray(p.sum() - p)
        return np.asarray((self.fractions if exact else self.floats).dot(p))

    @property
    def operator(self) -> Any:
        """The v_kl as a matrix, or what takes its place: `Distances`."""
        if self.numerators is None and self.n_categories > MANY:
            return Differing(self.n_categories)
        return self.floats

    @property
    def no_chance(self) -> str:
        """Why chance agreement is 1, if it is."""
        alike = self.numerators is not None and any(
            v == 0 for k, row in enumerate(self.numerators) for v in row[:k]
        )
        if alike:
            return "0/0: chance agreement is 1, to the weights all ratings are alike"
        return NO_CHANCE

    @cached_property
    def floats(self) -> NDArray[np.float64]:
        """The v_kl as floats, (n_categories, n_categories); ``nan`` for a reason."""
        if self.reason is not None:
            floats = np.full((self.n_categories, self.n_categories), np.nan)
        elif self.numerators is None:
            floats = 1.0 - np.eye(self.n_categories)
        else:
            w = self.denominator
            floats = np.array([[v / w for v in row] for row in self.numerators])
        floats.setflags(write=False)
        return floats

    @property
    def fractions(self) -> NDArray[Any]:
        """The v_kl as fractions, (n_categories, n_categories)."""
        q = range(self.n_categories)
        rows = self.numerators or [[int(k != l) for l in q] for k in q]  # noqa: E741 - k, l as in the formulas
        numerators: NDArray[Any] = np.array(rows, dtype=object)
        return np.asarray(numerators * Fraction(1, self.denominator))

    def as_floats(self) -> NDArray[np.float64]:
        """Return w, a matrix as `weights=` takes it; ``nan`` for a reason."""
        return np.asarray(1.0 - self.floats)


@dataclass(frozen=True, kw_only=True, eq=False)
class ManyWeights(Weights):
    """Weights of more categories than a matrix is made for: floats, not integers."""

    distances: Distances

    @property
    def has_matrix(self) -> bool:
        """Whether every v_kl is held: no."""
        return False

    @property
    def is_exact(self) -> bool:
        """Whether the v_kl are fractions: no."""
        return False

    @cached_property
    def total(self) -> Any:
        """Σ_kl v_kl."""
        return self.distances.sum()

    @property
    def operator(self) -> Distances:
        """What takes the place of a matrix."""
        return self.distances

    @cached_property
    def floats(self) -> NDArray[np.float64]:
        """The v_kl as floats, (n_categories, n_categories)."""
        return np.eye(self.n_categories) @ self.distances

    @property
    def fractions(self) -> NDArray[Any]:
        """The same: there are no fractions of them."""
        return self.floats

    def dot(self, p: NDArray[Any], *, exact: bool) -> NDArray[Any]:  # noqa: ARG002 - floats alone
        """Return Σ_l v_kl p_l, (n_categories,)."""
        return self.distances.dot(p.astype(np.float64))


WeightsLike = Weights | WeightName | ArrayLike | None
"""What `weights=` takes: a name or a matrix, or what they made; None for identity."""


def plain_name(name: str) -> str:
    """Return the name here of weights that have another one elsewhere."""
    return _ALIASES[name] if name in _ALIASES else name


def is_identity(weights: "WeightsLike") -> bool:
    """Return whether weights count every miss in full."""
    if isinstance(weights, Weights):
        return weights.name == "identity"
    return weights is None or (
        isinstance(weights, str) and plain_name(weights) == "identity"
    )


@cache
def identity_weights(n_categories: int) -> Weights:
    """Return the weights that count two different categories as a full miss."""
    return Weights(name="identity", n_categories=n_categories)


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
        n_categories): symmetric, 1 on the diagonal, elsewhere at most 1. A number is
        taken as the exact binary value it is. Weights that are made are returned; None
        are identity weights.
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
    "linear", "squared" of "quadratic"; the result has the name here.

    References
    ----------
    .. [1] Gwet, K. L. (2014). Handbook of Inter-Rater Reliability, 4th ed., ch. 3.

    Examples
    --------
    >>> made = declared_weights("linear", ["1", "1+", "2"])
    >>> made.numerators, made.denominator
    (((0, 1, 2), (1, 0, 1), (2, 1, 0)), 2)
    """
    if weights is None:
        weights = "identity"
    if type(categories) is not tuple:
        if not is_row(categories):
            raise RatingsError(
                "categories: needs a sequence of at least one label, got "
                f"{shown(categories)}"
            )
        if not isinstance(categories, np.ndarray):  # which may hold millions
            categories = tuple(categories)
    if isinstance(weights, str):
        if len(categories) > MANY:
            return _named(weights, categories, declared)
        return named_weights(weights, tuple(categories), declared)
    if isinstance(weights, Weights):
        return _of_other(weights, categories, declared)
    _check_order(categories, declared)
    return _of_matrix(weights, len(categories))


def _of_other(weights: Weights, categories: Sequence[Label], declared: bool) -> Weights:
    """Return weights that are made, of as many categories."""
    if not is_identity(weights):
        _check_order(categories, declared)
    if weights.n_categories != len(categories):
        raise ParameterError(
            f"weights: needs those of {len(categories)} categories, got weights "
            f'"{weights.name}" of {weights.n_categories}'
        )
    return weights


@lru_cache(maxsize=64)
def named_weights(name: str, categories: tuple[Label, ...], declared: bool) -> Weights:
    """Return the weights of that name, made once for a scale."""
    return _named(name, categories, declared)


def _named(name: str, categories: Sequence[Label], declared: bool) -> Weights:
    n, name = len(categories), plain_name(name)
    if name not in _NAMES:
        raise ParameterError(
            f"weights: needs one of {', '.join(_NAMES)} or a matrix, got {name!r}"
        )
    if name == "identity":
        return identity_weights(n)
    if n == 0:  # nobody rated anything
        return Weights(name=name, n_categories=0)
    _check_order(categories, declared)
    if n > MANY:
        return _many_weights(name, categories)
    return _exact_weights(name, categories)


def _many_weights(name: str, categories: Sequence[Label]) -> Weights:
    values, range_ = centred(value_array(categories))
    n = len(values)
    if name == "ratio":
        return ratio_weights("ratio", categories)
    if name == "linear":
        distances: Distances = Linear(values, 1.0 / range_)
    elif name == "quadratic":
        distances = Squared(values[:, None] / range_)
    elif name == "ordinal":
        # d (d + 1) / (n (n - 1)) of ranks d apart
        ranks, largest = centred(np.arange(float(n)))[0], n * (n - 1.0)
        squares = Squared(ranks[:, None] / math.sqrt(largest))
        distances = Both(squares, Linear(ranks, 1.0 / largest))
    elif name == "circular":
        distances = on_a_circle(value_array(categories))
    else:
        raise ParameterError(
            f"weights: {name} needs a matrix of every two categories, which is made of "
            f"at most {MANY}, got {n}; linear, quadratic, ordinal, ratio and circular "
            "need none"
        )
    return ManyWeights(name=name, n_categories=n, numerators=(), distances=distances)


def ratio_weights(
    name: str, categories: Sequence[Label], factor: float | None = None
) -> Weights:
    """Return ratio weights of many categories; by default the largest v is 1."""
    values, n = value_array(categories), len(categories)
    low, high = float(values.min()), float(values.max())
    if name == "ratio" and 0.0 in values:
        return Weights(name=name, n_categories=n, reason=_NO_RATIO)
    if low < 0.0 < high:
        raise ParameterError(
            f"categories: the ratio of {n} different values needs values of one sign, "
            f"got {low:g} to {high:g}"
        )
    if factor is None:
        factor = ((high + low) / (high - low)) ** 2
    return ManyWeights(
        name=name, n_categories=n, numerators=(), distances=Ratio(values, factor)
    )


def value_array(categories: Sequence[Label]) -> NDArray[np.float64]:
    """Return what categories weigh, as floats: text by rank from 1."""
    if isinstance(categories[0], str):
        return np.arange(1.0, len(categories) + 1.0)
    try:
        values = np.array(categories, dtype=np.float64)
    except OverflowError:  # a whole number that no float holds: refused with its value
        values = np.array([math.inf])
    if not np.isfinite(values).all():
        category_values(categories)
    return values


def _exact_weights(name: str, categories: Sequence[Label]) -> Weights:
    # as fractions
    n = len(categories)
    values = category_values(categories)
    if (reason := _absence(name, values)) is not None:
        return Weights(name=name, n_categories=n, reason=reason)
    if name == "ordinal":
        values = [Fraction(rank) for rank in range(1, n + 1)]
    distance = _DISTANCES[name](values)
    matrix = every_pair(values, distance)
    largest = max(map(max, matrix))
    if not largest:  # a sine of π, of values without end
        reason = f"0/0: the values lie too far apart for {name} weights"
        return Weights(name=name, n_categories=n, reason=reason)
    return over_one_denominator(
        name, [[value / largest for value in row] for row in matrix]
    )


def _check_order(categories: Sequence[Label], declared: bool) -> None:
    if not declared and len(categories) > 1 and isinstance(categories[0], str):
        raise ParameterError(
            "categories: weights need the declared scale in order, the ratings are "
            f"text: {', '.join(map(str, categories))}"
        )


def category_values(categories: Sequence[Label]) -> list[Fraction]:
    """Return what categories weigh: numbers by value, text by rank from 1."""
    if isinstance(categories[0], str):
        return [Fraction(rank) for rank in range(1, len(categories) + 1)]
    for value in categories:
        try:
            is_finite = math.isfinite(float(value))
        except (OverflowError, TypeError):  # a whole number that no float holds
            is_finite = False
        if not is_finite:
            raise ParameterError(
                f"categories: weights need finite numbers, got {_shortened(value)}"
            )
    return [_exact(value) for value in categories]


def _exact(value: Label) -> Fraction:
    if isinstance(value, np.floating):  # of another size than Python's
        return Fraction(*value.as_integer_ratio())
    return Fraction(value)


def _shortened(value: Label) -> str:
    # whole numbers of thousands of digits are no part of a sentence
    if isinstance(value, int) and abs(value) >= 10**20:
        return f"a whole number of {value.bit_length()} bits"
    return repr(value)


def _absence(weights: str, values: list[Fraction]) -> str | None:
    if len(values) == 1:
        return "0/0: a scale of one category has no weights but identity"
    if weights == "ratio" and any(
        x + y == 0 for i, x in enumerate(values) for y in values[: i + 1]
    ):
        return _NO_RATIO
    return None


_Matrix = list[list[Fraction]]
_Distance = Callable[[Fraction, Fraction], Fraction]


def every_pair(values: list[Fraction], distance: _Distance) -> _Matrix:
    """Return the distance of every two values."""
    # 0 on the diagonal by definition, also where a formula would be 0/0
    return [
        [Fraction(0) if k == l else distance(x, y) for l, y in enumerate(values)]  # noqa: E741 - k, l as in the formulas
        for k, x in enumerate(values)
    ]


def _radical(values: list[Fraction]) -> _Distance:
    # √ of the share of the range, so that the largest is 1 exactly
    span = max(values) - min(values)
    return lambda x, y: _square_root(abs(x - y) / span)


def _circular(values: list[Fraction]) -> _Distance:
    turn = max(values) - min(values) + 1
    return lambda x, y: _sine_squared(abs(x - y) / turn)


def _bipolar(values: list[Fraction]) -> _Distance:
    low, high = min(values), max(values)
    return lambda x, y: (x - y) ** 2 / ((x + y - 2 * low) * (2 * high - x - y))


def squared_ratio(x: Fraction, y: Fraction) -> Fraction:
    """Return the square of the difference over the sum."""
    return ((x - y) / (x + y)) ** 2


# From the values to the distance of two of them, up to a common factor. Of ranks d
# apart, C(d + 1, 2) pairs of ranks lie between, both included.
_DISTANCES: dict[str, Callable[[list[Fraction]], _Distance]] = {
    "linear": lambda _: lambda x, y: abs(x - y),
    "quadratic": lambda _: lambda x, y: (x - y) ** 2,
    "ordinal": lambda _: lambda x, y: abs(x - y) * (abs(x - y) + 1) / 2,
    "radical": _radical,
    "ratio": lambda _: squared_ratio,
    "circular": _circular,
    "bipolar": _bipolar,
}

# Roots and sines as fractions of 40 decimals: of a float, a difference of sums over
# them would keep the rounding error.
_SCALE = 10**40
# π to 60 digits (OEIS A000796)
_PI = Fraction(3141592653589793238462643383279502884197169399375105820974944, 10**60)


def _square_root(value: Fraction) -> Fraction:
    # √value, rounded down; exact for a square of such decimals
    root = math.isqrt(value.numerator * _SCALE**2 // value.denominator)
    return Fraction(root, _SCALE)


def _sine_squared(turns: Fraction) -> Fraction:
    # sin²(π · turns) = (1 - cos(2π · turns)) / 2
    arc = min(turns, 1 - turns)  # sin² is the same on both sides of a half turn
    angle = 2 * _PI * min(arc, Fraction(1, 2) - arc)  # in [0, π/2]
    # Series of the cosine, in integers with ten digits more than are kept.
    scale = _SCALE * 10**10
    square = angle * angle
    total, term, n = scale, scale, 0
    while term:
        n += 2
        term = term * square.numerator // (square.denominator * n * (n - 1))
        total += -term if n % 4 else term
    if arc > Fraction(1, 4):
        total = -total  # cos(π - x) = -cos x
    return Fraction((scale - total + 10**10) // (2 * 10**10), _SCALE)


def over_one_denominator(name: str, matrix: _Matrix) -> Weights:
    """Return fractions of disagreement as weights."""
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


def _of_matrix(weights: Any, n_categories: int) -> Weights:
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
