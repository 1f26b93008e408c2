"""The report: one self-contained page, the same as Markdown, tables and figures.

In: a protocol, its ratings and their analysis. Out: a folder with ``report.html``,
``report.md``, ``references.bib``, ``tables/*.csv``, ``figures/*.png`` and ``*.svg``,
and the hash of each in ``manifest.json``. The same inputs give the same bytes; there is
no time of day in any of them.
"""

from collections.abc import Callable, Collection, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import count
from pathlib import Path

from masrel.lab._study_files import MANIFEST
from masrel.lab.analysis import Analysis
from masrel.lab.analysis._results import analysis_text
from masrel.lab.protocol import Protocol, report_sections
from masrel.lab.ratings import InPerson, Ratings
from masrel.lab.report._agreement import (
    categories_section,
    estimates_section,
    retest_section,
)
from masrel.lab.report._conduct import StudyConduct, conduct_section, flow_section
from masrel.lab.report._design import design_section, sample_size_section
from masrel.lab.report._grade_sections import (
    confusion_section,
    grades_section,
    in_person_section,
    intended_section,
    questionnaires_section,
)
from masrel.lab.report._material import SUPPLEMENT, Material, gather, sentence
from masrel.lab.report._order_tables import order_section
from masrel.lab.report._pages import CONVERTED, WRITERS, pandoc_version
from masrel.lab.report._paragraphs import methods_section, result_text
from masrel.lab.report._report_folder import (
    NUMBERS,
    REFERENCES,
    replace_report,
    report_files,
)
from masrel.lab.report._trace_section import speeds_section, traces_section
from masrel.lab.verification import Anchor
from masrel.pages._sections import (
    Block,
    Content,
    Document,
    Drawing,
    Paragraph,
    References,
    Section,
    chapters,
    drawn_block,
)
from masrel.plots._drawn_values import Form
from masrel.tables._tables import Table, as_csv, tag_of

Progress = Callable[[str], object]
"""Called with the name of each figure, and of the pages, once it is made."""


SECTIONS: dict[str, tuple[str, str, Callable[[Material], Iterable[Content]]]] = {
    "design": ("", "Design", design_section),
    "flow": ("", "Flow of the raters", flow_section),
    "conduct": ("", "Conduct", conduct_section),
    "sample-size": ("", "Sample size", sample_size_section),
    "agreement": ("Agreement", "Estimates in full", estimates_section),
    "grades": ("Grades", "Tables of grades", grades_section),
    "categories": ("", "Agreement on each grade", categories_section),
    "intended": ("", "Agreement with the intended grade", intended_section),
    "confusion": (
        "Where raters disagree",
        "Grades by intended grade",
        confusion_section,
    ),
    "test-retest": ("Reliability over time", "Test-retest agreement", retest_section),
    "in-person": ("", "In-person and haptic grades", in_person_section),
    "order": ("", "Effects of order", order_section),
    "speeds": ("", "Stretching speeds", speeds_section),
    "traces": ("What was presented", "Torque traces", traces_section),
    "questionnaires": ("", "Questionnaires", questionnaires_section),
    # masrel audit has what it showed
    "claims": ("", "Published numbers", lambda _: ()),
    "methods": ("Methods", "References", methods_section),
}
"""The headings of each section and what it says, by its name in ``report.sections``.

In the order in which they come: the first heading is that in the main part, if the
section has anything there, the second that in the supplement.
"""

_INPUTS = {
    "protocol_sha256": "protocol",
    "ratings_sha256": "ratings",
    "in_person_sha256": "grades given in person",
    "answers_sha256": "answers to questionnaires",
}


def made_section(name: str, material: Material) -> tuple[Section, Section, str]:
    """Return what a section has in the main part and the supplement, or why nothing."""
    heading, title, contents = SECTIONS[name]
    every = [*contents(material)]
    reasons = [c.text for c in every if isinstance(c, Paragraph) and c.absent]
    if len(reasons) == len(every):
        every = []
    if SUPPLEMENT not in every:
        every.insert(len(every) if heading else 0, SUPPLEMENT)
    at = every.index(SUPPLEMENT)
    place = f"{name}-more" if heading else name
    return (
        Section(name=name, title=heading, blocks=tuple(every[:at])),
        Section(name=place, title=title, blocks=tuple(every[at + 1 :])),
        "" if len(every) > 1 else "; ".join(reasons),
    )


