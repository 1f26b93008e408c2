"""The document a report is, and the pages it is written as.

In: sections whose figures are drawn. Out: the bytes of a page, in every format that
`WRITERS` names.
"""

import base64
import html
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from masrel.lab.report._material import Content, Drawing, Listing, Paragraph
from masrel.tables._tables import SYMBOL, Table, page_cells

_KINDS = {
    Paragraph: "paragraph",
    Table: "table",
    Drawing: "figure",
    Listing: "listing",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Block:
    """A part of a section, with its number among those of its kind."""

    number: int
    content: Content
    # of a figure: its bytes, and its file from the report's folder, by form (png, svg)
    pictures: Mapping[str, bytes] = field(default_factory=dict)
    files: Mapping[str, str] = field(default_factory=dict)

    @property
    def kind(self) -> str:
        """What it is: paragraph, table, figure or listing."""
        return _KINDS[type(self.content)]


@dataclass(frozen=True, slots=True, kw_only=True)
class Chapter:
    """A section of the report as it is shown."""

    name: str  # its name in the protocol's ``report.sections``
    title: str
    blocks: tuple[Block, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Document:
    """All that a page of a report says."""

    title: str
    tag: str  # what stands before a caption where data are simulated
    banner: str  # what the page says in large letters, if anything
    provenance: str  # the sentence at its head
    result: str  # the first paragraph: what the study came to
    sections: tuple[Chapter, ...]
    inputs: tuple[tuple[str, str], ...]  # what it was made from, and the hash of that
    version: str  # of masrel


@dataclass(frozen=True, slots=True, kw_only=True)
class Writer:
    """A format of pages."""

    file: str  # name of the page, in the report's folder
    write: Callable[[Document], bytes]


def _as_html(document: Document) -> bytes:
    return _from_template("report.html", document)


def _as_markdown(document: Document) -> bytes:
    return _from_template("report.md", document)


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


def _from_template(name: str, document: Document) -> bytes:
    # Imported here: a section's tables alone load no templates.
    from jinja2 import Environment, PackageLoader, StrictUndefined, select_autoescape

    environment = Environment(
        loader=PackageLoader("masrel.lab.report"),
        autoescape=select_autoescape(enabled_extensions=("html",)),
        undefined=StrictUndefined,
        keep_trailing_newline=True,
    )
    environment.filters |= {
        "md": as_markdown,
        "symbols": _symbols,
        "cells": page_cells,
        "uri": _uri,
    }
    style = Path(__file__).with_name("templates") / "report.css"
    template = environment.get_template(name)
    page = template.render(document=document, style=style.read_text(encoding="utf-8"))
    return page.encode()


def _uri(picture: bytes) -> str:
    # An image of its own, not inline: ids inside two SVGs would collide.
    encoded = base64.b64encode(picture).decode("ascii")
    return f"data:image/svg+xml;base64,{encoded}"


def _symbols(text: str) -> str:
    # Escaped first; what is added after that is ours, and so safe in a template.
    text = SYMBOL.sub(r"\1<sub>\2</sub>", html.escape(text))
    return text.replace(" %", "&nbsp;%")  # no line begins with the sign


_MARKDOWN_ESCAPES = str.maketrans({letter: f"\\{letter}" for letter in "\\`*_|<>[]#"})


def as_markdown(text: str) -> str:
    """Return a text as one line of Markdown that shows it as it is."""
    return " ".join(text.translate(_MARKDOWN_ESCAPES).split())
