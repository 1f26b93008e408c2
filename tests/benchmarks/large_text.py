"""A large file of text: ``masrel agree`` beside what pandas and DuckDB take for it."""

import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

N_RATERS = 5
N_GRADES = 4
ORDERS = ("item by item", "rater by rater", "shuffled")
_BLOCK = 1 << 19  # rows that are written at once
_COMPILED = Path(tempfile.gettempdir()) / "masrel_compiled"

PANDAS = """
import sys
import numpy as np
import pandas as pd
frame = pd.read_csv(sys.argv[1])
grades = frame.pivot(index="item", columns="rater", values="grade").to_numpy()
counts = (grades[:, :, None] == np.unique(grades)).sum(axis=1)
n = grades.shape[1]
observed = (counts * (counts - 1)).sum(axis=1).mean() / (n * (n - 1))
share = counts.sum(axis=0) / counts.sum()
print((observed - (share**2).sum()) / (1 - (share**2).sum()))
"""
DUCKDB = """
import sys
import duckdb
packed = f"SELECT sum(1 << 8 * grade) AS row FROM '{sys.argv[1]}' GROUP BY item"
with duckdb.connect() as database:
    query = f"SELECT row, count(*) FROM ({packed}) GROUP BY row"
    print(len(database.execute(query).fetchall()))
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class Run:
    """What a process took: seconds of the clock, of processors, and megabytes."""

    wall_s: float
    processor_s: float
    megabytes: float


def write_ratings(path: Path, n_items: int, order: str) -> None:
    """Write ratings of some agreement, one row a rating, in one of the `ORDERS`."""
    rng = np.random.default_rng(20120831)
    truth = rng.integers(0, N_GRADES, (n_items, 1))
    other = rng.integers(0, N_GRADES, (n_items, N_RATERS))
    seen = rng.random((n_items, N_RATERS)) < 0.6
    grade = np.where(seen, truth, other).ravel()
    rows = np.arange(grade.size)
    if order == "shuffled":
        rng.shuffle(rows)
    elif order == "rater by rater":
        rows = rows.reshape(n_items, N_RATERS).T.ravel()
    with path.open("w", encoding="utf-8") as file:
        file.write("item,rater,grade\n")
        for start in range(0, len(rows), _BLOCK):
            block = rows[start : start + _BLOCK]
            cells = block // N_RATERS + 1, block % N_RATERS + 1, grade[block]
            each = zip(*(column.tolist() for column in cells), strict=True)
            file.write("".join(f"item{i:07},rater{r},{g}\n" for i, r, g in each))


def programs(path: Path) -> dict[str, list[str]]:
    """Return the commands that are compared."""
    python = sys.executable
    return {
        "masrel": [python, "-m", "masrel", "agree", str(path)],
        "pandas": [python, "-c", PANDAS, str(path)],
        "DuckDB": [python, "-c", DUCKDB, str(path)],
    }


def run(command: Sequence[str]) -> Run:
    """Run a process, its modules compiled as pip leaves what it installs."""
    environment = {**os.environ, "PYTHONPYCACHEPREFIX": str(_COMPILED)}
    environment |= {"OPENBLAS_NUM_THREADS": "1"}
    environment.pop("PYTHONDONTWRITEBYTECODE", None)
    start = time.perf_counter()
    with subprocess.Popen(
        command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, env=environment
    ) as process:
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
    wall_s = time.perf_counter() - start
    if process.returncode:
        raise SystemExit(f"{' '.join(command[-3:])}: ended with {process.returncode}")
    return Run(
        wall_s=wall_s,
        processor_s=usage.ru_utime + usage.ru_stime,
        megabytes=usage.ru_maxrss / 1e3,
    )


def measured(path: Path, turns: int) -> dict[str, list[Run]]:
    """Run all in turn, warm, so that all meet the same load."""
    commands = programs(path)
    for command in commands.values():
        run(command)
    runs: dict[str, list[Run]] = {name: [] for name in commands}
    for _ in range(turns):
        for name, command in commands.items():
            runs[name].append(run(command))
    return runs


def ratio(ours: Sequence[float], theirs: Sequence[float]) -> tuple[float, float]:
    """Return the median of ratios turn by turn, and half their range."""
    ratios = [a / b for a, b in zip(ours, theirs, strict=True)]
    return statistics.median(ratios), (max(ratios) - min(ratios)) / 2
