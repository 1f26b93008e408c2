"""A file that DuckDB groups gives what it gives when it is read as a whole."""

import csv
import gzip
import sys
from dataclasses import astuple, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from masrel.agreement import coefficient
from masrel.errors import ParameterError, RatingsError
from masrel.ratings import RatingsFile, Reading, read_ratings

pyarrow = pytest.importorskip("pyarrow")
parquet = pytest.importorskip("pyarrow.parquet")
pytest.importorskip("duckdb")

NAMES = ("fleiss_kappa", "gwet_ac", "krippendorff_alpha", "conger_kappa")
SAME = (
    *("layout", "item", "rater", "grade", "grades", "missing", "merged", "scale"),
    *("raters", "n_items", "n_raters", "n_ratings", "n_missing", "dropped"),
)


def written(path: Path, columns: dict[str, Any]) -> Path:
    if path.suffix == ".parquet":
        parquet.write_table(pyarrow.table(columns), path)
    else:
        with path.open("w", newline="") as file:
            rows = zip(*(list(values) for values in columns.values()), strict=True)
            csv.writer(file).writerows([list(columns), *rows])
    return path


def both(path: Path, **options: Any) -> tuple[RatingsFile, RatingsFile]:
    return (
        read_ratings(path, Reading(stream=True, **options)),
        read_ratings(path, Reading(stream=False, **options)),
    )


def is_streamed(file: RatingsFile) -> bool:
    return not file.parts[0].items


def assert_same(streamed: RatingsFile, whole: RatingsFile) -> None:
    for key in SAME:
        assert streamed.read[key] == whole.read[key], key
    assert streamed.scale == whole.scale
    assert streamed.simulated == whole.simulated
    assert streamed.warnings == whole.warnings
    for name in NAMES:
        ours, theirs = (
            coefficient(name)(f.parts[0].counted) for f in (streamed, whole)
        )
        # the same rows, added up in another order
        first, second = (astuple(replace(of, interval=None)) for of in (ours, theirs))
        for one, other in zip(first, second, strict=True):
            is_number = isinstance(one, float)
            assert one == (pytest.approx(other, rel=1e-12) if is_number else other)


def made(seed: int, n_items: int = 400, n_raters: int = 4) -> np.ndarray[Any, Any]:
    rng = np.random.default_rng(seed)
    truth = rng.integers(0, 4, (n_items, 1))
    noise = rng.integers(0, 4, (n_items, n_raters))
    return np.where(rng.random((n_items, n_raters)) < 0.6, truth, noise)


