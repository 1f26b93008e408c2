"""A document of sections as a self-contained page.

In: sections of paragraphs, tables, pictures and references. Out: HTML.
"""

import html
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

from masrel.plots._drawn_values import Drawn, Form
from masrel.tables._tables import SYMBOL, Table, page_cells

if TYPE_CHECKING:
    from jinja2 import Environment


@dataclass(frozen=True, slots=True, kw_only=True)
class Paragraph:
    """One paragraph of plain text."""

    text: str
    absent: bool = False  # whether it says that something is not there


@dataclass(frozen=True, slots=True, kw_only=True)
class Drawing:
    """A figure that is drawn when the document is written, and not before."""

    name: str  # name of its files, without extension
    caption: str  # what it shows, understood alone
    alt: str  # what a reader who cannot see it needs to know
    content: Drawn  # what is drawn
    stamp: str  # the line that says where its data come from


@dataclass(frozen=True, slots=True, kw_only=True)
class References:
    """What is cited, as a paper lists it, and as a file beside the page has it."""

    texts: tuple[str, ...]
    bibtex: str


Content = Paragraph | Table | Drawing | References
"""What a section is made of."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Section:
    """One section of the report."""

    name: str  # its name in the protocol's ``report.sections``
    title: str  # its heading
    blocks: tuple[Content, ...]  # in order


_KINDS = {
    Paragraph: "paragraph",
    Table: "table",
    Drawing: "figure",
    References: "references",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Block:
    """A part of a section, with its number among those of its kind."""

    number: str
    content: Content
    # of a figure: its bytes by form (inline, png, svg), and, by form, its file from the
    # report's folder
    pictures: Mapping[Form, bytes] = field(default_factory=dict)
    files: Mapping[Form, str] = field(default_factory=dict)

    @property
    def tables(self) -> list[Table]:
        """Itself in parts that no document is too narrow for, if it is a table."""
        return narrow(self.content) if isinstance(self.content, Table) else []

    @property
    def kind(self) -> str:
        """What it is: paragraph, table, figure or references."""
        return _KINDS[type(self.content)]


def drawn_block(
    number: str,
    content: Content,
    *,
    stamp: str = "",
    forms: Sequence[Form] = ("inline",),
) -> Block:
    """Return a block, its figure drawn; a stamp is given to one that has none."""
    pictures: dict[Form, bytes] = {}
    if isinstance(content, Drawing):
        from masrel.plots import draw  # a page without pictures loads nothing of it

        pictures = draw(content.content, stamp=content.stamp or stamp, forms=forms)
    return Block(number=number, content=content, pictures=pictures)


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
    # what is folded on a page and comes after the rest on paper
    supplement: tuple[Chapter, ...] = ()


_LETTERS = 106  # of a line of a table on paper
_WRAPPED = 14  # of a text that goes on in the next line


def narrow(table: Table) -> list[Table]:
    """Return a table in parts for which paper is wide enough, each with its names."""
    columns, rows = page_cells(table)
    widths = []
    for column, *cells in zip(columns, *rows, strict=True):
        # a number stays in one line
        wraps = column.align != "right"
        least = min(_WRAPPED * wraps or _LETTERS, max(map(len, cells), default=0))
        words = " ".join((column.heading, *(cells if wraps else ()))).split()
        widths.append(2 + max(least, *map(len, words)))
    names = (len({tuple(row[:n]) for row in rows}) for n in range(1, len(columns)))
    n_names = next((n for n, of in enumerate(names, 1) if of == len(rows)), 1)
    room = used = max(_LETTERS - sum(widths[:n_names]), _LETTERS // 2)
    parts: list[set[str]] = []
    for column, width in zip(columns[n_names:], widths[n_names:], strict=True):
        if (used := used + width) > room:
            parts.append({of.key for of in columns[:n_names]})
            used = width
        parts[-1].add(column.key)
    if len(parts) < 2:
        return [table]
    return [
        replace(
            table,
            caption=f"{table.caption} (part {at} of {len(parts)})",
            columns=tuple(
                of if of.key in part else replace(of, where="csv")
                for of in table.columns
            ),
            notes=table.notes if at == len(parts) else (),
        )
        for at, part in enumerate(parts, 1)
    ]


def chapters(
    sections: Sequence[Section],
    block_of: Callable[[str, Content], Block],
    prefix: str = "",
) -> tuple[Chapter, ...]:
    """Return sections of blocks, made of contents numbered by their kinds."""
    numbers: Counter[type] = Counter()

    def numbered(content: Content) -> Block:
        numbers[type(content)] += 1
        return block_of(f"{prefix}{numbers[type(content)]}", content)

    return tuple(
        Chapter(
            name=section.name,
            title=section.title,
            blocks=tuple(map(numbered, section.blocks)),
        )
        for section in sections
    )


TEMPLATES = Path(__file__).with_name("templates")


def template_environment(folder: Path) -> "Environment":
    """Return what renders the templates in a folder; all but plain text is escaped."""
    # Imported here: who wants tables loads no templates.
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    return Environment(
        loader=FileSystemLoader(folder),
        autoescape=lambda name: not f"{name}".endswith((".md", ".txt")),
        undefined=StrictUndefined,
        keep_trailing_newline=True,
    )


def html_page(document: Document) -> str:
    """Return a document as one HTML page."""
    environment = template_environment(TEMPLATES)
    environment.filters |= {
        "symbols": _symbols,
        "cells": page_cells,
        "svg": _svg,
    }
    style = (TEMPLATES / "page.css").read_text(encoding="utf-8")
    return environment.get_template("page.html").render(document=document, style=style)


def _svg(picture: bytes, alt: str) -> str:
    # an element of the page, in its colours, which a reader hears as an image; on a
    # narrow screen it shrinks as far as its letters can be read
    svg = picture.decode()
    width = float(svg.split('width="', 1)[1].split("pt", 1)[0])
    names = f'<svg role="img" aria-label="{html.escape(alt)}" '
    least = f'style="min-width: {_READABLE * width:.0f}pt" '
    return svg.replace("<svg ", names + least, 1)


_READABLE = 0.7  # of its size


def _symbols(text: str) -> str:
    # Escaped first; what is added after that is ours, and so safe in a template.
    text = SYMBOL.sub(r"\1<sub>\2</sub>", html.escape(text))
    return text.replace(" %", "&nbsp;%")  # no line begins with the sign
