"""``python -m docs.make.benchmarks NAME [--quick]`` repeats a benchmark.

It writes ``docs/evidence/benchmarks_NAME.csv``, a line per row and program, and draws
the figures of that benchmark. Times are of processors and gate nothing; ratios are of
one run, turn by turn.
"""

import argparse
import tempfile
import warnings
from pathlib import Path

from docs.make import evidence
from docs.make.benchmarks import (
    estimates,
    intervals,
    joint,
    large_designs,
    large_text,
    latent,
    measurements,
    plans,
    reading,
    streams,
)
from docs.make.benchmarks.rows import measured
from tests.benchmarks.sidebyside import one_thread

BENCHMARKS = {
    "estimates": estimates.BENCHMARK,
    "intervals": intervals.BENCHMARK,
    "reading": reading.BENCHMARK,
    "large_text": large_text.BENCHMARK,
    "streams": streams.BENCHMARK,
    "measurements": measurements.BENCHMARK,
    "large_designs": large_designs.BENCHMARK,
    "plans": plans.BENCHMARK,
    "joint": joint.BENCHMARK,
    "latent": latent.BENCHMARK,
}


def main() -> None:
    """Measure, and write what was measured."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("name", choices=BENCHMARKS)
    parser.add_argument("--quick", action="store_true", help="once, small, not written")
    options = parser.parse_args()
    benchmark, lines = BENCHMARKS[options.name], []
    with (
        tempfile.TemporaryDirectory() as folder,
        warnings.catch_warnings(),
        one_thread(),
    ):
        warnings.simplefilter("ignore")
        for line in measured(benchmark, Path(folder), quick=options.quick):
            shown = [evidence.cell(x) for x in line.values() if x is not None]
            print(*shown, sep=" | ", flush=True)
            lines.append(line)
    if not options.quick:
        evidence.write_rows(f"benchmarks_{options.name}", lines)
        if benchmark.draw is not None:
            benchmark.draw(lines)


if __name__ == "__main__":
    main()
