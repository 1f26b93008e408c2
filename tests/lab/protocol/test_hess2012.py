"""The bundled published study says what the paper's tables say."""

from pathlib import Path

import pytest

from masrel.lab.protocol import Protocol, read_protocol
from tests.files import table_of

STUDY = Path(__file__).parents[3] / "studies" / "hess2012"

# Table V of Park, Kim and Damiano (2012): per rater, grade and mean speed (deg/s)
# of HM1 to HM4, as printed.
TABLE_V = """
1 122 1+ 124 2 108 3 68
1 100 1+ 83 2 92 2 65
1 86 1+ 70 2 88 3 64
1+ 123 1+ 131 2 110 3 72
1 80 1+ 70 2 77 3 60
1 92 1 80 2 78 2 65
1 82 1+ 86 2 73 3 61
1 89 1 93 2 80 3 60
"""


@pytest.fixture(scope="module")
def protocol() -> Protocol:
    return read_protocol(STUDY / "protocol.toml")


def rows(name: str) -> list[dict[str, str]]:
    return table_of(STUDY / "ratings" / name)


def test_the_published_ratings_are_table_v_cell_by_cell() -> None:
    printed = [line.split() for line in TABLE_V.strip().splitlines()]
    expected = [
        ("test", f"R{rater}", f"HM{model + 1}", *cells[2 * model : 2 * model + 2])
        for rater, cells in enumerate(printed, start=1)
        for model in range(4)
    ]
    columns = ("session", "rater", "model", "grade", "mean_speed_deg_s")
    assert [tuple(row[c] for c in columns) for row in rows("published.csv")] == expected
    assert {row["source"] for row in rows("published.csv")} == {"published"}


def grades(table: str, column: str) -> dict[str, list[str]]:
    found: dict[str, list[str]] = {}
    for row in rows("in_person.csv"):
        if row["source_table"] == table:
            assert row["model"] == f"HM{row['subject']}"
            found.setdefault(row["rater"], []).append(row[column])
    return found


def test_the_in_person_grades_are_tables_i_and_iv_with_their_absences() -> None:
    assert grades("I", "in_person_grade") == {
        "R1": ["1", "1+", "2", "3"],
        "R2": ["1", "1+", "2", "2"],
        "R3": ["", "1+", "2", "3"],
    }
    assert grades("I", "haptic_grade") == dict.fromkeys(["R1", "R2", "R3"], [""] * 4)
    assert grades("IV", "in_person_grade") == {
        "R1": ["1", "1+", "2", "3"],
        "R2": ["1", "1+", "2", "2"],
        "R3": ["1", "", "2", "3"],
    }
    assert grades("IV", "haptic_grade") == {
        "R1": ["1", "1+", "2", "3"],
        "R2": ["1", "1+", "2", "2"],
        "R3": ["1", "1+", "2", "3"],
    }
    used = ["1", "1+", "2", "3"]  # the last line of Table I
    for table in ("I", "IV"):
        assert grades(table, "model_grade") == dict.fromkeys(["R1", "R2", "R3"], used)
