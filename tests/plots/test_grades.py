"""Ratings by grade: each is counted, coloured and named as it was given."""

from typing import Any

import numpy as np
import pandas as pd
import pytest
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb

from masrel.intervals import diagnose
from masrel.plots import categories, confusion, grades, items
from tests.plots.made import LONG, blank, diagnosis, overlaps, texts_of

# Kim gives a to the first two items and b to the others; Ann has no last item.
THREE = pd.DataFrame(
    {
        "Kim": ["a", "a", "b", "b", "b"],
        "Lee": ["a", "b", "b", "b", "c"],
        "Ann": ["a", "a", "b", "c", None],
    },
    index=["P1", "P2", "P3", "P4", "P5"],
)
TWO = THREE[["Kim", "Lee"]]


def drawn(n_items: int, n_raters: int, q: int, *, words: bool) -> list[list[Any]]:
    """Ratings of q grades, each given at least once, and some of them missing."""
    rng = np.random.default_rng(4)
    codes = np.arange(n_items)[:, None] + rng.integers(0, 2, (n_items, n_raters))
    grade = (lambda k: f"the grade {k} of many") if words else int
    table = [[grade(k % q) for k in row] for row in codes]
    for row, column in rng.integers(0, (n_items, n_raters), (n_items // 4, 2)):
        table[row][column] = None
    return table


def written(axes: Axes) -> dict[tuple[float, float], str]:
    """Text of every cell, by column and row."""
    return {of.get_position(): of.get_text() for of in axes.texts if of.get_text()}


def legend_of(axes: Axes) -> dict[str, tuple[float, ...]]:
    legend = axes.get_legend()
    colours = [patch.get_facecolor() for patch in legend.get_patches()]
    names = [text.get_text() for text in legend.get_texts()]
    return dict(zip(names, colours, strict=True))


def luminance(colour: Any) -> float:
    parts = ((np.array(to_rgb(colour)) + 0.055) / 1.055) ** 2.4
    return float(parts @ (0.2126, 0.7152, 0.0722))


def test_a_table_of_two_raters_has_the_counts_and_the_shares_of_rows() -> None:
    axes = confusion(TWO, ax=blank())
    cells = {(0, 0): "1", (1, 0): "1", (1, 1): "2", (2, 1): "1"}
    of_rows, of_columns = {(3, 0): "2", (3, 1): "3"}, {(0, 3): "1", (1, 3): "3"}
    assert written(axes) == cells | of_rows | of_columns | {(2, 3): "1", (3, 3): "5"}
    (image,) = axes.images
    shares = [[1 / 2, 1 / 2, 0], [0, 2 / 3, 1 / 3], [0, 0, 0]]
    np.testing.assert_allclose(np.asarray(image.get_array()), shares)
    assert image.get_clim() == (0.0, 1.0)
    framed = {(of.get_x(), of.get_y() + 0.5) for of in axes.patches}
    assert framed == {(-0.5, 0.0), (0.5, 1.0), (1.5, 2.0)}
    assert (axes.get_ylabel(), axes.get_xlabel()) == ("Kim", "Lee")
    assert any("same grade: 3 of 5 (60 %)" in text for text in texts_of(axes))


def test_all_others_are_held_against_a_reference_together() -> None:
    axes = confusion(THREE, reference="Kim", ax=blank())
    assert written(axes)[0, 0] == "3"  # a of Lee once, of Ann twice
    assert written(axes)[3, 3] == "9"  # one of ten pairs is without a rating
    assert (axes.get_ylabel(), axes.get_xlabel()) == ("Kim", "2 other raters")


def test_the_use_of_grades_is_a_bar_of_shares() -> None:
    axes = grades(THREE, ax=blank())
    bars = {
        (bar.get_y() + bar.get_height() / 2, bar.get_x()): bar.get_width()
        for bar in axes.patches
    }
    kim, lee = {(0, 0): 0.4, (0, 0.4): 0.6}, {(1, 0): 0.2, (1, 0.2): 0.6, (1, 0.8): 0.2}
    ann = {(2, 0): 0.5, (2, 0.5): 0.25, (2, 0.75): 0.25}
    assert sorted(bars.items()) == [
        (pytest.approx(place), pytest.approx(share))
        for place, share in sorted((kim | lee | ann).items())
    ]
    assert axes.get_xlim() == (0.0, 1.0)
    assert texts_of(axes).count("5 ratings") == 2
    assert {"Kim", "4 ratings", "a", "b", "c"} <= set(texts_of(axes))


def test_agreement_on_each_grade_has_its_dot_and_its_interval() -> None:
    result = diagnosis(4)
    axes = categories(result, names=["low", "middle", "high"], ax=blank())
    (dots,) = axes.lines
    np.testing.assert_array_equal(dots.get_xdata(), result.category_values)
    ends = np.array([path[:, 0] for path in axes.collections[0].get_segments()])
    np.testing.assert_array_equal(ends[:, 0], result.category_low)
    np.testing.assert_array_equal(ends[:, 1], result.category_high)
    assert axes.get_xlim() == (0.0, 1.0)
    first = f"{result.category_values[0]:.2f} ({result.category_counts[0]} ratings)"
    assert {"low", "middle", "high", first, "95 % confidence interval"} <= set(
        texts_of(axes)
    )


def test_items_come_by_disagreement_and_missing_ratings_are_blank() -> None:
    axes = items(THREE, n_shown=4, categories=["a", "b", "c"], ax=blank())
    names = [name.get_text() for name in axes.get_yticklabels()]
    # half a scale apart: both ratings of P5, and two pairs of three of P2 and P4
    assert names == ["P5", "P2", "P4", "P1"]
    rows = [written(axes).get((column, 0)) for column in range(3)]
    assert rows == ["b", "c", None]
    colours = np.asarray(axes.images[0].get_array())
    assert colours[0, 2, 3] == 0.0
    assert tuple(colours[3, 0]) == pytest.approx(legend_of(axes)["a"])


@pytest.mark.parametrize("ordered", [True, False])
def test_letters_can_be_read_on_every_cell(ordered: bool) -> None:
    axes = items(drawn(40, 3, 8, words=False), ordered=ordered, ax=blank())
    cells = np.asarray(axes.images[0].get_array())
    for (column, row), letters in {of.get_position(): of for of in axes.texts}.items():
        pair = (
            luminance(cells[int(row), int(column)][:3]),
            luminance(letters.get_color()),
        )
        assert (max(pair) + 0.05) / (min(pair) + 0.05) > 4.0


@pytest.mark.parametrize(
    ("n_raters", "q", "words"),
    [(2, 2, False), (8, 5, True), (30, 12, False)],
)
def test_no_text_lies_on_another_or_is_cut_off(
    n_raters: int, q: int, words: bool
) -> None:
    table = drawn(60, n_raters, q, words=words)
    # of two whose ends are the same, as much is shown as tells them apart
    names = [LONG, LONG.replace("Frei", "Edel"), *(f"R{k}" for k in range(2, n_raters))]
    for draw in (grades, items):
        assert overlaps(axes := draw(table, raters=names)) == []
        assert len({text for text in texts_of(axes) if text.startswith("Anna")}) == 2
    assert [
        *overlaps(confusion(table, raters=names, reference=LONG)),
        *overlaps(categories(diagnose(table))),
    ] == []
