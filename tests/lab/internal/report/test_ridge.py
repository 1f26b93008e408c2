"""Ridges: no resample is lost, moved or shown as more than it is."""

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import StepPatch

from masrel.estimates import Distribution, Interval
from masrel.plots._forest import _draw_ridge, _lowest, _Ridge, _ridge


def resamples(values: list[float], shares: list[float]) -> Distribution:
    return Distribution(
        values=np.array(values), weights=np.array(shares), continuous=False, words="b"
    )


def ridge(distribution: Distribution) -> _Ridge:
    shown = Interval(
        low=0.3,
        high=0.7,
        level=0.95,
        kind="credible",
        method="m",
        target="items",
        distribution=distribution,
    )
    return _ridge(shown)


def drawn(distribution: Distribution) -> Axes:
    axes = Figure().add_subplot()
    _draw_ridge(axes, ridge(distribution), base=0.0, top=1.0)
    return axes


def stems(axes: Axes) -> dict[float, float]:
    """Place and height of every stem."""
    (lines,) = axes.collections
    return {float(low[0]): float(high[1]) for low, high in lines.get_segments()}


def bars(axes: Axes) -> tuple[np.ndarray, np.ndarray]:
    """Edges and heights of the bars."""
    outline = [patch for patch in axes.patches if isinstance(patch, StepPatch)][-1]
    data = outline.get_data()
    return data.edges, data.values


def half_at_one(n_others: int = 200) -> Distribution:
    others = np.linspace(0.001, 0.9, n_others)
    shares = [0.5 / n_others] * n_others
    return resamples([*others, 1.0], [*shares, 0.5])


def test_few_values_are_stems_as_high_as_their_shares() -> None:
    few = resamples([-0.2, 0.5, 1.0], [0.2, 0.5, 0.3])
    assert tuple(ridge(few)) == ("stems",)
    assert stems(drawn(few)) == pytest.approx({-0.2: 0.4, 0.5: 1.0, 1.0: 0.6})


def test_values_that_differ_by_rounding_are_one() -> None:
    split = resamples([0.2, 0.5, 0.5 + 1e-13], [0.5, 0.25, 0.25])
    assert stems(drawn(split)) == pytest.approx({0.2: 1.0, 0.5: 1.0})


def test_a_point_mass_among_many_values_stays_a_line_where_it_is() -> None:
    mass = half_at_one()
    axes = drawn(mass)
    assert tuple(ridge(mass)) == ("stems", "bars")
    assert stems(axes) == {1.0: 1.0}
    # the bars hold the other half, in the unit of the stem, which is a half high
    assert bars(axes)[1].sum() == pytest.approx(1.0)


def test_bars_hold_every_resample_within_their_edges() -> None:
    rng = np.random.default_rng(5)
    values = np.sort(rng.normal(0.4, 0.1, 4000))
    many = resamples(list(values), [1 / 4000] * 4000)
    assert tuple(ridge(many)) == ("bars",)
    edges, heights = bars(drawn(many))
    assert edges[0] < values[0]
    assert values[-1] <= edges[-1]
    expected = np.histogram(values, edges)[0]
    np.testing.assert_allclose(heights, expected / expected.max())


@pytest.mark.parametrize(
    ("spread", "width"), [(0.1, 0.02), (0.02, 0.005), (1e-5, 1e-3)]
)
def test_what_is_narrow_has_narrow_bars(spread: float, width: float) -> None:
    values = np.sort(np.random.default_rng(6).normal(0.9, spread, 1000))
    edges, _ = bars(drawn(resamples(list(values), [1e-3] * 1000)))
    np.testing.assert_allclose(np.diff(edges), width)


def test_no_bar_goes_beyond_perfect_agreement() -> None:
    values = np.linspace(0.5, 1.0, 101)
    edges, _ = bars(drawn(resamples(list(values), [1 / 101] * 101)))
    assert edges[-1] == pytest.approx(1.0)


def test_infinite_values_are_passed_over() -> None:
    odd = resamples([-np.inf, 0.2, 0.4, np.inf], [0.1, 0.4, 0.4, 0.1])
    assert stems(drawn(odd)) == {0.2: 1.0, 0.4: 1.0}


def test_a_density_keeps_its_shape_and_reaches_the_top_once() -> None:
    at = np.linspace(0.2, 0.8, 61)
    density = np.exp(-50.0 * (at - 0.6) ** 2)
    bell = Distribution(values=at, weights=density, continuous=True, words="p")
    (line,) = drawn(bell).lines
    np.testing.assert_allclose(line.get_ydata(), density / density.max())
    assert tuple(ridge(bell)) == ("density",)


def test_a_faint_tail_needs_no_room() -> None:
    at = np.linspace(-0.9, 0.9, 181)
    bell = Distribution(
        values=at, weights=np.exp(-200.0 * (at - 0.5) ** 2), continuous=True, words="p"
    )
    assert 0.3 < _lowest(ridge(bell)) < 0.4
    assert _lowest(ridge(half_at_one())) < 0.1
