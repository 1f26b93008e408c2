"""Intervals beside scipy's: ratios of time, and memory.

``python -m docs.make.benchmarks.intervals [--quick]`` writes its part of
``docs/evidence/benchmarks.md``. Times gate nothing.
"""

import argparse
import platform
import warnings
from pathlib import Path

import masrel
from docs.make.benchmarks.interval_page import Results, write_page
from tests.benchmarks.bootstrap import by_items, exact_cost, memory
from tests.benchmarks.peers import present
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
            comparisons=by_items(quick),
            exact=exact_cost(quick),
            megabytes=memory(quick),
        )
    if quick:
        return
    packages = ["numpy", "scipy"]
    machine = f"{platform.machine()}, Python {platform.python_version()}"
    versions = {"masrel": masrel.__version__, **present(packages)}
    write_page(DOCS / "evidence/benchmarks.md", results, versions, machine)


if __name__ == "__main__":
    main()
