"""Figures: what they say, that they repeat, and that they stay inside their data."""

import dataclasses
from typing import Any

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.axes import Axes

from masrel.estimates import Distribution, Interval
from masrel.intervals import Diagnosis, diagnose
from masrel.lab.report._figure_data import (
    GradeGrid,
    GradesByAim,
    OrderDifferences,
    PlaceDots,
    SpeedColumn,
    SpeedDots,
    TraceColumns,
    TracePanel,
)
from masrel.lab.report.figures._order_differences import difference_figure
from masrel.lab.report.figures._study_figures import aim_figure, speed_figure
from masrel.lab.report.figures._trace_figures import trace_figure
from masrel.plots import draw
from masrel.plots._drawn_values import Drawn, Forest, ForestRow
from masrel.plots._forest import forest_figure
from masrel.plots._rater_pairs import rater_figure
from masrel.plots._style import STYLE, house_style, lay_out

PNG = b"\x89PNG\r\n\x1a\n"


def grid(n_raters: int = 2) -> GradeGrid:
    return GradeGrid(
        models=("HM1", "HM2"),
        raters=tuple(f"R{i}" for i in range(n_raters)),
        intended=("1", None),
        grades=((("1",),) * (n_raters - 1) + (("2",),), ((),) * n_raters),
        scale=("0", "1", "2"),
    )


def interval(**changes: Any) -> Interval:
    made: dict[str, Any] = {
        "low": 0.3,
        "high": 0.7,
        "level": 0.95,
        "kind": "confidence",
        "method": "m",
        "target": "items",
    }
    return Interval(**{**made, **changes})


def posterior() -> Interval:
    at = np.linspace(0.1, 0.9, 41)
    density = Distribution(
        values=at, weights=np.exp(-20.0 * (at - 0.5) ** 2), continuous=True, words="p"
    )
    return interval(kind="credible", distribution=density)


def resampled(n_values: int = 100) -> Interval:
    # one value has a fifth of the resamples, the others share the rest
    weights = np.full(n_values, 0.8 / (n_values - 1))
    weights[-1] = 0.2
    values = np.linspace(-0.2, 1.0, n_values)
    return interval(
        distribution=Distribution(
            values=values, weights=weights, continuous=False, words="b"
        )
    )


def forest() -> list[ForestRow]:
    shared = {"detail": "4 models", "interval": None}
    return [
        ForestRow(label="a", value=0.6, text="0.600", **shared),
        ForestRow(label="b", value=None, text="undefined", **shared),
        ForestRow(label="c", value=None, text="not in these data", **shared),
        ForestRow(label="d", value=0.5, interval=posterior(), text="[0.3, 0.7]"),
        ForestRow(label="e", value=0.5, interval=resampled(), text="[0.2, 0.8]"),
    ]


def panel() -> TracePanel:
    time = np.linspace(0.0, 1.0, 50)
    phase = np.repeat([0, 1, 2], [20, 20, 10])
    stretch = (time, 30 + 100 * time, 5 * time, phase)
    return TracePanel(title="HM1", stretches=(stretch, stretch))


def diagnosis(n_raters: int, reference: str | None = None) -> Diagnosis:
    rng = np.random.default_rng(3)
    items = np.arange(20) % 3
    drawn = rng.integers(0, 3, (20, n_raters))
    ratings = np.where(rng.random(drawn.shape) < 0.7, items[:, None], drawn)
    names = [f"R{k}" for k in range(n_raters)]
    if reference is not None:
        names[-1] = reference
    return diagnose(ratings, target="items", raters=names, reference=reference)


DRAWINGS = {
    "grades": grid(),
    "many raters": grid(14),
    "forest": Forest(rows=tuple(forest()), axis_label="κ"),
    "speeds": SpeedDots(
        columns=(
            SpeedColumn(
                model="HM1", session="first", speeds=((80.0,), (90.0, 95.0)), mean=85.0
            ),
        ),
        raters=("R1", "R2"),
        slowest=60.0,
    ),
    "pairs": Drawn(
        "masrel.plots._rater_pairs:rater_figure",
        ((("", diagnosis(3)),), "Fleiss' κ"),
    ),
    "traces": TraceColumns(panels=(panel(),)),
}


def svg_of(name: str, stamp: str) -> bytes:
    return draw(DRAWINGS[name], stamp=stamp)["svg"]


@pytest.mark.parametrize("name", DRAWINGS)
def test_the_same_data_give_the_same_bytes(name: str) -> None:
    first, second = (draw(DRAWINGS[name], stamp="SIMULATED DATA") for _ in range(2))
    assert first["png"].startswith(PNG)
    assert first == second


