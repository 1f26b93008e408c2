"""The document a report is, and the pages it is written as.

In: sections whose figures are drawn. Out: the bytes of a page, in every format that
`WRITERS` names.
"""

from collections.abc import Callable
from dataclasses import dataclass

from masrel.pages._sections import Document, html_page
from masrel.tables._tables import page_cells


@dataclass(frozen=True, slots=True, kw_only=True)
class Writer:
    """A format of pages."""

    file: str  # name of the page, in the report's folder
    write: Callable[[Document], bytes]


def _as_html(document: Document) -> bytes:
    return html_page(document).encode()


def _as_markdown(document: Document) -> bytes:
    # Imported here: a section's tables alone load no templates.
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader("masrel.lab.report"),
        autoescape=False,
        undefined=StrictUndefined,
        keep_trailing_newline=True,
    )
    environment.filters |= {"md": as_markdown, "cells": page_cells}
    return environment.get_template("report.md").render(document=document).encode()


def _as_latex(document: Document) -> bytes:
    # Imported here, as below: who wants a page loads no other format.
    from masrel.lab.report._latex_report import report_latex

    return report_latex(document).encode()


def _as_docx(document: Document) -> bytes:
    from masrel.lab.report._docx import report_docx

    return report_docx(document)


WRITERS: dict[str, Writer] = {
    "html": Writer(file="report.html", write=_as_html),
    "markdown": Writer(file="report.md", write=_as_markdown),
    "latex": Writer(file="report.tex", write=_as_latex),
    "docx": Writer(file="report.docx", write=_as_docx),
}
"""The formats of pages by name, in the order in which they are written."""


_MARKDOWN_ESCAPES = str.maketrans({letter: f"\\{letter}" for letter in "\\`*_|<>[]#"})


def as_markdown(text: str) -> str:
    """Return a text as one line of Markdown that shows it as it is."""
    return " ".join(text.translate(_MARKDOWN_ESCAPES).split())
