"""The hierarchical model of test-retest agreement against textbooks and samplers."""

import math

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import integrate, special, stats

from masrel.agreement import stratified_kappa
from masrel.errors import ParameterError, RatingsError, UndefinedStatisticWarning
from masrel.intervals import retest_model
from masrel.intervals.retest.density import RaterPairs, log_weights
from masrel.intervals.retest.posterior import RetestPosterior

Floats = NDArray[np.float64]
Table = NDArray[np.int64]
SHARES = (0.025, 0.5, 0.975)


def drawn_pairs(
    rng: np.random.Generator, kappas: Floats, shares: Floats, n_items: int
) -> list[list[list[int]]]:
    """Draw each rater's pairs: the second repeats the first with chance κ, else anew.

    shares : shape (n_raters, n_categories)
    """
    study = []
    for kappa, share in zip(kappas, shares, strict=True):
        first, fresh = rng.choice(share.size, (2, n_items), p=share)
        second = np.where(rng.random(n_items) < kappa, first, fresh)
        study.append(np.column_stack([first, second]).tolist())
    return study


SMALL = [
    np.array([[3, 1, 0], [0, 4, 0], [0, 0, 2]]),
    np.array([[2, 0, 0], [1, 3, 0], [0, 2, 2]]),
    np.array([[4, 0, 0], [0, 4, 0], [0, 0, 2]]),
]


def textbook_likelihood(table: Table, kappa: float) -> float:
    """Integrate Π P(k, l)^n_kl over π ~ Dirichlet(1, 1, 1) by brute force."""

    def of_shares(y: float, x: float) -> float:
        pi = np.array([x, y * (1 - x), (1 - y) * (1 - x)])
        cell = kappa * np.diag(pi) + (1 - kappa) * np.outer(pi, pi)
        return float(np.prod(cell**table)) * 2 * (1 - x)  # Dirichlet density 2

    value, _ = integrate.dblquad(of_shares, 0, 1, 0, 1, epsabs=0, epsrel=1e-10)
    return float(value)


@pytest.mark.parametrize("table", SMALL[:2])
def test_shares_integrate_out_as_by_brute_force(table: Table) -> None:
    pairs = RaterPairs.of(table, 1.0)
    j = np.arange(pairs.agree + 1)
    for kappa in (0.05, 0.6, 0.98):
        powers = (pairs.agree - j) * np.log(kappa) + (pairs.differ + j) * np.log1p(
            -kappa
        )
        ours = math.exp(special.logsumexp(pairs.log_weights + powers))
        assert ours == pytest.approx(textbook_likelihood(table, kappa), rel=1e-8)


def test_one_pair_by_hand() -> None:
    # Equal grades of two categories: Σ_k ∫ (κ π_k + (1 - κ) π_k²) over one k:
    # κ E[π] + (1 - κ) E[π²] = κ / 2 + (1 - κ) / 3.
    equal = np.exp(log_weights(np.array([[1, 0], [0, 0]]), 1.0))
    assert equal == pytest.approx([1 / 2, 1 / 3])
    # Unequal: (1 - κ) E[π (1 - π)] = (1 - κ) / 6.
    unequal = np.exp(log_weights(np.array([[0, 1], [0, 0]]), 1.0))
    assert unequal == pytest.approx([1 / 6])


def test_moments_are_those_of_the_beta() -> None:
    from masrel.intervals.retest.density import Risen

    m, g = 0.3, 0.1
    law = stats.beta(m * (1 / g - 1), (1 - m) * (1 / g - 1))
    assert law.mean() == pytest.approx(m)
    assert law.var() == pytest.approx(g * m * (1 - m))
    risen = Risen.of(np.array([special.logit(m)]), np.array([special.logit(3 * g)]), 5)
    log = risen.up[0, 2] + risen.down[0, 3] - risen.below[0, 5]
    assert math.exp(log) == pytest.approx(law.expect(lambda k: k**2 * (1 - k) ** 3))


def weighted_draws(
    tables: list[Table], rng: np.random.Generator, n: int
) -> tuple[Floats, Floats]:
    """Draw every unknown, m, g, each κ, each π; nothing is integrated out.

    m and g come from their prior, κ and π from a Beta and a Dirichlet near what the
    pairs say; the weights put that right.

    Returns
    -------
    m, spread and each κ (n, 2 + n_raters), and weights (n,) that sum to 1
    """
    m, g = rng.random(n), rng.random(n) / 3
    alpha, beta = m * (1 / g - 1), (1 - m) * (1 / g - 1)
    columns, log_weights = [m, np.sqrt(g * m * (1 - m))], np.zeros(n)
    for table in tables:
        agree, differ = 0.6 * np.trace(table), 0.8 * (table.sum() - np.trace(table))
        kappa = rng.beta(alpha + agree, beta + differ)
        log_weights += special.betaln(alpha + agree, beta + differ)
        log_weights -= special.betaln(alpha, beta)
        log_weights -= special.xlogy(agree, kappa) + special.xlog1py(differ, -kappa)
        near = 1 + 0.7 * (table.sum(axis=0) + table.sum(axis=1))
        pi = rng.dirichlet(near, n)
        log_weights -= special.xlogy(near - 1, pi).sum(axis=1)  # prior: all ones
        cell = (1 - kappa)[:, None, None] * pi[:, :, None] * pi[:, None, :]
        at = np.arange(3)
        cell[:, at, at] += kappa[:, None] * pi
        log_weights += special.xlogy(table, cell).sum(axis=(1, 2))
        columns.append(kappa)
    # κ of 1 to rounding, where unequal pairs have no chance: -inf + inf
    log_weights[np.isnan(log_weights)] = -np.inf
    weights = np.exp(log_weights - log_weights.max())
    return np.column_stack(columns), weights / weights.sum()


