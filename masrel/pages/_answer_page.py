"""The page of answers to questions about a file of ratings.

In: the ratings, the questions and their answers. Out: one HTML page with the result,
its tables and pictures, items to discuss, methods to paste, and what repeats it.
"""

import math
import warnings
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING

from masrel.analysis._file_estimates import Answer, Questions
from masrel.errors import MasrelWarning
from masrel.pages._methods_text import latent_methods, methods, reference_texts
from masrel.pages._pictures import (
    PICTURES,
    PartSeen,
    forest_drawing,
    judge_drawings,
    parts_seen,
)
from masrel.pages._sections import (
    Content,
    Document,
    Drawing,
    Paragraph,
    Section,
    chapters,
    drawn_block,
    html_page,
)
from masrel.plots._drawn_values import Drawn
from masrel.ratings import RatingsFile
from masrel.tables._first_screen import (
    first_screen,
    lacks_interval,
    reading_warnings,
    result_sentence,
    what_was_read,
)
from masrel.tables._tables import (
    ABSENT,
    SIMULATED,
    Column,
    Table,
    capital,
    interval_text,
    number,
    percent,
    table_of,
    tag_of,
)

if TYPE_CHECKING:
    from masrel.intervals import LatentTrait

_MOST_PARTS = 4  # whose pictures are all shown
_MOST_LISTED = 12  # items
_MOST_NAMED = 8  # raters whose grades stand one after the other
# Commands to what their page is called; it begins with their own tables
_TITLES = {
    "compare": "Agreement of groups in",
    "diagnose": "Raters, pairs and grades in",
    "judge": "Judges and humans in",
    "limits": "Limits of agreement of the raters in",
}

# Sections of pictures in the order of a page
_PICTURED = {
    "raters": "Raters",
    "grades": "Grades",
    "items": "Items to discuss",
    "variance": "Where the variance lies",
}

_NO_INTERVAL = (
    "No interval was asked for. To generalise to other items, add --target items (in "
    'Python target="items"); to other raters, raters or both.'
)


def answer_page(
    file: RatingsFile,
    questions: Questions,
    answers: Sequence[Answer],
    *,
    call: str = "",
    reading: Mapping[str, object] | None = None,
    items: str = "items",
) -> str:
    """Return the page of answers; call: the command that repeats it."""
    # reading: the options of Python, where there is no command
    # what is undefined is said in tables and pictures
    with warnings.catch_warnings(action="ignore", category=MasrelWarning):
        sections = [
            _result_section(file, questions, answers, items),
            *_picture_sections(file, questions, answers),
        ]
    blocks = [block for section in sections for block in section.blocks]
    drawn = [block.name for block in blocks if isinstance(block, Drawing)]
    sections.append(_methods_section(*methods(file, questions, answers, drawn, items)))
    _, sentence = result_sentence(answers, items)
    options = {**(reading or {}), **questions.record()}
    listed = ", ".join(f"{name} {of}" for name, of in options.items() if of is not None)
    title = _TITLES.get(questions.command, "Agreement of the raters in")
    how = {"Command": call} if call else {"Options": listed}
    return _page(file, title, sentence, sections, how, items)


def _page(
    file: RatingsFile,
    title: str,
    result: str,
    sections: Sequence[Section],
    inputs: Mapping[str, str],
    items: str = "items",
) -> str:
    stamp, name = SIMULATED if file.simulated else "", Path(file.read["file"]).name
    # what repeats it: the command or else the options, and what it was made of
    known = {**inputs, f"SHA-256 of {name}": file.sha256()}
    return html_page(
        Document(
            title=f"{title} {name}",
            tag=tag_of("simulated" if file.simulated else "foreign"),
            banner=stamp,
            provenance=" ".join(what_was_read(file, items)),
            result=result,
            sections=chapters(sections, partial(drawn_block, stamp=stamp)),
            inputs=tuple((name, value) for name, value in known.items() if value),
            version=version("masrel"),
        )
    )


