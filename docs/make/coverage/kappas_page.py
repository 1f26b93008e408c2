"""Rows of coverage as tables, as figures, and on the page."""

from collections.abc import Sequence

import pandas as pd

from docs.make.coverage.figure import LOWEST, Looks, draw
from docs.make.coverage.study import monte_carlo_error, percent
from docs.make.evidence import EVIDENCE, table, with_part

HIGHEST = 98.5
"""A coverage (%) above is higher than need be."""

QUESTIONS = {
    "items": "other items",
    "raters": "other raters",
    "both": "other items and raters",
    "two raters": "other items, two raters",
    "careless raters": "other raters",
}
BEFORE, AFTER = "auto-2026.1", "auto-2026.2"
"""Rules of the default for other items."""

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


def write_page(_: pd.DataFrame) -> None:
    """Write the parts of the page and its figures from the rows that there are."""
    path = EVIDENCE / "coverage.md"
    path.write_text(page(path.read_text("utf-8")), encoding="utf-8")
    first = _of_first(read("coverage"))
    panels = first["study"].map(QUESTIONS) + ": " + first["family"]
    draw(first.assign(panel=panels), "coverage", LOOKS)
    rules = read("coverage_defaults")
    draw(rules.assign(panel=rules["family"]), "coverage_defaults", RULES)


def page(text: str) -> str:
    """Return the page with the parts that its rows say."""
    rows = read("coverage")
    default, first = rows[rows["interval"] == "default"], _of_first(rows)
    n = int(rows["n_studies"].max())
    is_low, is_high = default["coverage"] < LOWEST, default["coverage"] > HIGHEST
    drawn = (
        f"{n} studies in each of {rows.groupby(['study', 'family', 'cell']).ngroups} "
        "cells: a population, a number of items and one of raters. A coverage of 95 % "
        f"has a Monte Carlo error of {100 * monte_carlo_error(0.95, n):.1f} %."
    )
    counts = (
        f"Of {len(default)} intervals (a cell and a coefficient each) {is_low.sum()} "
        f"cover less than {LOWEST} % and {is_high.sum()} more than {HIGHEST} %."
    )
    parts = {
        "drawn": drawn,
        "default": f"{counts}\n\n{summary(default, ['study', 'family'])}",
        "methods": crossed(first, "study"),
        "rules": crossed(_of_rules("coverage_defaults"), "family"),
        "held out": crossed(_of_rules("coverage_held_out"), "family"),
    }
    for name, part in parts.items():
        text = with_part(text, name, part)
    return text


def _of_rules(name: str) -> pd.DataFrame:
    rows = read(name)
    return rows[rows["interval"].isin([BEFORE, AFTER])]


def read(name: str) -> pd.DataFrame:
    """Read rows, with the coverage, and the cell in words."""
    rows = pd.read_csv(EVIDENCE / f"{name}.csv")
    rows["coverage"] = percent(rows)
    sizes = rows["n_items"].astype(str) + " × " + rows["n_raters"].astype(str)
    rows["cell"] = rows["population"] + ", " + sizes
    return rows[rows["undefined"] < rows["n_studies"]]


def _of_first(rows: pd.DataFrame) -> pd.DataFrame:
    """Return the rows of the coefficient that every method has."""
    return rows[rows["coefficient"].isin(["fleiss_kappa", "cohen_kappa"])]


def summary(rows: pd.DataFrame, lines: Sequence[str]) -> str:
    """Return a line a group in Markdown: how many fail, and what they cover."""
    shown = list[list[object]]()
    for names, of in rows.groupby(list(lines), sort=False):
        n_low = int((of["coverage"] < LOWEST).sum())
        ends = [f"{x:.0f}" for x in of["coverage"].agg(["min", "mean", "max"])]
        shown.append([*names, len(of), n_low, *ends, f"{of['width'].mean():.2f}"])
    head = ["intervals", "too low", "least %", "mean %", "most %", "mean width"]
    return table([*lines, *head], shown, n_text=len(lines))


def crossed(rows: pd.DataFrame, column: str) -> str:
    """Return mean coverages in Markdown, and how many intervals are too low."""
    columns = list(rows[column].unique())
    cells = rows.groupby(["interval", column], sort=False)["coverage"].agg(_in_words)
    shown = cells.unstack(sort=False).reindex(columns=columns).fillna("–")
    return table(["method", *columns], shown.reset_index().to_numpy().tolist())


def _in_words(coverage: pd.Series) -> str:
    n_low = int((coverage < LOWEST).sum())
    return f"{coverage.mean():.0f} ({n_low} of {len(coverage)})"
