"""Texts that a spreadsheet would run are written so that it does not."""

import csv
import io
from pathlib import Path

import pytest

from masrel._files import from_safe_cell, safe_cell
from masrel.lab.ratings import ratings_from_rows, read_study_ratings, write_ratings
from masrel.scales import Scale
from tests.cli.process import Caller

RUN = ['=HYPERLINK("http://x")', "+cmd|' /C calc'!A0", "-2+3", "@SUM(A1)", "'=1", "=1"]
SAFE = ["1+", "-1", "+2.5", "-1e-3", "'tis", "A=1", "R-1", ""]


def test_every_text_comes_back() -> None:
    for text in (*RUN, *SAFE, *(f"'{text}" for text in RUN)):
        assert from_safe_cell(safe_cell(text)) == text
    assert [safe_cell(text) for text in SAFE] == SAFE
    assert all(safe_cell(text) == f"'{text}" for text in RUN)


def test_a_study_reads_the_grades_that_it_wrote(tmp_path: Path) -> None:
    scale = Scale(name="odd", grades=("=0", "-", "1+", "-1"))
    rows = [
        {"session": "test", "rater": "R1", "model": f"M{i}", "grade": grade}
        for i, grade in enumerate(scale.grades)
    ]
    write_ratings(ratings_from_rows(rows, scale), tmp_path / "ratings.csv")
    text = (tmp_path / "ratings.csv").read_text()
    assert ",'=0," in text
    assert ",1+," in text
    read = read_study_ratings(tmp_path / "ratings.csv", scale)
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
