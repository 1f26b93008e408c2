"""What the catch depends on: its angle and its duration against mean speed."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from numpy.typing import NDArray

from masrel.report.figures.style import (
    BLACK,
    BLUE,
    GREY,
    ORANGE,
    VERMILLION,
    Form,
    as_bytes,
    house_style,
    put_stamp,
)

__all__ = ["CatchCurve", "draw_catches"]

_LOOKS = ((BLUE, "o"), (VERMILLION, "s"), (BLACK, "^"), (ORANGE, "D"), (GREY, "v"))


@dataclass(frozen=True, slots=True, kw_only=True)
class CatchCurve:
    """Catches of one model, found in motions of many speeds.

    Attributes
    ----------
    label : str
        The model.
    mean_speed : ndarray, shape (n_motions,)
        Mean speed from onset to catch, deg/s.
    catch_angle : ndarray, shape (n_motions,)
        deg.
    catch_speed : ndarray, shape (n_motions,)
        Mean speed during the catch, deg/s.
    duration : ndarray, shape (n_motions,)
        Of the catch, s; ``nan`` where the motion ends within it.
    clamps : tuple of two float
        ν_L and ν_H of (6), deg/s.
    """

    label: str
    mean_speed: NDArray[np.float64] = field(compare=False, repr=False)
    catch_angle: NDArray[np.float64] = field(compare=False, repr=False)
    catch_speed: NDArray[np.float64] = field(compare=False, repr=False)
    duration: NDArray[np.float64] = field(compare=False, repr=False)
    clamps: tuple[float, float]


def draw_catches(curves: Sequence[CatchCurve], *, form: Form, stamp: str) -> bytes:
    """Draw catch angle, duration, and duration times speed, against mean speed.

    Parameters
    ----------
    curves : sequence of CatchCurve
        The models.
    form : {"png", "svg", "pdf"}
        What file.
    stamp : str
        The line that says where the data come from.

    Returns
    -------
    bytes
        The file; the same curves give the same bytes.
    """
    with house_style():
        figure = Figure(figsize=(7.2, 3.1))
        angle, duration, travel = figure.subplots(1, 3)
        for curve, look in zip(
            curves, [_LOOKS[i % len(_LOOKS)] for i in range(len(curves))], strict=True
        ):
            _angles(angle, curve, look)
            _marks(duration, curve.catch_speed, curve.duration, curve.label, look)
            gone = curve.duration * curve.catch_speed
            _marks(travel, curve.catch_speed, gone, curve.label, look)
        angle.set_xlabel("mean speed before\nthe catch (deg/s)")
        angle.set_ylabel("catch angle (deg)")
        for axes in (duration, travel):
            axes.set_xlabel("mean speed during\nthe catch (deg/s)")
            axes.set_ylim(bottom=0.0)
        duration.set_ylabel("catch duration (s)")
        travel.set_ylabel("duration × speed (deg)")
        handles, labels = travel.get_legend_handles_labels()
        ring = Line2D(
            [], [], color=GREY, marker="o", markerfacecolor="none", linestyle="none"
        )
        handles.append(ring)
        labels.append("ν$_L$ and ν$_H$ of (6)")
        figure.legend(handles, labels, loc="outside lower center", ncols=6)
        put_stamp(figure, stamp)
        return as_bytes(figure, form)


def _angles(axes: Axes, curve: CatchCurve, look: tuple[str, str]) -> None:
    # the clamps of (6) as rings on the line
    _marks(axes, curve.mean_speed, curve.catch_angle, curve.label, look)
    speeds = curve.mean_speed
    for at in curve.clamps:
        if speeds.size and speeds.min() < at < speeds.max():
            height = float(np.interp(at, speeds, curve.catch_angle))
            axes.plot(
                at, height, "o", markersize=6.5, markerfacecolor="none",
                markeredgecolor=look[0], markeredgewidth=0.8,
            )  # fmt: skip


def _marks(
    axes: Axes,
    x: NDArray[np.float64],
    y: NDArray[np.float64],
    label: str,
    look: tuple[str, str],
) -> None:
    colour, marker = look
    every = max(1, x.size // 8)
    axes.plot(
        x,
        y,
        color=colour,
        linewidth=1.0,
        marker=marker,
        markersize=3.2,
        markevery=every,
        label=label,
    )