@pytest.mark.parametrize("name", DRAWINGS)
def test_a_readers_own_matplotlib_settings_change_nothing(name: str) -> None:
    plain = svg_of(name, "")
    with mpl.rc_context({"font.size": 20.0, "svg.hashsalt": "other"}):
        assert svg_of(name, "") == plain
        assert mpl.rcParams["font.size"] == 20.0


@pytest.mark.parametrize("name", DRAWINGS)
def test_a_figure_holds_no_time_of_day(name: str) -> None:
    drawn = draw(DRAWINGS[name], stamp="")
    assert b"<dc:date>" not in drawn["svg"]
    assert b"Software" not in drawn["png"]


@pytest.mark.parametrize("name", DRAWINGS)
def test_a_simulated_figure_carries_the_stamp(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    # With text kept as text the SVG says what can be read in the figure.
    monkeypatch.setitem(STYLE, "svg.fonttype", "none")
    assert b"SIMULATED DATA" in svg_of(name, "SIMULATED DATA")
    assert b"SIMULATED DATA" not in svg_of(name, "")


def test_a_grade_is_written_in_its_cell_and_a_missing_one_is_a_dash(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setitem(STYLE, "svg.fonttype", "none")
    svg = svg_of("grades", "").decode()
    assert svg.count(">1</text>") == 2  # intended, and the one rater who agrees
    assert svg.count(">2</text>") == 1
    assert svg.count(">–</text>") == 3  # two missing grades, no intended one


def forest_text(rows: list[ForestRow], monkeypatch: pytest.MonkeyPatch) -> str:
    monkeypatch.setitem(STYLE, "svg.fonttype", "none")
    shown = Forest(rows=tuple(rows), axis_label="κ")
    return draw(shown, stamp="", forms=("svg",))["svg"].decode()


def row(shown: Interval | None = None, **changes: Any) -> ForestRow:
    made = {"label": "a", "value": 0.5, "interval": shown, "text": "0.5"}
    return ForestRow(**{**made, **changes})


def test_an_estimate_that_is_not_there_is_said_in_the_figure(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    svg = forest_text(forest(), monkeypatch)
    assert "undefined" in svg
    assert "not in these data" in svg


@pytest.mark.parametrize(
    ("shown", "named"),
    [
        (None, set()),
        (interval(), {"95 % confidence interval"}),
        (interval(level=0.9), {"90 % confidence interval"}),
        (posterior(), {"95 % credible interval", "posterior density"}),
        (resampled(), {"95 % confidence interval", "in bars", "of one value"}),
        (resampled(50), {"95 % confidence interval", "of one value"}),
    ],
)
def test_the_legend_names_what_is_drawn_and_nothing_else(
    monkeypatch: pytest.MonkeyPatch, shown: Interval | None, named: set[str]
) -> None:
    svg = forest_text([row(shown)], monkeypatch)
    every = {
        "90 % confidence interval",
        "95 % confidence interval",
        "95 % credible interval",
        "posterior density",
        "in bars",
        "of one value",
    }
    assert {words for words in every if words in svg} == named


def test_a_heading_stands_once_above_its_rows(monkeypatch: pytest.MonkeyPatch) -> None:
    rows = [row(group=group) for group in ("test", "test", "retest")]
    svg = forest_text(rows, monkeypatch)
    assert (svg.count(">test<"), svg.count(">retest<")) == (1, 1)


def drawn_axes(*rows: ForestRow) -> Axes:
    with house_style():
        (axes,) = forest_figure(Forest(rows=rows, axis_label="κ")).axes
    return axes


def lines_at_zero(axes: Axes) -> list[tuple[float, float]]:
    found = (line.get_xydata() for line in axes.lines if line.get_zorder() < 1.0)
    return [(ends[0][1], ends[1][1]) for ends in found]


def test_zero_is_marked_where_chance_gives_it_alone() -> None:
    axes = drawn_axes(row(has_zero=False), row(), row(), row(has_zero=False), row())
    first, second = lines_at_zero(axes)
    assert first == pytest.approx((0.25, 0.75))
    assert second == pytest.approx((1.0, 1.25))
    assert lines_at_zero(drawn_axes(row(has_zero=False))) == []


@pytest.mark.parametrize(
    ("value", "low", "markers"),
    [(0.5, -0.9, {"|", "o"}), (0.5, -7.0, {"|", "o", "<"}), (-9.0, -20.0, {"|", "<"})],
)
def test_what_leaves_the_axis_is_an_arrow_at_its_end(
    value: float, low: float, markers: set[str]
) -> None:
    axes = drawn_axes(row(interval(low=low), value=value))
    assert axes.get_xlim()[0] >= -1.05
    assert {line.get_marker() for line in axes.lines} - {"None"} == markers
    inside = [x for line in axes.lines for x in line.get_xdata()]
    assert min(inside) >= axes.get_xlim()[0]


def test_pairs_are_written_in_their_cells_and_long_names_are_shortened(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setitem(STYLE, "svg.fonttype", "none")
    few = svg_of("pairs", "").decode()
    assert few.count(">R0</text>") == 2  # of the row and of the column
    first = f"{diagnosis(3).pair_values[0, 1]:.2f}".removeprefix("0")
    assert few.count(f">{first}</text>") >= 2
    assert ">95 % confidence interval</text>" in few
    long = Drawn(
        "masrel.plots._rater_pairs:rater_figure",
        ((("", diagnosis(16, "a long name " * 4)),), "κ"),
    )
    many = draw(long, stamp="", forms=("svg",))["svg"].decode()
    assert ">a long nam…" in many
    assert f">{first}</text>" not in many


def test_a_stretch_that_a_grade_rests_on_is_ringed_and_drawn_thicker() -> None:
    column = SpeedColumn(
        model="HM1",
        session="first",
        speeds=((80.0, 95.0),),
        mean=85.0,
        graded=((95.0,),),
    )
    (axes,) = speed_figure(
        SpeedDots(columns=(column,), raters=("R1",), slowest=60.0)
    ).axes
    ringed = [line for line in axes.lines if line.get_fillstyle() == "none"]
    assert [list(line.get_ydata()) for line in ringed] == [[95.0]]
    plain = panel()
    widths = []
    for graded in (False, True):
        one = dataclasses.replace(
            plain, stretches=plain.stretches[:1], graded=(graded,)
        )
        top = trace_figure(TraceColumns(panels=(one,))).axes[0]
        widths.append(top.lines[0].get_linewidth())
    assert widths[1] > 2.0 * widths[0]


@pytest.mark.parametrize(
    ("n_raters", "reference", "n_panels"), [(2, None, 1), (3, None, 2), (13, "Gold", 2)]
)
def test_every_group_has_its_map_and_what_raters_change_beside_it(
    n_raters: int, reference: str | None, n_panels: int
) -> None:
    parts = [("A", diagnosis(n_raters, reference)), ("B", diagnosis(n_raters))]
    with house_style():
        figure = rater_figure(parts[:1] if reference else parts, "Fleiss' κ")
        lay_out(figure, "")
    maps = [axes for axes in figure.axes if axes.images]
    assert len(figure.axes) == len(maps) * n_panels
    cells = [axes.get_position() for axes in maps]
    assert [of.y1 for of in cells] == sorted((of.y1 for of in cells), reverse=True)
    across, down = figure.get_size_inches() / maps[0].images[0].get_array().shape[::-1]
    # nearly squares, where they are more than the scale of colours needs
    assert n_raters == 2 or cells[0].width * across == pytest.approx(
        cells[0].height * down, rel=0.3
    )


def test_the_part_as_intended_stands_beside_its_row() -> None:
    content = GradesByAim(
        intended=("1", "2"),
        scale=("0", "1", "2"),
        counts=((1, 3, 0), (0, 0, 2)),
        shares=((0.75, 0.2, 0.99), (1.0, 0.16, 1.0)),
    )
    with house_style():
        left, right = aim_figure(content).axes
    assert [text.get_text() for text in left.texts] == ["1", "3", "2"]
    frames = [patch.get_x() + 0.46 for patch in left.patches]
    assert frames == pytest.approx([1, 2])  # the columns of 1 and of 2
    lines = [np.asarray(line.get_xydata()).tolist() for line in right.lines]
    assert lines == [
        [[20.0, 0.0], [99.0, 0.0]],
        [[75.0, 0.0]],
        [[16.0, 1.0], [100.0, 1.0]],
        [[100.0, 1.0]],
    ]


@pytest.mark.parametrize("has_places", [True, False])
def test_effects_of_order_reach_as_far_as_they_are(has_places: bool) -> None:
    nan = float("nan")
    content = OrderDifferences(
        parts=(
            PlaceDots(session="a", places=("1–2", "3–4"), steps=(0.1, -0.1)),
            PlaceDots(session="b", places=("1", "2"), steps=(nan, 0.9)),
        )
        if has_places
        else (),
        effects=(("one", 0.2, -2.0, 2.4), ("other", -0.1, nan, nan)),
    )
    with house_style():
        *left, right = difference_figure(content).axes
    low, high = right.get_xlim()
    assert low == -high
    assert high >= 2.4
    assert len(right.lines) == 4  # zero, an interval and its dot, a dot without one
    assert len(left) == has_places
    for axes in left:
        assert axes.get_ylim()[1] >= 0.9
        # sessions of unlike places have parts in common, not places
        assert [tick.get_text() for tick in axes.get_xticklabels()] == ["1", "2"]
    assert draw(content, stamp="published")["svg"].startswith(b"<?xml")
