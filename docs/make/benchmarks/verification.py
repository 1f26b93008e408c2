"""``masrel verify`` of a large study, beside ``sha256sum`` of the same files.

``python -m docs.make.benchmarks.verification [--quick]`` writes its part of
``docs/evidence/benchmarks.md``. Times are processor seconds of processes, turn by turn.
"""

import argparse
import platform
import resource
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

import masrel
from docs.make.benchmarks.parts import write_part
from tests.benchmarks.large_study import large_study

DOCS = Path(__file__).parents[2]
TURNS = 5


def processor_s(*command: str) -> float:
    """Processor seconds of a process and those that it starts."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def row(n_presentations: int) -> str:
    """A line of the table: one size of study."""
    with tempfile.TemporaryDirectory() as folder:
        study = large_study(Path(folder) / "study", n_presentations)
        files = [path for path in study.root.rglob("*") if path.is_file()]
        mb = sum(path.stat().st_size for path in files) / 1e6
        verify = (sys.executable, "-m", "masrel", "verify", str(study.root))
        hashes = ("find", str(study.root), "-type", "f")
        hashes = (*hashes, "-exec", "sha256sum", "{}", "+")
        seconds = [(processor_s(*verify), processor_s(*hashes)) for _ in range(TURNS)]
    ours, theirs = (statistics.median(each) for each in zip(*seconds, strict=True))
    ratios = [one / other for one, other in seconds]
    half = (max(ratios) - min(ratios)) / 2
    cells = (
        f"{n_presentations:,}",
        f"{len(files):,}, {mb:,.0f} MB",
        f"{ours:.2f} s",
        f"{theirs:.2f} s",
        f"{statistics.median(ratios):.2g} ± {half:.1g}",
    )
    return f"| {' | '.join(cells)} |"


def main() -> None:
    """Make the studies, measure, and write the part."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="small sizes, no page")
    quick = parser.parse_args().quick
    rows = [row(n) for n in ((160,) if quick else (160, 10_000))]
    print("\n".join(rows))
    if quick:
        return
    lines = [
        "## Verifying a study",
        "",
        "`python -m docs.make.benchmarks.verification` repeats this part: `masrel "
        "verify STUDY` as a process of its own, imports and all, beside `sha256sum` "
        "of every file of the study, in turn; medians of 5 turns of processor time, ± "
        "is half the range of the ratios. The study has four models, each four times "
        "a rater, its schedules, logs, recordings and `ratings.csv`; recordings are "
        "those of the simulated device. verify reads all of it once for the hashes, "
        "and replays every log.",
        "",
        f"{platform.machine()}, Python {platform.python_version()}; "
        f"masrel {masrel.__version__}.",
        "",
        "| presentations | files | masrel verify | sha256sum | ratio |",
        "|---|---|---|---|---|",
        *rows,
    ]
    write_part(DOCS / "evidence/benchmarks.md", "verification", lines)


if __name__ == "__main__":
    main()
