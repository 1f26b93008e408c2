"""The program that compares packages, on a few small cases."""

from pathlib import Path

import pytest

from docs.make.accuracy.__main__ import Line, compare, parts
from docs.make.accuracy.figure import draw
from docs.make.accuracy.page import page
from tests.accuracy.cases import DEGENERATE, ORDINARY


@pytest.fixture(scope="module")
def lines() -> list[Line]:
    return [
        compare(*part, ["statsmodels"])
        for case in (ORDINARY[1], *DEGENERATE)
        for part in parts(case)
    ]


def test_the_page_has_a_row_for_every_coefficient_of_a_case(lines: list[Line]) -> None:
    text = page(lines, {"masrel": "0"})
    cases = text.split("## Case by case")[1]
    rows = [row for row in cases.splitlines() if row.startswith("|")]
    assert len(rows) == len(lines) + 2 * 2  # two groups, each with a head and a bar
    assert "$" not in text


def test_the_figure_is_drawn(lines: list[Line], tmp_path: Path) -> None:
    draw(lines, tmp_path / "accuracy.png")
    assert (tmp_path / "accuracy.png").stat().st_size > 10_000
