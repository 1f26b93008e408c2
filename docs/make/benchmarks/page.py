"""Benchmarks of estimates as rows, and their figures."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import matplotlib as mpl
from matplotlib.figure import Figure

from docs.make.evidence import write_tables

if TYPE_CHECKING:
    from docs.make.benchmarks.agreement import Line

COLOURS = {
    "masrel": "#0072B2",
    "masrel, with errors": "#56B4E9",
    "statsmodels": "#D55E00",
    "krippendorff": "#009E73",
    "irrCAC": "#CC79A7",
}
OURS = ("masrel", "masrel, with errors")
MARKERS = {
    "masrel": "o",
    "masrel, with errors": "v",
    "statsmodels": "s",
    "krippendorff": "^",
    "irrCAC": "D",
}


def _figure() -> Figure:
    mpl.rcParams.update({"font.size": 9, "axes.spines.top": False})
    mpl.rcParams.update({"axes.spines.right": False, "savefig.dpi": 200})
    return Figure(figsize=(5.6, 3.8), layout="constrained")


def draw_times(lines: "Sequence[Line]", path: Path) -> None:
    """Draw time against ratings, both logarithmic, with the slope of ours."""
    figure = _figure()
    axes = figure.add_subplot()
    for name, colour in COLOURS.items():
        of_package = [
            (_ratings(line.name), line.times[name].median)
            for line in lines
            if name in line.times
        ]
        if of_package:
            label = name.replace("masrel", "masrel, three coefficients")
            x, y = zip(*of_package, strict=True)
            axes.loglog(x, y, marker=MARKERS[name], color=colour, label=label)
    axes.set_xlabel("ratings")
    axes.set_ylabel("time (s)")
    axes.grid(alpha=0.25)
    axes.legend(frameon=False)
    figure.savefig(path)


def draw_errors(points: Sequence[tuple[str, int, float, float]], path: Path) -> None:
    """Draw the error of Fleiss' kappa against time, ours and peers'."""
    figure = _figure()
    axes = figure.add_subplot()
    floor = 1e-17
    for name, colour in COLOURS.items():
        of_package = [
            (s, max(off, floor), n) for who, n, s, off in points if who == name
        ]
        if of_package:
            x, y, items = zip(*of_package, strict=True)
            axes.loglog(x, y, MARKERS[name], color=colour, label=name, alpha=0.9)
            for i, (at, off, n) in enumerate(zip(x, y, items, strict=True)):
                axes.annotate(
                    f"{n:.0e}".replace("e+0", "e"),
                    (at, off),
                    xytext=(0, -11 if i % 2 else 5),  # so that neighbours keep apart
                    textcoords="offset points",
                    ha="center",
                    size=6,
                )
    axes.axhline(2**-54, color="0.6", lw=0.8, ls="--")
    axes.set_xlabel("time (s); beside each point the number of items")
    axes.set_ylabel("absolute error of κ")
    axes.legend(frameon=False)
    figure.savefig(path)


def _ratings(name: str) -> int:
    n, r = name.replace(",", "").split(" × ")
    return int(n) * int(r)


def write_page(
    lines: "Sequence[Line]", more: "Sequence[Line]", megabytes: Mapping[str, float]
) -> None:
    """Write the rows."""
    peers = _peers(lines)
    text = ["| items × raters | masrel, three | with errors | "]
    text[0] += " | ".join(peers) + " | ratio | ratio with errors |"
    text += ["|---|---|---|" + "---|" * (len(peers) + 2)]
    for line in lines:
        cells = [_seconds(line, name) for name in (*OURS, *peers)]
        cells += [_ratio(line), _with_errors(line)]
        text.append(f"| {line.name} | " + " | ".join(cells) + " |")
    text += ["", "| what | masrel | beside | ratio |", "|---|---|---|---|"]
    for line in more:
        text.append(
            f"| {line.name} | {_seconds(line, 'masrel')} | {line.best}: "
            f"{_seconds(line, line.best)} | {_ratio(line)} |"
        )
    text += ["", "| 10,000,000 × 3 | most memory |", "|---|---|"]
    text += [f"| {name} | {mb:,.0f} MB |" for name, mb in megabytes.items()]
    write_tables(["estimates", "inputs", "memory"], text)


def _peers(lines: "Sequence[Line]") -> list[str]:
    return [name for name in lines[0].times if name not in OURS]


def _with_errors(line: "Line") -> str:
    ratio = line.times[OURS[1]].median / line.times[line.best].median
    return f"1/{1 / ratio:.0f}" if ratio < 0.2 else f"{ratio:.2f}"


def _seconds(line: "Line", name: str) -> str:
    if name not in line.times:
        return "–"
    timing = line.times[name]
    units = (("s", 1.0), ("ms", 1e-3), ("µs", 1e-6))
    unit, scale = next((u for u in units if timing.median >= u[1]), units[-1])
    return f"{timing.median / scale:.3g} {unit} ± {100 * timing.spread:.0f} %"


def _ratio(line: "Line") -> str:
    ratio, spread = line.ratio
    shown = f"1/{1 / ratio:.0f}" if ratio < 0.2 else f"{ratio:.2f}"
    return f"{shown} ± {100 * spread:.0f} %"
