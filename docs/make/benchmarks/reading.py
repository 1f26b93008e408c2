"""``masrel agree FILE`` beside what an analyst would write with pandas and a peer.

Every run is a process of its own: imports, reading, estimates.
"""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pandas as pd

from docs.make.benchmarks.rows import Benchmark, Row, agree, python

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
ONLY_READ = {"pandas read_csv alone": READ}
# what is asked, of which file, with which options; what stands beside
QUESTIONS = (
    (
        "100 000 × 5, one row an item, α",
        "wide.csv",
        ("--coefficients", "krippendorff_alpha"),
        {"pandas + krippendorff, nominal α": ALPHA},
    ),
    (
        "60 000 rows, 20 000 items, 10 000 workers",
        "crowd.csv",
        (),
        {"pandas read_csv + crosstab": CROSSTAB},
    ),
    (
        "60 000 × 2 measurements, ICC(A,1)",
        "icc.csv",
        ("--coefficients", "icc_a1"),
        ONLY_READ,
    ),
    ("10 × 100 000 columns", "columns.csv", (), ONLY_READ),
    (
        "600 × 1 523 columns of a survey, two of them raters",
        "survey.csv",
        ("--item", "id", "--raters", "tone_A,tone_B"),
        ONLY_READ,
    ),
)


def write_files(folder: Path, scale: int) -> None:
    """Write the files that are read, their sizes divided by `scale`."""
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


def rows(quick: bool, folder: Path) -> Iterator[Row]:
    """Yield the questions."""
    write_files(folder, 50 if quick else 1)
    for what, name, options, rivals in QUESTIONS:
        file = folder / name
        theirs = {rival: python(program, file) for rival, program in rivals.items()}
        yield Row(what=what, works={"masrel": agree(file, *options), **theirs})


BENCHMARK = Benchmark(rows=rows)
