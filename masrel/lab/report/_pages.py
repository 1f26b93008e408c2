"""The document a report is, and the pages it is written as.

In: sections whose figures are drawn. Out: the bytes of a page, in every format that
`WRITERS` names.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import chain
from typing import Literal

from masrel.lab.report._pandoc import converted
from masrel.pages._sections import Block, Document, html_page, narrow
from masrel.tables._latex import in_math
from masrel.tables._tables import Column, Table, page_cells


@dataclass(frozen=True, slots=True, kw_only=True)
class Writer:
    """A format of pages."""

    file: str  # name of the page, in the report's folder
    write: Callable[[Document], bytes]
    is_converted: bool = False  # whether pandoc makes it


def _as_html(document: Document) -> bytes:
    return html_page(document).encode()


def _as_markdown(document: Document) -> bytes:
    return _markdown(document, None).encode()


def _markdown(document: Document, form: Literal["latex", "docx"] | None) -> str:
    # form: what pandoc makes of it, whose captions it then has
    # Imported here: a section's tables alone load no templates.
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader("masrel.lab.report"),
        autoescape=False,
        undefined=StrictUndefined,
        keep_trailing_newline=True,
    )
    escape = as_markdown
    if form == "latex":  # whose own letters have no Greek ones

        def escape(text: str) -> str:
            return in_math(as_markdown(text).replace("$", r"\$"))

    environment.filters |= {"md": escape, "cells": page_cells, "rule": _rule}
    template = environment.get_template("report.md")
    return template.render(document=document, for_pandoc=form is not None)


def _as_document(form: Literal["latex", "docx"], document: Document) -> bytes:
    # tables are no wider than paper
    sections = tuple(
        replace(section, blocks=tuple(chain(*map(_parts, section.blocks))))
        for section in document.sections
    )
    document = replace(document, sections=sections)
    blocks = [block for section in sections for block in section.blocks]
    pictures = {
        block.files["png"]: block.pictures["png"] for block in blocks if block.files
    }
    return converted(_markdown(document, form), form, pictures=pictures)


def _parts(block: Block) -> list[Block]:
    if not isinstance(block.content, Table):
        return [block]
    return [replace(block, content=part) for part in narrow(block.content)]


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


def _rule(columns: Sequence[Column], rows: Sequence[Sequence[str]]) -> str:
    # of a table: how columns are set, and how wide they are to each other
    lines = []
    for column, *cells in zip(columns, *rows, strict=True):
        words = (word for text in (column.heading, *cells) for word in text.split())
        widest = min(max(map(len, cells), default=0), _WIDEST)
        line = "-" * max(widest, *map(len, words), 3)
        colons = {"left": (":", ""), "right": ("", ":"), "center": (":", ":")}
        lines.append(line.join(colons[column.align]))
    return f"|{'|'.join(lines)}|"


_WIDEST = 30  # letters of a column of text that may be broken into lines

_MARKDOWN_ESCAPES = str.maketrans({letter: f"\\{letter}" for letter in "\\`*_|<>[]#"})


def as_markdown(text: str) -> str:
    """Return a text as one line of Markdown that shows it as it is."""
    return " ".join(text.translate(_MARKDOWN_ESCAPES).split())
