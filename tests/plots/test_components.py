"""The parts of the variance: their shares, and what is said where there are none."""

import pytest

from masrel.agreement import icc
from masrel.errors import UndefinedStatisticWarning
from masrel.plots import components
from tests.plots.made import blank, texts_of

# Items 1.5, 3 and 6 on average, raters 3 and 4: by hand 5, 1/3 and 1/2.
TABLE: list[list[float | None]] = [[1, 2], [3, 3], [5, 7]]


def test_shares_of_the_three_add_up_and_have_their_standard_deviations() -> None:
    axes = components(TABLE, ax=blank())
    total = 5 + 1 / 3 + 1 / 2
    shares = [bar.get_width() for bar in axes.patches]
    assert shares == pytest.approx([5 / total, 1 / 3 / total, 1 / 2 / total])
    assert shares[0] == pytest.approx(icc(TABLE).value)
    assert {"items", "raters", "residual", "0.86, SD 2.24"} <= set(texts_of(axes))
    assert axes.get_xlim() == (0.0, 1.0)
    assert axes.get_xlabel().endswith("by ANOVA\nthe share of items is ICC(A,1)")


def test_gaps_are_said_to_need_restricted_likelihood() -> None:
    gaps = [*TABLE, [4, None], [8, 9]]
    axes = components(gaps, ax=blank())
    assert "by REML" in axes.get_xlabel()
    assert axes.patches[0].get_width() == pytest.approx(icc(gaps).value)


def test_without_variances_the_reason_stands_in_their_place() -> None:
    with pytest.warns(UndefinedStatisticWarning, match="fewer than two items"):
        axes = components([[1, 2]], ax=blank())
    assert "undefined: fewer than two items" in axes.get_xlabel()
    assert "undefined: all ratings are alike" in (
        components([[1, 1], [1, 1]], ax=blank()).get_xlabel()
    )
