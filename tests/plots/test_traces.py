"""Traces: all of every stretch is drawn, its phases told apart, and named."""

from math import radians

import numpy as np
import pytest
from matplotlib.axes import Axes

from masrel.lab.elbow import STANDARD_MODELS, ConstantSpeed, Trace, trace
from masrel.plots import traces
from tests.plots.made import blank, overlaps, texts_of


def stretch(speed: float, model: str = "HM3") -> Trace:
    motion = ConstantSpeed(start=radians(30), end=radians(146), speed=radians(speed))
    return trace(STANDARD_MODELS[model], motion, rate_hz=200.0)


def drawn(axes: Axes) -> np.ndarray:
    """The points of all lines, without gaps, once each and in order."""
    points = np.concatenate([line.get_xydata() for line in axes.lines])
    return np.unique(points[~np.isnan(points[:, 0])], axis=0)


@pytest.mark.parametrize("quantity", ["torque", "angle"])
def test_every_sample_is_drawn_in_the_units_of_its_axis(quantity: str) -> None:
    made = stretch(92.0)
    axes = traces(made, quantity=quantity, ax=blank())
    values = made.torque if quantity == "torque" else np.degrees(made.angle)
    expected = np.unique(np.stack([made.time, values], axis=1), axis=0)
    np.testing.assert_allclose(drawn(axes), expected)
    assert (
        axes.get_ylabel()
        == {"torque": "torque (N·m)", "angle": "angle (deg)"}[quantity]
    )


def test_phases_differ_in_colour_and_in_style_and_the_legend_has_those_there_are() -> (
    None
):
    caught, slow = traces(stretch(92.0), ax=blank()), traces(stretch(2.0), ax=blank())
    lines = [line for line in caught.lines if line.get_marker() == "None"]
    looks = [(of.get_color(), of.get_linewidth(), of.get_linestyle()) for of in lines]
    assert len({colour for colour, *_ in looks}) == len(looks) == 3
    assert len({tuple(rest) for _, *rest in looks}) == 3
    assert [of.get_text() for of in caught.get_legend().get_texts()] == [
        "pre-catch",
        "catch",
        "post-catch",
    ]
    assert slow.get_legend() is None


@pytest.mark.parametrize("speeds", [(60, 92, 120), range(60, 120, 4), (92,) * 5])
@pytest.mark.parametrize("quantity", ["torque", "angle"])
def test_names_lie_on_none_other(speeds: tuple[int, ...], quantity: str) -> None:
    labels = [f"{speed} deg/s" for speed in speeds]
    axes = traces([stretch(of) for of in speeds], labels=labels, quantity=quantity)
    assert overlaps(axes) == []
    assert sorted(of for of in texts_of(axes) if of in labels) == sorted(labels)
