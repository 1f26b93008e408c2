"""Text and tables as a document of a word processor, the same bytes every time."""

import importlib
import io
import zipfile
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import TYPE_CHECKING

from masrel.errors import ParameterError
from masrel.report._material import Paragraph
from masrel.report._tables import Table, page_cells

if TYPE_CHECKING:
    from docx.document import Document

_FIRST_DAY = (1980, 1, 1, 0, 0, 0)  # the earliest that a zip can say


@dataclass(frozen=True, slots=True, kw_only=True)
class Heading:
    """The heading of a document, or of a part of it."""

    text: str
    level: int = 0


def as_docx(
    blocks: Sequence[Heading | Paragraph | Table], *, landscape: bool = False
) -> bytes:
    """Return headings, paragraphs and tables as the bytes of a DOCX file."""
    try:
        docx = importlib.import_module("docx")
    except ModuleNotFoundError as error:
        raise ParameterError(
            "docx: needs python-docx; install it with: pip install 'masrel[docx]'"
        ) from error
    document: Document = docx.Document()
    if landscape:
        _turn(document)
    for block in blocks:
        if isinstance(block, Heading):
            document.add_heading(block.text, block.level)
        elif isinstance(block, Paragraph):
            document.add_paragraph(block.text)
        else:
            _add_table(document, block)
    properties = document.core_properties
    properties.author = properties.comments = ""
    properties.created = properties.modified = datetime(*_FIRST_DAY)
    properties.title = next((b.text for b in blocks if isinstance(b, Heading)), "")
    out = io.BytesIO()
    document.save(out)
    return _without_times(out.getvalue())


def _turn(document: "Document") -> None:
    from docx.enum.section import WD_ORIENT

    (section,) = document.sections
    size = section.page_height, section.page_width
    section.orientation = WD_ORIENT.LANDSCAPE
    section.page_width, section.page_height = size


def _add_table(document: "Document", table: Table) -> None:
    from docx.enum.text import WD_ALIGN_PARAGRAPH

    document.add_paragraph(table.labelled_caption, style="Caption")
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
            cell.text = text
            cell.paragraphs[0].alignment = aligns[column.align]
        if number == 0:
            _repeat_on_pages(grid.rows[0])
    for note in table.notes:
        document.add_paragraph(note)
    document.add_paragraph()


def _repeat_on_pages(row: object) -> None:
    from docx.oxml import OxmlElement
    from docx.oxml.ns import qn

    mark = OxmlElement("w:tblHeader")
    mark.set(qn("w:val"), "true")
    row._tr.get_or_add_trPr().append(mark)  # type: ignore[attr-defined]  # python-docx has no other way


def _without_times(data: bytes) -> bytes:
    # the same archive, every entry dated the same
    out = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(data)) as old, zipfile.ZipFile(out, "w") as new:
        for name in old.namelist():
            entry = zipfile.ZipInfo(name, date_time=_FIRST_DAY)
            entry.compress_type = zipfile.ZIP_DEFLATED
            new.writestr(entry, old.read(name))
    return out.getvalue()
