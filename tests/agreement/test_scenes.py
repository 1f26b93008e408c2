"""An estimate pays only for itself: what was done is counted, not timed."""

from collections.abc import Iterator

import numpy as np

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