def test_quadrature_agrees_with_draws_of_every_unknown() -> None:
    # Of m, the spread and each κ, the weight of draws below each quantile is its
    # share, within 4 standard errors: 15 times, so that one of 1 000 other seeds
    # fails. A hundredth more of any median, or of m's low end, is 5 errors or more.
    exact = RetestPosterior.of(SMALL, SHARES, shape=1.0, concentration=1.0)
    draws, weights = weighted_draws(SMALL, np.random.default_rng(5), 500_000)
    quantiles = [exact.quantiles, exact.spread_quantiles(SHARES)]
    quantiles += [exact.rater_quantiles(at, SHARES) for at in range(len(SMALL))]
    for column, of_one in zip(draws.T, quantiles, strict=True):
        for share, quantile in zip(SHARES, of_one, strict=True):
            beyond = (column < quantile) - share
            error = np.sqrt(((weights * beyond) ** 2).sum())
            assert abs(weights @ beyond) < 4 * error
            assert error < 0.06 * min(share, 1 - share)


def test_one_rater_is_a_mixture_that_integrates_by_brute_force() -> None:
    # κ of one rater: prior ∫∫ Beta(κ | m, g) dm dg on a grid of midpoints.
    table = SMALL[1]
    found = RetestPosterior.of([table], SHARES, shape=1.0, concentration=1.0)
    points = (np.arange(60) + 0.5) / 60
    m, g = (a.ravel() for a in np.meshgrid(points, points / 3))
    size = 1 / g - 1
    kappa = (np.arange(400) + 0.5) / 400
    edges = np.arange(401)[:, None] / 400
    cumulative = special.betainc(m * size, (1 - m) * size, edges).mean(axis=1)
    prior = np.diff(cumulative)
    density = prior * [textbook_log(table, k) for k in kappa]
    below = np.cumsum(density) / density.sum()
    ours = found.rater_quantiles(0, SHARES)
    theirs = np.interp(SHARES, below, kappa + 0.5 / 400)
    assert ours == pytest.approx(theirs, abs=2e-3)


def textbook_log(table: Table, kappa: float) -> float:
    pairs = RaterPairs.of(table, 1.0)
    j = np.arange(pairs.agree + 1)
    weights = np.exp(pairs.log_weights - pairs.log_weights.max())
    return float(
        weights @ (kappa ** (pairs.agree - j) * (1 - kappa) ** (pairs.differ + j))
    )


def test_on_many_pairs_of_alike_raters_it_is_stratified_kappa() -> None:
    rng = np.random.default_rng(11)
    shares = np.tile([0.1, 0.2, 0.4, 0.3], (6, 1))
    study = drawn_pairs(rng, np.full(6, 0.7), shares, 150)
    found = retest_model(study, categories=[0, 1, 2, 3])
    kappa = stratified_kappa(study, categories=[0, 1, 2, 3])
    # same margins for all: the mean of raters' kappas is the stratified one
    assert found.kappa.value == pytest.approx(kappa.value, abs=0.01)
    # 3 standard errors of .021 around the truth: once in 370 runs of other seeds
    assert found.kappa.value == pytest.approx(0.7, abs=0.063)
    assert found.spread.value < 0.1


def test_raters_who_differ_are_told_apart_and_pulled_together() -> None:
    rng = np.random.default_rng(12)
    kappas = np.array([0.3, 0.5, 0.7, 0.9] * 2)
    study = drawn_pairs(rng, kappas, np.full((8, 3), 1 / 3), 100)
    found = retest_model(study, categories=[0, 1, 2])
    truth = np.mean(kappas)
    assert found.kappa.interval.low < truth < found.kappa.interval.high
    assert found.spread.value == pytest.approx(np.std(kappas), abs=0.06)
    for of_rater, kappa in zip(found.raters, kappas, strict=True):
        assert of_rater.value == pytest.approx(kappa, abs=0.2)
    few = retest_model([pairs[:6] for pairs in study], categories=[0, 1, 2])
    assert np.ptp([q.value for q in few.raters]) < np.ptp(
        [q.value for q in found.raters]
    )


