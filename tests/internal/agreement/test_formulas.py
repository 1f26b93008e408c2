"""Formulas: slopes by a complex step, and sums over resampled raters pair by pair."""

from collections.abc import Sequence
from itertools import product

import numpy as np
import pytest
from numpy.typing import NDArray

from masrel.agreement import COEFFICIENTS, WeightName, coefficient, declared_weights

FORMULAS = {
    **{name: entry.formula for name, entry in COEFFICIENTS.items() if entry.formula},
    "ordinal alpha": coefficient("krippendorff_alpha").by_metric("ordinal").formula,
}
STEP = 1e-30  # nothing is subtracted, so that it may be as small as one likes


@pytest.mark.parametrize("has_gaps", [False, True])
@pytest.mark.parametrize("weights", ["identity", "linear", "quadratic"])
@pytest.mark.parametrize("name", FORMULAS)
def test_a_slope_is_the_derivative_of_the_value(
    name: str, weights: WeightName, has_gaps: bool
) -> None:
    formula = FORMULAS[name]
    assert formula is not None
    rng = np.random.default_rng(3)
    n_raters = 2 if coefficient(formula.name).n_raters == (2, 2) else 4
    is_icc = name.startswith("icc")  # of complete tables, and of what categories weigh
    codes = rng.integers(-1 if has_gaps and not is_icc else 0, 4, (30, n_raters))
    v = declared_weights(weights, [1, 2, 4, 5]).v
    if is_icc:
        v = np.array([0.0, 1.0, 3.0, 4.0])
    features = formula.features(codes, v)
    rows = features.rows()
    sums, freq = features.summed(np.ones(30, dtype=np.int64))
    assert sums == pytest.approx(rows.sum(axis=0), rel=1e-14)
    stepped = formula.value(sums + 1j * STEP * np.eye(len(sums)), v).imag / STEP
    # of several sums at once, as intervals ask for them
    for slope in (formula.slope(sums, v), *formula.slope(np.stack([sums, sums]), v)):
        assert slope == pytest.approx(stepped, rel=1e-12, abs=1e-15)
    u = (rows @ slope)[rows.any(axis=1)]
    expected = np.sqrt(len(u) / (len(u) - 1) * ((u - u.mean()) ** 2).sum())
    error = features.error(slope, freq)
    assert error == pytest.approx(expected, rel=1e-12)


# Rater 2 alone rated two items, raters 0 and 1 alone another two.
CODES = np.array(
    [[0, 0, 0], [1, 1, 0], [2, 1, 1], [-1, -1, 2], [-1, -1, 2], [0, 2, -1], [1, 1, -1]],
    dtype=np.int8,
)
POOLED = [  # the shares of Conger's raters are each rater's own
    name
    for name, entry in COEFFICIENTS.items()
    if entry.formula and entry.formula.resampled and name != "conger_kappa"
]


def by_pairs(
    taken: Sequence[int], v: NDArray[np.float64]
) -> tuple[float, NDArray[np.float64]] | None:
    """Return D_o and the shares of the categories, rating by rating."""
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
            share = np.bincount([k for _, k in ratings], minlength=3)
            shares.append(share / share.sum())
    if not disagreement:
        return None
    return float(np.mean(disagreement)), np.mean(shares, axis=0)


@pytest.mark.parametrize("weights", ["identity", "quadratic"])
@pytest.mark.parametrize("name", POOLED)
def test_of_resampled_raters_only_items_that_one_of_them_rated_count(
    name: str, weights: WeightName
) -> None:
    formula = FORMULAS[name]
    assert formula is not None
    assert formula.resampled is not None
    v = declared_weights(weights, [1, 2, 4]).v
    once = np.ones(len(CODES), dtype=np.int64)
    of_both, of_raters = formula.resampled(CODES, v), formula.resampled(CODES, v, once)
    chance = {
        "percent_agreement": lambda _: 1.0,
        "fleiss_kappa": lambda p: p @ v @ p,
        "brennan_prediger": lambda _: v.mean(),
        "gwet_ac": lambda p: 1 - (9 - v.sum()) / 6 * (p * (1 - p)).sum(),
    }[name]
    n_defined = 0
    for taken in product(range(3), repeat=3):
        raters = np.bincount(taken, minlength=3)[None].astype(np.float64)
        sums = of_both(once[None].astype(np.float64), raters)
        assert of_raters(sums, raters) == pytest.approx(sums, rel=1e-12)
        value = float(formula.value(sums, v)[0])
        parts = by_pairs(taken, v)
        if parts is None:
            assert np.isnan(value)
            continue
        n_defined += 1
        assert value == pytest.approx(1 - parts[0] / chance(parts[1]), rel=1e-12)
    assert n_defined == 24  # all but those that take one rater three times