def _parts(
    names: Sequence[str], material: Material
) -> tuple[list[Section], list[Section]]:
    # the main part and the supplement, of sections that have something to show
    made = {name: made_section(name, material) for name in names}
    main = [first for first, _, _ in made.values() if first.blocks]
    more = [second for _, second, _ in made.values() if second.blocks]
    if not main:
        main, more = more, []
    lacking = [
        f"{of.title.lower()} ({reason})" for _, of, reason in made.values() if reason
    ]
    if lacking:  # is said once
        text = f"Not in these data: {'; '.join(lacking)}."
        first, *others = main or [Section(name="result", title="Result", blocks=())]
        blocks = (*first.blocks, Paragraph(text=text, absent=True))
        main = [replace(first, blocks=blocks), *others]
    return main, more


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
        One CSV per table; a number is added to a name that there is already.
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
    raw_csv: bool = False,
) -> ReportFiles:
    """Write the report a protocol asks for.

    It begins with the results of the study, in sentences. Only those sections are made
    that `masrel.lab.protocol.report_sections` names: what is in the main part,
    then the supplement; matplotlib is loaded when a section has a figure.

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
        The folder of the sessions' recordings, for figures of measured torque.
    conduct : StudyConduct, optional
        How the study was run (`study_conduct`); where there is anything to say, it is
        said after the design.
    anchors : sequence of Anchor, optional
        Hashes of the session logs (`masrel.lab.verification.anchors_of`), printed at
        the end: a report kept elsewhere shows whether the logs were rewritten.
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
        If the folder is one of a study's primary records, or a link in it leads out;
        if the protocol asks for LaTeX or DOCX and pandoc is not installed.
    OSError
        If a file cannot be written; the pages that were there are then there still.
    """
    material = gather(protocol, ratings, analysis, in_person, recordings, conduct)
    files = make_report(material, anchors=anchors, progress=progress, raw_csv=raw_csv)
    replace_report(destination, files)
    pages = {
        name: destination / file if file in files else None
        for name, (file, _) in WRITERS.items()
    }
    return ReportFiles(
        **pages,
        manifest=destination / MANIFEST,
        tables=tuple(destination / p for p in files if p.startswith("tables/")),
        figures=tuple(destination / p for p in files if p.startswith("figures/")),
    )


def make_report(
    material: Material,
    *,
    anchors: Sequence[Anchor] = (),
    progress: Progress | None = None,
    raw_csv: bool = False,
    only: Collection[str] = (),
    formats: Collection[str] = (),
) -> dict[str, bytes]:
    """Return the files of a report, of these sections only if some are named."""
    # formats: those that are made beside the protocol's
    # By name from the report's folder, in the order in which they are to be written
    protocol, analysis = material.protocol, material.analysis
    is_sealed = material.ratings.is_sealed
    every = section_names(protocol, is_sealed=is_sealed)
    names = [name for name in every if not only or name in only]
    assets, inputs = dict[str, bytes](), dict(analysis.inputs)
    block = partial(_block, assets, progress, raw_csv)
    main, supplement = _parts(names, material)
    document = Document(
        title=protocol.report.title or protocol.study.title,
        tag=tag_of(material.data),
        banner=material.banner,
        provenance=material.provenance,
        result=sentence("result", "sealed") if is_sealed else result_text(material),
        sections=chapters(main, block),
        # what the pages end with: the hash of everything they were made from
        inputs=(
            *((f"SHA-256 of the {_INPUTS[name]}", of) for name, of in inputs.items()),
            *((f"SHA-256 of line {a.line} of {a.log}", a.sha256) for a in anchors),
        ),
        version=analysis.masrel_version,
        supplement=chapters(supplement, block, "S"),
    )
    forms = {*protocol.report.formats, *formats}
    writers = [writer for name, writer in WRITERS.items() if name in forms]
    pages = {file: write(document) for file, write in writers}
    pages[NUMBERS] = analysis_text(analysis).encode()
    if progress is not None:
        progress("pages")
    if material.conduct is not None:
        inputs |= material.conduct.inputs
    pandoc = pandoc_version() if CONVERTED & forms else None
    is_private = material.conduct is not None and material.conduct.goes_on
    return report_files(assets, pages, inputs, pandoc=pandoc, is_private=is_private)


def section_names(protocol: Protocol, *, is_sealed: bool) -> list[str]:
    """Return the names of the sections that a report can have, in their order."""
    # no protocol names the two: they are there where there is anything to say
    named = {"flow", "conduct", *(() if is_sealed else report_sections(protocol))}
    return [name for name in SECTIONS if name in named]


def _block(
    assets: dict[str, bytes],
    progress: Progress | None,
    raw_csv: bool,
    number: str,
    content: Content,
) -> Block:
    # as it is shown; files of tables, figures and references go to the assets
    if isinstance(content, Table):
        data, name = as_csv(content, raw=raw_csv).encode(), f"tables/{content.name}"
        if assets.get(f"{name}.csv") != data:  # not once more: fewer columns of it
            assets[_new_place(assets, name, "csv")] = data
    if isinstance(content, References):
        assets[REFERENCES] = content.bibtex.encode()
    block = drawn_block(number, content, forms=("png", "svg", "inline"))
    if not isinstance(content, Drawing):
        return block
    if progress is not None:
        progress(content.name)
    beside: tuple[Form, ...] = ("png", "svg")
    files = {
        form: _new_place(assets, f"figures/{content.name}", form) for form in beside
    }
    assets.update({place: block.pictures[form] for form, place in files.items()})
    return replace(block, files=files)


def _new_place(assets: Collection[str], name: str, form: str) -> str:
    # of a file whose name no other has, such as that of another session's table
    names = (f"{name}{f'_{n}' * (n > 1)}.{form}" for n in count(1))
    return next(place for place in names if place not in assets)
