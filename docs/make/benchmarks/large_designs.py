"""Large g studies and large tables of spans, in processes of their own.

``python -m docs.make.benchmarks.large_designs`` writes
``docs/evidence/benchmarks_large_designs.csv``: processor seconds and the largest memory
of whole processes, and how far moments are from REML where both can be had.
"""

import csv
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

from docs.make.evidence import write_rows
from masrel.agreement import g_study
from masrel.agreement._effects import moments
from tests.agreement.test_generalizability import sparse_frame

TURNS = 5
G_STUDY = """
from masrel.agreement import g_study
from tests.agreement.test_generalizability import sparse_frame
study = g_study(sparse_frame(36_000, 11_000, 130_000, 0), of="p", facets=["r"])
"""


def write_spans(path: Path) -> None:
    """Write the spans of five annotators in 1 000 documents, some 100 000 of each."""
    rng = np.random.default_rng(0)
    with path.open("w", encoding="utf-8", newline="") as file:
        rows = csv.writer(file)
        rows.writerow(["document", "annotator", "label", "start", "end", "length"])
        for document in range(1000):
            begins = np.sort(rng.choice(600, 105, replace=False)) * 40
            for annotator in range(5):
                moved = begins + rng.integers(0, 5, len(begins))
                ends = moved + rng.integers(5, 30, len(begins))
                kept = rng.random(len(begins)) < 0.95
                for begin, end in zip(moved[kept], ends[kept], strict=True):
                    rows.writerow(
                        [document, f"A{annotator}", "span", begin, end, 24_100]
                    )


def measured(*arguments: str) -> tuple[float, float]:
    """Return processor seconds and MB of a Python process, medians of several."""
    found = []
    for _ in range(TURNS):
        call = [sys.executable, *arguments]
        with subprocess.Popen(call, stdout=subprocess.DEVNULL) as process:
            _, status, usage = os.wait4(process.pid, 0)
            process.returncode = os.waitstatus_to_exitcode(status)
        found.append((usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024.0))
    seconds, size = np.median(found, axis=0)
    return float(seconds), float(size)


def apart() -> float:
    """Return how far moments are from REML, of 14 000 ratings, in %."""
    frame = sparse_frame(2000, 600, 14_000, 0)
    likeliest = g_study(frame, of="p", facets=["r"])
    grade = frame["grade"].to_numpy()
    codes = {frozenset({name}): frame[name].factorize()[0] for name in "pr"}
    cells = {**codes, frozenset("pr"): np.arange(len(grade))}
    parts = moments(grade - grade.mean(), cells)
    return float(100.0 * abs(parts / [*likeliest.components.values()] - 1.0).max())


def main() -> None:
    """Measure, and write the rows."""
    rows: list[dict[str, object]] = []
    with tempfile.TemporaryDirectory() as folder:
        spans = Path(folder, "spans.csv")
        write_spans(spans)
        call = ("-m", "masrel", "spans", str(spans), "--length", "length")
        for what, arguments in (
            ("g study, 36 000 × 11 000, 1.3e5 ratings, moments", ("-c", G_STUDY)),
            ("masrel spans, five annotators, 1e5 spans each", call),
        ):
            seconds, size = measured(*arguments)
            row = {"what": what, "seconds": seconds, "MB": size, "% from REML": ""}
            rows.append(row)
    what = "moments of 2 000 × 600, 14 000 ratings"
    rows.append({"what": what, "seconds": "", "MB": "", "% from REML": apart()})
    write_rows("benchmarks_large_designs", rows)


if __name__ == "__main__":
    main()
