"""What the latent-trait model costs.

``python -m docs.make.benchmarks.latent`` writes its part of
``docs/evidence/latent_trait.md``. Ratings are drawn from the model itself; each study
is sampled once, under one prior.
"""

import time
import warnings
from dataclasses import dataclass
from typing import Literal

import numpy as np

from docs.make.evidence import EVIDENCE, write_part
from masrel.intervals import latent_trait


@dataclass(frozen=True, slots=True, kw_only=True)
class Study:
    """How ratings are drawn, and what is said of them."""

    n_items: int
    n_raters: int
    shares: tuple[float, ...]  # of the grades
    items: Literal["fixed", "random"] = "fixed"
    remark: str = ""

    def ratings(self) -> np.ndarray:
        """Draw severities, biases and errors of variances .7, .05 and .25."""
        rng = np.random.default_rng(20120831)
        shape = (self.n_items, self.n_raters)
        severity = np.sqrt(0.7) * rng.standard_normal((self.n_items, 1))
        bias = np.sqrt(0.05) * rng.standard_normal(self.n_raters)
        perceived = severity + bias + 0.5 * rng.standard_normal(shape)
        ends = np.quantile(perceived, np.cumsum(self.shares)[:-1])
        return np.asarray((perceived[:, :, None] > ends).sum(axis=2))


STUDIES = (
    Study(n_items=20, n_raters=5, shares=(0.3, 0.4, 0.3)),
    Study(n_items=30, n_raters=14, shares=(0.2,) * 5),
    Study(n_items=95, n_raters=22, shares=(0.5, 0.5), remark=", half positive"),
    Study(
        n_items=95,
        n_raters=22,
        shares=(0.5, 0.5),
        items="random",
        remark=", half positive",
    ),
    Study(n_items=95, n_raters=22, shares=(0.9, 0.1), remark=", a tenth positive"),
    Study(
        n_items=95,
        n_raters=22,
        shares=(0.99, 0.01),
        remark=", one in a hundred positive",
    ),
)


def measure(study: Study) -> str:
    """Return the line of a table."""
    ratings, n_grades = study.ratings(), len(study.shares)
    began = time.process_time(), time.perf_counter()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        model = latent_trait(
            ratings, items=study.items, categories=range(n_grades), compare=False, rng=0
        )
    processor, wall = time.process_time() - began[0], time.perf_counter() - began[1]
    line = (
        f"| {study.n_items} × {study.n_raters}{study.remark} | {n_grades} | "
        f"{study.items} | {model.n_steps} | {processor:.0f} | {wall:.0f} |"
    )
    print(line, flush=True)
    return line


def main() -> None:
    """Measure, and write the part of the page."""
    lines = [
        "`python -m docs.make.benchmarks.latent`, under one prior, in seconds:",
        "",
        "| items × raters | grades | items | steps of a chain | processor | by the "
        "clock |",
        "|---|---|---|---|---|---|",
        *map(measure, STUDIES),
    ]
    write_part(EVIDENCE / "latent_trait.md", "costs", "\n".join(lines))


if __name__ == "__main__":
    main()