def _result_section(
    file: RatingsFile, questions: Questions, answers: Sequence[Answer], items: str
) -> Section:
    first, *more = (
        _with_interval(table, questions.level)
        for table in first_screen(
            file, questions, answers, detail="all", items=items, is_text=False
        )
    )
    notes = [f"Warning: {text}." for text in reading_warnings(file, answers[0])]
    if questions.target is None and lacks_interval(answers[0]):
        notes.append(_NO_INTERVAL)
    forest = forest_drawing(answers, questions)
    blocks: list[Content] = [
        first,
        *([] if forest is None else [forest]),
        *judge_drawings(answers, questions.level),
        *(Paragraph(text=text, absent=True) for text in notes),
    ]
    # which have an answer of their own
    is_first = questions.command in _TITLES and questions.judging is None
    blocks = [*more, *blocks] if is_first else [*blocks, *more]
    return Section(name="result", title="Result", blocks=tuple(blocks))


def _with_interval(table: Table, level: float) -> Table:
    """Return a table whose interval is one column, right after what it is of."""
    keys = [column.key for column in table.columns]
    if not {"low", "high"} <= set(keys):
        return table
    low, high = keys.index("low"), keys.index("high")
    has_any = any(row[low] is not None for row in table.rows)
    beside = ("standard_error", "median" if "value" in keys else "")
    of = max(at for at in range(low) if keys[at] not in beside)
    order = [at for at in range(len(keys)) if at not in (low, high)]
    order.sort(key=lambda at: keys[at] == "items")  # whether they are the same: last
    place = order.index(of) + 1
    column = Column(
        key="interval",
        heading=f"{percent(level)} % interval",
        align="center",
        where="everywhere" if has_any else "csv",
    )
    columns = [table.columns[at] for at in order]
    columns.insert(place, column)
    rows = []
    for at, row in enumerate(table.rows):
        cells = [row[at] for at in order]
        ends, text = (row[low], row[high]), None
        if isinstance(ends[0], float) and isinstance(ends[1], float):
            text = interval_text(ends[0], ends[1], in_units=at in table.in_units)
        rows.append((*cells[:place], text, *cells[place:]))
    return replace(table, columns=tuple(columns), rows=tuple(rows))


def _picture_sections(
    file: RatingsFile, questions: Questions, answers: Sequence[Answer]
) -> Iterator[Section]:
    every = parts_seen(file, questions, answers)
    parts = every[:_MOST_PARTS]
    for name, title in _PICTURED.items():
        blocks: list[Content] = [
            drawing
            for section, make in PICTURES.values()
            if section == name
            for part in parts
            if (drawing := make(part)) is not None
        ]
        if name == "items":
            blocks[:0] = [
                table for part in parts if (table := _items_table(part)) is not None
            ]
        text = f"Only the first {_MOST_PARTS} of {len(every)} groups are shown."
        some = [Paragraph(text=text, absent=True)] * (len(every) > _MOST_PARTS)
        if blocks:
            yield Section(name=name, title=title, blocks=(*some, *blocks))


_OF_ITEMS = (
    Column(key="item", heading="Item", align="left"),
    Column(key="disagreement", heading="Disagreement", digits=3),
)


def _items_table(seen: PartSeen) -> Table | None:
    """Return the items that raters disagree on most, with what each rater gave."""
    places = seen.disputed[:_MOST_LISTED]
    if seen.coded is None or places.size == 0:
        return None
    grades, rows = seen.file.scale.grades, []
    is_named = len(seen.raters) <= _MOST_NAMED
    for place in places:
        codes = seen.coded.codes[place].tolist()
        counts = [(codes.count(code), grade) for code, grade in enumerate(grades)]
        text = ", ".join(f"{grade} ×{n}" for n, grade in counts if n)
        if is_named:  # in the order of the raters
            text = ", ".join(grades[code] if code >= 0 else ABSENT for code in codes)
        rows.append(
            {
                "item": seen.items[place],
                "disagreement": float(seen.disagreement[place]),
                "grades": text,
            }
        )
    heading = f"Grades of {', '.join(seen.raters)}" if is_named else "Grades"
    of_part = f"{seen.group}: " if seen.group else ""
    metric = seen.questions.metric
    by = f"{seen.distance} weights" if metric is None else f"{metric} metric"
    return table_of(
        "items_to_discuss",
        f"{of_part}{capital(seen.how_many(len(rows)))}",
        [*_OF_ITEMS, Column(key="grades", heading=heading, align="left")],
        rows,
        notes=(
            "Disagreement: share of the pairs of ratings of an item that differ."
            if seen.distance == "identity"
            else f"Disagreement: mean distance between two ratings of an item ({by}).",
        ),
        data="simulated" if seen.file.simulated else "foreign",
    )


