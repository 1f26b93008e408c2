"""The test of a training needs fewer presentations than a fixed number as sure."""

from dataclasses import replace

import numpy as np
import pytest

from docs.make.training import (
    SEED,
    calibrated,
    criterion,
    fixed_errors,
    sequential,
)

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
