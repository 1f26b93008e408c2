"""Coefficients of measurements, no two of them alike, beside the formulas in numpy.

``python -m docs.make.benchmarks.measurements [--quick]`` writes its part of
``docs/evidence/benchmarks.md``. Times are processor seconds, turn by turn in one run.
"""

import argparse
import tempfile
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from docs.make.benchmarks.reading import Question, measure
from docs.make.evidence import write_tables
from masrel.agreement import fleiss_kappa, gwet_ac, krippendorff_alpha
from masrel.estimates import Estimate
from tests.benchmarks.peers import present
from tests.benchmarks.sidebyside import Timing, one_thread, side_by_side

TURNS = 7
Floats = NDArray[np.float64]
FILE = "measurements.csv"

READ = "import sys, numpy as np, pandas as pd\nx = pd.read_csv(sys.argv[1]).to_numpy()"
QUESTIONS = (
    Question(
        name="Krippendorff's α, interval",
        file=FILE,
        options=("--coefficients", "krippendorff_alpha", "--metric", "interval"),
        rival=f"{READ}\n1.0 - x.var(axis=1, ddof=1).mean() / x.var(ddof=1)",
        rival_name="pandas + numpy, value alone",
    ),
    Question(
        name="Krippendorff's α, ratio",
        file=FILE,
        options=("--coefficients", "krippendorff_alpha", "--metric", "ratio"),
        rival=f"""{READ}
def of_pairs(x):
    return sum((((x - y) / (x + y)) ** 2).sum() for y in x)
n, r = x.shape
1.0 - of_pairs(x.T) / (r - 1) * (n * r - 1) / of_pairs(x.ravel())""",
        rival_name="pandas + numpy, value alone, every pair",
    ),
    Question(
        name="percent agreement and Fleiss' κ, linear, each with its interval",
        file=FILE,
        options=("--weights", "linear", "--target", "items"),
        rival=READ,
        rival_name="pandas read_csv alone",
    ),
)


def mean_distance(x: Floats, ddof: int) -> Any:
    """Mean of |x - y| over all pairs of the last axis: by rank, as Gini's."""
    n = x.shape[-1]
    lower_less_higher = 2.0 * np.arange(n) - (n - 1)
    return np.sort(x, axis=-1) @ lower_less_higher * (2.0 / (n * (n - ddof)))


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


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """A coefficient with its weights or metric, and what gives the same value."""

    name: str
    estimate: Callable[[Floats], Estimate]
    rival: Callable[[Floats], float] | None = None
    rival_name: str = "numpy"

    def line(self, x: Floats, turns: int) -> str:
        """Return the line of a table: a value, it with its error, and the rival's."""
        works: dict[str, Callable[[], float]] = {
            "value": lambda: self.estimate(x).value,
            "error": lambda: self.estimate(x).standard_error,
        }
        rival = ["–"] * 3
        if self.rival is not None:
            works["rival"] = partial(self.rival, x)
        times = side_by_side(works, turns=turns, clock=time.process_time)
        if self.rival is not None:
            value, other = times["value"], times["rival"]
            rival = [
                f"{self.rival_name}: {_seconds(other)}",
                f"{value.median / other.median:.2g} ± "
                f"{100 * np.hypot(value.spread, other.spread):.0f} %",
                f"{abs(works['value']() / works['rival']() - 1.0):.0g}",
            ]
        ours = [f"{len(x):,} × {x.shape[1]}", self.name]
        ours += [_seconds(times["value"]), _seconds(times["error"])]
        shown = f"| {' | '.join([*ours, *rival])} |"
        print(shown, flush=True)
        return shown


def _seconds(timing: Timing) -> str:
    return f"{timing.median:.3g} s ± {100 * timing.spread:.0f} %"


def cases() -> Iterator[Case]:
    """Every coefficient and weighting of measurements, with numpy's formula of it."""
    # Gwet's chance is that of Fleiss where no two ratings are alike.
    for name, function, ddof in (
        ("Krippendorff's α", krippendorff_alpha, 1),
        ("Fleiss' κ", fleiss_kappa, 0),
        ("Gwet's AC", gwet_ac, 0),
    ):
        for weights, rival in (("linear", linear), ("quadratic", quadratic)):
            yield Case(
                name=f"{name}, {weights} weights",
                estimate=partial(function, weights=weights),
                rival=partial(rival, ddof=ddof),
            )
        yield Case(
            name=f"{name}, ratio weights", estimate=partial(function, weights="ratio")
        )
    yield Case(
        name="Krippendorff's α, interval metric",
        estimate=partial(krippendorff_alpha, metric="interval"),
        rival=partial(quadratic, ddof=1),
    )
    yield Case(
        name="Krippendorff's α, ratio metric",
        estimate=partial(krippendorff_alpha, metric="ratio"),
    )


def by_package() -> Iterator[Case]:
    """Alpha of so few measurements that the package has room for them."""
    for metric in ("interval", "ratio"):
        yield Case(
            name=f"Krippendorff's α, {metric} metric",
            estimate=partial(krippendorff_alpha, metric=metric),
            rival=partial(package, metric=metric),
            rival_name="krippendorff",
        )


def coefficients(quick: bool) -> list[str]:
    """Measure every coefficient; ratios need values of one sign, others are centred."""
    n, turns = (10_000, 2) if quick else (1_000_000, TURNS)
    rng = np.random.default_rng(20120831)
    centred = rng.normal(size=(n, 1)) + 0.5 * rng.normal(size=(n, 3))
    positive = np.exp(0.25 * centred)
    lines = [
        case.line(positive if "ratio" in case.name else centred, turns)
        for case in cases()
    ]
    if present(["krippendorff"]):
        lines += [case.line(positive[:200], turns) for case in by_package()]
    return lines


def files(turns: int) -> list[str]:
    """Measure ``masrel agree`` of 20 001 different grades."""
    rng = np.random.default_rng(20120831)
    x = rng.normal(20.0, 5.0, (6_667, 1)) + rng.normal(0.0, 1.0, (6_667, 3))
    with tempfile.TemporaryDirectory() as name:
        file = Path(name) / FILE
        np.savetxt(file, x, "%.17g", ",", header="A,B,C", comments="")
        return [measure(question, file.parent, turns) for question in QUESTIONS]


def main() -> None:
    """Measure, and write the part of the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="small sizes, no page")
    quick = parser.parse_args().quick
    # first, while this process has little memory, which counts for its children
    of_files = files(1 if quick else 5)
    with one_thread():
        of_coefficients = coefficients(quick)
    lines = [
        "| items × raters | coefficient | value | value and error | beside: value "
        "| ratio of these | values differ by |",
        "|---|---|---|---|---|---|---|",
        *of_coefficients,
        "",
        "| what | masrel agree | beside | ratio |",
        "|---|---|---|---|",
        *of_files,
    ]
    if quick:
        print("\n".join(lines))
        return
    write_tables(["measurements", "measured_files"], lines)


if __name__ == "__main__":
    main()
