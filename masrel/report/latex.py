"""Tables as LaTeX, for the `booktabs` package."""

from masrel.report.tables import Table, on_page, shown

__all__ = ["as_latex"]

_ESCAPES = {
    "\\": r"\textbackslash{}",
    "&": r"\&",
    "%": r"\%",
    "$": r"\$",
    "#": r"\#",
    "_": r"\_",
    "{": r"\{",
    "}": r"\}",
    "~": r"\textasciitilde{}",
    "^": r"\textasciicircum{}",
    "−": "$-$",
    "–": "--",
    "κ": r"$\kappa$",
    "π": r"$\pi$",
    "α": r"$\alpha$",
}


def as_latex(table: Table) -> str:
    r"""Return a table as LaTeX that needs the package `booktabs` and no other."""
    page = on_page(table)
    caption = f"SIMULATED DATA. {page.caption}" if page.simulated else page.caption
    letters = "".join(
        {"left": "l", "center": "c"}.get(c.align, "r") for c in page.columns
    )
    rows = [
        [shown(value, column) for value, column in zip(row, page.columns, strict=True)]
        for row in page.rows
    ]
    head = [column.heading for column in page.columns]
    lines = [
        r"\begin{table}",
        r"\centering",
        rf"\caption{{{_escaped(caption)}}}",
        rf"\begin{{tabular}}{{{letters}}}",
        r"\toprule",
        _line(head),
        r"\midrule",
        *map(_line, rows),
        r"\bottomrule",
        r"\end{tabular}",
    ]
    if page.notes:
        notes = r" \\ ".join(map(_escaped, page.notes))
        lines.append(rf"\par\smallskip\footnotesize\raggedright {notes}")
    return "\n".join([*lines, r"\end{table}"]) + "\n"


def _line(cells: list[str]) -> str:
    return " & ".join(map(_escaped, cells)) + r" \\"


def _escaped(text: str) -> str:
    return "".join(_ESCAPES.get(letter, letter) for letter in text)
