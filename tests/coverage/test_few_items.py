"""Few items by several raters: the default of coefficients other than Fleiss' kappa."""

import numpy as np
import pytest

from masrel.intervals import estimate

SHARES = np.array([0.35, 0.3, 0.2, 0.15])
N_STUDIES = 150


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::masrel.errors.MasrelWarning")
@pytest.mark.parametrize(("n_items", "n_raters"), [(4, 8), (6, 3)])
def test_the_default_of_few_items_covers(n_items: int, n_raters: int) -> None:
    # Items are Dirichlet(A π) with κ = 1/(1 + A) = .9. If 93 % hold the truth, 122 or
    # fewer of 150 would in two runs of 10^6; a jackknife does in 80.
    rho = 0.9
    alike = float(SHARES @ SHARES)
    agreement = 1.0 - (1.0 - rho) * (1.0 - alike)
    chance = (1.0 - alike) / 3.0  # Gwet's, of 4 categories
    truth = {
        "conger_kappa": rho,
        "percent_agreement": agreement,
        "gwet_ac": (agreement - chance) / (1.0 - chance),
    }
    rng = np.random.default_rng(20)
    held = dict.fromkeys(truth, 0)
    for _ in range(N_STUDIES):
        shares = rng.dirichlet((1.0 - rho) / rho * SHARES, n_items)
        cuts = shares.cumsum(axis=1)[:, None, :-1]
        codes = (rng.random((n_items, n_raters, 1)) > cuts).sum(axis=2)
        for name, true in truth.items():
            result = estimate(name, codes, target="items", categories=range(4))
            assert result.interval is not None
            held[name] += result.interval.low <= true <= result.interval.high
    assert min(held.values()) > 122, held
