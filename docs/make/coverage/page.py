"""Rows of coverage as tables, as figures, and on the page."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import matplotlib as mpl
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from docs.make.coverage.study import monte_carlo_error
from docs.make.evidence import table, with_part

LOWEST, HIGHEST = 0.925, 0.985
"""A coverage below is too low, and one above is higher than need be."""

QUESTIONS = {
    "items": "other items",
    "raters": "other raters",
    "both": "other items and raters",
    "two raters": "other items, two raters",
    "careless raters": "other raters",
}
BEFORE, AFTER = "auto-2026.1", "auto-2026.2"
"""Rules of the default for other items."""

Looks = Mapping[str, tuple[str, str]]
# Okabe and Ito's colours; markers tell them apart without colour
LOOKS: Looks = {
    "default": ("#0072B2", "o"),
    "jackknife": ("#E69F00", "v"),
    "bootstrap": ("#009E73", "^"),
    "irrCAC": ("#CC79A7", "D"),
    "SPSS": ("#D55E00", "X"),
}
RULES: Looks = {
    AFTER: LOOKS["default"],
    BEFORE: LOOKS["SPSS"],
    "jackknife": LOOKS["jackknife"],
}
_LEAST = 50.0  # %, where all that is below is drawn
_CELL = ["population", "size"]


def write_page(folder: Path) -> None:
    """Write the parts of the page and its figures from the rows in a folder."""
    path = folder / "coverage.md"
    path.write_text(page(path.read_text("utf-8"), folder), encoding="utf-8")
    first = _of_first(read(folder / "coverage.csv"))
    panels = first["study"].map(QUESTIONS) + ": " + first["family"]
    figures = folder.parent / "figures"
    draw(first.assign(panel=panels), figures / "coverage.png", LOOKS)
    rows = read(folder / "coverage_defaults.csv")
    path = figures / "coverage_defaults.png"
    draw(rows.assign(panel=rows["family"]), path, RULES)


def page(text: str, folder: Path) -> str:
    """Return the page with the parts that its rows say."""
    rows = read(folder / "coverage.csv")
    default = rows[rows["method"] == "default"]
    n = int(rows["n_studies"].max())
    n_low, n_high = (
        int(of.sum())
        for of in (default["coverage"] < LOWEST, default["coverage"] > HIGHEST)
    )
    drawn = (
        f"{n} studies in each of {rows.groupby(['study', 'family', *_CELL]).ngroups} "
        "cells: a population, a number of items and one of raters. A coverage of 95 % "
        f"has a Monte Carlo error of {100 * monte_carlo_error(0.95, n):.1f} %."
    )
    counts = (
        f"Of {len(default)} intervals (a cell and a coefficient each) {n_low} cover "
        f"less than {100 * LOWEST} % and {n_high} more than {100 * HIGHEST} %."
    )
    first = _of_first(rows)
    for name, part in {
        "drawn": drawn,
        "default": f"{counts}\n\n{summary(default, ['study', 'family'])}",
        "methods": crossed(first, "method", "study"),
        "rules": crossed(_of_rules(folder, "coverage_defaults"), "method", "family"),
        "held out": crossed(_of_rules(folder, "coverage_held_out"), "method", "family"),
    }.items():
        text = with_part(text, name, part)
    return text


def _of_rules(folder: Path, name: str) -> pd.DataFrame:
    rows = read(folder / f"{name}.csv")
    return rows[(rows["answered"] > 0.0) & rows["method"].isin([BEFORE, AFTER])]


def read(path: Path) -> pd.DataFrame:
    """Read rows, with the size in words."""
    rows = pd.read_csv(path)
    rows["size"] = rows["n_items"].astype(str) + " × " + rows["n_raters"].astype(str)
    return rows


def _of_first(rows: pd.DataFrame) -> pd.DataFrame:
    """Return the rows of the coefficient that every method has."""
    return rows[rows["coefficient"].isin(["fleiss_kappa", "cohen_kappa"])]


def summary(rows: pd.DataFrame, lines: Sequence[str]) -> str:
    """Return a line a group in Markdown: how many fail, and what they cover."""
    shown = list[list[object]]()
    for names, of in rows.groupby(list(lines), sort=False):
        percent = 100 * of["coverage"]
        n_low = int((of["coverage"] < LOWEST).sum())
        ends = [f"{x:.0f}" for x in (percent.min(), percent.mean(), percent.max())]
        shown.append([*names, len(of), n_low, *ends, f"{of['width'].mean():.2f}"])
    head = ["intervals", "too low", "least %", "mean %", "most %", "mean width"]
    return table([*lines, *head], shown, n_text=len(lines))


def crossed(rows: pd.DataFrame, line: str, column: str) -> str:
    """Return mean coverages in Markdown, and how many intervals are too low."""
    columns = list(rows[column].unique())
    shown = list[list[object]]()
    for name, of_line in rows.groupby(line, sort=False):
        groups = [of_line[of_line[column] == c]["coverage"] for c in columns]
        shown.append(
            [
                name,
                *(
                    f"{100 * of.mean():.0f} ({int((of < LOWEST).sum())} of {len(of)})"
                    if len(of)
                    else "–"
                    for of in groups
                ),
            ]
        )
    return table([line, *columns], shown)


def draw(rows: pd.DataFrame, path: Path, looks: Looks) -> None:
    """Draw a panel a value of the column `panel`: cells down, coverage along.

    A marker is the worst coefficient of a cell, and a line leads to the mean of all.
    """
    mpl.rcParams.update({"font.size": 7, "savefig.dpi": 200, "svg.hashsalt": "masrel"})
    panels = dict(list(rows.groupby("panel", sort=False)))
    heights = [of.groupby(_CELL).ngroups for of in panels.values()]
    figure = Figure(figsize=(7.2, 1.0 + 0.16 * sum(heights)), layout="constrained")
    grid = {"height_ratios": heights}
    every = figure.subplots(len(panels), sharex=True, squeeze=False, gridspec_kw=grid)
    for axes, (title, of) in zip(every.flat, panels.items(), strict=True):
        _panel(axes, of, looks)
        axes.set_title(title, fontsize=8, loc="left")
    handles, labels = every[0, 0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=5, frameon=False)
    every[-1, 0].set_xlabel("coverage (%)")
    path.parent.mkdir(exist_ok=True)
    figure.savefig(path, metadata={"Software": None})


def _panel(axes: Axes, rows: pd.DataFrame, looks: Looks) -> None:
    cells = list(rows.groupby(_CELL, sort=False).groups)
    axes.grid(axis="y", color="0.94", lw=6)
    axes.axvline(100 * LOWEST, color="0.4", lw=0.8, zorder=1)
    axes.axvline(95, color="0.75", lw=0.8, zorder=1)
    for place, (method, (colour, marker)) in enumerate(looks.items()):
        of_method = rows[rows["method"] == method].groupby(_CELL, sort=False)
        percent = (100 * of_method["coverage"].agg(["min", "mean"])).clip(lower=_LEAST)
        off = 0.6 * (place / (len(looks) - 1) - 0.5)
        y = [cells.index(cell) + off for cell in of_method.groups]
        axes.hlines(y, percent["min"], percent["mean"], colour, lw=0.8)
        above = 3.0 - 0.1 * place  # the first on top
        look = {"c": colour, "marker": marker, "lw": 0.0, "zorder": above}
        axes.scatter(percent["min"], y, 12, label=method, **look)
    axes.set_yticks(range(len(cells)), [", ".join(cell) for cell in cells])
    axes.set_ylim(len(cells) - 0.4, -0.6)
    axes.set_xlim(_LEAST - 0.5, 100.5)
    axes.tick_params(axis="y", length=0)
    axes.set_axisbelow(True)
    axes.spines[["top", "right", "left"]].set_visible(False)
