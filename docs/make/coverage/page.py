"""Rows of coverage as tables, as figures, and on the page."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from string import Template

import matplotlib as mpl
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from docs.make.coverage.study import monte_carlo_error

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
_CAPTION = "*A marker is the worst coefficient of a cell; its line ends at their mean.*"
_TEMPLATE = Path(__file__).with_name("page_template.md")


def write_page(folder: Path) -> None:
    """Write the page and its figures from the rows in a folder."""
    (folder / "coverage.md").write_text(page(folder), encoding="utf-8")
    first = _of_first(read(folder / "coverage.csv"))
    panels = first["study"].map(QUESTIONS) + ": " + first["family"]
    figures = folder.parent / "figures"
    draw(first.assign(panel=panels), figures / "coverage.png", LOOKS)
    if (decided := folder / "coverage_defaults.csv").exists():
        rows = read(decided)
        path = figures / "coverage_defaults.png"
        draw(rows.assign(panel=rows["family"]), path, RULES)


def page(folder: Path) -> str:
    """Return the page in Markdown."""
    rows = read(folder / "coverage.csv")
    n = int(rows["n_studies"].max())
    default = rows[rows["method"] == "default"]
    first = _of_first(rows)
    three, place = ["items", "raters", "both"], ["study", "family", "size"]
    return Template(_TEMPLATE.read_text(encoding="utf-8")).substitute(
        n_studies=f"{n:,}".replace(",", " "),
        error=f"{100 * monte_carlo_error(0.95, n):.1f}",
        n_cells=rows.groupby(["study", "family", *_CELL]).ngroups,
        n_default=len(default),
        n_low=(default["coverage"] < LOWEST).sum(),
        n_high=(default["coverage"] > HIGHEST).sum(),
        by_coefficient=table(_of(default, three), place, "coefficient"),
        by_method=table(_of(first, three), place, "method"),
        summary=summary(_of(first, three), ["study", "method"]),
        two_coefficients=table(_of(default, ["two raters"]), ["size"], "coefficient"),
        two_methods=table(_of(first, ["two raters"]), ["size"], "method"),
        careless=table(_of(default, ["careless raters"]), ["size"], "coefficient"),
        failures=_failures(default),
        rules=_rules(folder),
    )


def read(path: Path) -> pd.DataFrame:
    """Read rows, with the size in words."""
    rows = pd.read_csv(path)
    rows["size"] = rows["n_items"].astype(str) + " × " + rows["n_raters"].astype(str)
    return rows


def _of(rows: pd.DataFrame, studies: Sequence[str]) -> pd.DataFrame:
    return rows[rows["study"].isin(studies)]


def _of_first(rows: pd.DataFrame) -> pd.DataFrame:
    """Return the rows of the coefficient that every method has."""
    return rows[rows["coefficient"].isin(["fleiss_kappa", "cohen_kappa"])]


def marked(coverage: float) -> str:
    """Return it in %; bold: it is too low; italic: it is higher than need be."""
    share = f"{100 * coverage:.0f}"
    if coverage < LOWEST:
        return f"**{share}**"
    return f"*{share}*" if coverage > HIGHEST else share


def table(rows: pd.DataFrame, lines: Sequence[str], columns: str) -> str:
    """Return coverages in Markdown, cells of one place joined by strokes."""
    shown = rows.assign(shown=rows["coverage"].map(marked))
    joined = shown.groupby([*lines, columns], sort=False)["shown"].agg(" / ".join)
    return _markdown(joined.unstack(columns, fill_value="", sort=False), lines)


def summary(rows: pd.DataFrame, lines: Sequence[str]) -> str:
    """Return a line a group in Markdown: how many fail, and what they cover."""
    groups = rows.groupby(list(lines), sort=False)
    percent = 100 * groups["coverage"].agg(["min", "mean", "max"])
    nowhere = 100 * (1.0 - groups["answered"].mean())
    return _markdown(
        pd.DataFrame({
            "intervals": groups.size(),
            "too low": groups["coverage"].agg(lambda of: (of < LOWEST).sum()),
            "least %": percent["min"].map("{:.0f}".format),
            "mean %": percent["mean"].map("{:.0f}".format),
            "most %": percent["max"].map("{:.0f}".format),
            "mean width": groups["width"].mean().map("{:.2f}".format),
            "no interval %": nowhere.map("{:.1f}".format),
        }),
        lines,
    )  # fmt: skip


def _failures(rows: pd.DataFrame) -> str:
    """Return a line a cell that fails, of the coefficient that is covered least."""
    cells = ["study", "family", *_CELL]
    low = rows[rows["coverage"] < LOWEST].groupby(cells, sort=False)["coverage"]
    worst = rows.loc[low.idxmin()].assign(nowhere=lambda of: 1.0 - of["answered"])
    lines = [*cells, "coefficient"]
    shares = worst.set_index(lines)[
        ["coverage", "truth_below", "truth_above", "nowhere"]
    ]
    shown = shares.map(lambda share: f"{100 * share:.0f}")
    heads = ["covered %", "truth below %", "truth above %", "no interval %"]
    return _markdown(shown.set_axis(heads, axis=1), lines)


def _rules(folder: Path) -> str:
    """Return what became of the default for other items, where that is known."""
    parts = []
    if (folder / "coverage_defaults.csv").exists():
        parts = ["![Coverage of the rules](../figures/coverage_defaults.png)", _CAPTION]
    for name, title in (
        ("coverage_defaults.csv", "Of the cells by which the rule was chosen:"),
        ("coverage_held_out.csv", "Of cells drawn once it was:"),
    ):
        if not (folder / name).exists():
            continue
        rows = read(folder / name)
        rows = rows[rows["answered"] > 0.0]  # a method may have none of a coefficient
        # of each cell the coefficient that is covered least
        lines = ["family", *_CELL]
        worst = rows.groupby([*lines, "method"], sort=False)["coverage"].min()
        worst = worst.reset_index()
        fails = worst[(worst["method"] == AFTER) & (worst["coverage"] < LOWEST)]
        parts += [title, summary(rows, ["family", "method"])]
        if fails.empty:
            parts += [f"`{AFTER}` is nowhere too low."]
            continue
        parts += [f"Where `{AFTER}` is too low, the worst coefficient:"]
        parts += [table(worst.merge(fails[lines], on=lines), lines, "method")]
    return "\n\n".join(parts) or "It was not run yet."


def _markdown(frame: pd.DataFrame, lines: Sequence[str]) -> str:
    """Return a table whose first columns are text, the others numbers."""
    whole = frame.reset_index().astype(str)
    rule = ["---"] * len(lines) + ["---:"] * (whole.shape[1] - len(lines))
    rows = [list(whole.columns), rule, *whole.to_numpy().tolist()]
    return "\n".join(f"| {' | '.join(row)} |" for row in rows)


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
