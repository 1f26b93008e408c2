"""The document a report is, and the pages it is written as.

In: sections whose figures are drawn. Out: the bytes of a page, in every format that
`WRITERS` names.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Literal

from masrel.lab.report._pandoc import converted
from masrel.pages._sections import Document, html_page
from masrel.tables._tables import page_cells


@dataclass(frozen=True, slots=True, kw_only=True)
class Writer:
    """A format of pages."""

    file: str  # name of the page, in the report's folder
    write: Callable[[Document], bytes]
    is_converted: bool = False  # whether pandoc makes it


def _as_html(document: Document) -> bytes:
    return html_page(document).encode()


def _as_markdown(document: Document) -> bytes:
    return _markdown(document, for_pandoc=False).encode()


def _markdown(document: Document, *, for_pandoc: bool) -> str:
    # for_pandoc: with captions as it has them
    # Imported here: a section's tables alone load no templates.
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader("masrel.lab.report"),
        autoescape=False,
        undefined=StrictUndefined,
        keep_trailing_newline=True,
    )
    environment.filters |= {"md": as_markdown, "cells": page_cells}
    template = environment.get_template("report.md")
    return template.render(document=document, for_pandoc=for_pandoc)


def _as_document(form: Literal["latex", "docx"], document: Document) -> bytes:
    blocks = [block for section in document.sections for block in section.blocks]
    pictures = {
        block.files["png"]: block.pictures["png"] for block in blocks if block.files
    }
    markdown = _markdown(document, for_pandoc=True)
    return converted(markdown, form, pictures=pictures)


WRITERS: dict[str, Writer] = {
    "html": Writer(file="report.html", write=_as_html),
    "markdown": Writer(file="report.md", write=_as_markdown),
    "latex": Writer(
        file="report.tex", write=partial(_as_document, "latex"), is_converted=True
    ),
    "docx": Writer(
        file="report.docx", write=partial(_as_document, "docx"), is_converted=True
    ),
}
"""The formats of pages by name, in the order in which they are written."""


_MARKDOWN_ESCAPES = str.maketrans({letter: f"\\{letter}" for letter in "\\`*_|<>[]#"})


def as_markdown(text: str) -> str:
    """Return a text as one line of Markdown that shows it as it is."""
    return " ".join(text.translate(_MARKDOWN_ESCAPES).split())
