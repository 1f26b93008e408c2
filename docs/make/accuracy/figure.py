"""The figure of accuracy: relative errors of every package, group by group."""

import math
import random
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from docs.make.accuracy import peers

if TYPE_CHECKING:
    from docs.make.accuracy.__main__ import Line, Off

# Okabe and Ito's colours, told apart also by those who do not see red or green
LOOKS = {
    "masrel": ("#0072B2", "o"),
    "statsmodels": ("#D55E00", "s"),
    "irrCAC": ("#CC79A7", "D"),
    "scikit-learn": ("#E69F00", "v"),
    "krippendorff": ("#009E73", "^"),
}
PACKAGES = ("masrel", *peers.PACKAGES)
_LEAST, _NONE = 1e-19, 1e8  # where exact numbers and missing ones are drawn


def draw(lines: "Sequence[Line]", path: Path) -> None:
    """Draw errors of values and of standard errors, one panel each."""
    mpl.rcParams.update({"font.size": 8, "savefig.dpi": 200, "svg.hashsalt": "masrel"})
    figure = Figure(figsize=(7.2, 4.6), layout="constrained")
    left, right = figure.subplots(1, 2, sharey=True)
    groups = list(dict.fromkeys(line.case.group for line in lines))
    for axes, title in ((left, "value"), (right, "standard error")):
        for package in PACKAGES:
            if package in lines[0].values:
                _scatter(axes, lines, groups, package, title)
        _frame(axes, title, len(groups))
    left.set_yticks(range(len(groups)), groups)
    left.invert_yaxis()
    handles, labels = left.get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=5, frameon=False)
    path.parent.mkdir(exist_ok=True)
    figure.savefig(path, metadata={"Software": None})


def _scatter(
    axes: Axes, lines: "Sequence[Line]", groups: list[str], package: str, title: str
) -> None:
    jitter = random.Random(package)  # the same in every run
    row = (PACKAGES.index(package) - 2) * 0.16
    x, y = [], []
    for line in lines:
        off = line.off(title)[package]
        if line.exact(title) is None:
            continue
        if off.is_offered and off.is_comparable and not off.is_unasked:
            x.append(_place(off))
            y.append(groups.index(line.case.group) + row + jitter.uniform(-0.05, 0.05))
    colour, marker = LOOKS[package]
    axes.scatter(
        x, y, 9, color=colour, marker=marker, alpha=0.7, linewidths=0, label=package
    )


def _place(off: "Off") -> float:
    if off.note:
        return _NONE
    error = off.relative if off.absolute is None else off.absolute
    return max(error, _LEAST)


def _frame(axes: Axes, title: str, n_groups: int) -> None:
    axes.set_xscale("log")
    axes.set_xlim(1e-20, 1e10)
    ticks = [1e-16, 1e-12, 1e-8, 1e-4, 1]
    axes.set_xticks(
        [_LEAST, *ticks, _NONE],
        ["0", *(f"$10^{{{round(math.log10(t))}}}$" for t in ticks), "none"],
    )
    axes.xaxis.set_minor_locator(mpl.ticker.NullLocator())
    axes.axvline(2**-53, color="0.6", lw=0.8, ls="--")
    for between in range(n_groups - 1):
        axes.axhline(between + 0.5, color="0.9", lw=0.6, zorder=0)
    axes.set_title(title, fontsize=9)
    axes.set_xlabel("relative error")
    axes.spines[["top", "right"]].set_visible(False)
