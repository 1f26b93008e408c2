"""Formulas: slopes by a complex step."""

import numpy as np
import pytest

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
