"""Agreement coefficients beside other packages: time, memory, error.

``python -m docs.make.benchmarks.agreement [--quick]`` writes
``docs/evidence/benchmarks.md`` and its figures. Times gate nothing; ratios are of one
run, turn by turn.
"""

import argparse
import warnings
from dataclasses import dataclass
from fractions import Fraction
from functools import partial

import numpy as np
import pandas as pd

from masrel.agreement import (
    code_long,
    cohen_kappa,
    count_ratings,
    fleiss_kappa,
    gwet_ac,
    krippendorff_alpha,
)
from tests.benchmarks.peers import PEERS, Codes, made, present, sklearn_cohen
from tests.benchmarks.sidebyside import Timing, peak_megabytes, side_by_side

SIZES = ((4, 8), (100, 5), (10_000, 5), (1_000_000, 5), (10_000_000, 3))
WITH_ERRORS = "masrel, with errors"
THREE = (fleiss_kappa, gwet_ac, krippendorff_alpha)
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


@dataclass(frozen=True, slots=True, kw_only=True)
class Line:
    """One comparison: ours and each peer's time."""

    name: str
    times: dict[str, Timing]

    @property
    def best(self) -> str:
        """The fastest peer."""
        peers = [name for name in self.times if not name.startswith("masrel")]
        return min(peers, key=lambda name: self.times[name].median)

    @property
    def ratio(self) -> tuple[float, float]:
        """Our time over the best peer's, with its relative spread."""
        ours, other = self.times["masrel"], self.times[self.best]
        return ours.median / other.median, float(np.hypot(ours.spread, other.spread))


def by_size(quick: bool) -> list[Line]:
    """Three coefficients, against single ones of each peer."""
    rng = np.random.default_rng(1)
    lines = []
    for n, r in SIZES[: 3 if quick else None]:
        codes: Codes = made(rng, n, r)
        works = {
            "masrel": lambda codes=codes: three(codes),
            WITH_ERRORS: lambda codes=codes: three_with_errors(codes),
        }
        for name in present(list(PEERS)):
            # The slow ones take half a minute at 10 million items and gigabytes.
            if n < 10_000_000 or name == "statsmodels":
                works[name] = lambda codes=codes, name=name: PEERS[name](codes)  # type: ignore[misc]
        turns = 15 if n <= 10_000 else 5 if n <= 1_000_000 else 2
        lines.append(Line(name=f"{n:,} × {r}", times=side_by_side(works, turns=turns)))
        print(lines[-1].name, lines[-1].best, lines[-1].ratio, flush=True)
    return lines


def others(quick: bool) -> list[Line]:
    """Labels of the published study; Cohen's pairs; a long table of text."""
    from statsmodels.stats.inter_rater import aggregate_raters
    from statsmodels.stats.inter_rater import fleiss_kappa as theirs

    lines = [
        Line(
            name=f"4 × 8 labels, three coefficients{what}",
            times=side_by_side(
                {
                    "masrel": partial(function, TABLE_V),
                    "statsmodels, one without error": lambda: theirs(
                        aggregate_raters(np.asarray(TABLE_V))[0]
                    ),
                },
                turns=25,
            ),
        )
        for what, function in (("", three), (" with errors", three_with_errors))
    ]
    n = 10_000 if quick else 1_000_000
    rng = np.random.default_rng(2)
    small = made(rng, n, 5).astype(np.int8)
    works = {
        "masrel": lambda: three(small),
        "numpy.bincount of each of its columns": lambda: [
            np.bincount(column) for column in small.T
        ],
    }
    name = f"{n:,} × 5 int8, three coefficients"
    lines.append(Line(name=name, times=side_by_side(works, turns=15)))
    pairs: Codes = made(rng, n, 2)
    works = {"masrel": lambda: cohen_kappa(pairs).value}
    if present(["scikit-learn"]):
        works["scikit-learn"] = lambda: sklearn_cohen(pairs)
        lines.append(
            Line(name=f"Cohen's κ, {n:,} pairs", times=side_by_side(works, turns=7))
        )
    names = [f"patient {i}" for i in range(n // 5)]
    frame = pd.DataFrame(
        {
            "item": np.repeat(np.array(names, dtype=object), 5),
            "rater": np.tile(
                np.array([f"rater {j}" for j in range(5)], object), n // 5
            ),
            "grade": np.array(["0", "1", "1+", "2", "3"], object)[
                made(rng, n // 5, 5).ravel() - 1
            ],
        }
    )
    lines.append(
        Line(
            name=f"Fleiss' κ from a long table, {n:,} rows of text",
            times=side_by_side(
                {
                    "masrel": lambda: fleiss_kappa(code_long(frame)).value,
                    "pandas.factorize of its columns": lambda: [
                        frame[column].factorize() for column in frame
                    ],
                },
                turns=7,
            ),
        )
    )
    for line in lines:
        print(line.name, line.best, line.ratio, flush=True)
    return lines


def memory(quick: bool) -> dict[str, float]:
    """Most megabytes at once, beside the input itself."""
    n = 100_000 if quick else 10_000_000
    codes: Codes = made(np.random.default_rng(3), n, 3)
    megabytes = {"masrel": peak_megabytes(lambda: three_with_errors(codes))}
    megabytes["statsmodels"] = peak_megabytes(lambda: PEERS["statsmodels"](codes))
    print(megabytes, flush=True)
    return megabytes


def exact_fleiss(codes: Codes) -> Fraction:
    """Fleiss' kappa in fractions, by the textbook formula."""
    counts = np.stack([(codes == k).sum(axis=1) for k in range(1, 6)], axis=1)
    n, r = codes.shape
    agreeing = int((counts * (counts - 1)).sum())
    observed = Fraction(agreeing, n * r * (r - 1))
    chance = sum(
        (Fraction(int(total), n * r) ** 2 for total in counts.sum(axis=0)), Fraction(0)
    )
    return (observed - chance) / (1 - chance)


def errors(quick: bool) -> list[tuple[str, int, float, float]]:
    """Package, items, seconds and error on ratings nearly all in one category."""
    rng = np.random.default_rng(4)
    points = []
    for n in (
        (100, 1_000, 10_000) if quick else (100, 1_000, 10_000, 100_000, 1_000_000)
    ):
        codes: Codes = np.ones((n, 5), dtype=np.int64)
        rare = rng.integers(0, n, 5)
        codes[rare] = made(rng, 5, 5)
        exact = exact_fleiss(codes)
        works = {"masrel": lambda codes=codes: fleiss_kappa(codes).value}
        for name in present(["statsmodels", "irrCAC"]):
            works[name] = lambda codes=codes, name=name: PEERS[name](codes)  # type: ignore[misc]
        times = side_by_side(works, turns=3)
        for name, work in works.items():
            off = abs(Fraction(work()) - exact)
            points.append((name, n, times[name].median, float(off)))
    return points


def main() -> None:
    """Run everything and write the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="small sizes, no page")
    quick = parser.parse_args().quick
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        lines, more = by_size(quick), others(quick)
        megabytes, points = memory(quick), errors(quick)
    if quick:
        return
    from docs.make.benchmarks.page import draw_errors, draw_times, write_page
    from docs.make.evidence import FIGURES

    draw_times(lines, FIGURES / "benchmark_time.png")
    draw_errors(points, FIGURES / "benchmark_error.png")
    write_page(lines, more, megabytes)


if __name__ == "__main__":
    main()
