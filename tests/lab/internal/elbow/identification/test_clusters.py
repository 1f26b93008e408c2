"""Clustered least squares against closed forms and a dense form."""

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from masrel.lab.elbow.identification._clusters import (
    Rows,
    fitted,
    left_out_steps,
    partial_out,
    solve,
)


def without_own(own: np.ndarray, design: np.ndarray, target: np.ndarray) -> Rows:
    rest = partial_out(np.column_stack([own, design, target]), own.shape[1])
    return Rows(design=rest[:, :-1], target=rest[:, -1])


def trials(seed: int, sizes: Sequence[int], n_parameters: int = 2) -> list[Rows]:
    rng = np.random.default_rng(seed)
    made = []
    for size in sizes:
        design = rng.standard_normal((size, n_parameters)) + 1.0
        target = design.sum(axis=1) + rng.standard_normal() + rng.standard_normal(size)
        made.append(Rows(design=design, target=target))
    return made


def dense(rows: Sequence[Rows]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Values, CR2 covariance and degrees of freedom with whole n by n matrices."""
    x = np.concatenate([r.design for r in rows])
    y = np.concatenate([r.target for r in rows])
    inverse = np.linalg.inv(x.T @ x)
    values = inverse @ x.T @ y
    residual_maker = np.eye(len(y)) - x @ inverse @ x.T
    ends = np.cumsum([0, *(len(r.target) for r in rows)])
    pieces = [slice(a, b) for a, b in pairwise(ends)]
    meat, columns = np.zeros_like(inverse), []
    for piece in pieces:
        sizes, directions = np.linalg.eigh(residual_maker[piece, piece])
        root = directions @ np.diag(sizes**-0.5) @ directions.T
        score = x[piece].T @ root @ (residual_maker @ y)[piece]
        meat += np.outer(score, score)
        column = np.zeros((len(y), x.shape[1]))
        column[piece] = root @ x[piece] @ inverse
        columns.append(column)
    freedom = []
    for j in range(x.shape[1]):
        u = np.stack([column[:, j] for column in columns], axis=1)
        g = u.T @ residual_maker @ u
        freedom.append(np.trace(g) ** 2 / np.trace(g @ g))
    return values, inverse @ meat @ inverse, np.array(freedom)


@settings(max_examples=25, deadline=None)
@given(
    st.integers(0, 2**32),
    st.lists(st.integers(3, 9), min_size=3, max_size=6),
)
def test_reduced_and_whole_matrices_agree(seed: int, sizes: list[int]) -> None:
    rows = trials(seed, sizes)
    fit, (values, covariance, freedom) = solve(rows), dense(rows)
    np.testing.assert_allclose(fit.values, values, rtol=1e-9)
    np.testing.assert_allclose(fit.covariance, covariance, rtol=1e-6, atol=1e-12)
    np.testing.assert_allclose(fit.df, freedom, rtol=1e-6)


def test_what_leaving_a_trial_out_does_is_what_a_fit_without_it_says() -> None:
    rows = trials(6, [7, 9, 6, 8])
    fit = solve(rows)
    at_zero = [
        Rows(design=r.design, target=r.target - r.design @ fit.values) for r in rows
    ]
    for i, step in enumerate(left_out_steps(at_zero)):
        others = solve([r for j, r in enumerate(rows) if j != i])
        np.testing.assert_allclose(fit.values + step, others.values, rtol=1e-9)


def test_what_no_row_tells_is_undefined_and_the_rest_is_not() -> None:
    # a column of zeros, and two that say the same
    rng = np.random.default_rng(1)
    rows = []
    for _ in range(4):
        one, other = rng.standard_normal((2, 6))
        design = np.stack([one, np.zeros(6), other, 2.0 * other], axis=1)
        rows.append(Rows(design=design, target=2.0 * one))
    fit = solve(rows)
    assert fit.values[0] == pytest.approx(2.0, rel=1e-12)
    assert np.isnan(fit.values[1:]).all()
    assert fit.n_trials.tolist() == [4, 0, 4, 4]
    lone = solve(trials(4, [8]))
    assert np.isfinite(lone.values).all()
    assert np.isnan(lone.covariance).all()
    assert np.isnan(lone.df).all()


def test_what_own_parameters_explain_but_for_rounding_tells_nothing() -> None:
    # a speed that is constant in every trial, beside a constant of each trial's own
    rng = np.random.default_rng(3)
    rows = []
    for speed in (0.1396263, 0.1570796, 0.2):
        angle = np.cumsum(rng.uniform(0.5, 1.5, 40)) * speed
        design = np.stack([np.full(40, speed), angle], axis=1)
        own = np.ones((40, 1))
        rows.append(without_own(own, design, 1.26 * speed + 3.15 * angle))
    fit = solve(rows)
    assert math.isnan(fit.values[0])
    assert fit.values[1] == pytest.approx(3.15, rel=1e-12)


def test_as_many_trials_as_parameters_leave_no_freedom() -> None:
    # two points on a line: no warning of 0/0, and no interval
    rows = [
        Rows(design=np.array([[1.0, x]]), target=np.array([y]))
        for x, y in ((1.0, 3.0), (2.0, 5.0))
    ]
    found = solve(rows)
    np.testing.assert_allclose(found.values, [1.0, 2.0], atol=1e-12)
    estimates = fitted(("a", "b"), found, 0.95)
    assert all(np.isnan(estimate.low) for estimate in estimates)
    assert {estimate.reason for estimate in estimates} == {
        "these trials fit exactly: an interval needs more that differ"
    }
