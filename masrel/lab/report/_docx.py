"""Text and tables as a document of a word processor, the same bytes every time."""

import importlib
import importlib.util
import io
import zipfile
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import TYPE_CHECKING, Any

from masrel.errors import ParameterError
from masrel.lab.report._docx_table import (
    MARGIN,
    PAGE,
    add_element,
    add_table,
    add_table_styles,
    clean,
    laid_out,
    write,
)
from masrel.pages._sections import Block, Document, Drawing, Listing, Paragraph
from masrel.tables._tables import Table

if TYPE_CHECKING:
    from docx.document import Document as WordDocument

_ALARM = "A63C00"  # as in figures
_LAST = "Provenance"
_FIELD = ' TOC \\o "1-1" \\h \\z \\u '  # headings of level 1, as links
_STYLES = {
    # points: letters, above, below
    "Normal": (10, 0, 6),
    "Title": (18, 0, 10),
    "Heading 1": (13, 16, 5),
    "Heading 2": (11, 12, 4),
    "TOC Heading": (13, 12, 5),
    "toc 1": (10, 0, 3),
    "Caption": (9, 2, 12),
    "Table Note": (8, 2, 0),
    "macro": (8, 0, 6),
}
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
    label: str  # its number, and whether it is of simulated data
    caption: str
    alt: str


@dataclass(frozen=True, slots=True, kw_only=True)
class NumberedTable:
    """A table with its number."""

    label: str
    table: Table


@dataclass(frozen=True, slots=True, kw_only=True)
class Alarm:
    """What nobody who reads the document may miss."""

    text: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Contents:
    """A table of contents."""

    titles: tuple[str, ...]  # the headings of level 1, each a link to its place


Part = (
    Heading | Paragraph | Table | NumberedTable | Listing | Picture | Alarm | Contents
)
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
    parts += [Alarm(text=document.banner)] if document.banner else []
    parts.append(Paragraph(text=document.provenance))
    parts.append(Paragraph(text=f"{document.tag} {document.result}".strip()))
    titles = [section.title for section in document.sections]
    parts.append(Contents(titles=(*titles, _LAST)))
    for section in document.sections:
        parts.append(Heading(text=section.title, level=1))
        parts += [_part(block, document.tag) for block in section.blocks]
    parts.append(Heading(text=_LAST, level=1))
    parts.append(Paragraph(text=f"Made by masrel {document.version} of these inputs."))
    parts += [Paragraph(text=f"{name}:\n{hash_}") for name, hash_ in document.inputs]
    return as_docx(parts, header=document.tag.removesuffix(".").upper())


