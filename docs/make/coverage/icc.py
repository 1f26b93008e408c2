"""How often the intervals of ICC(A,1) of complete tables hold it, by F and by profile.

``python -m docs.make.coverage.icc`` prints the table of
``docs/reference/coefficients/icc.md``.
"""

import argparse
from itertools import product

import numpy as np

from docs.make.coverage.study import _counted, monte_carlo_error
from masrel.agreement import icc

SIZES = ((20, 3), (50, 3), (50, 5), (100, 10), (30, 2))  # items, raters
RATERS = (0.05, 0.5, 2.0)  # variances; that of items is 1
RESIDUAL, SEED, N_STUDIES = 0.2, 7, 1_000
HEAD = (
    "| items × raters | variance of raters | F: covers % | profile: covers % "
    "| F: width | profile: width |\n|---|---|---|---|---|---|"
)


def main() -> None:
    """Print a row per size and variance of raters."""
    parser = argparse.ArgumentParser(description="Coverage of ICC(A,1).")
    parser.add_argument("--studies", type=int, default=N_STUDIES, help="of a row")
    n_studies = parser.parse_args().studies
    print(HEAD)
    for (n, k), raters in product(SIZES, RATERS):
        ends = ends_of(n, k, raters, n_studies)
        by_f, by_profile = (
            _counted(of, 1.0 / (1.0 + raters + RESIDUAL), np.ones(n_studies))
            for of in np.moveaxis(ends, 1, 0)
        )
        covers = (
            f"{100 * of['coverage']:.1f} ± "
            f"{100 * monte_carlo_error(of['coverage'], n_studies):.1f}"
            for of in (by_f, by_profile)
        )
        errors = (ends[..., 1] - ends[..., 0]).std(axis=0) / np.sqrt(n_studies)
        widths = (
            f"{of['width']:.3f} ± {error:.3f}"
            for of, error in zip((by_f, by_profile), errors, strict=True)
        )
        print("|", " | ".join([f"{n} × {k}", f"{raters:g}", *covers, *widths]), "|")


def ends_of(n: int, k: int, raters: float, n_studies: int) -> np.ndarray:
    """Return low, high and 0 of studies, by F and by profile, (n_studies, 2, 3)."""
    rng, ends = np.random.default_rng([SEED, n, k]), []
    for _ in range(n_studies):
        ratings = rng.normal(size=(n, 1)) + raters**0.5 * rng.normal(size=k)
        ratings += RESIDUAL**0.5 * rng.normal(size=(n, k))
        of_study = [icc(ratings, interval=of).interval for of in ("F", "auto")]
        ends.append([(of.low, of.high, 0.0) for of in of_study])
    return np.array(ends)


if __name__ == "__main__":
    main()
