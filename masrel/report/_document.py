"""The report: one self-contained page, the same as Markdown, tables and figures.

In: a protocol, its ratings and their analysis. Out: a folder with ``report.html``,
``report.md``, ``tables/*.csv``, ``figures/*.png`` and ``*.svg``, and the hash of each
in ``manifest.json``. The same inputs give the same bytes; there is no time of day in
any of them.
"""

import base64
import html
import re
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from masrel.analysis import Analysis
from masrel.protocol import Protocol, Report
from masrel.ratings import InPerson, Ratings
from masrel.report._agreement import estimates_section
from masrel.report._conduct import StudyConduct, conduct_section
from masrel.report._design import design_section
from masrel.report._grades import grades_section, in_person_section, intended_section
from masrel.report._material import Drawing, Material, Paragraph, Section, gather
from masrel.report._question_tables import questionnaires_section
from masrel.report._report_folder import MANIFEST, Assets, replace_report
from masrel.report._stretches import speeds_section, traces_section
from masrel.report._tables import Table, as_csv, page_cells, tag_of
from masrel.verification import Anchor

Progress = Callable[[str], object]
"""Called with the name of each figure, and of the pages, once it is made."""

SECTIONS: dict[str, Callable[[Material], Section]] = {
    "design": design_section,
    "grades": grades_section,
    "agreement": partial(estimates_section, kind="inter-rater"),
    "intended": intended_section,
    "in-person": in_person_section,
    "test-retest": partial(estimates_section, kind="test-retest"),
    "speeds": speeds_section,
    "traces": traces_section,
    "questionnaires": questionnaires_section,
}
"""Name in ``report.sections`` to what makes it: only what a protocol names is made."""

_INPUTS = {
    "protocol_sha256": "protocol",
    "ratings_sha256": "ratings",
    "in_person_sha256": "grades given in person",
    "answers_sha256": "answers to questionnaires",
}

_KINDS = {Paragraph: "paragraph", Table: "table", Drawing: "figure"}

# Symbols of the model as they are written in plain text: an index after "_".
_SYMBOL = re.compile(r"(?<!\w)(ΔT|k|ν|θ|p)_(peak|post|th|L|start|end|o|e)(?!\w)")


@dataclass(frozen=True, slots=True, kw_only=True)
class ReportFiles:
    """The files of a report.

    Attributes
    ----------
    html, markdown : Path
        The document.
    manifest : Path
        The hash of every file, as JSON.
    tables : tuple of Path
        One CSV per table; its name ends in a hyphen and the start of its SHA-256.
    figures : tuple of Path
        A PNG and an SVG per figure, named like tables.
    """

    html: Path
    markdown: Path
    manifest: Path
    tables: tuple[Path, ...]
    figures: tuple[Path, ...]


