"""The report: one self-contained page, the same as Markdown, tables and figures.

In: a protocol, its ratings and their analysis. Out: a folder with ``report.html``,
``report.md``, ``tables/*.csv`` and ``figures/*.png`` and ``*.svg``. The same inputs
give the same bytes; there is no time of day in any of them.
"""

import base64
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from jinja2 import Environment, PackageLoader, StrictUndefined, select_autoescape

from masrel.analysis import Analysis
from masrel.protocol import Protocol
from masrel.ratings import InPerson, Ratings
from masrel.report.contents import build_sections
from masrel.report.material import Drawing, Material, Paragraph, Section
from masrel.report.tables import Table, as_csv, shown

__all__ = ["ReportFiles", "write_report"]

Progress = Callable[[str], object]
"""Called with the name of each figure, and of the pages, once it is made."""

BANNER = "SIMULATED DATA – no person gave these grades"


@dataclass(frozen=True, slots=True, kw_only=True)
class ReportFiles:
    """The files of a report.

    Attributes
    ----------
    html, markdown : Path
        The document.
    tables : tuple of Path
        One CSV per table.
    figures : tuple of Path
        A PNG and an SVG per figure.
    """

    html: Path
    markdown: Path
    tables: tuple[Path, ...]
    figures: tuple[Path, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class _Placed:
    # a block with its number; `uri` holds a figure inside the page
    kind: Literal["paragraph", "table", "figure"]
    number: int
    content: Paragraph | Table | Drawing
    uri: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class _PlacedSection:
    name: str
    title: str
    blocks: tuple[_Placed, ...]


def write_report(
    protocol: Protocol,
    ratings: Ratings,
    analysis: Analysis,
    destination: Path,
    *,
    in_person: InPerson | None = None,
    progress: Progress | None = None,
) -> ReportFiles:
    """Write the report a protocol asks for.

    Only the sections named in the protocol's ``report.sections`` are made, in
    that order; matplotlib is loaded when a section has a figure.

    Parameters
    ----------
    protocol : Protocol
        The study's protocol.
    ratings : Ratings
        The ratings.
    analysis : Analysis
        What `masrel.analysis.analyze` made of them.
    destination : Path
        The folder to write into; made if needed.
    in_person : InPerson, optional
        Grades given in person, whose notes are shown below their table.
    progress : callable, optional
        Called with the name of each figure, and of the pages, once it is made.

    Returns
    -------
    ReportFiles
        What was written.

    Raises
    ------
    OSError
        If a file cannot be written.
    """
    material = Material(
        protocol=protocol, ratings=ratings, analysis=analysis, in_person=in_person
    )
    sections = build_sections(material)
    report = progress or _silent
    tables = _write_tables(sections, destination / "tables")
    figures: list[Path] = []
    placed = _place(sections, destination / "figures", figures, report)
    html, markdown = destination / "report.html", destination / "report.md"
    context = _context(material, placed)
    environment = _environment()
    destination.mkdir(parents=True, exist_ok=True)
    for path in (html, markdown):
        page = environment.get_template(path.name).render(context)
        path.write_text(page, encoding="utf-8", newline="\n")
    report("pages")
    return ReportFiles(
        html=html, markdown=markdown, tables=tables, figures=tuple(figures)
    )


def _silent(_: str) -> None:
    # progress nobody asked for
    return


def _write_tables(sections: Sequence[Section], folder: Path) -> tuple[Path, ...]:
    paths = []
    for section in sections:
        for block in section.blocks:
            if isinstance(block, Table):
                folder.mkdir(parents=True, exist_ok=True)
                path = folder / f"{block.name}.csv"
                path.write_text(as_csv(block), encoding="utf-8", newline="\n")
                paths.append(path)
    return tuple(paths)


def _place(
    sections: Sequence[Section],
    folder: Path,
    written: list[Path],
    report: Progress,
) -> tuple[_PlacedSection, ...]:
    numbers = {"paragraph": 0, "table": 0, "figure": 0}
    placed = []
    for section in sections:
        blocks = []
        for block in section.blocks:
            kind = _kind(block)
            numbers[kind] += 1
            uri = ""
            if isinstance(block, Drawing):
                uri = _write_figure(block, folder, written)
                report(block.name)
            blocks.append(
                _Placed(kind=kind, number=numbers[kind], content=block, uri=uri)
            )
        placed.append(
            _PlacedSection(name=section.name, title=section.title, blocks=tuple(blocks))
        )
    return tuple(placed)


def _kind(
    block: Paragraph | Table | Drawing,
) -> Literal["paragraph", "table", "figure"]:
    if isinstance(block, Paragraph):
        return "paragraph"
    return "table" if isinstance(block, Table) else "figure"


def _write_figure(drawing: Drawing, folder: Path, written: list[Path]) -> str:
    drawn = drawing.draw()
    folder.mkdir(parents=True, exist_ok=True)
    for suffix, content in ((".png", drawn.png), (".svg", drawn.svg)):
        path = folder / f"{drawing.name}{suffix}"
        path.write_bytes(content)
        written.append(path)
    # An image of its own, not inline: ids inside two SVGs would collide.
    return "data:image/svg+xml;base64," + base64.b64encode(drawn.svg).decode("ascii")


def _context(
    material: Material, sections: tuple[_PlacedSection, ...]
) -> dict[str, object]:
    analysis = material.analysis
    style = Path(__file__).with_name("templates") / "report.css"
    colophon = [f"Made by masrel {analysis.masrel_version}."]
    colophon += [f"{name}: {digest}" for name, digest in analysis.inputs.items()]
    study = material.protocol.study
    return {
        "title": material.protocol.report.title or study.title,
        "simulated": material.ratings.simulated,
        "banner": BANNER,
        "provenance": _provenance(material),
        "sections": sections,
        "colophon": colophon,
        "style": style.read_text(encoding="utf-8"),
        "version": analysis.masrel_version,
    }


def _provenance(material: Material) -> str:
    if material.ratings.simulated:
        return (
            "The grades and speeds in this report are simulated. They show that the "
            "study runs; they say nothing about people or about the models."
        )
    source = material.protocol.study.source
    if material.data == "published":
        return f"Published grades and speeds: {source}".rstrip(": ")
    return f"Study {material.protocol.study.id}, {material.data} ratings."


def _environment() -> Environment:
    environment = Environment(
        loader=PackageLoader("masrel.report"),
        autoescape=select_autoescape(enabled_extensions=("html",)),
        undefined=StrictUndefined,
        keep_trailing_newline=True,
    )
    environment.filters["shown"] = shown
    environment.filters["md"] = _markdown
    return environment


def _markdown(text: str) -> str:
    for letter in "\\`*_|<[":
        text = text.replace(letter, f"\\{letter}")
    return text.replace("\n", " ")