def long_columns(
    order: np.ndarray[Any, Any] | None, items: list[Any]
) -> dict[str, Any]:
    grades = made(3, len(items))
    texts = np.array(["1", "1+", "2", ""], dtype=object)[grades]
    n, r = grades.shape
    rows = np.arange(n * r) if order is None else order[: n * r]
    rows = rows[(rows % 7) != 3]  # not everybody rated everything
    return {
        "patient": [items[k // r] for k in rows],
        "rater": [f"Dr. {'ABCD'[k % r]}" for k in rows],
        "grade": texts.ravel()[rows].tolist(),
    }


ORDER = np.random.default_rng(9).permutation(1600)
WIDE = dict(zip(("Kim", "Lee", "X", "Y"), made(1).astype(np.int8).T, strict=True))
SPELLINGS = np.array(["1", "1.0", " 2 ", "", "-99"], dtype=object)[
    np.random.default_rng(2).integers(0, 5, (300, 3))
]
MANY = np.random.default_rng(1).permutation(2400)  # 60 items by 40 raters
BY_SIDE = long_columns(None, list(range(400)))
FILES: dict[str, tuple[dict[str, Any], dict[str, Any]]] = {  # columns, options
    "wide": ({"case": np.arange(400), **WIDE}, {}),
    "wide, no item": (WIDE, {"no_item": True}),
    "spellings and missing grades": (
        {"id": [f"p {k}" for k in range(300)]}
        | {name: SPELLINGS[:, j].tolist() for j, name in enumerate("ABC")},
        {"missing_codes": ["-99"]},
    ),
    "long, numbers": (long_columns(None, list(range(400))), {}),
    "long, letters": (long_columns(None, [f"é{k:05}" for k in range(400)]), {}),
    "shuffled, texts": (long_columns(ORDER, [f"p{k}" for k in range(400)]), {}),
    "shuffled, numbers": (long_columns(ORDER, list(range(1000, 1400))), {}),
    "items that two columns name": (
        {
            **BY_SIDE,
            "patient": [k // 2 for k in BY_SIDE["patient"]],
            "side": [k % 2 for k in BY_SIDE["patient"]],
        },
        {"item": ["patient", "side"]},
    ),
    "more raters than a number has bits": (
        {
            "item": [f"p{k // 40}" for k in MANY],
            "rater": [f"r{k % 40}" for k in MANY],
            "grade": made(4, 60, 40).ravel()[MANY],
        },
        {},
    ),
    "blank lines": ({"id": ["p", "", "q"], "A": [1, "", 2], "B": [2, "", 2]}, {}),
}


@pytest.mark.parametrize("ending", ["parquet", "csv"])
@pytest.mark.parametrize("name", FILES)
def test_both_ways_are_one(tmp_path: Path, name: str, ending: str) -> None:
    columns, options = FILES[name]
    if ending == "parquet" and name == "blank lines":
        columns = {key: list(map(str, values)) for key, values in columns.items()}
    assert_same(*both(written(tmp_path / f"r.{ending}", columns), **options))


@pytest.mark.parametrize("ending", ["parquet", "csv"])
@pytest.mark.parametrize(
    ("names", "codes"),
    [
        (["p1", "p2", "p3"], []),
        (["P1", "P2", "p3"], []),
        (["a 1", "a-2", "b1"], []),
        (["p1", "P1", "p2"], ["alike"]),
        (["p1", "p 1", "p2"], ["alike"]),
        (["7", "007", "8"], ["alike"]),
        (["é1", "É1", "é2"], ["alike"]),
        (["p1", "Total", "p2"], ["summary"]),
    ],
)
def test_names_of_items_are_looked_through(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    names: list[str],
    codes: list[str],
    ending: str,
) -> None:
    columns = {"item": names, "A": [1, 2, 1], "B": [1, 2, 2]}
    path = written(tmp_path / f"wide.{ending}", columns)
    streamed, whole = both(path)
    assert_same(streamed, whole)
    assert [finding.code for finding in streamed.warnings] == codes
    monkeypatch.setattr(
        "masrel.ratings._large._MAX_NAMES", 2
    )  # too many of them, or rows
    streamed, _ = both(path)
    assert [finding.code for finding in streamed.warnings] == ["stream"] * len(codes)
    monkeypatch.setattr("masrel.ratings._large._MAX_NAMED", 2)
    streamed, _ = both(path)
    assert [finding.code for finding in streamed.warnings] == ["stream"]


@pytest.mark.parametrize(
    ("columns", "words"),
    [
        ({"id": [7, 8, 7], "A": [1, 1, 2], "B": [1, 2, 2]}, "row 2 and row 4: .*'7'"),
        ({"id": ["b", "a", "b"], "A": [1, 1, 2], "B": [1, 2, 2]}, "row 2 and row 4"),
        (
            {"id": [1, None], "A": [1, 1], "B": [1, 2]},
            "row 3, column 'id': needed a name for the",
        ),
        (
            {"id": ["p", "NA"], "A": [1, 1], "B": [1, 2]},
            "row 3, column 'id': .*got 'NA",
        ),
        ({"id": ["p", None], "A": [1, 1], "B": [1, 2]}, "row 3, column 'id': .*got ''"),
        (
            {"id": [1, 2], "A": ["1", "n/a"], "B": ["1", "2"]},
            "row 3, column 'A'.*--miss",
        ),
        (
            {"item": [1, 1, 2, 1], "rater": list("ABAA"), "grade": [1, 2, 1, 2]},
            "row 2 and row 5: 'A' graded '1' more than once",
        ),
        (
            {"item": [1, 1, 2, 2], "rater": list("ABAA"), "grade": [1, 2, 1, 2]},
            "row 4 and row 5: 'A' graded '2'",
        ),
        (
            {"item": [1, 2], "rater": ["A", ""], "grade": [1, 2]},
            "row 3, column 'rater': needed a name for the rater, got ''",
        ),
        ({"id": [1, 2], "A": [None, None], "B": ["", ""]}, "needed at least one grade"),
        ({"id": list("bab"), "A": [1, 1, 2], "B": [None, 2, 2]}, "row 2 and row 4"),
        ({"id": list("bbb"), "A": [1, 1, 2], "B": [1, 2, 2]}, "row 2 and row 3"),
        (
            {"id": range(40), **dict.fromkeys("AB", [1, 2] * 20), "C": [7, 8] * 20},
            "not look like raters, by their names or grades",
        ),
        (
            {"id": ["p", "q", "#"], "A": [1, 1, 2], "B": [1, 2, 2]},
            "row 4: '#' looks like",
        ),
    ],
)
def test_what_is_refused_is_refused_where_it_stands(
    tmp_path: Path, columns: dict[str, Any], words: str
) -> None:
    path = written(tmp_path / "table.parquet", columns)
    with pytest.raises(RatingsError, match=words):
        read_ratings(path, Reading(stream=True))
    with pytest.raises(RatingsError, match=words.split(":")[0]):
        read_ratings(path, Reading(stream=False))


HEAD = "id,A,B\n" + "".join(f"p{k},{k % 3},{k // 2 % 3}\n" for k in range(500))


@pytest.mark.parametrize("end", ["\n", "\r\n"])
@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("p,1,2,3", "line 502: needed 3 cells, as in the first line, got 4: 'p, 1"),
        ("p,1", "line 502: needed 3 cells, as in the first line, got 2: 'p, 1'"),
        ('"p,1,2', "line 502: a quote is opened but not closed"),
        ("p\xe9,1,2", "line 502: needed utf-8 text, got the byte 0xe9"),
        ("p,1,n/a", "line 502, column 'B': 'n/a' may mean that a grade"),
        (f"{'p' * 140_000},1,n/a", "line 502, column 'B': 'n/a' may mean"),
    ],
)
def test_a_wrong_line_of_a_text_is_refused_where_it_stands(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, line: str, words: str, end: str
) -> None:
    monkeypatch.setattr("masrel.ratings._large._HEAD_BYTES", 1000)
    path = tmp_path / "wide.csv"
    path.write_bytes(f"{HEAD}{line}\nq,1,2\n".replace("\n", end).encode("latin-1"))
    for stream in (True, False):
        with pytest.raises(RatingsError, match=words):
            read_ratings(path, Reading(stream=stream))


@pytest.mark.parametrize(
    "options",
    [{"by": "rater"}, {"session": "rater"}, {"repeated": "first"}, {"counts": True}],
)
def test_what_needs_the_whole_file_is_no_stream(
    tmp_path: Path, options: dict[str, Any]
) -> None:
    path = written(tmp_path / "long.parquet", long_columns(None, list(range(400))))
    with pytest.raises(ParameterError, match="needs the whole file in memory"):
        read_ratings(path, Reading(stream=True, **options))


def test_a_packed_file_is_no_stream(tmp_path: Path) -> None:
    path = tmp_path / "wide.csv.gz"
    path.write_bytes(gzip.compress(b"id,A,B\np1,1,2\n"))
    with pytest.raises(RatingsError, match="--stream: needed a Parquet file"):
        read_ratings(path, Reading(stream=True))
    with pytest.raises(RatingsError, match="no such file"):
        read_ratings(tmp_path / "none.csv", Reading(stream=True))
    assert len(read_ratings(path).parts) == 1


class TestSize:
    def test_more_grades_than_a_stream_counts_are_read_as_a_whole(
        self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        values = np.random.default_rng(1).normal(size=(400, 2))
        columns = {"id": np.arange(400), "A": values[:, 0], "B": values[:, 1]}
        path = written(tmp_path / "wide.parquet", columns)
        with pytest.raises(RatingsError, match=r"more than 120 .*--no-stream"):
            read_ratings(path, Reading(stream=True))
        monkeypatch.setattr("masrel.ratings._large._LARGE_TABLE", 1000)
        assert not is_streamed(read_ratings(path))

    def test_without_duckdb_it_is_read_as_a_whole(
        self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.setattr("masrel.ratings._large.find_spec", lambda _: None)
        monkeypatch.setitem(sys.modules, "duckdb", None)
        columns = long_columns(ORDER, [f"p{k}" for k in range(400)])
        path = written(tmp_path / "long.parquet", columns)
        with pytest.raises(RatingsError, match=r"masrel\[big\]"):
            read_ratings(path, Reading(stream=True))
        monkeypatch.setattr("masrel.ratings._large._LARGE_TABLE", 1000)
        assert not is_streamed(read_ratings(path))
