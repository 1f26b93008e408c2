"""masrel and other packages beside exact fractions: how far is each number off?

``python -m docs.make.accuracy [--quiet]`` runs the cases of ``tests/accuracy``, which
takes some minutes, and writes ``accuracy.csv`` and a part of ``accuracy.md``, in
``docs/evidence``. Packages that are not installed are left out.
"""

import argparse
import platform
from collections.abc import Iterator

from tqdm import tqdm

import masrel
from docs.make.accuracy.numbers import Number, compared
from docs.make.accuracy.page import rows, summary
from docs.make.accuracy.peers import PACKAGES
from docs.make.evidence import EVIDENCE, write_part, write_rows
from tests.accuracy.cases import CASES, METRICS, Case
from tests.benchmarks.peers import present


def parts(case: Case) -> Iterator[tuple[Case, str, str]]:
    """Pair a case with its coefficients and weights."""
    for weights in case.weights:
        for coefficient in case.coefficients:
            if weights not in METRICS or coefficient == "krippendorff_alpha":
                yield case, coefficient, weights


def main() -> None:
    """Run every case and write the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quiet", action="store_true", help="show no progress")
    quiet = parser.parse_args().quiet
    if not (packages := present(list(PACKAGES))):
        parser.error(f"needs one to compare with: {', '.join(PACKAGES)}")
    work = [part for case in CASES for part in parts(case)]
    numbers: list[Number] = []
    for part in tqdm(work, desc="accuracy", unit=" coefficients", disable=quiet):
        numbers += compared(*part, list(packages))
    versions = {"masrel": masrel.__version__, **packages}
    versions |= present(["numpy", "scipy", "pandas", "mpmath"])
    versions["Python"] = platform.python_version()
    write_rows("accuracy", list(rows(numbers)))
    write_part(EVIDENCE / "accuracy.md", "numbers", summary(numbers, versions))


if __name__ == "__main__":
    main()
