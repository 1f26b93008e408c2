"""The hierarchical model of test-retest agreement against textbooks and samplers."""

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from masrel.agreement import stratified_kappa
from masrel.errors import ParameterError, UndefinedStatisticWarning
from masrel.intervals import retest_model

Floats = NDArray[np.float64]


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


@pytest.mark.slow
def test_on_many_pairs_of_alike_raters_it_is_stratified_kappa() -> None:
    rng = np.random.default_rng(11)
    shares = np.tile([0.1, 0.2, 0.4, 0.3], (6, 1))
    study = drawn_pairs(rng, np.full(6, 0.7), shares, 150)
    result = retest_model(study, categories=[0, 1, 2, 3])
    kappa = stratified_kappa(study, categories=[0, 1, 2, 3])
    # same margins for all: the mean of raters' kappas is the stratified one
    assert result.kappa.value == pytest.approx(kappa.value, abs=0.01)
    # 3 standard errors of .021 around the truth: once in 370 runs of other seeds
    assert result.kappa.value == pytest.approx(0.7, abs=0.063)
    assert result.standard_deviation.value < 0.1


def test_where_there_is_nothing_to_learn_it_is_undefined() -> None:
    with pytest.warns(UndefinedStatisticWarning, match="no rater has a pair"):
        result = retest_model([[["a", None], [None, "b"]]])
    assert math.isnan(result.kappa.value)
    assert result.kappa.interval.reason == "no rater has a pair of grades"
    with pytest.warns(UndefinedStatisticWarning, match="one category"):
        retest_model([[["a", "a"], ["a", "a"]]])


@pytest.mark.parametrize(
    "options", [{"level": 1.0}, {"prior": "flat"}, {"concentration": 0.0}]
)
def test_what_is_no_question_is_refused(options: dict[str, object]) -> None:
    with pytest.raises(ParameterError):
        retest_model([[["a", "a"], ["b", "b"]]], **options)  # type: ignore[arg-type]