def _part(block: Block, tag: str) -> Part:
    # with its number among tables, or figures
    content = block.content
    if isinstance(content, Table):
        label = f"Table {block.number}. {content.tag}".strip()
        return NumberedTable(label=label, table=content)
    if isinstance(content, Drawing):
        return Picture(
            png=block.pictures["png"],
            label=f"Figure {block.number}. {tag}".strip(),
            caption=content.caption,
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
    _set_styles(document)
    _set_page(document, header)
    turns = [landscape or is_wide for is_wide in _are_wide(parts)]
    is_turned = False
    for place, (part, turn) in enumerate(zip(parts, turns, strict=True)):
        if turn != is_turned:
            is_turned = turn
            _turn(document, is_first=place == 0)
        _add(document, part, is_turned=landscape)
    headings = [p for p in document.paragraphs if p.style.name == "Heading 1"]  # type: ignore[union-attr]
    for nth, heading in enumerate(headings):
        _bookmark(heading, nth)
    properties = document.core_properties
    properties.author = properties.comments = ""
    properties.created = properties.modified = datetime(*_FIRST_DAY)
    properties.title = next((p.text for p in parts if isinstance(p, Heading)), "")
    out = io.BytesIO()
    document.save(out)
    return _without_times(out.getvalue())


def _are_wide(parts: Sequence[Part]) -> list[bool]:
    # whether each part stands on a page that is turned: tables that need it, and the
    # headings before them
    wide = [
        isinstance(part, NumberedTable) and laid_out(part.table).is_wide
        for part in parts
    ]
    for place in range(len(parts) - 2, -1, -1):
        if isinstance(parts[place], Heading) and place > 0:
            wide[place] = wide[place + 1]
    return wide


def _set_page(document: "WordDocument", header: str) -> None:
    # a page of A4 with its number at its foot
    from docx.enum.text import WD_ALIGN_PARAGRAPH
    from docx.shared import Pt, RGBColor

    (section,) = document.sections
    section.page_width, section.page_height = map(Pt, PAGE)
    section.left_margin = section.right_margin = Pt(MARGIN)
    section.top_margin = section.bottom_margin = Pt(MARGIN)
    if header:
        run = section.header.paragraphs[0].add_run(header)
        run.bold, run.font.color.rgb = True, RGBColor.from_string(_ALARM)
    foot = section.footer.paragraphs[0]
    foot.alignment = WD_ALIGN_PARAGRAPH.CENTER
    field = add_element(foot._p, "w:fldSimple", ("w:instr", "PAGE"))
    add_element(add_element(field, "w:r"), "w:t").text = "1"


def _set_styles(document: "WordDocument") -> None:
    """Set the fonts, sizes and distances of a manuscript."""
    from docx.enum.style import WD_STYLE_TYPE
    from docx.oxml.ns import qn
    from docx.shared import Pt, RGBColor

    styles = document.styles
    styles.add_style("toc 1", WD_STYLE_TYPE.PARAGRAPH, builtin=True)
    styles.add_style("Table Note", WD_STYLE_TYPE.PARAGRAPH)
    for name, (size, before, after) in _STYLES.items():
        style = styles[name]
        fonts = style.element.get_or_add_rPr().get_or_add_rFonts()
        for key in list(fonts.attrib):
            del fonts.attrib[key]
        style.font.name = "Courier New" if name == "macro" else "Arial"
        style.font.size = Pt(size)
        style.font.color.rgb = RGBColor(0, 0, 0)
        lines = style.paragraph_format
        lines.space_before, lines.space_after = Pt(before), Pt(after)
        lines.line_spacing = 1.15 if name == "Normal" else 1.0
    styles["Caption"].font.bold = False
    for element in styles["Title"].element.xpath("w:pPr/w:pBdr"):
        element.getparent().remove(element)
    add_table_styles(document)
    # the template is Word 2010's, and newer ones say so in the title of the window
    mode = '//w:compatSetting[@w:name="compatibilityMode"]'
    for setting in document.settings.element.xpath(mode):
        setting.set(qn("w:val"), "15")


def _add(document: "WordDocument", part: Part, *, is_turned: bool) -> None:
    if isinstance(part, Heading):
        write(document.add_heading(level=part.level), part.text)
    elif isinstance(part, Paragraph):
        write(document.add_paragraph(), part.text)
    elif isinstance(part, Alarm):
        _add_alarm(document, part)
    elif isinstance(part, Listing):
        document.add_heading(part.title, 2)
        document.add_paragraph(part.text, style="macro")
    elif isinstance(part, Picture):
        _add_picture(document, part)
    elif isinstance(part, Contents):
        _add_contents(document, part.titles)
    elif isinstance(part, NumberedTable):
        _add_table(document, part, is_turned=is_turned)
    else:
        numbered = NumberedTable(label=part.tag, table=part)
        _add_table(document, numbered, is_turned=is_turned)


def _add_contents(document: "WordDocument", titles: Sequence[str]) -> None:
    """Add a field with what it will say."""
    # One paragraph an entry: the field begins in the first and ends after the last. It
    # has no pages, which only what lays out knows: to update the field adds them.
    document.add_paragraph("Contents", style="TOC Heading")
    for nth, title in enumerate(titles):
        entry = document.add_paragraph(style="toc 1")
        if nth == 0:
            _field_part(entry, "begin")
            text = add_element(
                entry.add_run()._r, "w:instrText", ("xml:space", "preserve")
            )
            text.text = _FIELD
            _field_part(entry, "separate")
        link = add_element(
            entry._p, "w:hyperlink", ("w:anchor", _mark(nth)), ("w:history", "1")
        )
        add_element(add_element(link, "w:r"), "w:t").text = clean(title)
    if titles:
        _field_part(document.add_paragraph(), "end")


def _bookmark(heading: Any, nth: int) -> None:
    number = ("w:id", str(nth))
    start = add_element(heading._p, "w:bookmarkStart", number, ("w:name", _mark(nth)))
    heading.runs[0]._r.addprevious(start)
    add_element(heading._p, "w:bookmarkEnd", number)


def _mark(nth: int) -> str:
    return "_Toc" + str(nth + 1).zfill(8)


def _field_part(paragraph: Any, kind: str) -> None:
    add_element(paragraph.add_run()._r, "w:fldChar", ("w:fldCharType", kind))


def _add_alarm(document: "WordDocument", part: Alarm) -> None:
    from docx.shared import RGBColor

    run = document.add_paragraph().add_run(clean(part.text))
    run.bold, run.font.color.rgb = True, RGBColor.from_string(_ALARM)


def _add_picture(document: "WordDocument", picture: Picture) -> None:
    from docx.shared import Pt

    room = Pt(PAGE[0] - 2.0 * MARGIN)
    shape = document.add_picture(io.BytesIO(picture.png))
    scale = min(1.0, room / shape.width, room / shape.height)  # none is enlarged
    shape.width, shape.height = (
        type(shape.width)(side * scale) for side in (shape.width, shape.height)
    )
    shape._inline.docPr.set("descr", clean(picture.alt))
    document.paragraphs[-1].paragraph_format.keep_with_next = True
    _add_caption(document, picture.label, picture.caption)


def _add_caption(document: "WordDocument", label: str, caption: str) -> Any:
    paragraph = document.add_paragraph(style="Caption")
    if label:
        write(paragraph, f"{label} ", bold=True)
    write(paragraph, caption)
    return paragraph.paragraph_format


def _turn(document: "WordDocument", *, is_first: bool) -> None:
    # from here on pages lie where they stood, or stand again
    from docx.enum.section import WD_ORIENT

    if is_first:
        section = document.sections[0]
    else:
        section = document.add_section()
        # the break goes into the last paragraph: one of its own may need a page
        added = document.paragraphs[-1]._p
        last = added.getprevious()
        last.get_or_add_pPr().append(*added.xpath("w:pPr/w:sectPr"))
        added.getparent().remove(added)
    size = section.page_height, section.page_width
    section.page_width, section.page_height = size
    stands = int(size[0] or 0) < int(size[1] or 0)
    section.orientation = WD_ORIENT.PORTRAIT if stands else WD_ORIENT.LANDSCAPE


def _add_table(
    document: "WordDocument", part: NumberedTable, *, is_turned: bool
) -> None:
    from docx.shared import Pt

    head = _add_caption(document, part.label, part.table.caption)
    head.keep_with_next, head.space_before, head.space_after = True, Pt(12), Pt(4)
    layout = laid_out(part.table, is_turned=is_turned)
    add_table(document, part.table, layout)
    for note in part.table.notes or ("",):
        paragraph = document.add_paragraph(style="Table Note")
        paragraph.paragraph_format.keep_with_next = layout.is_whole
        write(paragraph, note)
    paragraph.paragraph_format.keep_with_next = False
    paragraph.paragraph_format.space_after = Pt(12)


def _without_times(data: bytes) -> bytes:
    # the same archive, every entry dated the same
    out = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(data)) as old, zipfile.ZipFile(out, "w") as new:
        for name in old.namelist():
            entry = zipfile.ZipInfo(name, date_time=_FIRST_DAY)
            entry.compress_type = zipfile.ZIP_DEFLATED
            new.writestr(entry, old.read(name))
    return out.getvalue()
