"""The document a report is, and the pages it is written as.

In: sections whose figures are drawn. Out: the bytes of a page, in every format that
`WRITERS` names.
"""

import base64
import html
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from masrel.lab.report._blocks import Document
from masrel.tables._tables import SYMBOL, page_cells


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
