"""The report: one self-contained page, the same as Markdown, tables and figures.

In: a protocol, its ratings and their analysis. Out: a folder with ``report.html``,
``report.md``, ``tables/*.csv``, ``figures/*.png`` and ``*.svg``, and the hash of each
in ``manifest.json``. The same inputs give the same bytes; there is no time of day in
any of them.
"""

import warnings
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from masrel.errors import MissingLettersWarning
from masrel.lab._cache import Cache
from masrel.lab.analysis import Analysis
from masrel.lab.analysis._analysis_json import analysis_text
from masrel.lab.protocol import Protocol, report_sections
from masrel.lab.ratings import InPerson, Ratings
from masrel.lab.report._agreement import estimates_section
from masrel.lab.report._conduct import CONDUCT_SECTIONS, StudyConduct, conduct_sections
from masrel.lab.report._design import design_section
from masrel.lab.report._grade_sections import (
    grades_section,
    in_person_section,
    intended_section,
)
from masrel.lab.report._grade_tables import categories_section, confusion_section
from masrel.lab.report._material import Material, gather
from masrel.lab.report._methods import methods_section
from masrel.lab.report._order_section import order_section
from masrel.lab.report._pages import WRITERS, Writer
from masrel.lab.report._pandoc import pandoc_version
from masrel.lab.report._published_numbers import PublishedClaims, claims_section
from masrel.lab.report._question_tables import questionnaires_section
from masrel.lab.report._report_folder import (
    MANIFEST,
    NUMBERS,
    Assets,
    replace_report,
    report_files,
)
from masrel.lab.report._result import result_text
from masrel.lab.report._sample_size import sample_size_section
from masrel.lab.report._stretches import speeds_section
from masrel.lab.report._trace_section import traces_section
from masrel.lab.verification import Anchor
from masrel.pages._sections import Block, Content, Document, Drawing, Section, chapters
from masrel.plots import draw
from masrel.tables._tables import Table, as_csv, tag_of

Progress = Callable[[str], object]
"""Called with the name of each figure, and of the pages, once it is made."""

SECTIONS: dict[str, Callable[[Material], Section]] = {
    "design": design_section,
    "sample-size": sample_size_section,
    "grades": grades_section,
    "agreement": partial(estimates_section, kind="inter-rater"),
    "test-retest": partial(estimates_section, kind="test-retest"),
    "categories": categories_section,
    "intended": intended_section,
    "confusion": confusion_section,
    "in-person": in_person_section,
    "order": order_section,
    "speeds": speeds_section,
    "traces": traces_section,
    "questionnaires": questionnaires_section,
    "claims": claims_section,
    "methods": methods_section,
}
"""Name in ``report.sections`` to what makes it."""

_INPUTS = {
    "protocol_sha256": "protocol",
    "ratings_sha256": "ratings",
    "in_person_sha256": "grades given in person",
    "answers_sha256": "answers to questionnaires",
    "claims_sha256": "claims of the paper",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class ReportFiles:
    """The files of a report.

    Attributes
    ----------
    html, markdown, latex, docx : Path or None
        The document in the formats that the protocol names; None for others.
    manifest : Path
        The hash of every file, as JSON.
    tables : tuple of Path
        One CSV per table; its name ends in a hyphen and the start of its SHA-256.
    figures : tuple of Path
        A PNG and an SVG per figure, named like tables.
    """

    html: Path | None
    markdown: Path | None
    latex: Path | None
    docx: Path | None
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
    claims: PublishedClaims | None = None,
    raw_csv: bool = False,
    cache: Path | None = None,
) -> ReportFiles:
    """Write the report a protocol asks for.

    It begins with what the study came to, in sentences. Of the sections only those are
    made that `masrel.lab.protocol.report_sections` names, in that order; matplotlib is
    loaded when a section has a figure.

    Parameters
    ----------
    protocol : Protocol
        The study's protocol.
    ratings : Ratings
        The ratings.
    analysis : Analysis
        What `masrel.lab.analysis.analyze` made of them.
    destination : Path
        The folder to write into; made if needed.
    in_person : InPerson, optional
        Grades given in person, whose notes are shown below their table.
    recordings : Path, optional
        The folder of the sessions' recordings, of which measured torque is drawn.
    conduct : StudyConduct, optional
        How the study was run (`study_conduct`); where there is anything to say, it is
        said after the design.
    anchors : sequence of Anchor, optional
        Hashes of the session logs (`masrel.lab.verification.anchors_of`), printed at
        the end: a report kept elsewhere shows whether the logs were written anew.
    progress : callable, optional
        Called with the name of each figure, and of the pages, once it is made.
    claims : PublishedClaims, optional
        What a paper printed of the study (`published_claims`), for section ``claims``.
    raw_csv : bool, optional
        Whether texts of the tables' files are as they are. Else those that a
        spreadsheet would run as formulas stand after an apostrophe.
    cache : Path, optional
        A folder in which figures and pages are kept, by all that they are made from;
        those that are there already are not made again.

    Returns
    -------
    ReportFiles
        What was written.

    Raises
    ------
    ParameterError
        If the folder is one of a study's primary records, or a link in it leads out;
        if the protocol asks for LaTeX or DOCX and pandoc is not installed.
    OSError
        If a file cannot be written; the pages that were there are then there still.
    """
    files = make_report(
        protocol,
        ratings,
        analysis,
        in_person=in_person,
        recordings=recordings,
        conduct=conduct,
        anchors=anchors,
        progress=progress,
        claims=claims,
        raw_csv=raw_csv,
        cache=Cache(cache),
    )
    replace_report(destination, files)
    pages = {
        name: destination / writer.file if writer.file in files else None
        for name, writer in WRITERS.items()
    }
    return ReportFiles(
        **pages,
        manifest=destination / MANIFEST,
        tables=tuple(destination / p for p in files if p.startswith("tables/")),
        figures=tuple(destination / p for p in files if p.startswith("figures/")),
    )


