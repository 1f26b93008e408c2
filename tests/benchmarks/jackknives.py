"""The jackknife of Fleiss' kappa beside two loops over statsmodels.

Part of ``python -m docs.make.benchmarks.intervals``.
"""

import time
from collections.abc import Callable
from functools import partial

import numpy as np

from masrel.intervals import jackknife
from tests.benchmarks.bootstrap import Codes, counted, made
from tests.benchmarks.sidebyside import Timing, side_by_side

OURS = "masrel"
FROM_RATINGS = "from ratings"
FROM_COUNTS = "from counts"


def loop_over_ratings(codes: Codes, every: int = 1) -> list[float]:
    """Leave out an item, count the rest, kappa: what a matrix of ratings takes."""
    from statsmodels.stats.inter_rater import aggregate_raters, fleiss_kappa

    return [
        fleiss_kappa(aggregate_raters(np.delete(codes, item, axis=0))[0])
        for item in range(0, len(codes), every)
    ]


def loop_over_counts(counts: Codes, every: int = 1) -> list[float]:
    """Leave out an item of a table that was counted beforehand, kappa."""
    from statsmodels.stats.inter_rater import fleiss_kappa

    return [
        fleiss_kappa(np.delete(counts, item, axis=0))
        for item in range(0, len(counts), every)
    ]


def jackknives(quick: bool) -> dict[str, dict[str, Timing]]:
    """Seconds of an item jackknife by study and way, turn by turn."""
    found = {}
    for n, r, q in ((16, 8, 4), (100, 5, 4), (1000, 5, 4), (10_000, 5, 4)):
        if quick and n > 100:
            continue
        codes = made(n, r, q)
        counts = counted(codes, q)
        # 10 000 turns of a loop are 10 000 times the same: every fiftieth is taken
        part = 50 if n == 10_000 else 1
        works: dict[str, Callable[[], object]] = {
            OURS: partial(
                jackknife, "fleiss_kappa", codes, target="items", categories=range(q)
            ),
            FROM_RATINGS: partial(loop_over_ratings, codes, part),
            FROM_COUNTS: partial(loop_over_counts, counts, part),
        }
        turns = 5 if quick or n == 10_000 else 15 if n == 1000 else 61
        times = side_by_side(works, turns=turns, clock=time.process_time)
        for way in (FROM_RATINGS, FROM_COUNTS):
            seconds = tuple(s * part for s in times[way].seconds)
            times[way] = Timing(seconds=seconds)
        found[f"{n:,} × {r}"] = times
        ours = times[OURS].median
        print(n, {way: t.median / ours for way, t in times.items()}, flush=True)
    return found
