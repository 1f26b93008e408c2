"""Monte Carlo errors of bootstrap intervals, tolerances, and their options."""

import math
import tracemalloc

import numpy as np
import pytest

from masrel.errors import ConvergenceError, ParameterError
from masrel.intervals import bootstrap
from tests.intervals.data import dirichlet_multinomial

few = pytest.mark.filterwarnings("ignore::masrel.errors.SmallSampleWarning")


def made(n: int, r: int, categories: int = 3) -> list[list[int]]:
    rows = dirichlet_multinomial(np.random.default_rng(n + r), n, r, 0.5)
    return [[min(grade, categories - 1) for grade in row] for row in rows]


@few
@pytest.mark.parametrize("kind", ["percentile", "basic", "bca", "studentized"])
@pytest.mark.parametrize(("n", "r", "categories"), [(10, 6, 3), (60, 3, 2)])
def test_errors_are_as_large_as_they_say(
    kind: str, n: int, r: int, categories: int
) -> None:
    options = {"target": "items", "kind": kind, "categories": range(3)}
    table = made(n, r, categories)
    exact = bootstrap("fleiss_kappa", table, **options)  # type: ignore[arg-type]
    assert exact.monte_carlo_error is None
    off = []
    for seed in range(30):
        found = bootstrap(
            "fleiss_kappa",
            table,
            exact=False,
            rng=seed,
            n_resamples=4000,
            **options,  # type: ignore[arg-type]
        )
        assert found.monte_carlo_error is not None
        for end in ("low", "high"):
            error = found.monte_carlo_error[end == "high"]
            if getattr(exact, end) not in (-1.0, 1.0):  # not cut
                off.append((getattr(found, end) - getattr(exact, end)) / error)
    # Root mean square of 30 or 60 standard normal numbers: outside once in 100 000 for
    # 30; the errors themselves are known to a quarter.
    assert 0.5 < math.sqrt(np.mean(np.square(off))) < 1.6


def test_the_error_of_bca_has_that_of_its_bias_in_it() -> None:
    # Without the error of the bias that of the low end would be 0.7 of the spread
    # between seeds.
    table = made(29, 8)
    found = [
        bootstrap(
            "fleiss_kappa",
            table,
            target="items",
            categories=range(3),
            kind="bca",
            exact=False,
            n_resamples=1000,
            rng=seed,
        )
        for seed in range(200)
    ]
    for end, of in (("low", 0), ("high", 1)):
        spread = np.std([getattr(f, end) for f in found], ddof=1)
        said = np.mean([f.monte_carlo_error[of] for f in found])  # type: ignore[index]
        # the sd of 200 values is within 22 % of its own but once in 100 000 runs
        assert 0.8 < said / spread < 1.25


def test_a_tolerance_draws_until_it_is_met() -> None:
    table = made(60, 5)
    options = {"target": "items", "categories": range(3), "exact": False, "rng": 4}
    loose = bootstrap("gwet_ac", table, n_resamples=1000, **options)  # type: ignore[arg-type]
    assert loose.monte_carlo_error is not None
    tolerance = min(loose.monte_carlo_error) / 3
    found = bootstrap(
        "gwet_ac",
        table,
        n_resamples=1000,
        tolerance=tolerance,
        **options,  # type: ignore[arg-type]
    )
    assert found.monte_carlo_error is not None
    assert max(found.monte_carlo_error) <= tolerance
    assert found.n_resamples is not None
    assert 4000 < found.n_resamples < 100_000
    again = bootstrap(
        "gwet_ac",
        table,
        n_resamples=1000,
        tolerance=tolerance,
        **options,  # type: ignore[arg-type]
    )
    assert again == found
    met = bootstrap("gwet_ac", table, n_resamples=1000, tolerance=1.0, **options)  # type: ignore[arg-type]
    assert met == loose


def test_a_tolerance_that_takes_too_long_says_how_long() -> None:
    table = made(60, 5)
    with pytest.raises(ConvergenceError, match=r"takes about \S+ more, and max_resam"):
        bootstrap(
            "gwet_ac",
            table,
            target="items",
            tolerance=1e-6,
            max_resamples=50_000,
            rng=1,
        )


def test_an_exact_interval_meets_any_tolerance() -> None:
    found = bootstrap("gwet_ac", made(20, 3, 2), target="items", tolerance=1e-12)
    assert found.monte_carlo_error is None


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"tolerance": 0.0}, "tolerance: needs a number above 0"),
        ({"tolerance": math.nan}, "tolerance: needs a number above 0"),
        ({"n_resamples": 500, "max_resamples": 400}, "needs at least the 500"),
        ({"exact": "yes"}, "exact: needs"),
        ({"exact": 1}, "exact: needs"),
    ],
)
def test_wrong_options_are_named(options: dict[str, object], said: str) -> None:
    with pytest.raises(ParameterError, match=said):
        bootstrap("gwet_ac", made(20, 3), target="items", **options)  # type: ignore[arg-type]


def test_memory_does_not_grow_with_items_times_resamples() -> None:
    table = np.random.default_rng(1).integers(0, 5, (100_000, 5), dtype=np.int8)
    options = {"target": "items", "categories": range(5), "n_resamples": 2000}
    bootstrap("fleiss_kappa", table[:1000], rng=1, **options)  # type: ignore[arg-type]
    tracemalloc.start()
    try:
        bootstrap("fleiss_kappa", table, rng=1, **options)  # type: ignore[arg-type]
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    # the drawn items alone would be 200 million numbers
    assert peak < 30e6