def make_report(
    protocol: Protocol,
    ratings: Ratings,
    analysis: Analysis,
    *,
    in_person: InPerson | None = None,
    recordings: Path | None = None,
    conduct: StudyConduct | None = None,
    anchors: Sequence[Anchor] = (),
    progress: Progress | None = None,
    raw_csv: bool = False,
    only: Collection[str] = (),
    formats: Collection[str] = (),
    claims: PublishedClaims | None = None,
    cache: Cache,
) -> dict[str, bytes]:
    """Return the files of a report, of these sections only if some are named."""
    # formats: those that are made beside the protocol's
    # By name from the report's folder, in the order in which they are to be written
    printed = () if claims is None else claims.claims
    material = gather(protocol, ratings, analysis, in_person, recordings, printed)
    inputs = {**analysis.inputs, **({} if claims is None else claims.inputs)}
    names = [name for name in report_sections(protocol) if not only or name in only]
    sections = [SECTIONS[name](material) for name in names]
    if conduct is not None:
        place = 1 + next((i for i, s in enumerate(sections) if s.name == "design"), -1)
        of_conduct = conduct_sections(material, conduct)
        sections[place:place] = [s for s in of_conduct if not only or s.name in only]
    assets, lacking = Assets(), set[str]()
    document = Document(
        title=protocol.report.title or protocol.study.title,
        tag=tag_of(material.data),
        banner=material.banner,
        provenance=material.provenance,
        result=result_text(analysis),
        sections=chapters(
            sections, _blocks(assets, progress, cache, lacking, raw_csv=raw_csv)
        ),
        inputs=_inputs(inputs, anchors),
        version=analysis.masrel_version,
    )
    if lacking:  # of all figures at once
        warnings.warn(MissingLettersWarning(lacking), stacklevel=2)
    writers = [
        writer
        for name, writer in WRITERS.items()
        if name in protocol.report.formats or name in formats
    ]
    pages = {writer.file: _page(writer, document, cache) for writer in writers}
    pages[NUMBERS] = analysis_text(analysis).encode()
    if progress is not None:
        progress("pages")
    made_from = {**inputs, **({} if conduct is None else conduct.inputs)}
    converted = any(writer.is_converted for writer in writers)
    with_pandoc = pandoc_version() if converted else None
    return report_files(assets, pages, made_from, pandoc=with_pandoc)


def section_names(protocol: Protocol) -> tuple[str, ...]:
    """Return the names of the sections that the report of a study can have."""
    return (*report_sections(protocol), *CONDUCT_SECTIONS)


def _blocks(
    assets: Assets,
    progress: Progress | None,
    cache: Cache,
    lacking: set[str],
    *,
    raw_csv: bool,
) -> Callable[[int, Content], Block]:
    # what makes blocks as they are shown; files of tables and figures go to the assets
    def block(number: int, content: Content) -> Block:
        pictures: Mapping[str, bytes] = {}
        if isinstance(content, Table):
            file = as_csv(content, raw=raw_csv).encode()
            assets.add("tables", content.name, "csv", file)
        elif isinstance(content, Drawing):
            pictures = _pictures(content, cache, lacking)
            if progress is not None:
                progress(content.name)
        files = {
            form: assets.add("figures", content.name, form, picture)
            for form, picture in pictures.items()
            if isinstance(content, Drawing)
        }
        return Block(number=number, content=content, pictures=pictures, files=files)

    return block


def _pictures(drawing: Drawing, cache: Cache, lacking: set[str]) -> Mapping[str, bytes]:
    # its files by form: those that were kept, or else drawn; lacking: letters that
    # figures so far have no font for
    key = cache.key("figure", drawing.content, drawing.stamp, libraries=_DRAWING)
    stored = cache.read(key)
    if stored is None:
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            files = draw(drawing.content, stamp=drawing.stamp)
        stored = {str(form): data for form, data in files.items()}
        if not caught:  # a font with the letters that are missing may come
            cache.write(key, stored)
        for warning in caught:
            if isinstance(warning.message, MissingLettersWarning):
                lacking |= warning.message.letters
            else:
                warnings.warn(warning.message, stacklevel=2)
    return stored


_DRAWING = ("matplotlib", "numpy", "pillow", "scipy")
_PAGE = "page"


def _page(writer: Writer, document: Document, cache: Cache) -> bytes:
    pandoc = pandoc_version() if writer.is_converted else None
    key = cache.key("page", writer.file, document, pandoc, libraries=("jinja2",))
    stored = cache.read(key)
    if stored is not None:
        return stored[_PAGE]
    page = writer.write(document)
    cache.write(key, {_PAGE: page})
    return page


def _inputs(
    inputs: Mapping[str, str], anchors: Sequence[Anchor]
) -> tuple[tuple[str, str], ...]:
    # what the pages end with: the hash of everything they were made from
    return (
        *(
            (f"SHA-256 of the {_INPUTS[name]}", digest)
            for name, digest in inputs.items()
        ),
        *((f"SHA-256 of line {a.line} of {a.log}", a.sha256) for a in anchors),
    )
