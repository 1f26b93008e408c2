"""Restricted likelihood of ratings with gaps, against algebra of whole matrices."""

import numpy as np
import pytest

from masrel.agreement._mixed import Components, components


@pytest.mark.parametrize("scale", [0.0, 1.0])  # of raters: at the bound, or not
def test_information_is_that_of_projections_written_out(scale: float) -> None:
    rng = np.random.default_rng(5)
    parts = rng.standard_normal((12, 1)), scale * rng.standard_normal((1, 4))
    values = sum(parts) + rng.standard_normal((12, 4))
    values[rng.random((12, 4)) < 0.3] = np.nan
    found = components(values, has_raters=True)
    assert isinstance(found, Components)
    items, raters = np.nonzero(~np.isnan(values))
    of_items, of_raters = (np.equal.outer(of, of) * 1.0 for of in (items, raters))
    residual = np.eye(items.size)
    inverse = np.linalg.inv(
        residual + found.ratios[0] * of_items + found.ratios[1] * of_raters
    )
    ones = inverse.sum(axis=1)
    projection = inverse - np.outer(ones, ones) / ones.sum()
    terms = [projection @ part for part in (of_items, of_raters, residual)]
    traces = [[np.trace(one @ other) for one in terms] for other in terms]
    information = found.likelihood.information(found.ratios)
    np.testing.assert_allclose(information, traces, rtol=1e-9)
