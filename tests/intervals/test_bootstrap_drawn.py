"""Monte Carlo errors of bootstrap intervals, tolerances, and their options."""

import math
import tracemalloc

import numpy as np
import pytest

from masrel.errors import ParameterError
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


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"n_resamples": 50}, "n_resamples: needs a whole number of at least 100"),
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
