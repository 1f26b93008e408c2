"""How numbers are rounded and told, which every table and sentence does alike."""

import csv
import io
import math
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

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
    percent,
    significant,
)

TOLD: list[tuple[Any, object]] = [
    (number(0.626083678854127, 3), "0.626"),
    (number(-0.25, 2), "−0.25"),
    (number(-0.0004, 3), "0.000"),
    (number(math.nan, 1), "undefined"),
    (number(None, 1), "–"),
    (number(146.0, None), "146"),
    (interval_text(math.nan, 0.5), "[undefined]"),
    (interval_text(-math.inf, 0.5), "[−∞, 0.500]"),  # an end without a bound
    (as_entered(0.1 + 0.2), "0.30000000000000004"),
    (as_entered(-2.5), "−2.5"),
    (as_entered(1e-7), "0.0000001"),
    (as_entered(math.nan), "undefined"),
    ([percent(x) for x in (0.95, 0.999, 0.57)], ["95", "99.9", "57"]),
    ((counted(1, "rater"), counted(0, "rater")), ("1 rater", "0 raters")),
    (
        [fixed_or_significant(x, 3) for x in (0.0, 0.0099, -2.5)],
        ["0.000", "0.0099", "-2.500"],
    ),
    (fixed_or_significant(12345678.9, 3), "1.235e+07"),
    ((significant(92.0), significant(0.123456, 3)), ("92", "0.123")),
    (aligned([["θ̇", "1"], ["N", "22"]], ["left", "right"]), ["θ̇   1", "N  22"]),
]


@pytest.mark.parametrize(("found", "told"), TOLD)
def test_a_number_is_told(found: object, told: object) -> None:
    assert found == told


def example(*rows: float | None, data: str = "simulated") -> Table:
    columns = (
        Column(key="value_nm", heading="Value (N·m)", digits=2),
        Column(key="page", heading="Page", where="page"),
        Column(key="low", heading="Low", where="csv"),
    )
    cells = tuple((row, "shown", 1) for row in rows)
    return Table(name="one", caption="One", columns=columns, rows=cells, data=data)


def test_a_table_says_where_its_data_come_from_and_lines_up() -> None:
    text = as_text(example(1 / 3, math.nan, None))
    assert text.startswith("SIMULATED DATA")
    assert text.splitlines()[1:] == [
        "Value (N·m)   Page",
        "-----------  -----",
        "       0.33  shown",
        "  undefined  shown",
        "          –  shown",
    ]
    assert "SIMULATED" not in as_text(example(1.0, data="published"))


@given(st.floats(allow_nan=False, allow_infinity=False, width=32))
def test_a_csv_gives_every_digit_back(value: float) -> None:
    (row,) = csv.DictReader(io.StringIO(as_csv(example(value))))
    assert float(row["value_nm"]) == value
    assert (row["low"], row["data"], "page" in row) == ("1", "simulated", False)
