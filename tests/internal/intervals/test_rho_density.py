"""A category's polynomial, tilted, against Stirling numbers in integers."""

import math

import numpy as np
import pytest

from masrel.errors import ConvergenceError
from masrel.intervals import _dirichlet_multinomial
from masrel.intervals._dirichlet_multinomial import (
    TRIMMED,
    DirichletMultinomial,
    Powers,
    log_coefficients,
    tilted,
)


def stirling(n: int) -> list[int]:
    """Coefficients of x (x + 1) ... (x + n - 1), from power 0."""
    row = [1]
    for j in range(n):
        row = [
            j * same + below for same, below in zip([*row, 0], [0, *row], strict=True)
        ]
    return row


def of_one_item(n: int, log_tilt: float) -> Powers:
    """One item whose n ratings are all in one category: every N_j is 1."""
    model = DirichletMultinomial.of_counts(np.array([[n, 0]]))
    x, _ = model.saddle(np.exp([log_tilt]))
    return tilted(model.powers[0], 1.0, float(x[0, 0]), log_tilt)


@pytest.mark.parametrize("n", [5, 40, 700])
@pytest.mark.parametrize("log_tilt", [-30.0, -2.0, 0.0, 5.0, 40.0])
def test_every_coefficient_is_the_integer_times_its_moment(
    n: int, log_tilt: float
) -> None:
    result = of_one_item(n, log_tilt)
    # Γ(1 + t) = t!
    exact = np.array(
        [
            math.log(c) + math.lgamma(1.0 + t) + t * log_tilt
            for t, c in enumerate(stirling(n))
            if t
        ]
    )
    kept = np.flatnonzero(exact > exact.max() + math.log(TRIMMED)) + 1
    assert result.first == kept[0]
    assert result.values.size == kept.size
    logs = np.log(result.values) + result.scale
    assert logs == pytest.approx(exact[kept - 1], rel=1e-12, abs=1e-10)


def test_what_floats_drop_is_multiplied_out_in_logarithms(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    # At this tilt the moments still need powers whose probability is below 1e-230.
    log_coefficients.cache_clear()
    of_one_item(700, -2.0)
    assert log_coefficients.cache_info().currsize == 1
    log_coefficients.cache_clear()
    monkeypatch.setattr(_dirichlet_multinomial, "_MAX_FACTORS", 500)
    with pytest.raises(ConvergenceError, match="use the jackknife"):
        of_one_item(700, -2.0)
