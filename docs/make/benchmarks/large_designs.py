"""Large g studies and large tables of spans, in processes of their own."""

import csv
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from docs.make.benchmarks.rows import Benchmark, Row
from masrel.agreement import g_study
from masrel.agreement._effects import moments
from tests.agreement.test_generalizability import sparse_frame

G_STUDY = """
from masrel.agreement import g_study
from tests.agreement.test_generalizability import sparse_frame
study = g_study(sparse_frame(36_000, 11_000, 130_000, 0), of="p", facets=["r"])
"""


def write_spans(path: Path, n_documents: int) -> None:
    """Write the spans of five annotators in documents, some hundred of each."""
    rng = np.random.default_rng(0)
    with path.open("w", encoding="utf-8", newline="") as file:
        rows = csv.writer(file)
        rows.writerow(["document", "annotator", "label", "start", "end", "length"])
        for document in range(n_documents):
            begins = np.sort(rng.choice(600, 105, replace=False)) * 40
            for annotator in range(5):
                moved = begins + rng.integers(0, 5, len(begins))
                ends = moved + rng.integers(5, 30, len(begins))
                kept = rng.random(len(begins)) < 0.95
                for begin, end in zip(moved[kept], ends[kept], strict=True):
                    rows.writerow(
                        [document, f"A{annotator}", "span", begin, end, 24_100]
                    )


def from_reml() -> float:
    """Return how far moments are from REML, of 14 000 ratings, in %."""
    frame = sparse_frame(2000, 600, 14_000, 0)
    likeliest = g_study(frame, of="p", facets=["r"])
    grade = frame["grade"].to_numpy()
    codes = {frozenset({name}): frame[name].factorize()[0] for name in "pr"}
    cells = {**codes, frozenset("pr"): np.arange(len(grade))}
    parts = moments(grade - grade.mean(), cells)
    return float(100.0 * abs(parts / [*likeliest.components.values()] - 1.0).max())


def rows(quick: bool, folder: Path) -> Iterator[Row]:
    """Yield what is large, and how far moments are from REML where both can be had."""
    yield Row(
        what="g study, 36 000 × 11 000, 1.3e5 ratings, moments",
        works={"masrel": [sys.executable, "-c", G_STUDY]},
        turns=5,
    )
    spans = folder / "spans.csv"
    write_spans(spans, 20 if quick else 1000)
    options = ["--length", "length"]
    yield Row(
        what="masrel spans, five annotators, 1e5 spans each",
        works={
            "masrel": [sys.executable, "-m", "masrel", "spans", str(spans), *options]
        },
        turns=5,
    )
    yield Row(
        what="moments and REML of 2 000 × 600, 14 000 ratings",
        works={"masrel": from_reml},
        turns=1,
        value=float,
    )


BENCHMARK = Benchmark(rows=rows, value="% from REML")
