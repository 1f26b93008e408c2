"""The exact posterior of ρ against values by hand, panels, and a published table.

Panels are another way to the same posterior: the polynomial is multiplied out factor by
factor in logarithms, and the density integrated over all that matters of logit ρ.
"""

import math
from collections.abc import Sequence
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from numpy.typing import NDArray

from masrel.errors import UndefinedStatisticWarning
from masrel.estimates import Interval
from masrel.intervals import posterior
from tests.intervals.data import SCALE, TABLE_V, dirichlet_multinomial
from tests.strategies import LABELS, Table, tables

Ratings = list[list[str | None]]


def ends(result: Interval) -> tuple[float, float]:
    return result.low, result.high


def quadratic(constant: float, slope: float, share: float) -> float:
    """The quantile of the density (constant + slope ρ) / (constant + slope / 2)."""
    total = (constant + 0.5 * slope) * share
    return 2.0 * total / (constant + math.sqrt(constant**2 + 2.0 * slope * total))


# One item of two ratings, both in category 1 of K, prior Dirichlet(a, ...): its chance
# is π_1 (A π_1 + 1) / (A + 1) = ρ π_1 + (1 - ρ) π_1², and E π_1 = 1 / K,
# E π_1² = (a + 1) / (K (K a + 1)). So the density is linear in ρ.
@pytest.mark.parametrize("n_categories", [2, 3, 6])
@pytest.mark.parametrize("a", [1.0, 0.5, 1 / 6, 3.0])
def test_one_agreeing_pair_by_hand(n_categories: int, a: float) -> None:
    result = posterior(
        "fleiss_kappa",
        [["0", "0"]],
        target="items",
        categories=SCALE[:n_categories],
        concentration=a,
    )
    square = (a + 1.0) / (n_categories * a + 1.0)
    by_hand = [quadratic(square, 1.0 - square, share) for share in (0.025, 0.975)]
    assert ends(result) == pytest.approx(by_hand, abs=1e-12)


def labelled(counts: NDArray[np.int64] | list[list[int]]) -> Ratings:
    """Ratings that have these counts, padded with missing ones."""
    rows = [[str(k) for k, n in enumerate(row) for _ in range(n)] for row in counts]
    most = max(map(len, rows))
    return [[*row, *[None] * (most - len(row))] for row in rows]


def drawn(n_items: int, n_raters: int, kappa: float) -> Ratings:
    rng = np.random.default_rng([n_items, n_raters, int(1000 * kappa)])
    codes = dirichlet_multinomial(rng, n_items, n_raters, kappa)
    return [[str(code) for code in row] for row in codes]


GAPS: Ratings = [
    [grade if (i + j) % 3 else None for j, grade in enumerate(row)]
    for i, row in enumerate(drawn(12, 6, 0.6))
]

STUDIES: dict[str, Ratings] = {
    "one item": [["0", "0", "1", "2", "2"]],
    "two items": [["0", "0", "1"], ["1", "1", "2"]],
    "Table V": [[str(SCALE.index(grade)) for grade in row] for row in TABLE_V],
    "gaps": GAPS,
    "perfect": [[str(i % 3)] * 4 for i in range(9)],
    "one category": [["0"] * 8] * 5,
    "nobody agrees": [["0", "1", "2"]] * 20,
    **{f"30 x 3, {kappa}": drawn(30, 3, kappa) for kappa in (0.05, 0.6, 0.95)},
    **{f"100 x 5, {kappa}": drawn(100, 5, kappa) for kappa in (0.01, 0.6, 0.99)},
    "1000 x 4": drawn(1000, 4, 0.6),
    "1000 x 3, 0.001": drawn(1000, 3, 0.001),
    "1000 x 3, 0.99": drawn(1000, 3, 0.99),
    "1000 x 2 perfect": [[str(i % 3)] * 2 for i in range(1000)],
    "1000 x 2 in one category": [["0"] * 2] * 1000,
    "one item of many ratings": labelled([[120, 100, 16, 4]]),
    "few of many ratings": labelled([[40, 20, 0, 0], [0, 3, 55, 2]]),
}


@pytest.mark.parametrize("name", STUDIES)
@pytest.mark.parametrize(
    ("a", "prior"), [(Fraction(1), "uniform"), (Fraction(1, 4), "jeffreys")]
)
def test_ends_are_those_of_panels(name: str, a: Fraction, prior: str) -> None:
    ratings = STUDIES[name]
    scale = ["0", "1", "2", "3"]
    if name == "Table V":
        scale += ["4", "5"]
    counts = [[row.count(grade) for grade in scale] for row in ratings]
    panels = ByPanels(counts, a, 1.0 if prior == "uniform" else 0.5)
    result = posterior(
        "fleiss_kappa",
        ratings,
        target="items",
        categories=scale,
        prior=prior,  # type: ignore[arg-type]
        concentration=float(a),
    )
    expected = [panels.quantile(share) for share in (0.025, 0.975)]
    assert ends(result) == pytest.approx(expected, abs=1e-9)


WITH_PAIRS = tables().filter(
    lambda table: any(sum(grade is not None for grade in row) > 1 for row in table)
)


@settings(max_examples=25)
@given(WITH_PAIRS)
def test_the_density_integrates_to_one(table: Table) -> None:
    of = posterior(
        "fleiss_kappa", table, target="items", categories=LABELS
    ).distribution
    assert of is not None
    assert of.continuous
    assert (np.diff(of.values) > 0.0).all()
    assert (of.weights >= 0.0).all()
    # over the logit, in which the points are equally spaced
    logits = np.log(of.values) - np.log1p(-of.values)
    mass = of.weights * of.values * (1.0 - of.values)
    assert np.trapezoid(mass, logits) == pytest.approx(1.0, abs=1e-4)


