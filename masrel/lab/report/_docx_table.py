"""Tables as those of a word processor: how wide each column is, and their rules."""

import math
import unicodedata
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from masrel.tables._tables import SYMBOL, Column, Table, page_cells

if TYPE_CHECKING:
    from docx.document import Document as WordDocument

# Points of a page of A4, and of what is left free around it
PAGE, MARGIN = (595.3, 841.9), 70.9

_SIZES = (9, 8, 7)  # points of the letters of a table: the largest that fits
_TEXT = 15.0  # sizes: a column that would be wider has text, which is broken anyway
_PADDING = 4.0  # points on either side of a cell
_WHOLE = 0.7  # of a page: a table that is no higher stays on one

# Widths of letters of Arial, in hundredths of their size; most are 56 wide.
_WIDTHS = {
    letter: width
    for width, letters in (
        (25, "ijl'|ᵃᵇᶜᵈᵉᶠᵍʰⁱ"),
        (30, " .,:;/!()[]-ftrI\N{NO-BREAK SPACE}"),
        (50, "cksvxyzJ"),
        (68, "ABEKPSVXYCDGHNORTU&w"),
        (86, "mMOQW%@±→"),
    )
    for letter in letters
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Layout:
    """How a table stands on a page."""

    size: int  # points of its letters
    widths: tuple[float, ...]  # points of each column
    is_wide: bool  # whether it needs the page turned
    is_whole: bool  # whether it stays on one page


def laid_out(table: Table, *, is_turned: bool = False) -> Layout:
    """Return how a table fits on a page, which is turned if it must be."""
    columns, rows = page_cells(table)
    for is_wide in (True,) if is_turned else (False, True):
        room = PAGE[is_wide] - 2.0 * MARGIN
        fitting = []
        for size in _SIZES if is_wide else _SIZES[:2]:
            least, natural = _needs(columns, rows, size)
            if sum(least) <= room:
                widths = _shared(least, natural, room)
                fitting.append((size, widths, is_wide))
                if sum(min(width, _TEXT * size) for width in natural) <= room:
                    break  # smaller letters would save few lines
        if fitting:
            break
    # otherwise words are broken
    widths = tuple(width * room / sum(least) for width in least)
    size, widths, is_wide = fitting[-1] if fitting else (size, widths, True)
    n_lines = sum(_n_lines(row, widths, size) for row in rows)
    is_whole = 1.3 * size * n_lines <= _WHOLE * (PAGE[not is_wide] - 2.0 * MARGIN)
    return Layout(size=size, widths=widths, is_wide=is_wide, is_whole=is_whole)


def _n_lines(row: Sequence[str], widths: Sequence[float], size: float) -> int:
    # of its highest cell
    return max(
        sum(
            math.ceil(_width(line, size) / (width - 2.0 * _PADDING)) or 1
            for line in cell.split("\n")
        )
        for cell, width in zip(row, widths, strict=True)
    )


def _needs(
    columns: Sequence[Column], rows: Sequence[Sequence[str]], size: float
) -> tuple[list[float], list[float]]:
    # of each column the points of its longest word, and of its longest line; a number
    # and its interval are one word
    least, natural = [], []
    for place, column in enumerate(columns):
        cells = [row[place] for row in rows]
        lines = [line for cell in cells for line in cell.split("\n")]
        words = lines if column.align == "right" else _words(lines)
        heads = [1.08 * _width(word, size) for word in column.heading.split()]  # bold
        whole = [1.08 * _width(column.heading, size)]
        least.append(max([*heads, *(_width(w, size) for w in words)]) + 2.0 * _PADDING)
        natural.append(
            max([*whole, *(_width(line, size) for line in lines)]) + 2.0 * _PADDING
        )
    return least, [max(pair) for pair in zip(least, natural, strict=True)]


def _words(lines: Iterable[str]) -> set[str]:
    # a line also breaks after a hyphen
    return {word for line in lines for word in line.replace("-", "- ").split()}


def _width(text: str, size: float) -> float:
    # points of a line of text, a little more than Arial takes
    hundredths = sum(
        100 if unicodedata.east_asian_width(letter) in "WF" else _WIDTHS.get(letter, 56)
        for letter in text
    )
    return 1.03 * size * hundredths / 100.0


def _shared(
    least: Sequence[float], natural: Sequence[float], room: float
) -> tuple[float, ...]:
    # what each column wants, or else what it must have and a share of what is left
    more = [b - a for a, b in zip(least, natural, strict=True)]
    left = room - sum(least)
    share = 1.0 if sum(more) <= left else left / sum(more)
    return tuple(a + share * b for a, b in zip(least, more, strict=True))


def add_table(document: "WordDocument", table: Table, layout: Layout) -> None:
    """Add rows between rules, with the heads on every page that the table is on."""
    from docx.enum.text import WD_ALIGN_PARAGRAPH
    from docx.text.paragraph import Paragraph

    columns, rows = page_cells(table)
    grid = document.add_table(rows=0, cols=len(columns), style=_RULED)
    grid.autofit = False
    for column, points in zip(
        grid._tbl.tblGrid.gridCol_lst, layout.widths, strict=True
    ):
        column.w = _points(points)
    lines = [[column.heading for column in columns], *rows]
    for number, texts in enumerate(lines):
        is_last = number == len(lines) - 1
        # what is kept on the page of the next paragraph: heads, and short tables
        keeps = bool(table.notes) if is_last else layout.is_whole or number < 3
        row = grid.add_row()
        properties = row._tr.get_or_add_trPr()
        add_element(properties, "w:cantSplit")
        if number == 0:
            add_element(properties, "w:tblHeader", ("w:val", "true"))
        # by their elements: a table finds each of its cells anew among all of them
        for cell, text, column in zip(row._tr.tc_lst, texts, columns, strict=True):
            paragraph = Paragraph(cell.p_lst[0], row)
            paragraph._p.style = _text_style(layout.size).replace(" ", "")
            if column.align != "left":
                paragraph.alignment = getattr(WD_ALIGN_PARAGRAPH, column.align.upper())
            if keeps:
                paragraph.paragraph_format.keep_with_next = True
            write(paragraph, text)


def _text_style(size: int) -> str:
    return f"Table Text {size}"


def _points(points: float) -> Any:
    from docx.shared import Pt

    return Pt(points)


def add_table_styles(document: "WordDocument") -> None:
    """Add the style of tables, and those of letters of every size in them."""
    from docx.enum.style import WD_STYLE_TYPE
    from docx.oxml import parse_xml
    from docx.oxml.ns import nsdecls

    document.styles.element.append(parse_xml(_RULES.replace("NAMES", nsdecls("w"))))
    for size in _SIZES:
        name = _text_style(size)
        style = document.styles.add_style(name, WD_STYLE_TYPE.PARAGRAPH)
        style.base_style = document.styles["Normal"]
        style.font.size = _points(size)
        lines = style.paragraph_format
        lines.space_before = lines.space_after = _points(1.0)
        lines.line_spacing = 1.0


_RULED = "Ruled"
_RULES = """<w:style NAMES w:type="table" w:customStyle="1" w:styleId="Ruled">
  <w:name w:val="Ruled"/><w:basedOn w:val="TableNormal"/>
  <w:tblPr>
    <w:tblBorders>
      <w:top w:val="single" w:sz="8" w:space="0" w:color="000000"/>
      <w:bottom w:val="single" w:sz="8" w:space="0" w:color="000000"/>
    </w:tblBorders>
    <w:tblCellMar>
      <w:left w:w="80" w:type="dxa"/><w:right w:w="80" w:type="dxa"/>
    </w:tblCellMar>
  </w:tblPr>
  <w:tblStylePr w:type="firstRow">
    <w:rPr><w:b/></w:rPr>
    <w:tcPr>
      <w:tcBorders>
        <w:bottom w:val="single" w:sz="4" w:space="0" w:color="000000"/>
      </w:tcBorders>
      <w:vAlign w:val="bottom"/>
    </w:tcPr>
  </w:tblStylePr>
</w:style>"""
"""A rule above, below, and under the heads; cells have four points on either side."""


def add_element(parent: Any, name: str, *attributes: tuple[str, str]) -> Any:
    """Add an element that python-docx has no words for."""
    from docx.oxml import OxmlElement
    from docx.oxml.ns import qn

    element = OxmlElement(name)
    for key, value in attributes:
        element.set(qn(key), value)
    parent.append(element)
    return element


def write(paragraph: Any, text: str, *, bold: bool = False) -> None:
    """Write text at the end of a paragraph, the indices of symbols below the line."""
    parts = SYMBOL.split(clean(text))
    for place, part in enumerate(parts):
        if part:
            run = paragraph.add_run(part)
            if bold:
                run.bold = True
            if place % 3 == 2:
                run.font.subscript = True


def clean(text: str) -> str:
    """Return text without the letters that XML cannot hold."""
    return "".join(c for c in text if c in "\t\n" or ord(c) >= 32)
