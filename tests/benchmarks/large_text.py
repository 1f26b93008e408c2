"""A large file of text, and what others take for it."""

from pathlib import Path

import numpy as np

N_RATERS = 5
N_GRADES = 4
ORDERS = ("item by item", "rater by rater", "shuffled")
_BLOCK = 1 << 19  # rows that are written at once

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
