"""How often tests of a judge reject what is true, and what is not.

``python -m docs.make.judge_levels`` writes ``docs/evidence/judges_levels.csv``.
"""

from bisect import bisect_right
from collections.abc import Iterator, Sequence
from functools import cache
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from docs.make.evidence import write_rows
from masrel.agreement import benjamini_yekutieli
from masrel.judges import PairedTest
from masrel.judges._paired import (
    maximum,
    p_less,
    p_less_of_clusters,
    region_share,
    rejected,
)

Row = dict[str, Any]
Floats = NDArray[np.float64]
Integers = NDArray[np.int64]

COLUMNS = ("what", "n", "test", "bound", "epsilon", "of", "percent")

TESTS: tuple[PairedTest, ...] = ("exact", "score", "t")
SIZES = (
    *(20, 25, 30, 40, 50, 60, 75, 100, 125, 150, 200, 250, 300),
    *(1000, 2500, 3000),
)
BOUNDS = {"0.05": 0.05, "0.00909": 0.05 / 5.5}  # the first of three humans
EPSILONS = (0.1, 0.15, 0.2)
SHARES = (0.1, 0.4)  # of items that differ, as many either way
FAMILIES = [(m, n) for m in (3, 5) for n in (30, 50, 100, 300)]
CLUSTERS = [(20, 5), (50, 4), (100, 3)]  # how many, items of each
ALIKE = (0.1, 0.5)  # correlation of two items of a cluster
SEED, N_STUDIES = 20261130, 20_000
_GRADES, _ACCURACY = 3, 0.97  # of humans, who choose each wrong grade alike often


def worst(largest: Integers, epsilon: float) -> float:
    """Return the share of rejections at the boundary, where that is largest."""
    n = len(largest) - 1
    return maximum(lambda q: region_share(largest, epsilon, q), n, epsilon)


def exact_rows(sizes: Sequence[int]) -> Iterator[Row]:
    """Yield levels, and powers where judge and human are alike."""
    for n, test, (name, bound), epsilon in product(
        sizes, TESTS, BOUNDS.items(), EPSILONS
    ):
        largest = _by_t(n, epsilon, bound)
        if test != "t":
            largest = rejected(n, epsilon, bound, test)
        at = (n, test, name, epsilon)
        yield _row("level", *at, "", worst(largest, epsilon))
        for share, power in zip(
            SHARES, region_share(largest, 0.0, np.array(SHARES) / 2), strict=True
        ):
            yield _row("power", *at, share, power)


def _by_t(n: int, epsilon: float, bound: float) -> Integers:
    """Return, for each c, the largest b that Student's t rejects; -1 for none."""
    counts = [
        bisect_right(
            range(n - c + 1), bound, key=lambda b: p_less(b, c, n, epsilon, "t")
        )
        for c in range(n + 1)
    ]
    return np.array(counts) - 1


def family_rows(n_studies: int, epsilon: float = 0.1) -> Iterator[Row]:
    """Yield how often a judge passes that all humans beat by just epsilon."""
    for m, n in FAMILIES:
        of_judge = brentq(_gap, 0.0, 1.0, (m, epsilon))
        shares, d = _patterns(m, of_judge)
        rng = np.random.default_rng([SEED, m, n])
        counts = rng.multinomial(n, shares, n_studies)  # (n_studies, n_patterns)
        b, c = counts @ (d == 1), counts @ (d == -1)  # (n_studies, m)
        for test in TESTS:
            of_pair = cache(lambda b, c, n=n, t=test: p_less(b, c, n, epsilon, t))
            p = np.vectorize(of_pair)(b, c)
            n_rejected = [
                sum(x <= 0.05 for x in benjamini_yekutieli(row)) for row in p.tolist()
            ]
            is_passed = np.array(n_rejected) >= 0.5 * m
            yield _row("passed", n, test, "0.05", epsilon, m, is_passed.mean())


def _patterns(m: int, of_judge: float) -> tuple[Floats, Integers]:
    """Return how frequent grades of m humans and a judge are, and who is nearer."""
    # -> (n_patterns,), (n_patterns, m); the right grade is 0
    grades = np.array(list(product(range(_GRADES), repeat=m + 1)))
    humans, judge = grades[:, :m], grades[:, m:]
    of_human = (humans[:, :, None] == humans[:, None, :]).sum(axis=2) - 1
    same = humans == judge
    right = np.array([_ACCURACY] * m + [of_judge])
    shares = np.where(grades == 0, right, (1.0 - right) / (_GRADES - 1)).prod(axis=1)
    of_judges = same.sum(axis=1, keepdims=True) - same
    return shares, np.sign(of_human - of_judges)


def _gap(of_judge: float, m: int, epsilon: float) -> float:
    shares, d = _patterns(m, of_judge)
    return float(shares @ d[:, 0]) - epsilon


def cluster_rows(n_studies: int, epsilon: float = 0.1) -> Iterator[Row]:
    """Yield levels with clusters, items of which share an answer or not."""
    for (n_clusters, size), alike in product(CLUSTERS, ALIKE):
        rng = np.random.default_rng([SEED, n_clusters, round(10 * alike)])
        units = np.arange(n_clusters).repeat(size)
        draws = (n_studies, n_clusters, size)
        p = (0.02, 0.86, 0.12)  # of -1, 0 and 1: few differ
        items = rng.choice([-1, 0, 1], draws, p=p)
        shared = rng.choice([-1, 0, 1], (n_studies, n_clusters, 1), p=p)
        d = np.where(rng.random(draws) < alike**0.5, shared, items)
        p_values = [p_less_of_clusters(x.ravel(), units, epsilon) for x in d]
        share = (np.array(p_values) <= 0.05).mean()
        of = f"{n_clusters} × {size}, {alike:g}"
        yield _row(
            "clusters", n_clusters * size, "clusters", "0.05", epsilon, of, share
        )


def _row(*values: Any) -> Row:
    *cell, share = values
    return dict(zip(COLUMNS, (*cell, round(100.0 * float(share), 2)), strict=True))


def main() -> None:
    """Compute and write the rows."""
    rows = [
        *exact_rows(SIZES),
        *family_rows(N_STUDIES),
        *cluster_rows(N_STUDIES),
    ]
    write_rows("judges_levels", rows)


if __name__ == "__main__":
    main()
