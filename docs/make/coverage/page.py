"""The page on coverage."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from string import Template
from typing import NamedTuple

from docs.make.coverage.careless import CarelessCell
from docs.make.coverage.methods import DEFAULT, FEW, METHODS, PEERS, SEVERAL
from docs.make.coverage.rare import RareCell
from docs.make.coverage.rare_page import (
    careless_rows,
    careless_share,
    rare_cells,
    rare_failures,
    rare_summary,
)
from docs.make.coverage.simulate import DESIGNS, KAPPAS, MODELS, TARGETS, Cell, Counted

LOWEST, HIGHEST = 93, 98  # %, of coverages rounded to whole numbers
Cells = Sequence[Cell]


class Rare(NamedTuple):
    """What came of studies with rare categories, and with careless raters."""

    chosen: Sequence[RareCell]
    checked: Sequence[RareCell]
    careless: Sequence[CarelessCell]


_TEMPLATE = Path(__file__).with_name("page_template.md")


def page(cells: Cells, others: Cells, rare: Rare) -> str:
    """Write the page in Markdown."""
    return Template(_TEMPLATE.read_text(encoding="utf-8")).substitute(
        n_studies=f"{cells[0].n_studies:,}".replace(",", " "),
        error=f"{100 * cells[0].error(0.95):.1f}",
        few=FEW,
        several=SEVERAL,
        seen=_seen(cells),
        of_default=_of_default(cells),
        outside=_outside(cells),
        n_outside=sum(not is_within(c.methods[DEFAULT].coverage) for c in cells),
        n_cells=len(cells),
        n_nobody=sum(not any(_within(c)) for c in cells),
        n_others=others[0].n_studies,
        error_of_others=f"{100 * others[0].error(0.95):.1f}",
        others=_of_others(others),
        all_methods="\n\n".join(_of_target(cells)),
        **_of_rare(rare),
    )


def _of_rare(rare: Rare) -> dict[str, str]:
    head = ["coefficient", "cells", "jackknife fails", "least %", "default fails"]
    head += ["least %", "higher than need be"]
    every = [*rare.chosen, *rare.checked]
    failing = ["coefficient", "raters", "rarer", "items × raters", "κ", "studies"]
    careful = ["items × raters", "coverage %", "studies without a careless rater %"]
    return {
        "n_rare": f"{every[0].n_studies:,}".replace(",", " "),
        "n_rare_cells": str(len(every)),
        "n_rare_low": str(len(rare_failures(every))),
        "n_neither": str(
            sum(c.verdict() == c.verdict("jackknife") == "low" for c in every)
        ),
        "n_rare_before": str(sum(c.verdict("jackknife") == "low" for c in every)),
        "chosen": markdown_table(head, rare_summary(rare.chosen), n_text=1),
        "checked": markdown_table(head, rare_summary(rare.checked), n_text=1),
        "rare_failures": markdown_table(
            [*failing, "default", "jackknife"], rare_failures(every), n_text=4
        ),
        "rare_cells": "\n\n".join(
            markdown_table(heads, rows, n_text=3)
            for cells in (rare.chosen, rare.checked)
            for heads, rows in rare_cells(cells)
        ),
        "careless": markdown_table(careful, careless_rows(rare.careless), n_text=1),
        "careless_share": careless_share(),
    }


def is_within(coverage: float) -> bool:
    """Whether a coverage rounds to 93-98 %."""
    return LOWEST <= round(100 * coverage) <= HIGHEST


def _within(cell: Cell) -> list[str]:
    # candidates, which peers are not, that cover as they should
    return [
        name
        for name, counted in cell.methods.items()
        if name not in PEERS and is_within(counted.coverage)
    ]


def _seen(cells: Cells) -> str:
    rows = []
    for target in TARGETS:
        of_target = [cell for cell in cells if cell.target == target]
        for name in METHODS[target]:
            of_method = [cell.methods[name] for cell in of_target]
            shares = [counted.coverage for counted in of_method]
            width = sum(counted.width for counted in of_method) / len(of_method)
            inside = sum(map(is_within, shares))
            ends = f"{100 * min(shares):.0f}", f"{100 * max(shares):.0f}"
            rows.append([target, name, *ends, f"{inside}", f"{width:.2f}"])
    head = ["target", "method", "least %", "most %", "cells within 93-98", "mean width"]
    return markdown_table(head, rows, n_text=2)


def _of_default(cells: Cells) -> str:
    rows = []
    for target, model, design in _groups():
        row = [_cell(cells, target, model, design, kappa) for kappa in KAPPAS]
        defaults = [cell.methods[DEFAULT] for cell in row]
        covers = [
            f"{marked(of)} ± {100 * cell.error(of.coverage):.1f}"
            for of, cell in zip(defaults, row, strict=True)
        ]
        widths = [f"{of.width:.2f}" for of in defaults]
        rows.append([target, model, design, *covers, *widths])
    kappas = [f"κ {kappa:g}" for kappa in KAPPAS]
    head = [
        "target",
        "model",
        "items × raters",
        *kappas,
        *(f"width {k}" for k in kappas),
    ]
    return markdown_table(head, rows, n_text=3)


def _outside(cells: Cells) -> str:
    rows = []
    for cell in cells:
        default, others = cell.methods[DEFAULT].coverage, _within(cell)
        if is_within(default) and others:
            continue
        narrow = min(others, key=lambda name: cell.methods[name].width, default="")
        other = f"{narrow}, {marked(cell.methods[narrow])}" if narrow else "none"
        place = [cell.target, cell.model, str(cell.design), f"{cell.kappa:g}"]
        shares = [f"{100 * x:.0f} %" for x in (cell.spreadless, cell.single)]
        rows.append([*place, marked(cell.methods[DEFAULT]), other, *shares])
    head = ["target", "model", "items × raters", "κ", "default", "narrowest within"]
    head += ["no spread", "one category"]
    return markdown_table(head, rows, n_text=3)


_TITLES = {
    "items": "Other items",
    "raters": "Other raters",
    "both": "Other items and raters",
}
_COMPARED: dict[str, tuple[str, ...]] = {
    "items": ("posterior, holding κ̂", "jackknife, t, intraclass, stopgap"),
    "raters": ("jackknife, t, intraclass, stopgap", "posterior"),
    "both": ("posterior and E", "V_I and E, intraclass, stopgap"),
}


def _of_others(cells: Cells) -> str:
    tables = []
    for target, compared in _COMPARED.items():
        here = [cell for cell in cells if cell.target == target]
        rows = []
        for model, design in dict.fromkeys((c.model, str(c.design)) for c in here):
            row = [_cell(here, target, model, design, kappa) for kappa in KAPPAS]
            shown = [_triple(row, name) for name in (DEFAULT, *compared)]
            rows.append([model, design, *shown])
        head = ["model", "items × raters", DEFAULT, *compared]
        tables += [f"### {_TITLES[target]}", markdown_table(head, rows, n_text=2)]
    return "\n\n".join(tables)


def _triple(cells: Cells, name: str) -> str:
    return " / ".join(marked(cell.methods[name]) for cell in cells)


def _of_target(cells: Cells) -> Iterator[str]:
    for target in TARGETS:
        yield f"### {_TITLES[target]}"
        for model in MODELS:
            rows = []
            for name in METHODS[target]:
                by_design = [
                    [_cell(cells, target, model, str(d), k) for k in KAPPAS]
                    for d in DESIGNS
                ]
                covers = [_triple(of_design, name) for of_design in by_design]
                widths = [
                    " / ".join(f"{cell.methods[name].width:.2f}" for cell in of_design)
                    for of_design in by_design
                ]
                rows.append([name, *covers, *widths])
            designs = [str(design) for design in DESIGNS]
            head = ["method", *designs, *(f"width {d}" for d in designs)]
            yield f"**{model[0].upper()}{model[1:]}**"
            yield markdown_table(head, rows, n_text=1)


def _groups() -> Iterator[tuple[str, str, str]]:
    for target in TARGETS:
        for model in MODELS:
            for design in DESIGNS:
                yield target, model, str(design)


def _cell(cells: Cells, target: str, model: str, design: str, kappa: float) -> Cell:
    key = target, model, design, kappa
    return next(c for c in cells if (c.target, c.model, str(c.design), c.kappa) == key)


def marked(counted: Counted) -> str:
    """Return a coverage; bold: it is too little; italic: more than need be."""
    shown = f"{100 * counted.coverage:.0f}"
    if is_within(counted.coverage):
        return shown
    return f"**{shown}**" if int(shown) < LOWEST else f"*{shown}*"


def markdown_table(head: list[str], rows: list[list[str]], *, n_text: int) -> str:
    """Return a table whose first columns are text, the others numbers."""
    rule = ["---"] * n_text + ["---:"] * (len(head) - n_text)
    return "\n".join(f"| {' | '.join(row)} |" for row in [head, rule, *rows])
