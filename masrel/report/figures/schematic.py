"""The catch of one stretch, with the constants of the law written where they act."""

from dataclasses import dataclass, field

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from masrel.report.figures.style import (
    BLUE,
    DASHES,
    GREY,
    SHADES,
    Form,
    as_bytes,
    house_style,
    put_stamp,
)

__all__ = ["CatchSchematic", "draw_schematic"]

_NUMERALS = ("i", "ii", "iii", "iv")


@dataclass(frozen=True, slots=True, kw_only=True)
class CatchSchematic:
    """One stretch and its catch.

    Attributes
    ----------
    title : str
        The model and its motion.
    time, torque : ndarray, shape (n_points,)
        s and N·m; where the torque jumps, two points have the same time.
    phases : tuple of (str, float, float)
        Name, first and last time of each phase, s.
    catch, peak_end, catch_end : float
        s; the last is the end of the stretch if that comes first.
    pre_end, peak, residual : float
        Torque before, at and after the peak, N·m.
    residual_name : str
        What the residual is above `pre_end`, as matplotlib sets it.
    """

    title: str
    time: NDArray[np.float64] = field(compare=False, repr=False)
    torque: NDArray[np.float64] = field(compare=False, repr=False)
    phases: tuple[tuple[str, float, float], ...]
    catch: float
    peak_end: float
    catch_end: float
    pre_end: float
    peak: float
    residual: float
    residual_name: str


def draw_schematic(stretch: CatchSchematic, *, form: Form, stamp: str) -> bytes:
    """Draw the torque of a stretch against time and name the parts of its catch.

    Parameters
    ----------
    stretch : CatchSchematic
        The stretch.
    form : {"png", "svg", "pdf"}
        What file.
    stamp : str
        The line that says where the data come from.

    Returns
    -------
    bytes
        The file; the same stretch gives the same bytes.
    """
    with house_style():
        figure = Figure(figsize=(5.4, 3.5))
        axes = figure.subplots()
        highest = max(float(stretch.torque.max()), stretch.peak)
        axes.set_ylim(min(0.0, float(stretch.torque.min())), 1.22 * highest)
        for (name, start, end), numeral in zip(stretch.phases, _NUMERALS, strict=False):
            axes.axvspan(start, end, color=SHADES[name], linewidth=0, zorder=0)
            axes.text(
                0.5 * (start + end), 1.19 * highest, f"({numeral})\n{name}",
                ha="center", va="top", fontsize=8,
            )  # fmt: skip
        axes.plot(stretch.time, stretch.torque, color=BLUE, linewidth=1.6)
        _levels(axes, stretch)
        _durations(axes, stretch)
        axes.set_xlim(stretch.time[0], stretch.time[-1])
        axes.set_xlabel("time (s)")
        axes.set_ylabel("torque (N·m)")
        axes.set_title(stretch.title, loc="left")
        put_stamp(figure, stamp)
        return as_bytes(figure, form)


def _levels(axes: Axes, stretch: CatchSchematic) -> None:
    # arrows from τ_pre_end up: H·v_c beside the peak, Q·H·v_c in the residual
    rest = 0.5 * (stretch.peak_end + stretch.catch_end)
    axes.plot(
        [stretch.catch, stretch.catch_end], [stretch.pre_end] * 2,
        color=GREY, linewidth=0.8, linestyle=DASHES,
    )  # fmt: skip
    places = [(0.5 * (stretch.catch + stretch.peak_end), stretch.peak, "$H\\,v_c$")]
    if stretch.catch_end > stretch.peak_end:
        places.append((rest, stretch.residual, stretch.residual_name))
    for at, top, text in places:
        _arrow(axes, (at, stretch.pre_end), (at, top))
        axes.text(
            at, 0.5 * (stretch.pre_end + top), f" {text}", va="center", fontsize=9
        )
    axes.text(
        stretch.catch_end, stretch.pre_end, r" $\tau_{\mathrm{pre\_end}}$",
        va="center", fontsize=9,
    )  # fmt: skip


def _durations(axes: Axes, stretch: CatchSchematic) -> None:
    gap = 0.04 * stretch.peak
    rows = [
        (stretch.catch, stretch.peak_end, stretch.peak + gap, r"$\Delta T_{peak}$"),
        (stretch.catch, stretch.catch_end, 0.55 * stretch.pre_end, r"$\Delta T_c$"),
    ]
    for start, end, height, text in rows:
        _arrow(axes, (start, height), (end, height))
        axes.text(0.5 * (start + end), height + 0.3 * gap, text, ha="center",
                  va="bottom", fontsize=9)  # fmt: skip


def _arrow(axes: Axes, one: tuple[float, float], other: tuple[float, float]) -> None:
    axes.annotate(
        "",
        one,
        other,
        arrowprops={"arrowstyle": "<->", "lw": 0.8, "shrinkA": 0, "shrinkB": 0},
    )
