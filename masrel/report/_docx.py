"""Text and tables as a document of a word processor, the same bytes every time."""

import importlib
import importlib.util
import io
import zipfile
from collections.abc import Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from typing import TYPE_CHECKING, Any

from masrel.errors import ParameterError
from masrel.report._material import Drawing, Listing, Paragraph
from masrel.report._pages import Block, Document
from masrel.report._tables import Table, page_cells

if TYPE_CHECKING:
    from docx.document import Document as WordDocument

_CONTENTS = "Contents"
_FIELD = ' TOC \\o "1-1" \\h \\z \\u '  # headings of level 1, as links
_FIRST_DAY = (1980, 1, 1, 0, 0, 0)  # the earliest that a zip can say


@dataclass(frozen=True, slots=True, kw_only=True)
class Heading:
    """The heading of a document, or of a part of it."""

    text: str
    level: int = 0


@dataclass(frozen=True, slots=True, kw_only=True)
class Picture:
    """A figure with what is said below it, and to who cannot see it."""

    png: bytes
    caption: str
    alt: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Contents:
    """A table of contents: the headings of level 1, each a link to its place."""


Part = Heading | Paragraph | Table | Listing | Picture | Contents
"""What a document is made of."""


def check_docx() -> None:
    """Refuse documents of a word processor where what writes them is not installed."""
    if importlib.util.find_spec("docx") is None:
        raise ParameterError(
            "docx: needs python-docx; install it with: pip install 'masrel[docx]'"
        )


def report_docx(document: Document) -> bytes:
    """Return a report as the bytes of a DOCX file."""
    parts: list[Part] = [Heading(text=document.title)]
    parts += [Paragraph(text=document.banner)] if document.banner else []
    parts.append(Paragraph(text=document.provenance))
    parts.append(Paragraph(text=f"{document.tag} {document.result}".strip()))
    parts.append(Contents())
    for section in document.sections:
        parts.append(Heading(text=section.title, level=1))
        parts += [_part(block, document.tag) for block in section.blocks]
    parts.append(Heading(text="Made from", level=1))
    parts.append(Paragraph(text=f"masrel {document.version}"))
    parts += [Paragraph(text=f"{name}: {hash_}") for name, hash_ in document.inputs]
    return as_docx(parts, header=document.tag.removesuffix(".").upper())


def _part(block: Block, tag: str) -> Part:
    # with its number among tables, or figures
    content = block.content
    if isinstance(content, Table):
        return replace(content, caption=f"Table {block.number}. {content.caption}")
    if isinstance(content, Drawing):
        caption = f"{tag} {content.caption}".strip()
        return Picture(
            png=block.pictures["png"],
            caption=f"Figure {block.number}. {caption}",
            alt=content.alt,
        )
    return content


def as_docx(
    parts: Sequence[Part], *, landscape: bool = False, header: str = ""
) -> bytes:
    """Return parts as the bytes of a DOCX file; every page has the header."""
    check_docx()
    docx = importlib.import_module("docx")
    document: WordDocument = docx.Document()
    if header:
        document.sections[0].header.paragraphs[0].text = header
    if landscape:
        _turn(document)
    for part in parts:
        _add(document, part)
    if any(isinstance(part, Contents) for part in parts):
        _fill_contents(document)
    properties = document.core_properties
    properties.author = properties.comments = ""
    properties.created = properties.modified = datetime(*_FIRST_DAY)
    properties.title = next((p.text for p in parts if isinstance(p, Heading)), "")
    out = io.BytesIO()
    document.save(out)
    return _without_times(out.getvalue())


def _add(document: "WordDocument", part: Part) -> None:
    if isinstance(part, Heading):
        document.add_heading(_clean(part.text), part.level)
    elif isinstance(part, Paragraph):
        document.add_paragraph(_clean(part.text))
    elif isinstance(part, Listing):
        document.add_heading(part.title, 2)
        document.add_paragraph(part.text, style="macro")
    elif isinstance(part, Picture):
        _add_picture(document, part)
    elif isinstance(part, Contents):
        document.add_heading(_CONTENTS, 1)
    else:
        _add_table(document, part)


