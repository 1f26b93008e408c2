"""Where categories are rare the default covers what the page claims.

Seeds are fixed, so that a run that passes passes again.
"""

import numpy as np
import pytest
from scipy.stats import binom

from docs.make.coverage.rare import (
    RareQuestion,
    checked_on,
    chosen_on,
    coefficients,
    count_rare,
)
from docs.make.coverage.rare_methods import N_DRAWS, RareStudies, held, jackknife
from docs.make.coverage.rare_studies import Formula, Population, population
from masrel.intervals import estimate

pytestmark = pytest.mark.filterwarnings("ignore::masrel.errors.MasrelWarning")
THINNED = 300  # studies of a cell
LOWEST = 0.85  # the least a cell of the page has, and its Monte Carlo error
FALSE_ALARM = 1e-6


@pytest.mark.parametrize("kappa", [0.4, 0.8])
@pytest.mark.parametrize("shares", [(0.96, 0.04), (0.7, 0.15, 0.08, 0.05, 0.02)])
def test_raters_alike_have_the_kappa_and_the_shares(
    shares: tuple[float, ...], kappa: float
) -> None:
    table = population("alike", shares, kappa, 3)
    found = table.shares @ table.counts / 3
    assert found == pytest.approx(shares, abs=1e-12)
    # by whichever weights: what two ratings of an item differ by is 1 - rho of chance
    for name in ("fleiss_kappa", "conger_kappa", "krippendorff_alpha"):
        for weights in ("identity", "quadratic"):
            truth = Formula.of(name, weights, table).truth(table)
            assert truth == pytest.approx(kappa, abs=1e-9)


@pytest.mark.parametrize(
    ("kind", "shares", "n_raters", "n_items"),
    [
        ("alike", (0.92, 0.08), 3, 50),
        ("unlike", (0.92, 0.08), 2, 100),
        ("double coding", (0.8, 0.2), 2, 100),
        ("unlike", (0.86, 0.08, 0.04, 0.02), 3, 25),
    ],
)
def test_the_default_is_what_the_study_judges(
    kind: Population, shares: tuple[float, ...], n_raters: int, n_items: int
) -> None:
    question = RareQuestion(kind, shares, n_raters, n_items, 0.6)
    table = population(kind, shares, 0.6, n_raters)
    rng = np.random.Generator(np.random.PCG64(5))
    freq = rng.multinomial(n_items, table.shares, size=4)
    studies = RareStudies(table, freq, rng)
    for name, weights in coefficients(question):
        formula = Formula.of(name, weights, table)
        value, _ = jackknife(studies, formula)
        ends = (studies if name == "fleiss_kappa" else studies.of_pairs).rho
        if weights != "identity":
            (ends,) = studies.drawn([formula])
        elif name == "gwet_ac":
            ends = studies.grid[1]
        judged = held(ends, value)
        for s in np.flatnonzero(studies.rare):
            codes = np.repeat(table.patterns, freq[s], axis=0).astype(float)
            result = estimate(
                name,
                np.where(codes < 0, np.nan, codes),
                target="items",
                categories=range(len(shares)),
                weights=weights,  # type: ignore[arg-type]
            )
            assert result.interval is not None
            assert "posterior" in result.interval.method
            given = result.interval.low, result.interval.high
            expected, slack = np.array([judged.low[s], judged.high[s]]), 0.01
            if (drawn := result.interval.n_resamples) is not None:
                # both draw, the study fewer: a joint error, with a false alarm of 1e-6
                errors = np.array(result.interval.monte_carlo_error)
                slack = 5.0 * errors * np.sqrt(1.0 + drawn / N_DRAWS)
            assert np.all(np.abs(given - expected) <= slack)


def covers(questions: list[RareQuestion], size: int) -> None:
    """Check that the default covers in every cell, and the jackknife does not."""
    n_failed = n_cells = 0
    for question in questions:
        for cell in count_rare(question, size):
            share, n = cell.methods["default"].coverage, cell.n_defined
            if n < size / 4:
                continue
            least = binom.ppf(FALSE_ALARM, n, LOWEST)
            assert round(share * n) >= least, (question, cell.coefficient)
            n_failed += cell.verdict("jackknife") == "low"
            n_cells += 1
    assert n_failed > n_cells / 3


@pytest.mark.slow
def test_the_default_covers_where_categories_are_rare() -> None:
    covers([*chosen_on()][::15], THINNED)


@pytest.mark.long
def test_the_default_covers_in_all_cells() -> None:
    covers([*chosen_on(), *checked_on()], 5_000)
