"""An estimate pays only for itself: what was done is counted, not timed."""

import subprocess
import sys
from collections.abc import Iterator

import numpy as np
import pytest

from masrel.agreement import (
    COEFFICIENTS,
    count_ratings,
    fleiss_kappa,
    gwet_ac,
    krippendorff_alpha,
)

THREE = (fleiss_kappa, gwet_ac, krippendorff_alpha)
RATINGS = np.random.default_rng(1).integers(1, 6, (500, 4))


class Rows:
    """Rows of ratings that count how often they are read."""

    def __init__(self) -> None:
        self.n_reads = 0

    def __iter__(self) -> Iterator[list[int]]:
        self.n_reads += 1
        return iter(RATINGS.tolist())


def test_several_coefficients_of_counted_ratings_read_the_ratings_once() -> None:
    rows = Rows()
    counted = count_ratings(rows)
    assert [function(counted).value for function in THREE]
    assert rows.n_reads == 1


def test_an_estimate_has_no_interval_unless_it_is_its_own() -> None:
    for entry in COEFFICIENTS.values():
        if entry.shape == "ratings" and entry.n_raters[1] is None:
            found = entry(
                [["1", "2"], ["2", "2"], ["3", "3"]], categories="1 2 3".split()
            )
            assert (found.interval is not None) == entry.has_interval


@pytest.mark.parametrize("name", ["fleiss_kappa", "gwet_ac", "cohen_kappa"])
def test_one_estimate_from_an_array_loads_numpy_alone(name: str) -> None:
    code = (
        "import sys, numpy\nbefore = {m.split('.')[0] for m in sys.modules}\n"
        f"from masrel.agreement import {name}\n"
        f"{name}(numpy.array([[1, 1], [1, 2], [2, 2]]), weights='quadratic')\n"
        "after = {m.split('.')[0] for m in sys.modules} - before\n"
        "print(sorted(after & {'pandas', 'scipy', 'statsmodels', 'matplotlib', "
        "'emcee', 'click', 'msgspec'}), 'masrel.intervals' in sys.modules)"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )
    assert done.stdout.strip() == "[] False"
