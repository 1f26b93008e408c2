"""The figure of accuracy: relative errors of every package, group by group."""

import math
import random
from collections.abc import Sequence
from pathlib import Path

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from docs.make.accuracy import peers
from docs.make.accuracy.numbers import QUANTITIES, Number

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


def draw(numbers: Sequence[Number], path: Path) -> None:
    """Draw errors of values and of standard errors, one panel each."""
    mpl.rcParams.update({"font.size": 8, "savefig.dpi": 200, "svg.hashsalt": "masrel"})
    figure = Figure(figsize=(7.2, 4.6), layout="constrained")
    panels = figure.subplots(1, 2, sharey=True)
    groups = list(dict.fromkeys(of.case.group for of in numbers))
    for axes, what in zip(panels, QUANTITIES, strict=True):
        of_what = [of for of in numbers if of.what == what]
        for package in PACKAGES:
            if shown := [of for of in of_what if of.package == package]:
                _scatter(axes, shown, groups, package)
        _frame(axes, what, len(groups))
    panels[0].set_yticks(range(len(groups)), groups)
    panels[0].invert_yaxis()
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=5, frameon=False)
    path.parent.mkdir(exist_ok=True)
    figure.savefig(path, metadata={"Software": None})


def _scatter(
    axes: Axes, numbers: Sequence[Number], groups: list[str], package: str
) -> None:
    jitter = random.Random(package)  # the same in every run
    row = (PACKAGES.index(package) - 2) * 0.16
    shown = [of for of in numbers if of.counts and not of.is_unasked]
    y = [
        groups.index(of.case.group) + row + jitter.uniform(-0.05, 0.05) for of in shown
    ]
    colour, marker = LOOKS[package]
    axes.scatter(
        [_place(of) for of in shown], y, 9, color=colour, marker=marker, alpha=0.7,
        linewidths=0, label=package,
    )  # fmt: skip


def _place(of: Number) -> float:
    if of.note:
        return _NONE
    return max(of.relative if of.absolute is None else of.absolute, _LEAST)


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