@pytest.mark.parametrize(
    ("ratings", "reason"),
    [
        ([["a", None], [None, "b"]], "no item has ratings of two raters"),
        ([["a", "a"], ["a", "a"]], "one category is declared"),
    ],
)
def test_where_the_prior_alone_would_speak_it_is_undefined(
    ratings: list[list[str | None]], reason: str
) -> None:
    with pytest.warns(UndefinedStatisticWarning, match=reason):
        result = posterior("fleiss_kappa", ratings, target="items")
    assert math.isnan(result.low)
    assert math.isnan(result.high)
    assert (result.reason, result.kind) == (reason, "credible")


Floats = NDArray[np.float64]
Counts = Sequence[Sequence[int]]


class ByPanels:
    """The posterior of ρ given counts (n_items, n_categories).

    π ~ Dirichlet(a, ...), a rational; ρ ~ Beta(shape, shape).
    """

    def __init__(
        self,
        counts: Counts,
        a: Fraction = Fraction(1),
        shape: float = 1.0,
        panels: int = 400,
    ) -> None:
        self._terms, self._powers = _log_terms(counts, a)
        sizes = [sum(row) for row in counts]
        self._below = [sum(n > j for n in sizes) for j in range(max(sizes))]
        self._shape = shape
        low, high = self._limits()
        self.edges = np.linspace(low, high, panels + 1)
        self._x, self._w = np.polynomial.legendre.leggauss(12)
        points = self._points(self.edges[:-1], self.edges[1:])
        log = self.log_density(points.ravel()).reshape(points.shape)
        self._top = float(log.max())
        width = 0.5 * np.diff(self.edges)
        self._cells = (np.exp(log - self._top) @ self._w) * width

    def log_density(self, logit: Floats) -> Floats:
        """Of logit ρ, up to a constant; term by term."""
        log_a = -logit
        out = np.empty(logit.size)
        for start in range(0, logit.size, 256):
            part = log_a[start : start + 256]
            terms = self._terms + np.multiply.outer(part, self._powers)
            top = terms.max(axis=1)
            out[start : start + 256] = top + np.log(
                np.exp(terms - top[:, None]).sum(axis=1)
            )
        for j, n in enumerate(self._below):
            out -= n * (log_a if j == 0 else np.logaddexp(log_a, math.log(j)))
        spread = np.logaddexp(0.0, logit) + np.logaddexp(0.0, -logit)
        return np.asarray(out - self._shape * spread)

    def probability(self, logit: float) -> float:
        """That logit ρ is at most this."""
        panel = int(np.searchsorted(self.edges, logit)) - 1
        start = self.edges[panel]
        points = self._points(np.array([start]), np.array([logit]))[0]
        density = np.exp(self.log_density(points) - self._top)
        part = float(density @ self._w) * 0.5 * (logit - float(start))
        return (float(self._cells[:panel].sum()) + part) / float(self._cells.sum())

    def quantile(self, share: float) -> float:
        """Of ρ, by halving the panel it lies in."""
        cumulative = self._cells.cumsum() / self._cells.sum()
        panel = int(np.searchsorted(cumulative, share))
        low, high = self.edges[panel], self.edges[panel + 1]
        for _ in range(60):
            middle = 0.5 * (low + high)
            if self.probability(middle) < share:
                low = middle
            else:
                high = middle
        return 1.0 / (1.0 + math.exp(-low))

    def _points(self, low: Floats, high: Floats) -> Floats:
        half = 0.5 * (high - low)[:, None]
        return np.asarray(low[:, None] + half * (self._x + 1.0))

    def _limits(self) -> tuple[float, float]:
        # where the density is above exp(-50) of its largest value on a wide grid
        low, high = -130.0, 130.0
        for _ in range(6):
            grid = np.linspace(low, high, 261)
            log = self.log_density(grid)
            above = np.flatnonzero(log > log.max() - 50.0)
            low, high = grid[max(above[0] - 1, 0)], grid[min(above[-1] + 1, 260)]
        return float(low), float(high)


def _log_terms(counts: Counts, a: Fraction) -> tuple[Floats, Floats]:
    # log of each coefficient of A^t, and t
    lowest, product = 0, np.zeros(1)  # of logarithms
    for above in _above(counts):
        category = np.zeros(1)
        for j, n in enumerate(above):
            for _ in range(n if j else 0):
                category = _log_times(category, np.array([math.log(j), 0.0]))
        category = category + _log_moments(a, above[0], category.size)
        lowest, product = lowest + above[0], _log_times(product, category)
    log_moments = _log_moments(a * len(counts[0]), lowest, product.size)
    return product - log_moments, lowest + np.arange(product.size, dtype=np.float64)


def _above(counts: Counts) -> list[list[int]]:
    # N_kj of each category k
    depths = range(max(sum(row) for row in counts))
    return [[sum(n > j for n in c) for j in depths] for c in zip(*counts, strict=True)]


def _log_moments(a: Fraction, first: int, n: int) -> Floats:
    # log Γ(a + t) / Γ(a) for t = first, first + 1, ...
    logs = np.log(float(a) + np.arange(first + n - 1))
    return np.concatenate([[0.0], logs.cumsum()])[first:]


def _log_times(one: Floats, two: Floats) -> Floats:
    if one.size > two.size:
        one, two = two, one
    out = np.full(one.size + two.size - 1, -np.inf)
    for i, log in enumerate(one):
        part = out[i : i + two.size]
        np.logaddexp(part, log + two, out=part)
    return out