@pytest.mark.parametrize(
    ("n_raters", "n_items"), [(3, 4), pytest.param(5, 12, marks=pytest.mark.slow)]
)
def test_ranks_of_what_made_the_data_are_uniform(n_raters: int, n_items: int) -> None:
    # Simulation-based calibration with exact posteriors: the share of the posterior
    # below the true mean is U(0, 1). 100 studies; p < 1e-4 by chance once in 10 000.
    rng = np.random.default_rng([n_raters, n_items])
    below = []
    for _ in range(100):
        m, g = rng.random(), rng.random() / 3
        kappas = rng.beta(m * (1 / g - 1), (1 - m) * (1 / g - 1), n_raters)
        shares = rng.dirichlet(np.ones(3), n_raters)
        study = np.array(drawn_pairs(rng, kappas, shares, n_items))
        tables = [
            np.bincount(3 * a + b, minlength=9).reshape(3, 3)
            for a, b in np.moveaxis(study, 2, 1)
        ]
        found = RetestPosterior.of(tables, (0.5,), shape=1.0, concentration=1.0)
        below.append(found.mean.probability(float(special.logit(m))))
    assert stats.kstest(below, "uniform").pvalue > 1e-4


def test_three_raters_and_four_models_say_how_little_is_known() -> None:
    perfect = [[["1", "1"], ["1+", "1+"], ["2", "2"], ["3", "3"]]] * 2
    study = [*perfect, [["1", "1"], ["1+", "1"], ["2", "2"], ["3", "2"]]]
    found = retest_model(study, categories=["0", "1", "1+", "2", "3", "4"])
    assert found.kappa.interval.low < 0.5
    assert found.kappa.interval.high > 0.9
    assert found.raters[2].value < found.kappa.value < found.raters[0].value
    assert found.n_pairs == (4, 4, 4)
    assert found.prior.startswith("mean kappa ~ U(0, 1), π ~ Dirichlet(1")
    assert found.other_prior != found.prior
    assert found.other_kappa.interval != found.kappa.interval
    assert (found.kappa.interval.target, found.kappa.interval.kind) == (
        "raters",
        "credible",
    )
    assert found.raters[0].interval.target == "items"


def test_jeffreys_prior_is_what_the_other_prior_was() -> None:
    study = drawn_pairs(
        np.random.default_rng(1), np.full(3, 0.6), np.ones((3, 2)) / 2, 5
    )
    flat = retest_model(study, categories=[0, 1])
    other = retest_model(study, categories=[0, 1], prior="jeffreys")
    assert other.prior == flat.other_prior
    assert other.kappa.interval.low == pytest.approx(flat.other_kappa.interval.low)


def test_gaps_and_raters_without_pairs_are_left_out() -> None:
    full = [["a", "a"], ["b", "b"], ["a", "b"]]
    gaps = [["a", None], ["b", "b"], [None, None]]
    none = [[None, "a"]] * 3
    found = retest_model([full, none, gaps])
    assert [q.name for q in found.raters] == ["rater 1", "rater 3"]
    assert found.n_pairs == (3, 1)


@pytest.mark.parametrize(
    "table",
    [
        np.diag([200, 200]),
        np.array([[0, 300], [300, 0]]),
        np.array([[300, 0], [0, 0]]),
    ],
)
def test_extreme_tables_have_finite_ends(table: Table) -> None:
    found = RetestPosterior.of([table] * 3, SHARES, shape=1.0, concentration=1.0)
    assert 0 < found.quantiles[0] < found.quantiles[1] < found.quantiles[2] <= 1
    low, middle, high = found.rater_quantiles(0, SHARES)
    assert 0 <= low < middle < high <= 1
    assert list(found.spread_quantiles(SHARES)) == sorted(
        found.spread_quantiles(SHARES)
    )


def test_where_there_is_nothing_to_learn_it_is_undefined() -> None:
    with pytest.warns(UndefinedStatisticWarning, match="no rater has a pair"):
        found = retest_model([[["a", None], [None, "b"]]])
    assert math.isnan(found.kappa.value)
    assert found.kappa.interval.reason == "no rater has a pair of grades"
    with pytest.warns(UndefinedStatisticWarning, match="one category"):
        retest_model([[["a", "a"], ["a", "a"]]])


def test_what_is_no_question_is_refused() -> None:
    pairs = [[["a", "a"], ["b", "b"]]]
    with pytest.raises(ParameterError, match="level"):
        retest_model(pairs, level=1.0)
    with pytest.raises(ParameterError, match="prior"):
        retest_model(pairs, prior="flat")  # type: ignore[arg-type]
    with pytest.raises(ParameterError, match="concentration"):
        retest_model(pairs, concentration=0.0)
    with pytest.raises(RatingsError):
        retest_model("aabb")
