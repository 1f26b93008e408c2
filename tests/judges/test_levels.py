"""A part of the rows of levels comes again from the seed."""

import csv
from itertools import islice

from docs.make.evidence import EVIDENCE
from docs.make.judge_levels import cluster_rows, exact_rows

ROWS = EVIDENCE / "judges_levels.csv"


def test_rows_come_again() -> None:
    with ROWS.open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    again = [{name: str(x) for name, x in row.items()} for row in exact_rows([20, 25])]
    assert again == [row for row in rows if row["n"] in {"20", "25"}]
    # 800 of 20 000 studies differ from all by more than five errors in 1e-6
    (first,) = islice(cluster_rows(800), 1)
    (row,) = (row for row in rows if row["of"] == "20 × 5, 0.1")
    share = float(row["percent"]) / 100
    assert abs(first["percent"] / 100 - share) < 5 * (share / 800) ** 0.5


def test_the_default_keeps_its_level() -> None:
    with ROWS.open(encoding="utf-8", newline="") as file:
        rows = [row for row in csv.DictReader(file) if row["what"] == "level"]
    for row in rows:
        bound = 100 * (0.05 if row["bound"] == "0.05" else 0.05 / 5.5)
        if row["test"] == "exact":
            assert float(row["percent"]) <= bound + 0.005
        if row["test"] == "score" and int(row["n"]) > 2500:
            assert float(row["percent"]) <= 1.06 * bound
