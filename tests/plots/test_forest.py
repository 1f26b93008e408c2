"""The forest: every estimate, its interval, and how it is distributed, are in it."""

import math

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.patches import StepPatch
from numpy.typing import NDArray

from masrel.estimates import Estimate, Interval
from masrel.plots import forest
from tests.plots.made import LONG, blank, estimate, interval, overlaps, spread, texts_of

BELL = np.linspace(0.2, 0.8, 61)
DENSITY = np.exp(-50.0 * (BELL - 0.6) ** 2)


def one(interval: Interval) -> Axes:
    return forest(estimate(interval), ax=blank())


def lines(axes: Axes) -> list[tuple[str, list[list[float]]]]:
    """Marker, and points, of every line but the one at zero."""
    return [
        (str(line.get_marker()), np.asarray(line.get_xydata()).tolist())
        for line in axes.lines
        if line.get_zorder() >= 1.0
    ]


def test_every_estimate_has_its_dot_its_interval_and_its_numbers() -> None:
    several = [estimate(interval(low=0.1 * n), value=0.5 + 0.1 * n) for n in range(3)]
    axes = forest(several, ["a", "b", "c"], ax=blank())
    dots = [points[0][0] for marker, points in lines(axes) if marker == "o"]
    ends = [[x for x, _ in points] for marker, points in lines(axes) if marker == "|"]
    assert dots == pytest.approx([0.5, 0.6, 0.7])
    assert ends == [pytest.approx([0.1 * n, 0.7]) for n in range(3)]
    assert {"a", "b", "c", "0.600 [0.100, 0.700]"} <= set(texts_of(axes))


def test_an_undefined_estimate_is_said_to_be_and_has_no_mark() -> None:
    axes = forest(estimate(value=math.nan, reason="one category"), ax=blank())
    assert "undefined" in texts_of(axes)
    assert lines(axes) == []


@pytest.mark.parametrize(
    ("value", "low", "markers"),
    [(0.5, -0.9, {"|", "o"}), (0.5, -7.0, {"|", "o", "<"}), (-9.0, -20.0, {"|", "<"})],
)
def test_what_leaves_the_axis_is_an_arrow_at_its_end(
    value: float, low: float, markers: set[str]
) -> None:
    axes = forest(estimate(interval(low=low), value=value), ax=blank())
    left = axes.get_xlim()[0]
    assert left >= -1.05
    assert {marker for marker, _ in lines(axes)} == markers
    assert min(x for _, points in lines(axes) for x, _ in points) >= left


@pytest.mark.parametrize(
    ("shown", "words"),
    [
        (estimate(), {"estimate"}),
        (estimate(interval()), {"estimate", "95 % confidence interval"}),
        (estimate(interval(level=0.9)), {"estimate", "90 % confidence interval"}),
        (
            estimate(spread(BELL, DENSITY, continuous=True)),
            {
                "estimate",
                "95 % credible interval",
                "posterior density, scaled in each row",
            },
        ),
        (
            estimate(spread([0.2, 0.5], [0.4, 0.6])),
            {
                "estimate",
                "95 % confidence interval",
                "resamples by value, scaled in each row",
            },
        ),
    ],
)
def test_the_legend_names_what_is_drawn_and_nothing_else(
    shown: Estimate, words: set[str]
) -> None:
    legend = forest(shown, ax=blank()).get_legend()
    assert legend is not None
    assert {text.get_text() for text in legend.get_texts()} == words


@pytest.mark.parametrize("n", [1, 12])
def test_no_text_lies_on_another_or_is_cut_off(n: int) -> None:
    several = [estimate(spread(BELL, DENSITY, continuous=True))] * n
    axes = forest(several, [LONG] * n, groups=["first"] + ["second"] * (n - 1))
    assert overlaps(axes) == []


# What a ridge shows of a distribution.


def shares(heights: NDArray[np.float64], places: NDArray[np.float64]) -> dict:
    return dict(zip(places.tolist(), (heights / heights.max()).tolist(), strict=True))


def stems(axes: Axes) -> dict[float, float]:
    """Place of every stem, and its height, that of the highest being 1."""
    (found,) = (of for of in axes.collections if isinstance(of, LineCollection))
    ends = np.array(found.get_segments())
    return shares(ends[:, 0, 1] - ends[:, 1, 1], ends[:, 0, 0])


def bars(axes: Axes) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Edges of the bars, and how high each is."""
    outline = [patch for patch in axes.patches if isinstance(patch, StepPatch)][-1]
    data = outline.get_data()
    return data.edges, data.baseline - data.values


def test_few_values_are_stems_as_high_as_their_shares() -> None:
    axes = one(spread([-0.2, 0.5, 1.0], [0.2, 0.5, 0.3]))
    assert stems(axes) == pytest.approx({-0.2: 0.4, 0.5: 1.0, 1.0: 0.6})


@pytest.mark.parametrize(
    ("spread_of", "width"), [(0.1, 0.02), (0.02, 0.005), (1e-5, 1e-3)]
)
def test_bars_hold_every_resample_and_are_narrow_where_it_is_narrow(
    spread_of: float, width: float
) -> None:
    values = np.sort(np.random.default_rng(6).normal(0.8, spread_of, 4000))
    edges, heights = bars(one(spread(values, [1 / 4000] * 4000)))
    assert edges[0] < values[0]
    assert values[-1] <= edges[-1]
    np.testing.assert_allclose(np.diff(edges), width)
    expected = np.histogram(values, edges)[0]
    np.testing.assert_allclose(heights / heights.max(), expected / expected.max())


def test_a_density_keeps_its_shape_and_a_faint_tail_needs_no_room() -> None:
    at = np.linspace(-0.9, 0.9, 181)
    density = np.exp(-200.0 * (at - 0.5) ** 2)
    axes = one(spread(at, density, continuous=True))
    (points,) = (np.array(of) for _, of in lines(axes) if len(of) == at.size)
    heights = points[:, 1].max() - points[:, 1]
    np.testing.assert_allclose(heights / heights.max(), density, atol=1e-12)
    assert axes.get_xlim()[0] == pytest.approx(-0.05)
