"""Memory that intervals take beside the ratings of a million items by five raters."""

import subprocess
import sys
import tracemalloc
from collections.abc import Callable
from functools import partial

import numpy as np
import pytest
from numpy.typing import NDArray

from masrel.intervals import analytic, bootstrap, jackknife, posterior

N_ITEMS = 1_000_000
MOST_MB = 300.0
FEW_MB = 50.0  # of some thousand distinct rows; the ratings alone take 5 as bytes


def megabytes(work: Callable[[], object], *, loaded: bool = True) -> float:
    """Return the most that was allocated at once, without what is loaded first."""
    if loaded:
        work()
    tracemalloc.start()
    try:
        work()
        return tracemalloc.get_traced_memory()[1] / 1e6
    finally:
        tracemalloc.stop()


def test_the_meter_sees_an_array() -> None:
    assert 8.0 < megabytes(lambda: np.ones(1_000_000)) < 8.1


@pytest.fixture(scope="module")
def ratings() -> NDArray[np.int8]:
    rng = np.random.default_rng(1)
    truth = rng.integers(0, 5, (N_ITEMS, 1), dtype=np.int8)
    other = rng.integers(0, 5, (N_ITEMS, 5), dtype=np.int8)
    return np.where(rng.random((N_ITEMS, 5)) < 0.6, truth, other)


@pytest.mark.parametrize(
    ("target", "kind"),
    [("items", "bca"), ("items", "studentized"), ("raters", "bca")],
)
def test_a_bootstrap_keeps_sums_and_not_resamples(
    ratings: NDArray[np.int8], target: str, kind: str
) -> None:
    # the drawn items of 10 000 resamples would be 10^10 numbers
    work = partial(
        bootstrap,
        "fleiss_kappa",
        ratings,
        target=target,  # type: ignore[arg-type]
        categories=range(5),
        kind=kind,  # type: ignore[arg-type]
        exact=False,
        rng=1,
    )
    assert megabytes(work) < FEW_MB


@pytest.mark.parametrize("target", ["items", "raters", "both"])
def test_a_jackknife_leaves_out_distinct_rows(
    ratings: NDArray[np.int8], target: str
) -> None:
    work = partial(
        jackknife,
        "fleiss_kappa",
        ratings,
        target=target,  # type: ignore[arg-type]
        categories=range(5),
    )
    assert megabytes(work) < FEW_MB


def test_the_delta_method_takes_no_more(ratings: NDArray[np.int8]) -> None:
    work = partial(
        analytic, "fleiss_kappa", ratings, target="items", categories=range(5)
    )
    assert megabytes(work) < FEW_MB


@pytest.mark.slow
@pytest.mark.parametrize("n_clusters", [1000, N_ITEMS])
def test_clusters_are_summed_a_block_at_a_time(
    ratings: NDArray[np.int8], n_clusters: int
) -> None:
    work = partial(
        bootstrap,
        "fleiss_kappa",
        ratings,
        target="items",
        categories=range(5),
        clusters=np.arange(N_ITEMS) % n_clusters,
        rng=1,
    )
    assert megabytes(work, loaded=False) < MOST_MB


@pytest.mark.slow
def test_the_exact_posterior_counts_items_once(ratings: NDArray[np.int8]) -> None:
    work = partial(
        posterior, "fleiss_kappa", ratings, target="items", categories=range(5)
    )
    assert megabytes(work, loaded=False) < MOST_MB


@pytest.mark.slow
def test_most_items_may_differ() -> None:
    # 20 categories at random: 860 000 of a million rows are distinct
    rows = np.random.default_rng(1).integers(0, 20, (N_ITEMS, 5), dtype=np.int8)
    work = partial(
        bootstrap,
        "fleiss_kappa",
        rows,
        target="items",
        categories=range(20),
        kind="bca",
        n_resamples=200,
        rng=1,
    )
    assert megabytes(work, loaded=False) < MOST_MB


@pytest.mark.slow
def test_labels_in_lists_take_no_more(ratings: NDArray[np.int8]) -> None:
    grades = ["0", "1", "1+", "2", "3"]
    rows = np.array(grades, dtype=object)[ratings].tolist()
    work = partial(
        bootstrap, "fleiss_kappa", rows, target="items", categories=grades, rng=1
    )
    assert megabytes(work, loaded=False) < MOST_MB


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["percentile", "bca", "studentized"])
def test_the_whole_process_takes_no_more(kind: str) -> None:
    # what the operating system saw, so that nothing is allocated past the meter
    code = f"""
import resource
import numpy as np
from masrel.intervals import bootstrap
rows = np.random.default_rng(1).integers(0, 5, ({N_ITEMS}, 5), dtype=np.int8)
options = dict(target="items", categories=range(5), kind={kind!r}, rng=1)
bootstrap("fleiss_kappa", rows[:1000], **options)
before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
found = bootstrap("fleiss_kappa", rows, **options)
assert found.low < found.high and found.n_resamples == 10_000
print((resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) * 1024 / 1e6)
"""
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )
    assert 0.0 <= float(done.stdout) < MOST_MB
