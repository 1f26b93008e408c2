"""Intervals beside other packages: work against error, ratios of time, memory.

``python -m docs.make.benchmarks.intervals [--quick]`` writes its part of
``docs/benchmarks.md`` and its figures. Times gate nothing.
"""

import argparse
import platform
import warnings
from pathlib import Path

import masrel
from docs.make.benchmarks.interval_page import Results, write_page
from tests.benchmarks.bootstrap import by_items, exact_cost, memory, races
from tests.benchmarks.jackknives import jackknives
from tests.benchmarks.peers import present
from tests.benchmarks.posteriors import posteriors
from tests.benchmarks.sidebyside import one_thread

DOCS = Path(__file__).parents[2]


def main() -> None:
    """Run everything and write the part."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="small sizes, no page")
    quick = parser.parse_args().quick
    with warnings.catch_warnings(), one_thread():
        warnings.simplefilter("ignore")
        results = Results(
            jackknives=jackknives(quick),
            comparisons=by_items(quick),
            exact=exact_cost(quick),
            posteriors=posteriors(quick),
            megabytes=memory(quick),
        )
        of_bootstrap = races(quick)
    if quick:
        return
    from docs.make.benchmarks.interval_figures import draw_races

    figures = DOCS / "figures"
    draw_races(of_bootstrap, figures / "benchmark_bootstrap.png")
    of_posterior = [one.race for one in results.posteriors]
    draw_races(of_posterior, figures / "benchmark_posterior.png")
    packages = ["numpy", "scipy", "arch", "resample", "statsmodels", "emcee"]
    machine = f"{platform.machine()}, Python {platform.python_version()}"
    versions = {"masrel": masrel.__version__, **present(packages)}
    write_page(DOCS / "benchmarks.md", results, versions, machine)


if __name__ == "__main__":
    main()
