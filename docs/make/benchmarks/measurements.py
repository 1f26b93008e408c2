"""Coefficients of measurements, no two of them alike, beside the formulas in numpy."""

from collections.abc import Callable, Iterator, Mapping
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from docs.make.benchmarks.reading import ONLY_READ
from docs.make.benchmarks.rows import Benchmark, Row, agree, python
from masrel.agreement import fleiss_kappa, gwet_ac, krippendorff_alpha
from masrel.estimates import Estimate
from tests.benchmarks.peers import present

Floats = NDArray[np.float64]

READ = "import sys, numpy as np, pandas as pd\nx = pd.read_csv(sys.argv[1]).to_numpy()"
# of 20 001 different grades in a file
QUESTIONS = (
    (
        "Krippendorff's α, interval, of a file",
        ("--coefficients", "krippendorff_alpha", "--metric", "interval"),
        {
            "pandas + numpy, value alone": f"{READ}\n"
            "1.0 - x.var(axis=1, ddof=1).mean() / x.var(ddof=1)"
        },
    ),
    (
        "percent agreement and Fleiss' κ, linear, each with its interval, of a file",
        ("--weights", "linear", "--target", "items"),
        ONLY_READ,
    ),
)


def mean_distance(x: Floats, ddof: int) -> Floats:
    """Mean of |x - y| over all pairs of the last axis: by rank, as Gini's."""
    n = x.shape[-1]
    lower_less_higher = 2.0 * np.arange(n) - (n - 1)
    return np.asarray(
        np.sort(x, axis=-1) @ lower_less_higher * (2.0 / (n * (n - ddof)))
    )


def linear(x: Floats, ddof: int) -> float:
    """1 - D_o / D_e of |x - y|; ddof is 1 where chance draws without replacement."""
    return float(1.0 - mean_distance(x, 1).mean() / mean_distance(x.ravel(), ddof))


def quadratic(x: Floats, ddof: int) -> float:
    """The same of (x - y)², which is twice a variance."""
    return float(1.0 - x.var(axis=1, ddof=1).mean() / x.var(ddof=ddof))


def package(x: Floats, metric: str) -> float:
    """Krippendorff's alpha by the package of that name."""
    import krippendorff

    return float(krippendorff.alpha(x.T, level_of_measurement=metric))


def compared(
    what: str,
    x: Floats,
    estimate: Callable[[Floats], Estimate],
    rivals: Mapping[str, Callable[[Floats], float]],
) -> Row:
    """A value, it with its error, and how far they are from that of a rival."""

    def value() -> float:
        return estimate(x).value

    def with_error() -> float:
        found = estimate(x)
        _ = found.standard_error
        return found.value

    def apart(found: float) -> float:
        (rival,) = rivals.values()
        return abs(found / rival(x) - 1.0)

    return Row(
        what=f"{what}, {len(x):,} × {x.shape[1]}",
        works={
            "masrel": value,
            "masrel, with its error": with_error,
            **{name: partial(rival, x) for name, rival in rivals.items()},
        },
        value=apart if rivals else None,
    )


def coefficients(n: int) -> Iterator[Row]:
    """Every coefficient whose weights need no matrix, and few enough for a package."""
    rng = np.random.default_rng(20120831)
    x = rng.normal(size=(n, 1)) + 0.5 * rng.normal(size=(n, 3))
    # Gwet's chance is that of Fleiss where no two ratings are alike.
    for name, function, ddof in (
        ("Krippendorff's α", krippendorff_alpha, 1),
        ("Fleiss' κ", fleiss_kappa, 0),
        ("Gwet's AC", gwet_ac, 0),
    ):
        for weights, formula in (("linear", linear), ("quadratic", quadratic)):
            rivals = {"numpy": partial(formula, ddof=ddof)}
            estimate = partial(function, weights=weights)
            yield compared(f"{name}, {weights} weights", x, estimate, rivals)
    few = np.exp(0.25 * x[:200])  # ratios need values of one sign
    for metric in ("interval", "ratio"):
        estimate = partial(krippendorff_alpha, metric=metric)
        rivals = {
            name: partial(package, metric=metric) for name in present(["krippendorff"])
        }
        yield compared(f"Krippendorff's α, {metric} metric", few, estimate, rivals)


def files(folder: Path) -> Iterator[Row]:
    """``masrel agree`` of 20 001 different grades."""
    rng = np.random.default_rng(20120831)
    x = rng.normal(20.0, 5.0, (6_667, 1)) + rng.normal(0.0, 1.0, (6_667, 3))
    file = folder / "measurements.csv"
    np.savetxt(file, x, "%.17g", ",", header="A,B,C", comments="")
    for what, options, rivals in QUESTIONS:
        theirs = {rival: python(program, file) for rival, program in rivals.items()}
        yield Row(
            what=what, works={"masrel": agree(file, "--no-item", *options), **theirs}
        )


def rows(quick: bool, folder: Path) -> Iterator[Row]:
    """Yield coefficients of arrays, and of a file."""
    yield from coefficients(10_000 if quick else 1_000_000)
    yield from files(folder)


BENCHMARK = Benchmark(rows=rows, value="from theirs")
