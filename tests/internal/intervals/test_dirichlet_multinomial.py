"""The Dirichlet-multinomial model against betas, integrals, and merged categories."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from numpy.typing import NDArray

from masrel.agreement import code_ratings
from masrel.agreement._codes import item_counts
from masrel.intervals._dirichlet_multinomial import DirichletMultinomial, RhoDensity
from tests.strategies import LABELS, Table, tables

Floats = NDArray[np.float64]

WITH_PAIRS = tables().filter(
    lambda table: any(sum(grade is not None for grade in row) > 1 for row in table)
)


@settings(max_examples=25)
@given(WITH_PAIRS)
def test_unused_categories_are_one_of_the_sum_of_their_priors(table: Table) -> None:
    counts = item_counts(code_ratings(table, LABELS).codes, len(LABELS))
    used = counts.any(axis=0)
    unused = float((~used).sum())
    few = np.column_stack([counts[:, used], np.zeros(len(counts), np.int64)])
    merged = DirichletMultinomial.of_counts(few)
    prior = merged.prior.copy()
    prior[-1] = unused if unused else prior[-1]
    merged = dataclasses.replace(merged, prior=prior)
    whole = DirichletMultinomial.of_counts(counts)
    at = np.array([-3.0, 0.0, 0.5, 4.0])
    if unused:
        assert RhoDensity(whole)(at) == pytest.approx(RhoDensity(merged)(at))
    else:
        assert whole.prior.size == used.sum()


def test_unused_categories_are_one_part_of_the_prior() -> None:
    model = DirichletMultinomial.of_counts(np.array([[2, 0, 1, 0], [0, 0, 3, 0]]))
    assert model.prior.tolist() == [1.0, 1.0, 2.0]
