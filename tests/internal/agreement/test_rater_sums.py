"""Sums over resampled raters are those of the ratings of the raters taken."""

from collections.abc import Sequence
from itertools import product

import numpy as np
import pytest

from masrel.agreement import COEFFICIENTS, declared_weights
from masrel.agreement._rows import distinct_rows

# Rater 2 alone rated two items, raters 0 and 1 alone another two.
CODES = np.array(
    [[0, 0, 0], [1, 1, 0], [2, 1, 1], [-1, -1, 2], [-1, -1, 2], [0, 2, -1], [1, 1, -1]],
    dtype=np.int8,
)
POOLED = [  # the shares of Conger's raters are each rater's own
    name
    for name, entry in COEFFICIENTS.items()
    if entry.formula is not None
    and entry.formula.rater_sums is not None
    and name != "conger_kappa"
]


def plain(taken: Sequence[int], v: np.ndarray) -> tuple[float, np.ndarray] | None:
    """D_o and the shares of the categories, rating by rating."""
    disagreement, shares = [], []
    for row in CODES.tolist():
        ratings = [(rater, row[rater]) for rater in taken if row[rater] >= 0]
        pairs = [
            v[k, other]
            for (g, k), (h, other) in product(ratings, ratings)
            if g != h  # a rater is no witness of its copies
        ]
        if pairs:
            disagreement.append(np.mean(pairs))
        if ratings:
            shares.append(np.bincount([k for _, k in ratings], minlength=3))
    if not disagreement:
        return None
    means = [share / share.sum() for share in shares]
    return float(np.mean(disagreement)), np.mean(means, axis=0)


@pytest.mark.parametrize("weights", ["identity", "quadratic"])
@pytest.mark.parametrize("name", POOLED)
def test_of_resampled_raters_only_items_that_one_of_them_rated_count(
    name: str, weights: str
) -> None:
    formula = COEFFICIENTS[name].formula
    assert formula is not None
    assert formula.rater_sums is not None
    v = declared_weights(weights, [1, 2, 4]).v  # type: ignore[arg-type]
    rows, freq = distinct_rows(CODES, 3)
    sums = formula.rater_sums(rows, freq, v)
    chance = {
        "percent_agreement": lambda _: 1.0,
        "fleiss_kappa": lambda p: p @ v @ p,
        "brennan_prediger": lambda _: v.mean(),
        "gwet_ac": lambda p: 1 - (9 - v.sum()) / 6 * (p * (1 - p)).sum(),
    }[name]
    n_defined = 0
    for taken in product(range(3), repeat=3):
        taken_freq = np.bincount(taken, minlength=3).astype(np.float64)
        value = float(formula.value(sums(taken_freq), v))
        parts = plain(taken, v)
        if parts is None:
            assert np.isnan(value)
            continue
        n_defined += 1
        assert value == pytest.approx(1 - parts[0] / chance(parts[1]), rel=1e-12)
    assert n_defined == 24  # all but those that take one rater three times