def write_report(
    protocol: Protocol,
    ratings: Ratings,
    analysis: Analysis,
    destination: Path,
    *,
    in_person: InPerson | None = None,
    recordings: Path | None = None,
    conduct: StudyConduct | None = None,
    anchors: Sequence[Anchor] = (),
    progress: Progress | None = None,
    raw_csv: bool = False,
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
    recordings : Path, optional
        The folder of the sessions' recordings, of which measured torque is drawn.
    conduct : StudyConduct, optional
        How the study was run (`study_conduct`); where there is anything to say, the
        report begins with it.
    anchors : sequence of Anchor, optional
        Hashes of the session logs (`masrel.verification.anchors_of`), printed at the
        end: a report kept elsewhere shows whether the logs were written anew.
    progress : callable, optional
        Called with the name of each figure, and of the pages, once it is made.
    raw_csv : bool, optional
        Whether texts of the tables' files are as they are. Else those that a
        spreadsheet would run as formulas stand after an apostrophe.

    Returns
    -------
    ReportFiles
        What was written.

    Raises
    ------
    ParameterError
        If the folder is one of a study's primary records, or a link in it leads out.
    OSError
        If a file cannot be written; the pages that were there are then there still.
    """
    material = gather(protocol, ratings, analysis, in_person, recordings)
    sections = [SECTIONS[name](material) for name in _section_names(protocol)]
    if conduct is not None and (first := conduct_section(material, conduct)):
        sections.insert(0, first)
    assets = Assets()
    shown = _make_blocks(sections, assets, progress, raw_csv=raw_csv)
    pages = _pages(material, shown, anchors)
    replace_report(destination, assets, pages, analysis.inputs)
    if progress is not None:
        progress("pages")
    return ReportFiles(
        html=destination / "report.html",
        markdown=destination / "report.md",
        manifest=destination / MANIFEST,
        tables=tuple(destination / p for p in assets.contents if p.endswith(".csv")),
        figures=tuple(
            destination / p for p in assets.contents if not p.endswith(".csv")
        ),
    )


def _section_names(protocol: Protocol) -> tuple[str, ...]:
    # who leaves the choice to masrel sees the questionnaires where there are some
    names: tuple[str, ...] = protocol.report.sections
    if names == Report().sections and protocol.questionnaires:
        return (*names, "questionnaires")
    return names


def _make_blocks(
    sections: Sequence[Section],
    assets: Assets,
    progress: Progress | None,
    *,
    raw_csv: bool,
) -> list[dict[str, object]]:
    # what templates show, every block with its number among those of its kind
    shown: list[dict[str, object]] = []
    numbers: Counter[str] = Counter()
    for section in sections:
        blocks = []
        for block in section.blocks:
            kind = _KINDS[type(block)]
            numbers[kind] += 1
            entry = {"kind": kind, "number": numbers[kind], "content": block}
            blocks.append(entry)
            if isinstance(block, Table):
                entry["columns"], entry["rows"] = page_cells(block)
                content = as_csv(block, raw=raw_csv).encode()
                assets.add("tables", block.name, "csv", content)
            elif isinstance(block, Drawing):
                # Imported here: a report without figures loads nothing that draws.
                from masrel.report.figures import draw

                pictures = draw(block.content, stamp=block.stamp)
                entry["files"] = {
                    form: assets.add("figures", block.name, form, picture)
                    for form, picture in pictures.items()
                }
                # An image of its own, not inline: ids inside two SVGs would collide.
                encoded = base64.b64encode(pictures["svg"]).decode("ascii")
                entry["uri"] = f"data:image/svg+xml;base64,{encoded}"
                if progress is not None:
                    progress(block.name)
        shown.append({"name": section.name, "title": section.title, "blocks": blocks})
    return shown


def _pages(
    material: Material,
    sections: Sequence[Mapping[str, object]],
    anchors: Sequence[Anchor],
) -> dict[str, str]:
    # Imported here: a section's tables alone load no templates.
    from jinja2 import Environment, PackageLoader, StrictUndefined, select_autoescape

    environment = Environment(
        loader=PackageLoader("masrel.report"),
        autoescape=select_autoescape(enabled_extensions=("html",)),
        undefined=StrictUndefined,
        keep_trailing_newline=True,
    )
    environment.filters |= {"md": _markdown, "symbols": _symbols}
    analysis, study = material.analysis, material.protocol.study
    style = Path(__file__).with_name("templates") / "report.css"
    context = {
        "title": material.protocol.report.title or study.title,
        "tag": tag_of(material.data),
        "banner": material.banner,
        "provenance": material.provenance,
        "sections": sections,
        "inputs": [
            *(
                (f"SHA-256 of the {_INPUTS[name]}", digest)
                for name, digest in analysis.inputs.items()
            ),
            *((f"SHA-256 of line {a.line} of {a.log}", a.sha256) for a in anchors),
        ],
        "style": style.read_text(encoding="utf-8"),
        "version": analysis.masrel_version,
    }
    names = ("report.html", "report.md")
    return {name: environment.get_template(name).render(context) for name in names}


def _symbols(text: str) -> str:
    # Escaped first; what is added after that is ours, and so safe in a template.
    return _SYMBOL.sub(r"\1<sub>\2</sub>", html.escape(text))


_MARKDOWN_ESCAPES = str.maketrans({letter: f"\\{letter}" for letter in "\\`*_|<>[]#"})


def _markdown(text: str) -> str:
    return " ".join(text.translate(_MARKDOWN_ESCAPES).split())
