"""Where a verb puts what it found: JSON, a table, and the form of a figure."""

import json
from pathlib import Path
from typing import TYPE_CHECKING

import click

from masrel.errors import ParameterError

if TYPE_CHECKING:
    from masrel.report._tables import Table
    from masrel.report.figures import Form

__all__ = ["figure_form", "print_table", "tell", "write_json"]

_FORMS: dict[str, "Form"] = {".png": "png", ".svg": "svg", ".pdf": "pdf"}


def write_json(document: dict[str, object], file: Path) -> None:
    """Write a document, or print it."""
    text = json.dumps(document, indent=1, ensure_ascii=False, allow_nan=False)
    if file == Path("-"):
        click.echo(text)
    else:
        file.write_text(text + "\n", encoding="utf-8", newline="\n")


def print_table(table: "Table", *, csv: bool, latex: bool = False) -> None:
    """Print a table."""
    from masrel.report._tables import as_csv, as_latex, as_text

    form = as_csv if csv else as_latex if latex else as_text
    click.echo(form(table).rstrip("\n"))
    if csv:
        tell(table.notes)


def tell(notes: tuple[str, ...]) -> None:
    """Say notes on stderr, one a line."""
    click.echo("".join(f"{note}\n" for note in notes), err=True, nl=False)


def figure_form(file: Path) -> "Form":
    """Return in which form a figure is wanted."""
    form = _FORMS.get(file.suffix.lower())
    if form is None:
        raise ParameterError(
            f"--figure: needs a name that ends in .png, .svg or .pdf, got {file}"
        )
    return form
