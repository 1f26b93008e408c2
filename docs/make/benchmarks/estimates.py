"""Agreement coefficients beside other packages: time and memory."""

from collections.abc import Iterator
from functools import partial
from pathlib import Path

import numpy as np
import pandas as pd

from docs.make.benchmarks.figures import LOOKS, chart, series
from docs.make.benchmarks.rows import Benchmark, Result, Row
from masrel.agreement import (
    code_long,
    cohen_kappa,
    count_ratings,
    fleiss_kappa,
    gwet_ac,
    krippendorff_alpha,
)
from tests.benchmarks.peers import PEERS, Codes, made, present, sklearn_cohen

SIZES = ((4, 8), (100, 5), (10_000, 5), (1_000_000, 5), (10_000_000, 3))
THREE = (fleiss_kappa, gwet_ac, krippendorff_alpha)
BY_SIZE = "three coefficients of"
TABLE_V = [
    ["1", "1", "1", "1+", "1", "1", "1", "1"],
    ["1+", "1+", "1+", "1+", "1+", "1", "1+", "1"],
    ["2", "2", "2", "2", "2", "2", "2", "2"],
    ["3", "2", "3", "3", "3", "2", "3", "3"],
]


def three(ratings: object) -> list[float]:
    """Fleiss' kappa, AC1 and alpha."""
    counted = count_ratings(ratings)
    return [function(counted).value for function in THREE]


def three_with_errors(ratings: object) -> list[tuple[float, float]]:
    """Fleiss' kappa, AC1 and alpha, each with its standard error."""
    counted = count_ratings(ratings)
    estimates = [function(counted) for function in THREE]
    return [(estimate.value, estimate.standard_error) for estimate in estimates]


def rows(quick: bool, _: Path) -> Iterator[Row]:
    """Yield all of them."""
    yield from by_size(quick)
    yield from other_ways_in(10_000 if quick else 1_000_000)


def by_size(quick: bool) -> Iterator[Row]:
    """Three coefficients, against single ones of each peer."""
    rng = np.random.default_rng(1)
    for n, r in SIZES[: 3 if quick else None]:
        codes: Codes = made(rng, n, r)
        # The slow ones take half a minute at 10 million items and gigabytes.
        peers = list(PEERS) if n < 10_000_000 else ["statsmodels"]
        yield Row(
            what=f"{BY_SIZE} {n:,} × {r}",
            n_ratings=n * r,
            works={
                "masrel": partial(three, codes),
                "masrel, with errors": partial(three_with_errors, codes),
                **{name: partial(PEERS[name], codes) for name in present(peers)},
            },
            turns=15 if n <= 10_000 else 5,
            has_memory=n == 10_000_000,
        )


def other_ways_in(n: int) -> Iterator[Row]:
    """Labels of the published study; small integers; pairs; a long table of text."""
    from statsmodels.stats.inter_rater import aggregate_raters
    from statsmodels.stats.inter_rater import fleiss_kappa as theirs

    yield Row(
        what="three coefficients of 4 × 8 labels",
        works={
            "masrel": partial(three, TABLE_V),
            "masrel, with errors": partial(three_with_errors, TABLE_V),
            "statsmodels": lambda: theirs(aggregate_raters(np.asarray(TABLE_V))[0]),
        },
        turns=25,
    )
    rng = np.random.default_rng(2)
    small = made(rng, n, 5).astype(np.int8)
    yield Row(
        what=f"three coefficients of {n:,} × 5 int8",
        works={
            "masrel": lambda: three(small),
            "numpy.bincount of each of its columns": lambda: [
                np.bincount(column) for column in small.T
            ],
        },
        turns=15,
    )
    pairs: Codes = made(rng, n, 2)
    peers = {name: partial(sklearn_cohen, pairs) for name in present(["scikit-learn"])}
    works = {"masrel": lambda: cohen_kappa(pairs).value, **peers}
    yield Row(what=f"Cohen's κ of {n:,} pairs", works=works)
    grades = made(rng, n // 5, 5).ravel() - 1
    items = np.array([f"patient {i}" for i in range(n // 5)], dtype=object)
    raters = np.array([f"rater {j}" for j in range(5)], dtype=object)
    frame = pd.DataFrame(
        {
            "item": np.repeat(items, 5),
            "rater": np.tile(raters, n // 5),
            "grade": np.array(["0", "1", "1+", "2", "3"], object)[grades],
        }
    )
    yield Row(
        what=f"Fleiss' κ of a long table, {n:,} rows of text",
        works={
            "masrel": lambda: fleiss_kappa(code_long(frame)).value,
            "pandas.factorize of its columns": lambda: [
                frame[column].factorize() for column in frame
            ],
        },
    )


def draw(lines: list[Result]) -> None:
    """Draw time against ratings."""
    sized = [line for line in lines if line["what"].startswith(BY_SIZE)]
    with chart("benchmark_time", x="ratings", y="time (s)") as axes:
        for name, of in series(sized, "program").items():
            label = name.replace("masrel", "masrel, three coefficients")
            ratings = [line["ratings"] for line in of]
            seconds = [line["seconds"] for line in of]
            axes.loglog(ratings, seconds, label=label, **LOOKS[name])
        axes.grid(alpha=0.25)


BENCHMARK = Benchmark(rows=rows, draw=draw)
