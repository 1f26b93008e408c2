"""Estimates, diagnoses and axes made for tests of pictures."""

import itertools
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.text import Text

from masrel.estimates import Distribution, Estimate, Interval
from masrel.intervals import Diagnosis, diagnose

LONG = "Anna-Katharina Freifrau von und zu Hohenstein-Ardeck"


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


def estimate(shown: Interval | None = None, **changes: Any) -> Estimate:
    made: dict[str, Any] = {
        "coefficient": "fleiss_kappa",
        "weights": "identity",
        "value": 0.5,
        "standard_error": 0.1,
        "observed": 0.7,
        "chance": 0.3,
        "n_items": 4,
        "n_items_paired": 4,
        "n_raters": 8,
        "n_categories": 6,
    }
    return Estimate(**{**made, **changes}, interval=shown)


def spread(values: Any, weights: Any, *, continuous: bool = False) -> Interval:
    """An interval with this distribution."""
    kind = "credible" if continuous else "confidence"
    distribution = Distribution(
        values=np.array(values, dtype=float),
        weights=np.array(weights, dtype=float),
        continuous=continuous,
        words="w",
    )
    return interval(kind=kind, distribution=distribution)


def diagnosis(n_raters: int, reference: str | None = None) -> Diagnosis:
    rng = np.random.default_rng(3)
    items = np.arange(20) % 3
    drawn = rng.integers(0, 3, (20, n_raters))
    ratings = np.where(rng.random(drawn.shape) < 0.7, items[:, None], drawn)
    names = [f"R{k}" for k in range(n_raters)]
    if reference is not None:
        names[-1] = reference
    return diagnose(ratings, target="items", raters=names, reference=reference)


def blank() -> Axes:
    return Figure(layout="constrained").add_subplot()


def texts_of(axes: Axes) -> list[str]:
    """Every text that a reader of a picture sees."""
    return [text.get_text() for text in _shown(axes) if text.get_text()]


def overlaps(axes: Axes) -> list[tuple[str, str]]:
    """Every two texts of a drawn picture that lie on each other, and none cut off."""
    figure = axes.figure
    figure.draw_without_rendering()
    boxes = [(of.get_text(), of.get_window_extent()) for of in _shown(axes)]
    boxes = [(text, box) for text, box in boxes if text.strip()]
    beyond = [
        (text, "the figure's edge")
        for text, box in boxes
        if box.x0 < 0 or box.y0 < 0
        or box.x1 > figure.bbox.x1 + 0.5 or box.y1 > figure.bbox.y1 + 0.5
    ]  # fmt: skip
    return beyond + [
        (one, other)
        for (one, first), (other, second) in itertools.combinations(boxes, 2)
        if min(first.x1, second.x1) - max(first.x0, second.x0) > 1.0
        and min(first.y1, second.y1) - max(first.y0, second.y0) > 1.0
    ]


def _shown(axes: Axes) -> list[Text]:
    # a label of a tick beyond the ends of its axis is there, and not drawn
    beyond = {
        label
        for of in axes.findobj(Axes)
        for axis in (of.xaxis, of.yaxis)
        for tick in axis.get_major_ticks()
        for label in (tick.label1, tick.label2)
        if not min(ends := axis.get_view_interval()) <= tick.get_loc() <= max(ends)
    }
    texts = axes.findobj(Text)
    return [of for of in texts if of.get_visible() and of not in beyond]
