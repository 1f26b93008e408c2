"""Texts that a spreadsheet would run are written so that it does not."""

import csv
import io
from pathlib import Path

import pytest

from masrel.lab.ratings import ratings_from_rows, read_study_ratings, write_ratings
from masrel.scales import Scale
from tests.cli.process import Caller

RUN = ['=HYPERLINK("http://x")', "+cmd|' /C calc'!A0", "-2+3", "@SUM(A1)", "'=1", "=1"]
SAFE = ["1+", "-1", "+2.5", "-1e-3", "'tis", "A=1", "R-1"]


def test_every_text_comes_back(tmp_path: Path) -> None:
    grades = [*RUN, *SAFE, *(f"'{text}" for text in RUN if text[0] != "'")]
    scale = Scale(name="odd", grades=tuple(dict.fromkeys(grades)))
    rows = [
        {"session": "test", "rater": "R1", "model": f"M{i}", "grade": grade}
        for i, grade in enumerate(scale.grades)
    ]
    file = tmp_path / "ratings.csv"
    write_ratings(ratings_from_rows(rows, scale), file)
    lines = [line for line in file.read_text().splitlines() if line[0] != "#"]
    written = {row["model"]: row["grade"] for row in csv.DictReader(lines)}
    assert [written[f"M{i}"] for i, grade in enumerate(scale.grades)] == [
        grade if grade in SAFE else f"'{grade}" for grade in scale.grades
    ]
    read = read_study_ratings(file, scale)
    assert read.table["grade"].tolist() == list(scale.grades)


def test_raw_cells_are_those_of_a_table_that_is_printed(
    tmp_path: Path, masrel: Caller
) -> None:
    table = tmp_path / "table.csv"
    table.write_text("item,A,B\n1,2,2\n2,x,x\n")
    done = masrel("agree", table, "--raw-csv")
    assert (done.code, done.out) == (2, "")
    assert "--raw-csv: needs --csv" in done.err


@pytest.mark.parametrize("raw", [False, True])
def test_csv_on_the_screen(raw: bool, tmp_path: Path, masrel: Caller) -> None:
    table = tmp_path / "table.csv"
    table.write_text("item,=A,B\n1,=2+2,=2+2\n2,x,x\n3,x,=2+2\n4,x,x\n")
    options = ["--target", "items", "--each-category", "--csv"]
    done = masrel("agree", table, *options, *(["--raw-csv"] if raw else []))
    assert done.code == 0, done.err
    cells = [cell for row in csv.reader(io.StringIO(done.out)) for cell in row]
    assert ("=2+2" in cells) is raw
    assert ("'=2+2" in cells) is not raw
