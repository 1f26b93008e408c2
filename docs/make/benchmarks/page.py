"""The page of benchmarks and its figures."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from docs.make.benchmarks.parts import write_part

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


def slope(lines: "Sequence[Line]") -> float:
    """Return the steepest of our slopes from 10 000 items on, with errors."""
    points = [(_ratings(x.name), x.times[OURS[1]].median) for x in lines]
    large = np.log([pair for pair in points if pair[0] >= 50_000])
    return float((np.diff(large[:, 1]) / np.diff(large[:, 0])).max())


def write_page(
    path: Path,
    lines: "Sequence[Line]",
    more: "Sequence[Line]",
    megabytes: Mapping[str, float],
    versions: Mapping[str, str],
    machine: str,
) -> None:
    """Write the part of the page in Markdown."""
    text = [
        "## Estimates",
        "",
        "`python -m docs.make.benchmarks.agreement` repeats this part: every function "
        "in turn in one run, medians; ± is the",
        "relative half-distance of the quartiles. Times are of one machine with other "
        "load; ratios are what to look at. masrel",
        "computes Fleiss' κ, AC1 and α, and their standard errors where it says so; "
        "each peer one coefficient, irrCAC with",
        "its error, the others without.",
        "",
        f"{machine}; " + ", ".join(f"{k} {v}" for k, v in versions.items()) + ".",
        "",
        "### From a matrix of whole numbers",
        "",
        "| items × raters | masrel, three | with errors | "
        + " | ".join(_peers(lines))
        + " | ratio |",
        "|---|---|---|" + "---|" * len(_peers(lines)) + "---|",
    ]
    for line in lines:
        cells = [_seconds(line, name) for name in (*OURS, *_peers(lines))]
        text.append(f"| {line.name} | " + " | ".join(cells) + f" | {_ratio(line)} |")
    steepest = slope(lines)
    text += [
        "",
        "Ratio: masrel's three coefficients over the fastest peer's one; with errors "
        f"it is {_with_errors(lines)}. From 10 000 "
        f"items on, log time against log ratings rises by at most {steepest:.2f}.",
        "",
        "![Time against ratings](../figures/benchmark_time.png)",
        "",
        "Most memory at once beyond the input, 10 million items by 3 raters: "
        + ", ".join(f"{name} {mb:,.0f} MB" for name, mb in megabytes.items())
        + f" (ratio {megabytes['masrel'] / megabytes['statsmodels']:.3f}).",
        "",
        "### Other ways in",
        "",
        "| what | masrel | beside | ratio |",
        "|---|---|---|---|",
    ]
    for line in more:
        text.append(
            f"| {line.name} | {_seconds(line, 'masrel')} | {line.best}: "
            f"{_seconds(line, line.best)} | {_ratio(line)} |"
        )
    text += [
        "",
        "A standard error is computed when it is read. In the smallest studies three "
        "of them cost more than the estimates.",
        "",
        "### Error against time",
        "",
        "Five raters, all items but five unanimous in one category, so that chance "
        "agreement is near 1; error against the value in",
        "fractions. The dashed line is half a unit in the last place below 1. irrCAC "
        "rounds to five decimals.",
        "",
        "![Error against time](../figures/benchmark_error.png)",
    ]
    write_part(path, "estimates", text)


def _peers(lines: "Sequence[Line]") -> list[str]:
    return [name for name in lines[0].times if name not in OURS]


def _with_errors(lines: "Sequence[Line]") -> str:
    shown = []
    for line in lines:
        ratio = line.times[OURS[1]].median / line.times[line.best].median
        shown.append(f"1/{1 / ratio:.0f}" if ratio < 0.2 else f"{ratio:.2f}")
    return ", ".join(shown)


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
