"""The slope of every formula is the complex step of its value."""

import numpy as np
import pytest

from masrel.agreement import COEFFICIENTS, WeightName, coefficient, declared_weights
from masrel.agreement._engine import Formula

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
    assert isinstance(formula, Formula)
    rng = np.random.default_rng(3)
    n_raters = 2 if name in ("cohen_kappa", "scott_pi") else 4
    codes = rng.integers(-1 if has_gaps else 0, 4, (30, n_raters))
    v = declared_weights(weights, [1, 2, 4, 5]).v
    features = formula.features(codes, v)
    sums, rows = features.sums(np.ones(30, dtype=np.int64)), features.rows()
    assert sums == pytest.approx(rows.sum(axis=0), rel=1e-14)
    stepped = formula.value(sums + 1j * STEP * np.eye(len(sums)), v).imag / STEP
    slope = formula.slope(sums, v)
    assert slope == pytest.approx(stepped, rel=1e-12, abs=1e-15)
    assert features.dot(slope) == pytest.approx(rows @ slope, abs=1e-14)
    # of several sums at once, as intervals ask for them
    for one in formula.slope(np.stack([sums, sums]), v):
        assert one == pytest.approx(slope, rel=1e-12, abs=1e-15)
