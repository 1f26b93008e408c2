"""The profile likelihood of ICC(A,1) by mean squares, against a grid."""

import numpy as np
import pytest
from scipy import optimize, stats

from masrel.agreement._profile import profile_ends

RATIOS = np.array([0.0, *np.geomspace(1e-6, 1e11, 60_000)])  # of raters to the residual
TABLES = [  # items, raters; mean squares of items, raters and residual
    (55, 2, (2.5, 0.141, 0.23)),  # of a low correlation raters have two valleys
    (50, 3, (3.2, 25.0, 0.2)),
    (12, 6, (58.3, 44.3, 70.9)),  # items vary less than chance has it
    (10, 4, (5.0, 0.0, 1.0)),
    (200, 10, (0.9, 300.0, 1.0)),
    (4, 3, (40.0, 2.0, 1e-6)),
]


@pytest.mark.parametrize(("n", "k", "squares"), TABLES)
@pytest.mark.parametrize("level", [0.5, 0.95])
def test_ends_are_where_the_deviance_is_a_quantile_higher(
    n: int, k: int, squares: tuple[float, float, float], level: float
) -> None:
    items, raters, residual = np.multiply(squares, (n - 1, k - 1, (n - 1) * (k - 1)))

    def deviance(of_items: np.ndarray, of_raters: np.ndarray) -> np.ndarray:
        a, b = 1.0 + k * of_items, 1.0 + n * of_raters
        total = items / a + raters / b + residual
        return (n - 1) * np.log(a) + (k - 1) * np.log(b) + (n * k - 1) * np.log(total)

    best = min(
        optimize.minimize(
            lambda z: float(deviance(*np.expm1(z))),
            start,
            bounds=[(0, 40)] * 2,
            options={"ftol": 1e-15, "gtol": 1e-9},
        ).fun
        for start in ([0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 5.0], [14.0, 12.0])
    )
    low, high = profile_ends(n, k, squares, level)
    for end in (low, high):
        odds = end / (1.0 - end)
        above = deviance(odds * (1.0 + RATIOS), RATIOS).min() - best
        if end == 0.0:
            assert above <= stats.chi2.ppf(level, 1) + 1e-6
        else:
            assert above == pytest.approx(stats.chi2.ppf(level, 1), abs=2e-4)
