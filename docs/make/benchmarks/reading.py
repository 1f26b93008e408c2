"""``masrel agree FILE`` beside what an analyst would write with pandas and a peer.

``python -m docs.make.benchmarks.reading [--quick]`` writes its part of
``docs/evidence/benchmarks.md``. Every run is a process of its own: imports, reading,
estimates. Memory of this process counts for its children: what writes is loaded late.
"""

import argparse
import os
import statistics
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from docs.make.evidence import write_tables

TURNS = 5
COMPILED = Path(tempfile.gettempdir()) / "masrel_compiled"

CROSSTAB = """
import sys, pandas as pd
d = pd.read_csv(sys.argv[1])
pd.crosstab(d["item"], d["grade"])
"""
ALPHA = """
import sys, pandas as pd, krippendorff
d = pd.read_csv(sys.argv[1], index_col=0)
krippendorff.alpha(d.to_numpy().T, level_of_measurement="nominal")
"""
READ = """
import sys, pandas as pd
pd.read_csv(sys.argv[1])
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class Question:
    """A file, our options, and what stands beside."""

    name: str
    file: str
    options: tuple[str, ...]
    rival: str  # a program
    rival_name: str


QUESTIONS = (
    Question(
        name="100 000 × 5, one row an item, α",
        file="wide.csv",
        options=("--coefficients", "krippendorff_alpha"),
        rival=ALPHA,
        rival_name="pandas + krippendorff, nominal α",
    ),
    Question(
        name="60 000 rows, 20 000 items, 10 000 workers",
        file="crowd.csv",
        options=(),
        rival=CROSSTAB,
        rival_name="pandas read_csv + crosstab",
    ),
    Question(
        name="60 000 × 2 measurements, ICC(A,1)",
        file="icc.csv",
        options=("--coefficients", "icc_a1"),
        rival=READ,
        rival_name="pandas read_csv alone",
    ),
    Question(
        name="10 × 100 000 columns",
        file="columns.csv",
        options=(),
        rival=READ,
        rival_name="pandas read_csv alone",
    ),
    Question(
        name="600 × 1 523 columns of a survey, two of them raters",
        file="survey.csv",
        options=("--item", "id", "--raters", "tone_A,tone_B"),
        rival=READ,
        rival_name="pandas read_csv alone",
    ),
)


def write_files(folder: Path, scale: int) -> None:
    """Write the files that are read, their sizes divided by `scale`."""
    import numpy as np
    import pandas as pd

    rng = np.random.default_rng(20120831)
    wide = rng.integers(0, 5, (100_000 // scale, 5))
    frame = pd.DataFrame(wide, columns=list("ABCDE")).rename_axis("item")
    frame.to_csv(folder / "wide.csv")
    m = 60_000 // scale
    crowd = pd.DataFrame(
        {
            "item": rng.integers(0, m // 3, m),
            "rater": rng.integers(0, m // 6, m),
            "grade": rng.integers(0, 5, m),
        }
    ).drop_duplicates(["item", "rater"])
    crowd.to_csv(folder / "crowd.csv", index=False)
    values = rng.normal(20, 5, (m, 1)) + rng.normal(0, 1, (m, 2))
    frame = pd.DataFrame(values.round(3), columns=["A", "B"]).rename_axis("item")
    frame.to_csv(folder / "icc.csv")
    columns = [f"r{k}" for k in range(100_000 // scale)]
    frame = pd.DataFrame(rng.integers(0, 4, (10, len(columns))), columns=columns)
    frame.rename_axis("item").to_csv(folder / "columns.csv")
    n = 600 // scale
    answers = rng.integers(0, 10**9, (n, 1_520)).astype(str).tolist()
    grades = rng.integers(0, 4, (n, 2)).tolist()
    names = ["id", *["Comment"] * 1_520, "tone_A", "tone_B"]
    rows = [
        [k, *(f"answer {text}" for text in texts), *of]
        for k, (texts, of) in enumerate(zip(answers, grades, strict=True))
    ]
    pd.DataFrame(rows, columns=names).to_csv(folder / "survey.csv", index=False)


def run(command: Sequence[str]) -> tuple[float, float]:
    """Return the processor time of a process in s, and its largest memory in MB."""
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1"}
    # compiled, as pip leaves what it installs
    environment.pop("PYTHONDONTWRITEBYTECODE", None)
    environment["PYTHONPYCACHEPREFIX"] = str(COMPILED)
    with tempfile.TemporaryFile() as errors:
        process = subprocess.Popen(
            command, stdout=subprocess.DEVNULL, stderr=errors, env=environment
        )
        _, status, usage = os.wait4(process.pid, 0)
        if status:
            errors.seek(0)
            raise SystemExit(f"{' '.join(command[-3:])}: {errors.read().decode()}")
    return usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1e3


def measure(question: Question, folder: Path, turns: int) -> str:
    """Return the line of a table: ours, the rival's, in turn."""
    file = str(folder / question.file)
    ours = [sys.executable, "-m", "masrel", "agree", file, *question.options]
    theirs = [sys.executable, "-c", question.rival, file]
    run(ours)  # compiles
    run(theirs)
    pairs = [(run(ours), run(theirs)) for _ in range(turns)]
    seconds = [(a[0], b[0]) for a, b in pairs]
    ratios = [a / b for a, b in seconds]
    half = (max(ratios) - min(ratios)) / 2
    one, two = (statistics.median(column) for column in zip(*seconds, strict=True))
    memory = max(a[1] for a, _ in pairs), max(b[1] for _, b in pairs)
    return (
        f"| {question.name} | {one:.2f} s, {memory[0]:.0f} MB | {question.rival_name}: "
        f"{two:.2f} s, {memory[1]:.0f} MB | {statistics.median(ratios):.2f} ± "
        f"{half:.2f} |"
    )


def main() -> None:
    """Measure, and write the part of the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--quick", action="store_true", help="small files, no page")
    parser.add_argument("--write", type=Path, help="write the files here, and end")
    options = parser.parse_args()
    scale = 50 if options.quick else 1
    if options.write:
        write_files(options.write, scale)
        return
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        # in a process of its own: memory that this one has used counts for its children
        quick = ["--quick"] if options.quick else []
        command = [sys.executable, "-m", __spec__.name, "--write", name, *quick]
        subprocess.run(command, check=True)
        turns = 1 if options.quick else TURNS
        rows = [measure(question, folder, turns) for question in QUESTIONS]
    lines = [
        "| file | masrel agree | beside | ratio |",
        "|---|---|---|---|",
        *rows,
    ]
    if options.quick:
        print("\n".join(lines))
        return
    write_tables(["reading"], lines)


if __name__ == "__main__":
    main()
