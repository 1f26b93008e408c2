"""Agreement of pairs: every pair has its cell, every rater his or her change."""

import numpy as np
import pytest

from masrel.plots import pairs
from tests.plots.made import LONG, blank, diagnosis, overlaps, texts_of


def test_values_stand_in_their_cells_on_colours_from_0_to_1() -> None:
    found = diagnosis(3)
    axes = pairs(found, ax=blank())
    shown = np.asarray(axes.images[0].get_array())
    order = [int(name.get_text()[1]) for name in axes.get_yticklabels()]
    np.testing.assert_array_equal(shown, found.pair_values[np.ix_(order, order)])
    assert axes.images[0].get_clim() == (0.0, 1.0)
    first = f"{found.pair_values[0, 1]:.2f}".removeprefix("0")
    assert texts_of(axes).count(first) >= 2
    assert "95 % confidence interval" in texts_of(axes)


def test_what_changes_without_each_rater_stands_in_the_raters_row() -> None:
    found = diagnosis(4)
    axes = pairs(found, ax=blank())
    order = [int(name.get_text()[1]) for name in axes.get_yticklabels()]
    (panel,) = (of for of in axes.child_axes if "change" in of.get_xlabel())
    (dots,) = (of for of in panel.lines if of.get_marker() == "o")
    assert dots.get_ydata().tolist() == [0, 1, 2, 3]
    np.testing.assert_array_equal(dots.get_xdata(), found.changes[order])


@pytest.mark.parametrize(
    ("n_raters", "reference"), [(2, None), (8, LONG), (16, LONG), (30, None)]
)
def test_no_text_lies_on_another_or_is_cut_off(
    n_raters: int, reference: str | None
) -> None:
    axes = pairs(diagnosis(n_raters, reference))
    assert overlaps(axes) == []
    numbers = [text for text in texts_of(axes) if text.startswith(".")]
    assert bool(numbers) == (n_raters <= 14)
