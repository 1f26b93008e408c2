"""Intervals beside scipy's: ratios of time, and memory.

``python -m docs.make.benchmarks.intervals [--quick]`` writes its part of
``docs/evidence/benchmarks.md``. Times gate nothing.
"""

import argparse
import warnings

from docs.make.benchmarks.interval_page import Results, write_page
from tests.benchmarks.bootstrap import by_items, exact_cost, memory
from tests.benchmarks.sidebyside import one_thread


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
    write_page(results)


if __name__ == "__main__":
    main()
