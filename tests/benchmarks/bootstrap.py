"""Bootstrap intervals beside scipy's: time and memory.

Part of ``python -m docs.make.benchmarks.intervals``.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from masrel.intervals import bootstrap
from tests.benchmarks.sidebyside import Timing, peak_megabytes, side_by_side

Codes = NDArray[np.int64]
Formula = Callable[[NDArray[np.int64]], float]
Coefficient = Literal["fleiss_kappa", "gwet_ac"]

N_RESAMPLES = 10_000
OURS = "masrel"


def made(n: int, r: int, q: int, seed: int = 1) -> Codes:
    """Ratings of items that differ, codes 0 to q - 1."""
    rng = np.random.default_rng(seed)
    shares = rng.dirichlet(np.ones(q), n).cumsum(axis=1)
    return (rng.random((n, r, 1)) > shares[:, None, :-1]).sum(axis=2)


def counted(codes: Codes, q: int) -> NDArray[np.int64]:
    """Raters per item and category."""
    return np.stack([(codes == k).sum(axis=1) for k in range(q)], axis=1)


def fleiss(counts: NDArray[np.int64]) -> float:
    """Fleiss' kappa of (n_items, n_categories), as its textbook has it."""
    r = counts.sum(axis=1)
    observed = ((counts * (counts - 1)).sum(axis=1) / (r * (r - 1))).mean()
    shares = counts.sum(axis=0) / counts.sum()
    chance = (shares**2).sum()
    return float((observed - chance) / (1.0 - chance))


def gwet(counts: NDArray[np.int64]) -> float:
    """Gwet's AC1 of (n_items, n_categories), as its textbook has it."""
    r = counts.sum(axis=1)
    observed = ((counts * (counts - 1)).sum(axis=1) / (r * (r - 1))).mean()
    shares = (counts / r[:, None]).mean(axis=0)
    chance = (shares * (1.0 - shares)).sum() / (counts.shape[1] - 1)
    return float((observed - chance) / (1.0 - chance))


FORMULAS: dict[Coefficient, Formula] = {"fleiss_kappa": fleiss, "gwet_ac": gwet}


@dataclass(frozen=True, slots=True, kw_only=True)
class Comparison:
    """One study: seconds of 10 000 resamples, by package."""

    name: str
    times: dict[str, Timing]
    scale: dict[str, float]

    def seconds(self, name: str) -> float:
        """The median of one package, for 10 000 resamples."""
        return self.times[name].median * self.scale.get(name, 1.0)

    def ratios(self) -> dict[str, tuple[float, float]]:
        """Each peer's time over ours, with its relative spread."""
        spread = self.times[OURS].spread
        return {
            name: (
                self.seconds(name) / self.seconds(OURS),
                float(np.hypot(spread, timing.spread)),
            )
            for name, timing in self.times.items()
            if name != OURS
        }


def scipy_loop(
    counts: Codes, formula: Formula, n_resamples: int, seed: int = 1
) -> tuple[float, ...]:
    """scipy.stats.bootstrap with a Python statistic of the drawn items."""
    from scipy.stats import bootstrap as theirs

    found = theirs(
        (np.arange(len(counts)),),
        lambda items: formula(counts[items]),
        n_resamples=n_resamples,
        vectorized=False,
        method="percentile",
        rng=seed,
    )
    return tuple(found.confidence_interval)


