"""The study of two raters judges what the package gives."""

import itertools

import numpy as np
import pytest

from docs.make.coverage.simulate import KAPPAS
from docs.make.coverage.tables import COEFFICIENTS, MODELS, cohen
from docs.make.coverage.two_raters import (
    Question,
    all_questions,
    draw,
    intervals,
)
from masrel.agreement import COEFFICIENTS as REGISTER
from masrel.intervals import estimate

pytestmark = pytest.mark.filterwarnings("ignore::masrel.errors.MasrelWarning")


def rows(
    counts: "np.ndarray[tuple[int, ...], np.dtype[np.float64]]",
) -> list[list[int]]:
    """Ratings of two raters that have this table."""
    return [list(pair) for pair, n in np.ndenumerate(counts) for _ in range(int(n))]


@pytest.mark.parametrize(
    ("model", "q", "kappa"), list(itertools.product(MODELS, (2, 4), KAPPAS))
)
def test_populations_have_their_kappa(model: str, q: int, kappa: float) -> None:
    table = MODELS[model](kappa, q)
    found = float(cohen(table))
    # margins that differ make chance agreement another than that of the accidents
    slack = 1e-8 if model == "latent trait" else 0.03
    assert found == pytest.approx(kappa, abs=slack)
    assert table.sum() == pytest.approx(1.0, abs=1e-9)


@pytest.mark.parametrize("coefficient", COEFFICIENTS)
@pytest.mark.parametrize("n_items", [8, 16])
def test_the_default_is_what_the_study_judges(coefficient: str, n_items: int) -> None:
    question = Question(coefficient, 4, "latent trait", n_items, 0.6)
    tables, _ = draw(question, 5)
    judged = intervals(tables)["default"]
    name, _, weights = coefficient.partition(", ")
    for s, counts in enumerate(tables.counts):
        given = estimate(
            name,
            rows(counts),
            target="items",
            categories=range(4),
            weights=weights or "identity",
        )
        assert given.interval is not None
        assert given.value == pytest.approx(tables.value[s], rel=1e-12)
        ends = given.interval.low, given.interval.high
        # ends of 1 000 draws have an error of some .02; the jackknife has none
        slack = 0.1 if given.interval.n_resamples or given.value == 1.0 else 1e-9
        assert ends == pytest.approx((judged.low[s], judged.high[s]), abs=slack)


def test_all_that_the_study_asks_is_registered_and_asked_once() -> None:
    questions = list(all_questions())
    assert len(set(questions)) == len(questions) == 150
    assert {name.partition(",")[0] for name in COEFFICIENTS} <= set(REGISTER)
