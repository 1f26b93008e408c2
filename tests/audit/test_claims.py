"""What a paper prints is read in every way that it may be meant."""

import itertools
from statistics import NormalDist

import numpy as np
import pytest
from statsmodels.stats.inter_rater import cohens_kappa

from masrel.agreement import cohen_kappa, count_table
from masrel.audit import Claim, audit_claim
from masrel.errors import ParameterError

TABLE = [[5, 2], [4, 16]]
PLAIN = {"n_items": 27, "n_categories": 2, "agreement": "77.8", "kappa": "0.471"}


def fitting(**printed: object) -> dict[tuple[str | None, str | None], bool]:
    """Whether `TABLE` has what is printed, by each reading of errors and tests."""
    margins = {"margins_1": (7, 20), "margins_2": (9, 18)}  # which leave no other table
    audit = audit_claim(Claim(**PLAIN, **margins, **printed))
    return {(r.error, r.test): bool(r.n_tables) for r in audit.readings}


def test_margins_leave_the_tables_that_have_them() -> None:
    audit = audit_claim(Claim(**PLAIN, margins_1=(7, 20)))
    assert audit.examples == (((5, 2), (4, 16)),)
    assert [reading.n_tables for reading in audit.readings] == [1]
    none = audit_claim(Claim(**PLAIN, margins_1=(8, 19)))
    assert none.is_possible is False
    assert [str(result) for result in none.alone.values()][-1] == "4 tables"


@pytest.mark.parametrize("error", ["delta", "delta n-1", "null", "simple"])
def test_standard_errors_and_intervals_are_of_one_kind(error: str) -> None:
    other = cohens_kappa(np.array(TABLE))
    n, p_o, p_e = 27, 21 / 27, (7 * 9 + 20 * 18) / 27**2
    spread = {
        "delta": other.std_kappa,
        "delta n-1": cohen_kappa(count_table(TABLE)).standard_error,
        "null": other.std_kappa0,
        "simple": (p_o * (1 - p_o) / n) ** 0.5 / (1 - p_e),
    }[error]
    z = NormalDist().inv_cdf(0.95)
    ends = other.kappa - z * spread, other.kappa + z * spread
    for printed in (
        {"standard_error": f"{spread:.6f}"},
        {"low": f"{ends[0]:.6f}", "high": f"{ends[1]:.6f}", "level": 0.9},
    ):
        fits = fitting(**printed)
        assert [kind for (kind, _), is_fit in fits.items() if is_fit] == [error]
        assert len(fits) == 4


def test_p_is_of_one_or_two_sides_and_of_either_error() -> None:
    other = cohens_kappa(np.array(TABLE))
    for error, sides in itertools.product(("null", "delta"), (1, 2)):
        spread = {"null": other.std_kappa0, "delta": other.std_kappa}[error]
        p = sides * (1 - NormalDist().cdf(other.kappa / spread))
        fits = fitting(p=f"{p:.6f}")
        name = f"{error}, {'one' if sides == 1 else 'two'}-sided"
        assert [test for (_, test), is_fit in fits.items() if is_fit] == [name]
    assert all(fitting(p="<0.05").values())
    assert not any(fitting(p="<0.001").values())


def test_rules_that_differ_are_two_readings() -> None:
    # 9 of 16 are 56.25 %
    claim = Claim(n_items=16, n_categories=2, agreement="56.3", kappa="0.263")
    numbers = {r.rounding: r.n_tables for r in audit_claim(claim).readings}
    assert numbers == {"half_even": 0, "half_up": 4}


def test_an_interval_beside_its_kappa_is_of_no_table_however_many_there_are() -> None:
    claim = Claim(n_items=13, n_categories=3, kappa="0.50", low="0.6", high="0.7")
    audit = audit_claim(claim)
    assert audit.is_possible is False
    assert {reading.n_tables for reading in audit.readings} == {0}


@pytest.mark.parametrize(
    ("low", "high", "excludes"),
    [
        # 0.50 may be up to 0.505, and 0.51 from there on; likewise below
        ("0.51", "0.70", False),
        ("0.52", "0.70", True),
        ("0.10", "0.49", False),
        ("0.10", "0.48", True),
    ],
)
def test_an_interval_excludes_no_kappa_that_rounding_may_hold(
    low: str, high: str, excludes: bool
) -> None:
    claim = Claim(n_items=38, n_categories=4, kappa="0.50", low=low, high=high)
    assert claim.excludes_kappa == excludes


def test_margins_may_lack_the_items_that_were_not_rated() -> None:
    few = {"n_items": 20, "n_categories": 2, "agreement": "85.0", "n_unrated": 2}
    assert Claim(**few, margins_1=(10, 8)).margins_1 == (10, 8)  # type: ignore[arg-type]
    with pytest.raises(ParameterError, match="margins_1: "):
        Claim(**few, margins_1=(10, 7))  # type: ignore[arg-type]
