"""``masrel report`` from nothing, beside what it was, and a page of a file of ratings.

``python -m docs.make.benchmarks.cold [--before CHECKOUT]`` writes its part of
``docs/evidence/benchmarks.md``; the checkout is one of an earlier commit. Times are
processor seconds of processes, turn by turn.
"""

import argparse
import os
import platform
import shutil
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pandas as pd

import masrel
from docs.make.benchmarks.parts import write_part
from docs.make.benchmarks.reading import COMPILED
from docs.make.benchmarks.verification import processor_s
from tests.benchmarks.many_ratings import many_ratings

ROOT = Path(__file__).parents[3]
TURNS = 3
SIZES = (200, 10, 5)  # raters, models, times each
PAGES = ((1000, 5), (200, 30))  # items, raters


def built(study: Path, place: Path, code: Path) -> float:
    """Processor seconds of a report with nothing kept of the one before."""
    for folder in (study / ".masrel_cache", place):
        shutil.rmtree(folder, ignore_errors=True)
    os.environ["PYTHONPATH"] = str(code)
    command = ("-P", "-m", "masrel", "report", str(study), "-o", str(place), "--quiet")
    return processor_s(sys.executable, *command)


def row(name: str, study: Path, before: Path | None) -> str:
    """A line of the table: one study."""
    trees = [ROOT] if before is None else [ROOT, before]
    place = study.with_name(f"{study.name}-report")
    for tree in trees:  # compiled, as pip leaves what it installs
        built(study, place, tree)
    turns = [[built(study, place, tree) for tree in trees] for _ in range(TURNS)]
    times = [statistics.median(each) for each in zip(*turns, strict=True)]
    cells = [name, f"{times[0]:.2f} s", "–", "–"]
    if before is not None:
        ratios = [one / other for one, other in turns]
        half = (max(ratios) - min(ratios)) / 2
        cells[2:] = f"{times[1]:.2f} s", f"{statistics.median(ratios):.2f} ± {half:.2f}"
    return f"| {' | '.join(cells)} |"


def large_row(folder: Path) -> str:
    """The line of a study of many raters, of which there was no report before."""
    study = folder / "large"
    many_ratings(study, *SIZES)
    place = folder / "large-report"
    built(study, place, ROOT)
    seconds = statistics.median(built(study, place, ROOT) for _ in range(3))
    megabytes = (place / "report.html").stat().st_size / 1e6
    name = "{} raters × {} models × {} times".format(*SIZES)
    return f"| {name}, HTML {megabytes:.1f} MB | {seconds:.2f} s | – | – |"


def at_commit(checkout: Path | None) -> str:
    """Which commit a checkout is at."""
    command = ("git", "-C", str(checkout or ROOT), "rev-parse", "--short", "HEAD")
    return subprocess.run(
        command, check=True, capture_output=True, text=True
    ).stdout.strip()


def page_row(folder: Path, n_items: int, n_raters: int) -> str:
    """A line of the second table: the page of one file of ratings."""
    rng = np.random.default_rng(1)
    usual = rng.integers(0, 5, n_items)
    other = rng.integers(0, 5, (n_raters, n_items))
    agrees = rng.random((n_raters, n_items)) < 0.7
    table = pd.DataFrame(np.where(agrees, usual, other).T)
    ratings = folder / "ratings.csv"
    table.add_prefix("rater ").to_csv(ratings, index_label="item")
    page = folder / "page.html"
    os.environ["PYTHONPATH"] = str(ROOT)
    command = ("-P", "-m", "masrel", "agree", str(ratings), "--target", "both")
    command = (*command, "--html", str(page))
    times = [processor_s(sys.executable, *command) for _ in range(TURNS + 1)][1:]
    cells = f"{statistics.median(times):.2f} s", f"{page.stat().st_size / 1e3:.0f} kB"
    return f"| {n_items:,} items × {n_raters} raters | {' | '.join(cells)} |"


def main() -> None:
    """Make the studies, measure, and write the part."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--before", type=Path, help="checkout of an earlier commit")
    before = parser.parse_args().before
    os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
    os.environ["PYTHONPYCACHEPREFIX"] = str(COMPILED)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        oldest = before or ROOT  # what it makes, both read
        os.environ["PYTHONPATH"] = str(oldest)
        demo = ("-P", "-m", "masrel", "demo", str(folder / "demo"), "--quiet")
        subprocess.run((sys.executable, *demo), check=True, stdout=subprocess.DEVNULL)
        published = folder / "published"
        shutil.copytree(oldest / "studies" / "hess2012", published)
        rows = [
            row("the demo's simulated study", folder / "demo" / "study", before),
            row("the published study", published, before),
            large_row(folder),
        ]
        pages = [page_row(folder, *size) for size in PAGES]
    print("\n".join(rows + pages))
    lines = [
        "## A report from nothing",
        "",
        "`python -m docs.make.benchmarks.cold --before CHECKOUT` repeats this part: "
        "`masrel report STUDY` as a process of its own, imports and all, no cache; "
        f"medians of {TURNS} turns of processor time, ± is half the range of the "
        f"ratios. Before is commit {at_commit(before)}.",
        "",
        f"{platform.machine()}, Python {platform.python_version()}; "
        f"masrel {masrel.__version__}, matplotlib {mpl.__version__}.",
        "",
        "| study | masrel report | before | ratio |",
        "|---|---|---|---|",
        *rows,
        "",
        "A page of a file of ratings, `masrel agree FILE --html PAGE`, medians of "
        f"{TURNS} runs:",
        "",
        "| file | processor time | page |",
        "|---|---|---|",
        *pages,
    ]
    write_part(ROOT / "docs/evidence/benchmarks.md", "cold", lines)


if __name__ == "__main__":
    main()
