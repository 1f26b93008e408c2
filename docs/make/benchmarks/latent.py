"""What the latent-trait model costs, under one prior.

Ratings are drawn from the model itself; each study is sampled once.
"""

from collections.abc import Iterator
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from docs.make.benchmarks.rows import Benchmark, Row
from masrel.intervals import latent_trait

# items, raters, shares of the grades, how items are taken
STUDIES = {
    "20 × 5": (20, 5, (0.3, 0.4, 0.3), "fixed"),
    "30 × 14": (30, 14, (0.2,) * 5, "fixed"),
    "95 × 22, half positive": (95, 22, (0.5, 0.5), "fixed"),
    "95 × 22, half positive, random items": (95, 22, (0.5, 0.5), "random"),
    "95 × 22, a tenth positive": (95, 22, (0.9, 0.1), "fixed"),
    "95 × 22, one in a hundred positive": (95, 22, (0.99, 0.01), "fixed"),
}


def drawn(n_items: int, n_raters: int, shares: tuple[float, ...]) -> NDArray[np.int64]:
    """Draw ratings of severities, biases and errors of variances .7, .05 and .25."""
    rng = np.random.default_rng(20120831)
    severity = np.sqrt(0.7) * rng.standard_normal((n_items, 1))
    bias = np.sqrt(0.05) * rng.standard_normal(n_raters)
    perceived = severity + bias + 0.5 * rng.standard_normal((n_items, n_raters))
    ends = np.quantile(perceived, np.cumsum(shares)[:-1])
    return np.asarray((perceived[:, :, None] > ends).sum(axis=2))


def rows(quick: bool, _: Path) -> Iterator[Row]:
    """Yield the studies."""
    for what, (n_items, n_raters, shares, items) in STUDIES.items():
        model = partial(
            latent_trait,
            drawn(n_items, n_raters, shares),
            items=items,
            categories=range(len(shares)),
            compare=False,
            rng=0,
        )
        yield Row(
            what=what,
            works={"masrel": model},
            turns=1,
            value=lambda found: found.n_steps,
        )
        if quick:
            return


BENCHMARK = Benchmark(rows=rows, value="steps of a chain")
