"""The test of a training needs fewer presentations than a fixed number as sure."""

from dataclasses import replace

import numpy as np
import pytest

from docs.make.training import (
    SEED,
    calibrated,
    counting,
    criterion,
    fixed_errors,
    kappa_of_all,
    lengths,
    sequential,
)
from masrel.agreement import cohen_kappa

N = 1_000


@pytest.mark.slow
@pytest.mark.parametrize(("order", "n"), [("blocked", N), ("adaptive", 4 * N)])
def test_it_needs_30_percent_fewer_presentations_at_equal_errors(
    order: str, n: int
) -> None:
    rule, rng = criterion(order=order), np.random.default_rng(SEED)
    boundary = calibrated(rule).boundary
    bad = sequential(rule, boundary, rule.insufficient, n, rng)
    good = sequential(rule, boundary, rule.sufficient, n, rng)
    false_pass = max(share for share, _ in bad.values())
    false_fail = max(1.0 - share for share, _ in good.values())
    # other trainees than those of the calibration; four standard errors
    assert false_pass <= 0.05 + 4.0 * (0.05 * 0.95 / n) ** 0.5
    assert false_fail <= 0.1
    mean = max(length for _, length in good.values())
    as_many = int(mean / 0.7 / rule.n_models) * rule.n_models
    fails, _ = fixed_errors(replace(rule, order="blocked"), as_many, false_pass, n)
    # a fixed number that is 30 % larger fails more
    assert fails > false_fail + 4.0 * (2.0 * false_fail / n) ** 0.5


def test_kappa_of_all_is_cohens_kappa() -> None:
    rng = np.random.default_rng(3)
    intended, codes = rng.integers(1, 5, (4, 20)), rng.integers(0, 6, (4, 20))
    expected = [
        cohen_kappa(np.column_stack(pair), categories=range(6), weights="linear").value
        for pair in zip(intended, codes, strict=True)
    ]
    assert kappa_of_all(criterion(), intended, codes) == pytest.approx(
        expected, abs=1e-12
    )


@pytest.mark.slow
def test_who_counts_what_came_gains_next_to_nothing() -> None:
    rule, rng = criterion(), np.random.default_rng(SEED)
    boundary = calibrated(rule).boundary
    shares = []
    for is_even in (None, False, True):
        drawn = counting(rule, is_even, N, rng)
        passed, _ = lengths(rule, rule.evidence(*drawn), boundary)
        shares.append(float(passed.mean()))
    plain, counts, in_even_blocks = shares
    # four standard errors of a difference, and 2 %
    assert counts - plain < 0.02 + 4.0 * (2.0 * 0.08 * 0.92 / N) ** 0.5
    assert in_even_blocks > 0.5  # blocks of each model twice would give it away
