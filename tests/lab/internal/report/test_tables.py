"""Rounding, words and the three forms of a table."""

import csv
import io
import math

from hypothesis import given
from hypothesis import strategies as st

from masrel.lab.report._stretches import whole_or_tenths
from masrel.tables._latex import as_latex
from masrel.tables._tables import (
    Column,
    Table,
    aligned,
    as_csv,
    as_entered,
    as_text,
    counted,
    fixed_or_significant,
    interval_text,
    number,
    page_cells,
    percent,
    significant,
)


def example(data: str = "published") -> Table:
    return Table(
        name="example",
        caption="Values by model",
        columns=(
            Column(key="model", heading="Model", align="left"),
            Column(key="value_nm", heading="Value (N·m)", digits=2),
        ),
        rows=(("HM1", 1 / 3), ("HM2", math.nan), ("HM3", None)),
        notes=("One is undefined.",),
        data=data,
    )


def test_a_number_is_rounded_only_when_it_is_shown() -> None:
    assert number(0.626083678854127, 3) == "0.626"
    assert "0.3333333333333333" in as_csv(example())


def test_a_negative_number_has_a_true_minus_and_zero_has_none() -> None:
    assert number(-0.25, 2) == "−0.25"
    assert number(-0.0004, 3) == "0.000"


def test_undefined_and_absent_are_told_apart() -> None:
    assert number(math.nan, 1) == "undefined"
    assert number(None, 1) == "–"
    assert interval_text(math.nan, 0.5) == "[undefined]"
    assert interval_text(-math.inf, 0.5) == "[−∞, 0.500]"  # an end without a bound


def test_every_row_of_a_csv_says_where_its_data_come_from() -> None:
    rows = list(csv.DictReader(io.StringIO(as_csv(example("simulated")))))
    assert [row["data"] for row in rows] == ["simulated"] * 3
    assert [row["value_nm"] for row in rows] == [repr(1 / 3), "", ""]


def test_a_simulated_table_says_so_on_screen() -> None:
    assert as_text(example("simulated")).startswith("SIMULATED DATA")
    assert "SIMULATED" not in as_text(example("published"))


def test_the_columns_of_a_screen_table_line_up() -> None:
    lines = as_text(example()).splitlines()
    assert lines[1:6] == [
        "Model  Value (N·m)",
        "-----  -----------",
        "HM1           0.33",
        "HM2      undefined",
        "HM3              –",
    ]


def test_whole_measurements_are_shown_whole() -> None:
    assert whole_or_tenths([122.0, 68.0]) == 0
    assert whole_or_tenths([122.0, 68.5, math.nan]) == 1


@given(st.floats(allow_nan=False, allow_infinity=False, width=32))
def test_a_csv_gives_every_digit_back(value: float) -> None:
    table = Table(
        name="one",
        caption="One value",
        columns=(
            Column(key="name", heading="Name"),
            Column(key="value", heading="Value", digits=1),
        ),
        rows=(("a", value),),
        data="foreign",
    )
    (row,) = csv.DictReader(io.StringIO(as_csv(table)))
    assert float(row["value"]) == value


def test_a_number_somebody_chose_keeps_its_digits() -> None:
    assert [as_entered(x) for x in (146.0, 0.35, -2.5, 1e-7, 0.1 + 0.2)] == [
        "146",
        "0.35",
        "−2.5",
        "0.0000001",
        "0.30000000000000004",
    ]
    assert as_entered(math.nan) == "undefined"
    assert number(146.0, None) == "146"


def test_a_level_is_not_rounded_to_certainty() -> None:
    assert [percent(x) for x in (0.95, 0.9, 0.999, 0.57, 1.0)] == [
        "95",
        "90",
        "99.9",
        "57",
        "100",
    ]


def test_one_is_singular() -> None:
    assert (counted(1, "rater"), counted(0, "rater")) == ("1 rater", "0 raters")


def test_a_column_may_be_of_the_page_or_of_the_csv_alone() -> None:
    table = Table(
        name="one",
        caption="One",
        columns=(
            Column(key="id", heading="Id"),
            Column(key="both", heading="Interval", where="page"),
            Column(key="low", heading="Low", digits=1, where="csv"),
        ),
        rows=(("a", "[0.1, 0.2]", 0.123),),
        data="foreign",
    )
    assert as_csv(table) == "id,low,data\na,0.123,foreign\n"
    assert page_cells(table)[1] == [["a", "[0.1, 0.2]"]]
    assert "0.123" not in as_text(table)


def test_letters_that_latex_reads_as_its_own_are_escaped() -> None:
    text = as_latex(example("simulated"))
    assert r"\caption{\textbf{Simulated data.} Values by model}" in text
    assert "HM3 & -- \\\\" in text


def test_a_number_too_small_or_large_for_its_decimals_keeps_four_digits() -> None:
    shown = [fixed_or_significant(x, 3) for x in (0.0, 0.01, 0.0099, -2.5, 12345678.9)]
    assert shown == ["0.000", "0.010", "0.0099", "-2.500", "1.235e+07"]
    assert significant(92.0) == "92"
    assert significant(0.123456, 3) == "0.123"


def test_marks_above_letters_take_no_column() -> None:
    rows = [["law", "N"], ["θ̇", "1"]]
    assert aligned(rows, ["left", "right"]) == ["law  N", "θ̇    1"]