def _fill_contents(document: "WordDocument") -> None:
    """Put a field below the heading of the contents, with what it will say."""
    # One paragraph an entry: the field begins in the first and ends after the last. It
    # has no pages, which only what lays out knows: to update the field adds them.
    from docx.enum.style import WD_STYLE_TYPE

    headings = [p for p in document.paragraphs if p.style.name == "Heading 1"]  # type: ignore[union-attr]
    place = next(nth for nth, p in enumerate(headings) if p.text == _CONTENTS)
    after = headings[place + 1]
    document.styles.add_style("toc 1", WD_STYLE_TYPE.PARAGRAPH, builtin=True)
    for nth, heading in enumerate(headings[place + 1 :]):
        _bookmark(heading, nth)
        entry = after.insert_paragraph_before(style="toc 1")
        if nth == 0:
            _field_part(entry, "begin")
            text = _add_element(
                entry.add_run()._r, "w:instrText", ("xml:space", "preserve")
            )
            text.text = _FIELD
            _field_part(entry, "separate")
        link = _add_element(
            entry._p, "w:hyperlink", ("w:anchor", _mark(nth)), ("w:history", "1")
        )
        _add_element(_add_element(link, "w:r"), "w:t").text = heading.text
    _field_part(after.insert_paragraph_before(), "end")


def _bookmark(heading: Any, nth: int) -> None:
    number = ("w:id", str(nth))
    start = _add_element(heading._p, "w:bookmarkStart", number, ("w:name", _mark(nth)))
    heading.runs[0]._r.addprevious(start)
    _add_element(heading._p, "w:bookmarkEnd", number)


def _mark(nth: int) -> str:
    return "_Toc" + str(nth + 1).zfill(8)


def _field_part(paragraph: Any, kind: str) -> None:
    _add_element(paragraph.add_run()._r, "w:fldChar", ("w:fldCharType", kind))


def _add_element(parent: Any, name: str, *attributes: tuple[str, str]) -> Any:
    from docx.oxml import OxmlElement
    from docx.oxml.ns import qn

    element = OxmlElement(name)
    for key, value in attributes:
        element.set(qn(key), value)
    parent.append(element)
    return element


def _clean(text: str) -> str:
    # without the letters that XML cannot hold
    return "".join(c for c in text if c in "\t\n" or ord(c) >= 32)


def _add_picture(document: "WordDocument", picture: Picture) -> None:
    section = document.sections[0]
    sides = section.page_width, section.left_margin, section.right_margin
    page, left, right = (int(side or 0) for side in sides)
    width = page - left - right
    shape = document.add_picture(io.BytesIO(picture.png))
    scale = min(1.0, width / shape.width, width / shape.height)  # none is enlarged
    shape.width, shape.height = (
        type(shape.width)(side * scale) for side in (shape.width, shape.height)
    )
    shape._inline.docPr.set("descr", _clean(picture.alt))
    document.add_paragraph(_clean(picture.caption), style="Caption")


def _turn(document: "WordDocument") -> None:
    from docx.enum.section import WD_ORIENT

    (section,) = document.sections
    size = section.page_height, section.page_width
    section.orientation = WD_ORIENT.LANDSCAPE
    section.page_width, section.page_height = size


def _add_table(document: "WordDocument", table: Table) -> None:
    from docx.enum.text import WD_ALIGN_PARAGRAPH

    document.add_paragraph(_clean(table.labelled_caption), style="Caption")
    columns, rows = page_cells(table)
    aligns = {
        "left": WD_ALIGN_PARAGRAPH.LEFT,
        "right": WD_ALIGN_PARAGRAPH.RIGHT,
        "center": WD_ALIGN_PARAGRAPH.CENTER,
    }
    grid = document.add_table(rows=0, cols=len(columns), style="Light List")
    heads = [column.heading for column in columns]
    for number, texts in enumerate([heads, *rows]):
        cells = grid.add_row().cells
        for cell, text, column in zip(cells, texts, columns, strict=True):
            cell.text = _clean(text)
            cell.paragraphs[0].alignment = aligns[column.align]
        if number == 0:
            _repeat_on_pages(grid.rows[0])
    for note in table.notes:
        document.add_paragraph(_clean(note))
    document.add_paragraph()


def _repeat_on_pages(row: Any) -> None:
    # python-docx has no other way
    _add_element(row._tr.get_or_add_trPr(), "w:tblHeader", ("w:val", "true"))


def _without_times(data: bytes) -> bytes:
    # the same archive, every entry dated the same
    out = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(data)) as old, zipfile.ZipFile(out, "w") as new:
        for name in old.namelist():
            entry = zipfile.ZipInfo(name, date_time=_FIRST_DAY)
            entry.compress_type = zipfile.ZIP_DEFLATED
            new.writestr(entry, old.read(name))
    return out.getvalue()
