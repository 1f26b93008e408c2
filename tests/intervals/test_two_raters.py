"""The posterior of two raters' table: by hand, by other integrals, by drawing it."""

import math

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.special import betaincinv

from masrel.errors import UndefinedStatisticWarning
from masrel.estimates import Interval
from masrel.intervals import posterior

Floats = NDArray[np.float64]

TAILS = (0.025, 0.975)


def pairs(table: list[list[int]]) -> list[list[str]]:
    """Ratings of two raters that have this table."""
    names = "abcdef"
    return [
        [names[k], names[l]]
        for k, row in enumerate(table)
        for l, n in enumerate(row)  # noqa: E741 - as in a table
        for _ in range(n)
    ]


def table_posterior(
    coefficient: str, table: list[list[int]], rng: int = 1, **options: object
) -> Interval:
    return posterior(
        coefficient,
        pairs(table),
        target="items",
        model="table",
        rng=rng,
        **{"categories": list("abcdef"[: len(table)]), **options},  # type: ignore[arg-type]
    )


@pytest.mark.parametrize(("n", "row"), [(1, 0), (9, 1)])
def test_raters_who_never_agree_are_as_uncertain_as_draws_say(n: int, row: int) -> None:
    # κ is 0 where one rater has one category and the other the other one, and its
    # density has no end there: no step from it leads anywhere.
    cells = np.full((2, 2), 1.5 / 4)
    table = np.zeros((2, 2), dtype=int)
    table[row, 1 - row] = n
    p = np.random.default_rng(n).dirichlet((cells + table).ravel(), 200_000)
    p = p.reshape(-1, 2, 2)
    chance = (p.sum(axis=1) * p.sum(axis=2)).sum(axis=1)
    kappas = (p[:, 0, 0] + p[:, 1, 1] - chance) / (1.0 - chance)
    found = table_posterior("cohen_kappa", table.tolist())
    for end, share in zip(ends(found), TAILS, strict=True):
        # five standard errors: one of 100 000 other seeds of these eight fails
        assert (kappas <= end).mean() == pytest.approx(share, abs=1.75e-3)


def ends(result: Interval) -> tuple[float, float]:
    return result.low, result.high


TABLE = [[8, 2, 0], [1, 9, 3], [0, 2, 7]]


def test_agreement_is_a_beta() -> None:
    # 24 of 32 pairs agree; of the prior, 1.5 items, half is on pairs that do
    agreed = betaincinv(24 + 0.75, 8 + 0.75, TAILS)
    percent = table_posterior("percent_agreement", TABLE)
    assert ends(percent) == pytest.approx(tuple(agreed), abs=1e-11)
    corrected = table_posterior("brennan_prediger", TABLE)
    assert ends(corrected) == pytest.approx(
        tuple(1.0 - 1.5 * (1.0 - agreed)), abs=1e-11
    )
    for result in (percent, corrected):
        assert (result.n_resamples, result.seed, result.monte_carlo_error) == (
            None,
        ) * 3


def drawn_values(coefficient: str, prior: Floats, v: Floats, n: int = 60_000) -> Floats:
    """Draw whole tables of chances, and the coefficient of each by its definition."""
    q = len(prior)
    rng = np.random.default_rng(7)
    theta = rng.dirichlet(prior.ravel(), size=n).reshape(n, q, q)
    first, second = theta.sum(axis=2), theta.sum(axis=1)
    apart = (theta * v).sum(axis=(1, 2))
    both = 0.5 * (first + second)
    by_chance = {
        "percent_agreement": np.ones(n),
        "brennan_prediger": np.full(n, v.sum() / q**2),
        "scott_pi": np.einsum("nk,kl,nl->n", both, v, both),
        "cohen_kappa": np.einsum("nk,kl,nl->n", first, v, second),
        "gwet_ac": 1.0
        - (1.0 - v).sum() / (q * (q - 1)) * (both * (1.0 - both)).sum(axis=1),
    }
    return np.asarray(1.0 - apart / by_chance[coefficient])


def by_default(q: int) -> Floats:
    """1.5 items, half on the diagonal: 3/8 a cell of 2 × 2."""
    return np.where(np.eye(q) > 0.0, 0.75 / q, 0.75 / (q * q - q))


@pytest.mark.parametrize("weights", ["identity", "linear", "quadratic"])
@pytest.mark.parametrize(
    "coefficient",
    ["cohen_kappa", "scott_pi", "gwet_ac", "percent_agreement", "brennan_prediger"],
)
@pytest.mark.parametrize("table", [TABLE, [[20, 5], [10, 15]]])
def test_whole_tables_drawn_give_the_same(
    coefficient: str, weights: str, table: list[list[int]]
) -> None:
    q = len(table)
    away: Floats = np.abs(np.subtract.outer(range(q), range(q))) / (q - 1.0)
    v = {"identity": (away > 0.0) * 1.0, "linear": away, "quadratic": away**2}[weights]
    values = drawn_values(coefficient, np.array(table) + by_default(q), v)
    result = table_posterior(coefficient, table, weights=weights)
    errors = result.monte_carlo_error or (0.0, 0.0)
    density = result.distribution
    assert density is not None
    for end, share, error in zip(ends(result), TAILS, errors, strict=True):
        slope = float(np.interp(end, density.values, density.weights))
        below = float((values <= end).mean())
        noise = math.hypot(
            math.sqrt(share * (1.0 - share) / values.size), error * slope
        )
        assert abs(below - share) < 4.5 * noise  # once in 150 000


def test_the_monte_carlo_error_is_the_spread_over_seeds() -> None:
    runs = [
        table_posterior("cohen_kappa", TABLE, rng=seed, n_draws=500)
        for seed in range(30)
    ]
    for end in (0, 1):
        spread = float(np.std([ends(run)[end] for run in runs], ddof=1))
        said = [run.monte_carlo_error[end] for run in runs if run.monte_carlo_error]
        # of 30 the standard deviation is within 0.6 and 1.45 but once in 1000
        assert 0.6 < spread / float(np.mean(said)) < 1.45


def test_items_of_a_single_rating_are_left_out() -> None:
    ratings: list[list[str | None]] = [list(row) for row in pairs([[20, 5], [10, 15]])]
    whole = posterior("cohen_kappa", ratings, target="items", model="table")
    ratings += [["a", None], [None, "b"], [None, None]]
    assert posterior("cohen_kappa", ratings, target="items", model="table") == whole
    # they tell of chance agreement by Fleiss' kappa, but not here: a note says so
    result = posterior("fleiss_kappa", ratings, target="items", model="table")
    assert "items with a single rating, left out: 2" in result.notes


@pytest.mark.parametrize(
    ("ratings", "options", "reason"),
    [
        ([["a", None], [None, "b"]], {}, "no item has ratings of two raters"),
        ([["a", "a"]], {"categories": ["a"]}, "one category is declared"),
        (
            [["a", "b"]],
            {"categories": ["a", "b"], "weights": np.ones((2, 2))},
            "the weights treat nothing as disagreement",
        ),
        (
            [[-1, 1], [1, 1]],
            {"categories": [-1, 1], "weights": "ratio"},
            "the scale has no such weights",
        ),
    ],
)
def test_where_nothing_can_be_said_it_is_undefined(
    ratings: object, options: dict[str, object], reason: str
) -> None:
    with pytest.warns(UndefinedStatisticWarning, match=reason):
        result = posterior(
            "cohen_kappa",
            ratings,
            target="items",
            model="table",
            **options,  # type: ignore[arg-type]
        )
    assert math.isnan(result.low)
    assert (result.reason, result.kind) == (reason, "credible")
