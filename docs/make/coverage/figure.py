"""The figure of coverage: targets by models, every cell a place on the axis."""

from collections.abc import Sequence
from pathlib import Path

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from docs.make.coverage.methods import DEFAULT
from docs.make.coverage.simulate import DESIGNS, KAPPAS, MODELS, TARGETS, Cell

# Okabe and Ito's colours; markers tell them apart without colour
_COLOURS = {
    "default": ("#0072B2", "o"),
    "plain jackknife": ("#E69F00", "v"),
    "irrCAC": ("#CC79A7", "D"),
    "null standard error": ("#D55E00", "x"),
}
_PLAIN = {"items": "jackknife, t", "raters": "jackknife, t", "both": "V_I + V_R, t"}
_LEAST = 40.0
_TITLES = {
    "items": "other items",
    "raters": "other raters",
    "both": "other items and raters",
}


def draw(cells: Sequence[Cell], path: Path) -> None:
    """Draw it."""
    mpl.rcParams.update({"font.size": 8, "savefig.dpi": 300, "svg.hashsalt": "masrel"})
    figure = Figure(figsize=(7.2, 5.8), layout="constrained")
    panels = figure.subplots(len(TARGETS), len(MODELS), sharex=True, sharey=True)
    for row, target in zip(panels, TARGETS, strict=True):
        for axes, model in zip(row, MODELS, strict=True):
            _frame(axes)
            here = [c for c in cells if (c.target, c.model) == (target, model)]
            _points(axes, here, _PLAIN[target])
            if target == TARGETS[0]:
                axes.set_title(model[0].upper() + model[1:], fontsize=8)
        row[0].set_ylabel(f"{_TITLES[target]}\ncoverage (%)")
    handles, labels = panels[0][0].get_legend_handles_labels()
    figure.legend(
        handles[::-1], labels[::-1], loc="outside upper center", ncols=5, frameon=False
    )
    figure.supxlabel(
        "κ 0.2, 0.6, 0.9 from left to right in each design, items × raters", fontsize=8
    )
    figure.savefig(path, metadata={"Software": None})


def _points(axes: Axes, cells: Sequence[Cell], plain: str) -> None:
    names = {**{name: name for name in _COLOURS}, "plain jackknife": plain}
    for label, (colour, marker) in reversed(_COLOURS.items()):
        shares = [100 * c.methods[names[label]].coverage for c in cells]
        size = 22 if names[label] == DEFAULT else 16
        axes.scatter(
            [_place(c) for c in cells],
            [max(share, _LEAST) for share in shares],
            size,
            color=colour,
            marker=marker,
            linewidths=1.0 if marker == "x" else 0,
            label=label,
            zorder=3 if names[label] == DEFAULT else 2,
            clip_on=False,
        )


def _place(cell: Cell) -> float:
    return DESIGNS.index(cell.design) * 4.0 + KAPPAS.index(cell.kappa)


def _frame(axes: Axes) -> None:
    axes.axhspan(93, 98, color="0.9", lw=0, zorder=0)
    axes.axhline(95, color="0.6", lw=0.8, zorder=1)
    axes.set_ylim(_LEAST, 101)
    axes.set_yticks([40, 50, 60, 70, 80, 90, 95, 100])
    axes.set_xlim(-1, 15)
    axes.set_xticks([1 + 4 * j for j in range(len(DESIGNS))], [str(d) for d in DESIGNS])
    axes.tick_params(axis="x", length=0)
    for between in range(1, len(DESIGNS)):
        axes.axvline(4 * between - 1, color="0.85", lw=0.6, zorder=0)
    axes.spines[["top", "right"]].set_visible(False)
