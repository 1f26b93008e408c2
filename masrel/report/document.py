"""The report: one self-contained page, the same as Markdown, tables and figures.

In: a protocol, its ratings and their analysis. Out: a folder with ``report.html``,
``report.md``, ``tables/*.csv`` and ``figures/*.png`` and ``*.svg``. The same inputs
give the same bytes; there is no time of day in any of them.
"""

import base64
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from masrel.analysis import Analysis
from masrel.protocol import Protocol
from masrel.ratings import InPerson, Ratings
from masrel.report._tables import Table, as_csv, page_cells
from masrel.report.contents import build_sections
from masrel.report.material import Drawing, Material, Paragraph, Section
from masrel.report.pages import Placed, PlacedSection, render_pages

__all__ = ["ReportFiles", "write_report"]

Progress = Callable[[str], object]
"""Called with the name of each figure, and of the pages, once it is made."""


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
    pictures = _write_figures(sections, destination / "figures", report)
    for name, page in render_pages(material, _placed(sections, pictures)).items():
        destination.mkdir(parents=True, exist_ok=True)
        (destination / name).write_text(page, encoding="utf-8", newline="\n")
    report("pages")
    return ReportFiles(
        html=destination / "report.html",
        markdown=destination / "report.md",
        tables=tables,
        figures=tuple(path for made in pictures.values() for path in made.paths),
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class _Picture:
    paths: tuple[Path, Path]
    uri: str


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


def _write_figures(
    sections: Sequence[Section], folder: Path, report: Progress
) -> dict[str, _Picture]:
    # -> by name of the drawing
    pictures = {}
    for section in sections:
        for block in section.blocks:
            if isinstance(block, Drawing):
                pictures[block.name] = _write_figure(block, folder)
                report(block.name)
    return pictures


def _write_figure(drawing: Drawing, folder: Path) -> _Picture:
    drawn = drawing.draw()
    folder.mkdir(parents=True, exist_ok=True)
    png, svg = folder / f"{drawing.name}.png", folder / f"{drawing.name}.svg"
    png.write_bytes(drawn.png)
    svg.write_bytes(drawn.svg)
    # An image of its own, not inline: ids inside two SVGs would collide.
    encoded = base64.b64encode(drawn.svg).decode("ascii")
    return _Picture(paths=(png, svg), uri=f"data:image/svg+xml;base64,{encoded}")


def _placed(
    sections: Sequence[Section], pictures: dict[str, _Picture]
) -> tuple[PlacedSection, ...]:
    numbers: Counter[str] = Counter()

    def place(block: Paragraph | Table | Drawing) -> Placed:
        kind = _kind(block)
        numbers[kind] += 1
        uri = pictures[block.name].uri if isinstance(block, Drawing) else ""
        columns, rows = page_cells(block) if isinstance(block, Table) else ([], [])
        return Placed(
            kind=kind,
            number=numbers[kind],
            content=block,
            columns=columns,
            rows=rows,
            uri=uri,
        )

    return tuple(
        PlacedSection(
            name=section.name,
            title=section.title,
            blocks=tuple(place(block) for block in section.blocks),
        )
        for section in sections
    )


def _kind(
    block: Paragraph | Table | Drawing,
) -> Literal["paragraph", "table", "figure"]:
    if isinstance(block, Paragraph):
        return "paragraph"
    return "table" if isinstance(block, Table) else "figure"
