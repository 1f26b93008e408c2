"""Figures: what they say, that they repeat, and that they stay inside their data."""

from typing import Any

import matplotlib as mpl
import numpy as np
import pytest

from masrel.estimates import Distribution, Interval
from masrel.report import figures
from masrel.report.figures import ForestRow, GradeGrid, SpeedColumn, TracePanel
from masrel.report.figures.style import STYLE

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
        ForestRow(label="b", value=float("nan"), text="undefined", **shared),
        ForestRow(label="c", value=None, text="not in these data", **shared),
        ForestRow(label="d", value=0.5, interval=posterior(), text="[0.3, 0.7]"),
        ForestRow(label="e", value=0.5, interval=resampled(), text="[0.2, 0.8]"),
    ]


def panel() -> TracePanel:
    time = np.linspace(0.0, 1.0, 50)
    phase = np.repeat([0, 1, 2], [20, 20, 10])
    stretch = (time, 30 + 100 * time, 5 * time, phase)
    return TracePanel(title="HM1", stretches=(stretch, stretch))


DRAWINGS = {
    "grades": lambda stamp: figures.draw_grades(grid(), stamp=stamp),
    "many raters": lambda stamp: figures.draw_grades(grid(14), stamp=stamp),
    "forest": lambda stamp: figures.draw_forest(forest(), axis_label="κ", stamp=stamp),
    "speeds": lambda stamp: figures.draw_speeds(
        [
            SpeedColumn(
                model="HM1", session="first", speeds=((80.0,), (90.0, 95.0)), mean=85.0
            )
        ],
        raters=("R1", "R2"),
        slowest=60.0,
        stamp=stamp,
    ),
    "traces": lambda stamp: figures.draw_traces([panel()], stamp=stamp),
}


@pytest.mark.parametrize("name", DRAWINGS)
def test_the_same_data_give_the_same_bytes(name: str) -> None:
    first, second = DRAWINGS[name]("SIMULATED DATA"), DRAWINGS[name]("SIMULATED DATA")
    assert first.png.startswith(PNG)
    assert (first.png, first.svg) == (second.png, second.svg)


@pytest.mark.parametrize("name", DRAWINGS)
def test_a_readers_own_matplotlib_settings_change_nothing(name: str) -> None:
    plain = DRAWINGS[name]("")
    with mpl.rc_context({"font.size": 20.0, "svg.hashsalt": "other"}):
        assert DRAWINGS[name]("").svg == plain.svg
        assert mpl.rcParams["font.size"] == 20.0


@pytest.mark.parametrize("name", DRAWINGS)
def test_a_figure_holds_no_time_of_day(name: str) -> None:
    drawn = DRAWINGS[name]("")
    assert b"<dc:date>" not in drawn.svg
    assert b"Software" not in drawn.png


@pytest.mark.parametrize("name", DRAWINGS)
def test_a_simulated_figure_carries_the_stamp(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    # With text kept as text the SVG says what can be read in the figure.
    monkeypatch.setitem(STYLE, "svg.fonttype", "none")
    assert b"SIMULATED DATA" in DRAWINGS[name]("SIMULATED DATA").svg
    assert b"SIMULATED DATA" not in DRAWINGS[name]("").svg


def test_a_grade_is_written_in_its_cell_and_a_missing_one_is_a_dash(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setitem(STYLE, "svg.fonttype", "none")
    svg = figures.draw_grades(grid(), stamp="").svg.decode()
    assert svg.count(">1</text>") == 2  # intended, and the one rater who agrees
    assert svg.count(">2</text>") == 1
    assert svg.count(">–</text>") == 3  # two missing grades, no intended one


def test_an_estimate_that_is_not_there_is_said_in_the_figure(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setitem(STYLE, "svg.fonttype", "none")
    svg = figures.draw_forest(forest(), axis_label="κ", stamp="").svg
    assert b"undefined" in svg
    assert b"not in these data" in svg