def scipy_vectorized(
    counts: Codes, name: Coefficient, n_resamples: int, seed: int = 1
) -> tuple[float, ...]:
    """scipy.stats.bootstrap with a statistic of many resamples at once."""
    from scipy.stats import bootstrap as theirs

    n, q = counts.shape
    r = int(counts[0].sum())

    def statistic(items: Codes, axis: int = -1) -> NDArray[np.float64]:
        taken = np.moveaxis(counts[items], axis - 1, -2)
        observed = ((taken * taken).sum(axis=(-1, -2)) / n - r) / (r * (r - 1))
        squares = ((taken.sum(axis=-2) / (r * n)) ** 2).sum(axis=-1)
        chance = squares if name == "fleiss_kappa" else (1.0 - squares) / (q - 1)
        return np.asarray((observed - chance) / (1.0 - chance))

    found = theirs(
        (np.arange(n),),
        statistic,
        n_resamples=n_resamples,
        vectorized=True,
        batch=max(1, 2_000_000 // n),
        method="percentile",
        rng=seed,
    )
    return tuple(found.confidence_interval)


def by_items(quick: bool) -> list[Comparison]:
    """10 000 percentile resamples of each coefficient and size, turn by turn."""
    lines = []
    for n, r, q in ((16, 8, 3), (100, 5, 4), (10_000, 5, 4))[: 2 if quick else None]:
        codes = made(n, r, q)
        for name, formula in FORMULAS.items():
            lines.append(_compare(codes, q, name, formula, turns=3 if quick else 9))
            print(lines[-1].name, lines[-1].ratios(), flush=True)
    return lines


def _compare(
    codes: Codes, q: int, name: Coefficient, formula: Formula, turns: int
) -> Comparison:
    counts, n = counted(codes, q), len(codes)
    size = N_RESAMPLES if n < 1000 else N_RESAMPLES // 20
    ours = partial(bootstrap, name, codes, target="items", categories=range(q), rng=1)
    works: dict[str, Callable[[], object]] = {
        OURS: partial(ours, exact=False),
        "scipy, a Python statistic": lambda: scipy_loop(counts, formula, size),
        "scipy, vectorized": lambda: scipy_vectorized(counts, name, size),
    }
    return Comparison(
        name=f"{name}, {n:,} × {codes.shape[1]}",
        times=side_by_side(works, turns=turns, clock=time.process_time),
        scale={peer: N_RESAMPLES / size for peer in works if peer != OURS},
    )


def exact_cost(quick: bool) -> list[tuple[str, str, Timing]]:
    """Study, what is enumerated, and the time of an exact interval."""
    studies: dict[str, tuple[Codes, int, str]] = {
        "4 × 8, 4 categories": (made(4, 8, 4, 2), 4, "items"),
        "8 × 8, 4 categories": (made(8, 8, 4), 4, "items"),
        "8 raters of 16 items": (made(16, 8, 3), 3, "raters"),
        "10 raters of 16 items": (made(16, 10, 3), 3, "raters"),
        "16 × 8, 2 categories": (made(16, 8, 2), 2, "items"),
        "12 × 8, 3 categories": (made(12, 8, 3), 3, "items"),
        "100 × 3, 2 categories": (made(100, 3, 2), 2, "items"),
    }
    found = []
    for study, (codes, q, target) in studies.items():
        work = partial(
            bootstrap,
            "fleiss_kappa",
            codes,
            target=target,  # type: ignore[arg-type]
            categories=range(q),
            exact=True,
        )
        words = work().distribution.words  # type: ignore[union-attr]
        timing = side_by_side(
            {study: work}, turns=3 if quick else 15, clock=time.process_time
        )[study]
        found.append((study, words, timing))
        print(study, words, f"{1e3 * timing.median:.3g} ms", flush=True)
    return found


def memory(quick: bool) -> dict[str, float]:
    """Most megabytes at once above the ratings themselves, by kind of interval."""
    n = 100_000 if quick else 1_000_000
    codes = made(n, 5, 5).astype(np.int8)
    found = {}
    for kind in ("percentile", "bca", "studentized"):
        work = partial(
            bootstrap,
            "fleiss_kappa",
            codes,
            target="items",
            categories=range(5),
            kind=kind,  # type: ignore[arg-type]
            rng=1,
        )
        found[kind] = peak_megabytes(work)
    print(f"{n:,} × 5", found, flush=True)
    return found