def _methods_section(text: str, keys: Sequence[str]) -> Section:
    # a paragraph, and the keys of what it cites
    blocks = [Paragraph(text=text) for text in (text, *reference_texts(keys))]
    return Section(name="methods", title="Methods, to paste", blocks=tuple(blocks))


def latent_page(
    file: RatingsFile, result: "LatentTrait", table: Table, *, call: str = ""
) -> str:
    """Return the page of a latent-trait model of ratings, whose table is given."""
    kappa, grades = result.kappa, file.scale.grades
    low, high = (getattr(kappa.interval, end, math.nan) for end in ("low", "high"))
    level = getattr(kappa.interval, "level", 0.95)
    alt = "; ".join(f"{of.name} {number(of.value, 2)}" for of in result.thresholds)
    drawing = Drawing(
        name="latent",
        caption="Items, thresholds between grades and raters on one scale: posterior "
        f"medians (dots) with {percent(level)} % credible intervals, and each rater's "
        "noise (shaded).",
        alt=f"The latent scale. Thresholds: {alt}.",
        content=Drawn("masrel.plots._latent_scale:latent_picture", (result, grades)),
        stamp="",
    )
    table = replace(table, caption="Every quantity of the model", read=())
    blocks = (drawing, _with_interval(table, level))
    return _page(
        file,
        "Latent trait of the ratings in",
        f"Two new raters agree with κ {number(kappa.value, 3)} "
        f"({percent(level)} % credible interval {interval_text(low, high)}).",
        [
            Section(name="result", title="Result", blocks=blocks),
            _methods_section(*latent_methods(file, result)),
        ],
        {"Command": call, "Seed": str(result.seed)},
    )


def spans_page(table: Table, drawn: Drawn, inputs: Mapping[str, str]) -> str:
    """Return the page of agreement on the spans in a file, whose table is given."""
    text = f"The spans of each observer in {drawn.arguments[-1]}, label by label."
    drawing = Drawing(name="spans", caption=text, alt=text, content=drawn, stamp="")
    return html_page(
        Document(
            title="Agreement on spans",
            tag="",
            banner="",
            provenance="",
            result="",
            sections=chapters(
                [Section(name="result", title="Result", blocks=(table, drawing))],
                drawn_block,
            ),
            inputs=tuple(inputs.items()),
            version=version("masrel"),
        )
    )


def study_page(
    tables: Sequence[Table], curves: Drawn, inputs: Mapping[str, str], methods: str
) -> str:
    """Return the page of a generalizability study: its tables and its curves."""
    # methods: how it was made, to paste
    first, *more = tables
    stamp = SIMULATED if "simulated" in first.data else ""
    drawing = Drawing(
        name="reliability",
        caption="Dependability Φ of means, by number of levels.",
        alt="Curves that rise with the number of levels; the table has the numbers.",
        content=curves,
        stamp="",
    )
    table = replace(
        first,
        caption="Components of variance",
        read=(),
        notes=first.notes[1:],  # the result stands above
    )
    sections = [
        Section(name="result", title="Result", blocks=(table, drawing, *more)),
        _methods_section(methods, ["brennan2001"]),
    ]
    return html_page(
        Document(
            title="Generalizability study",
            tag=tag_of(first.data),
            banner=stamp,
            provenance=first.read[0],
            result=first.notes[0],
            sections=chapters(sections, partial(drawn_block, stamp=stamp)),
            inputs=tuple(inputs.items()),
            version=version("masrel"),
        )
    )
