"""Columns that are more than raters and items: frequencies, criteria, and others."""

import csv
import itertools
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from masrel.agreement import count_ratings
from masrel.errors import ParameterError, RatingsError
from masrel.ratings import RatingsFile, Reading, read_ratings
from tests.cli.process import Caller


def read(folder: Path, text: str, **options: Any) -> RatingsFile:
    path = folder / "r.csv"
    path.write_text(text, encoding="utf-8")
    return read_ratings(path, Reading(**options))


# ---- rows that stand for several items ----

PAIRS = "Kim,Lee,Freq\nyes,yes,5\nyes,no,2\nno,yes,0\nno,,1\n"
ROW_NAMES = ",Freq,right,left,sex\n1,3,1,1,f\n2,1,2,1,f\n3,2,1,1,m\n4,0,3,2,m\n"


@pytest.mark.parametrize(
    ("text", "options", "parts", "record"),
    [
        (
            PAIRS,
            {},
            [{(0, -1): 1, (1, 0): 2, (1, 1): 5}],
            {
                "n_items": 8,
                "n_raters": 2,
                "n_ratings": 15,
                "n_missing": 1,
                "missing": {"": 1},
                "grades": {"no": 3, "yes": 12},
                "raters": ["Kim", "Lee"],
                "frequency": "Freq",
                "ignored": [],
            },
        ),
        (PAIRS.replace("Kim,", "item,"), {}, None, {"raters": ["item", "Lee"]}),
        # row names are no raters, whether they number all rows or those of a group
        *(
            (
                text,
                {"by": "sex"},
                [{(0, 0): 3, (1, 0): 1}, {(0, 0): 2}],
                {"raters": ["right", "left"], "n_items": 6},
            )
            for text in (ROW_NAMES, ROW_NAMES.replace("\n3,2", "\n1,2"))
        ),
        (
            "cell,Kim,Lee,n\na,1,1,3\nb,2,1,1\n",
            {"item": "cell", "frequency": "n"},
            [{(0, 0): 3, (1, 0): 1}],
            {},
        ),
    ],
)
def test_frequencies(
    tmp_path: Path,
    text: str,
    options: dict[str, Any],
    parts: list[dict[tuple[int, ...], int]] | None,
    record: dict[str, Any],
) -> None:
    file = read(tmp_path, text, **{"frequency": "Freq", **options})
    assert {key: file.read[key] for key in record} == record
    counted = [count_ratings(part.ratings) for part in file.parts]
    met = [
        dict(zip(map(tuple, c.codes.tolist()), c.freq, strict=True)) for c in counted
    ]
    assert parts is None or met == parts


@pytest.mark.parametrize(
    ("text", "options", "words"),
    [
        *(
            (PAIRS.replace("no,2", f"no,{cell}"), {}, "line 3, column 'Freq'.*from 0")
            for cell in ("2.5", "-1", "two", "", "1e13")
        ),
        ("A,B,Freq\n1,1,0\n1,2,0\n", {}, "--frequency.*none"),
        (PAIRS, {"frequency": "count"}, "--frequency: there is no column 'count'"),
        (PAIRS, {"raters": ["Kim,Freq"]}, "--raters, --frequency|--frequency, --rat"),
        *(
            (PAIRS, options, "--frequency: ")
            for options in (
                {"rater": "Kim"},
                {"counts": True},
                {"table": True},
                {"session": "Kim"},
                {"clusters": "Kim"},
                {"repeated": "first"},
            )
        ),
        (PAIRS, {"stream": True}, "--frequency: needs the whole file"),
    ],
)
def test_frequencies_that_are_refused(
    tmp_path: Path, text: str, options: dict[str, Any], words: str
) -> None:
    with pytest.raises((RatingsError, ParameterError), match=words):
        read(tmp_path, text, **{"frequency": "Freq", **options})


def numbers_of(document: Any) -> list[Any]:
    """All numbers of a document, in order."""
    if isinstance(document, dict | list):
        values = document.values() if isinstance(document, dict) else document
        return [number for value in values for number in numbers_of(value)]
    return [document] if isinstance(document, int | float) else []


@pytest.mark.parametrize(
    "options",
    [
        ("--coefficients", "all", "--target", "items"),
        *(
            ("--interval", interval, "--target", "items")
            for interval in ("analytic", "jackknife", "bootstrap", "posterior")
        ),
        ("--target", "both"),
        ("--diagnose", "--target", "items"),
        ("--by", "sex", "--compare", "--coefficients", "fleiss_kappa"),
    ],
)
def test_frequencies_are_rows_that_are_repeated(
    tmp_path: Path, masrel: Caller, options: tuple[str, ...]
) -> None:
    rng = np.random.default_rng(4)
    patterns = itertools.product("fm", "123", "123", ["1", "2", "3", ""])
    often = [(row, int(rng.integers(4) + 5 * (row[1] == row[2]))) for row in patterns]
    rows = {
        "counted.csv": [["sex", "A", "B", "C", "Freq"]]
        + [[*row, str(n)] for row, n in often],
        "repeated.csv": [["sex", "A", "B", "C"]]
        + [list(row) for row, n in often for _ in range(n)],
    }
    for name, table in rows.items():
        with (tmp_path / name).open("w", newline="") as file:
            csv.writer(file).writerows(table)
    if "--by" not in options:
        options = (*options, "--ignore", "sex")
    counted, repeated = (
        masrel("agree", tmp_path / name, *more, *options, "--json", "-")
        for name, more in (
            ("counted.csv", ("--frequency", "Freq")),
            ("repeated.csv", ("--no-item",)),
        )
    )
    assert counted.code == repeated.code == 0, (counted.err, repeated.err)
    ours, theirs = (
        [v for k, v in json.loads(done.out).items() if k not in ("read", "options")]
        for done in (counted, repeated)
    )
    assert numbers_of(ours) == pytest.approx(numbers_of(theirs), rel=1e-12, abs=1e-14)
