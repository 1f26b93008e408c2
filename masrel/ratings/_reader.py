"""Any file of ratings, in whatever shape its program left it, as ratings.

In: a path and what the caller says of it. Out: a `RatingsFile` with what was read. The
stages: `_sheet` or `_exports` (a file as columns of text; `_tools` has what exports of
annotation and evaluation tools say), `_layout` (which column is
what), `_grade_texts` (which grade a text is), and here ratings put together item by
rater, or tables of counts; `_large` is for large files. `_findings` has
the texts of all that is refused or warned of.
"""

import hashlib
import math
import re
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from functools import cache, cached_property, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from masrel._input import USUAL_NAMES
from masrel.agreement import (
    CodedRatings,
    CountedRatings,
    Weights,
    count_ratings,
    declared_weights,
)
from masrel.agreement._codes import count_items, count_table, read_only
from masrel.errors import ParameterError, RatingsError
from masrel.ratings._doubts import (
    doubt_columns,
    doubt_counts,
    doubt_item_names,
    doubt_items,
    doubt_names,
    refuse_named,
)
from masrel.ratings._findings import (
    Finding,
    Reading,
    listed,
    refusal,
)
from masrel.ratings._grade_texts import (
    Grades,
    count_of,
    graded,
    if_thousands,
    is_number,
    with_order,
)
from masrel.ratings._layout import (
    Layout,
    columns_of,
    find_layout,
    named,
    rated_twice,
    sides_of,
    together,
    without_second_header,
)
from masrel.ratings._sheet import (
    TEXT_FORMATS,
    TYPED_FORMATS,
    WORKBOOKS,
    Codes,
    Column,
    Sheet,
    bytes_of,
    decoded,
    finished,
    long_cells,
    read_text,
    refuse_html,
    unpacked,
)
from masrel.ratings._tools import Annotation, brat_spans, label_studio_spans
from masrel.scales import Scale

if TYPE_CHECKING:
    from masrel.ratings._large import Answer, Source

_LARGE_TEXT = 32 << 20  # bytes of text from which DuckDB groups it, if it is there
_MAX_DENSE = 20_000_000  # places, items by raters, that are always kept one by one
_MAX_SPARSE = 8  # places a rating beyond which only counts are kept
_MAX_COUNTS = 200_000_000  # places, items by categories, of counts
_MAX_COUNT = 10**12  # of a row


@dataclass(frozen=True, kw_only=True)
class RatingsPart:
    """The ratings of one group and session of a file.

    Attributes
    ----------
    group : str or None
        Their entry in the column of groups; None without such a column.
    session : str or None
        Their session; None where the file has no such column.
    items, raters : tuple of str
        Names, in the order in which they are met; raters without a name have none, and
        neither have the items of a stream.
    clusters : tuple of str
        The cluster of each item; empty where none are told apart.
    ratings : CodedRatings or CountedRatings
        The ratings on the values of the scale, item by rater; counted where only
        counts are known, or kept because items and raters are many.
    """

    group: str | None = None
    session: str | None = None
    items: tuple[str, ...] = field(default=(), repr=False)
    raters: tuple[str, ...] = field(default=(), repr=False)
    ratings: CodedRatings | CountedRatings = field(repr=False)
    clusters: tuple[str, ...] = field(default=(), repr=False)

    @cached_property
    def counted(self) -> CountedRatings:
        """The ratings, counted once for several coefficients."""
        return count_ratings(self.ratings)


@dataclass(frozen=True, slots=True, kw_only=True)
class RatingsFile:
    """A file of ratings, and what was read from it.

    Attributes
    ----------
    parts : tuple of RatingsPart
        The ratings; one part unless groups or sessions are told apart.
    scale : Scale
        Its grades in order: declared, or those met.
    is_ordered : bool
        Whether that order is more than the alphabet's.
    read : dict
        What was read, ready for JSON: format, columns, grades, missing ones, scale.
    sha256 : callable
        Returns the hash of the file's bytes, for which a stream is read again; nothing
        of a table in memory.
    warnings : tuple of Finding
        What may have been read wrongly, and which option would tell.
    simulated : bool
        Whether any rating is simulated.
    """

    parts: tuple[RatingsPart, ...]
    scale: Scale
    is_ordered: bool
    read: dict[str, Any] = field(repr=False)
    sha256: Callable[[], str] = field(repr=False, compare=False)
    warnings: tuple[Finding, ...]
    simulated: bool


@long_cells()
def read_ratings(
    data: Any,
    reading: Reading | None = None,
    *,
    progress: Callable[[int, int], None] | None = None,
) -> RatingsFile:
    r"""Read the ratings in a file or table, or say which option decides.

    Parameters
    ----------
    data : Path, str, DataFrame, dict of columns or array_like
        The path of a file; "-" is standard input. Text, workbooks, Parquet, Feather,
        JSON, SPSS, Stata and SAS, packed or not; ``docs/reference/formats/ratings.md``
        has every shape. Or a table: a DataFrame of pandas or polars, a table of Arrow,
        a relation of DuckDB, columns by name, or rows without names.
    reading : Reading, optional
        How it is read; the file tells what is not given.
    progress : callable, optional
        Takes how many bytes of how many are read of a stream.

    Returns
    -------
    RatingsFile
        The ratings, and what was read.

    Raises
    ------
    RatingsError
        If the file is not a table of ratings, or could be more than one.
    ParameterError
        If `reading` has categories that are not a scale.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder) / "wide.csv"
    ...     _ = path.write_text("patient;Kim;Lee\nA;1;1+\nB;2;NA\n")
    ...     file = read_ratings(path)
    >>> file.scale.name, file.read["raters"], file.read["n_missing"]
    ('MAS', ['Kim', 'Lee'], 1)
    """
    options = reading or Reading()
    if not isinstance(data, Path | str):
        from masrel.ratings._exports import read_table  # with pandas

        sheet, options = read_table(data, options)
        return _read_cells(finished(sheet, options), options)
    path = Path(data)
    suffix, is_large = path.suffix.lower(), bool(options.stream)
    if options.stream is None and not options.whole and path.is_file():
        is_large = path.stat().st_size >= _LARGE_TEXT or suffix == ".parquet"
    report = progress or (lambda *_: None)
    streamed = _streamed(path, options, report) if is_large else None
    return streamed or _read_cells(_read_sheet(path, options), options)


@long_cells()
def read_facets(
    path: Path, facets: Sequence[str], reading: Reading
) -> tuple[Sheet, dict[str, Any]]:
    """Return a long table, and its columns of items, of facets and of numbers."""
    sheet = without_second_header(_read_sheet(path, reading))
    if not len(sheet.numbers):
        raise sheet.refuse("no rows", sheet.at(0))
    places = columns_of(sheet, "facets", facets)
    first, *others = (sheet.header[place] for place in places)
    aside = replace(reading, rater=first, ignore=(*reading.ignore, *others))
    layout = find_layout(sheet, aside)
    reading = with_order(sheet, layout.grades, reading)
    grades = graded(sheet, layout.grades, reading)
    if grades.scale.name == "observed" and not is_number(grades.scale.grades[0]):
        raise sheet.refuse("facets of text", sheet.at(0), layout.grades[0])
    values = np.array([*grades.scale.values, np.nan])[grades.codes.ravel()]
    columns: dict[str, Any] = {
        " ".join(sheet.header[k] for k in layout.item): layout.item
    }
    columns |= {sheet.header[place]: [place] for place in places}
    for name, of in columns.items():
        column = named(sheet, "item" if of is layout.item else "facet", of)
        columns[name] = np.array(column.texts, dtype=object)[column.codes]
    return sheet, {**columns, sheet.header[layout.grades[0]]: values}


def _read_cells(sheet: Sheet, options: Reading) -> RatingsFile:
    """Return the ratings in the cells of a file or a table."""
    cells = without_second_header(sheet)
    if not len(cells.numbers):
        raise cells.refuse("no rows", cells.at(0))
    layout = find_layout(cells, options)
    options = with_order(cells, layout.grades, options)
    read = _counted if layout.kind in ("counts", "table") else _rated
    if layout.frequency is not None:
        cells, read = _standing_for(cells, layout.frequency, options), _patterns
    return read(cells, layout, options, list(cells.findings))


def _read_sheet(path: Path | str, options: Reading) -> Sheet:
    """Read a file of any format as columns of text."""
    name, data = str(path), bytes_of(path)
    if not data:
        raise refusal(name, "empty")
    sha256 = partial(str, hashlib.sha256(data).hexdigest())  # which pickle takes
    inner, data = unpacked(name, data, is_export=options.source is not None)
    refuse_html(name, data)
    suffix = Path(inner).suffix.lower()
    if options.sheet is not None and suffix not in WORKBOOKS:
        raise refusal(name, "no workbook", sheet=options.sheet)
    is_typed = options.source is not None or suffix in TYPED_FORMATS
    if is_typed and options.names_at and (options.source or suffix not in WORKBOOKS):
        raise refusal(name, "no lines")
    if is_typed:
        from masrel.ratings._exports import read_typed  # with pandas

        return finished(read_typed(name, sha256, suffix, data, options), options)
    text = decoded(name, data, options.encoding)
    kind = TEXT_FORMATS.get(suffix, "text")
    return finished(read_text(name, sha256, text, kind, options), options)


def _streamed(
    path: Path, options: Reading, progress: Callable[[int, int], None]
) -> RatingsFile | None:
    # by DuckDB; None if the file is to be read as a whole
    from masrel.ratings import _large

    try:
        source = _large.source_of(path, options)
        sheet = without_second_header(source.head)
        if sheet.findings or not len(sheet.numbers):
            return None
        layout = find_layout(sheet, options)
        if layout.session is not None:
            return None
        options = with_order(sheet, layout.grades, options)
        with _large.database_of(source, layout, progress) as answer:
            return _grouped(answer, source, layout, options)
    except _large.NoStreamError as error:
        if options.stream and (path.exists() or str(path) == "-"):
            text = f"{path}: {error}; --no-stream reads the whole file at once"
            raise RatingsError(text) from error
        return None


def _grouped(
    answer: "Answer", source: "Source", layout: Layout, options: Reading
) -> RatingsFile:
    # the rows of ratings that differ, how often each is there, and their grades
    from masrel.ratings import _large

    groups = _large.groups_of(answer, source, layout)
    grades = graded(groups, layout.grades, options)
    freq, codes = groups.freq, grades.codes.ravel()
    n_missing, *counts = _often(grades, freq)
    names, findings = [groups.header[place] for place in layout.raters], []
    if layout.kind == "long":
        rater, n_rows = named(groups, "rater", layout.raters), int(freq.sum())
        names = rater.texts
        rows, freq = _large.patterns(answer, groups, layout, rater, codes)
        findings = doubt_items(groups, layout, int(freq.sum()), n_rows)
    else:
        rows = grades.codes
        findings = doubt_columns(source.head, layout, options, rows, grades.scale, freq)
        _large.refuse_repeated_items(answer, groups, layout)
    findings += doubt_names("raters", names)
    return _file_of(
        *(groups, layout, options, grades),
        [RatingsPart(raters=tuple(names), ratings=_distinct(rows, freq, grades.scale))],
        np.array(counts),
        findings + _large.doubt_names_met(answer, groups, layout),
        raters=names,
        n_items=int(freq.sum()),
        n_raters=len(names),
        n_missing=int(n_missing),
    )


def _often(grades: Grades, freq: Codes) -> Codes:
    # how often there is no grade, and each of the scale, by how often each row is there
    n_cells = np.repeat(freq, grades.codes.shape[1])
    n = np.bincount(grades.codes.ravel() + 1, n_cells, len(grades.scale.grades) + 1)
    return n.astype(np.int64)


def _distinct(rows: Codes, freq: Codes, scale: Scale) -> CountedRatings:
    # rows of ratings that differ, of rows that are there so often
    rows = rows.astype(np.min_scalar_type(-len(scale.grades) - 1))
    rows, place = np.unique(rows, axis=0, return_inverse=True)
    return CountedRatings(
        codes=rows,
        freq=np.bincount(place.ravel(), freq).astype(np.int64),
        categories=scale.values,
        n_raters=int((rows >= 0).any(axis=0).sum()),
        declared=_is_declared(scale),
    )


def _is_declared(scale: Scale) -> bool:
    # numbers that nobody declared may be measurements rather than grades
    return scale.name != "observed" or not all(map(is_number, scale.grades))


def _file_of(
    sheet: Sheet,
    layout: Layout,
    options: Reading,
    grades: Grades,
    parts: Sequence[RatingsPart],
    counts: Codes,
    findings: Sequence[Finding],
    **facts: Any,
) -> RatingsFile:
    """Return the ratings with the record of what was read."""
    # counts (n_grades,): how often each grade of the scale is there; facts: the rest of
    # the record
    scale, header = grades.scale, sheet.header
    of_long = (*layout.raters, *layout.grades) if layout.kind == "long" else (None,) * 2
    roles = ("rater", "grade", "session", "by")
    places = (*of_long, layout.session, layout.by)
    used = {*layout.item, *layout.raters, *layout.grades, *places}
    used |= {layout.clusters, layout.frequency}
    findings = (*findings, *grades.findings)
    record = {
        "file": sheet.name,
        **sheet.facts,
        "layout": layout.kind,
        "item": [header[place] for place in layout.item],
        **{
            role: None if place is None else header[place]
            for role, place in zip(roles, places, strict=True)
        },
        "ignored": [name for k, name in enumerate(header) if k not in used],
        "grades": {
            g: n for g, n in zip(scale.grades, counts.tolist(), strict=True) if n
        },
        "missing": grades.n_missing,
        "merged": grades.merged,
        **grades.facts,
        "dropped": sheet.dropped,
        "scale": {
            "name": scale.name,
            "grades": list(scale.grades),
            "declared": options.categories is not None,
        },
        "raters": [],
        "n_items": 0,
        "n_raters": 0,
        "n_ratings": int(counts.sum()),
        "n_missing": None,  # counts do not say
        "n_repeated": 0,
        "repeated": None,
        **facts,
        "warnings": list(map(str, findings)),
    }
    sources = [c for n, c in zip(header, sheet.columns, strict=True) if n == "source"]
    is_simulated = any("simulated" in column.texts for column in sources)
    return RatingsFile(
        parts=tuple(parts),
        scale=scale,
        # more than by the alphabet
        is_ordered=scale.name != "observed" or all(map(is_number, scale.grades)),
        read=record,
        sha256=sheet.sha256,
        warnings=findings,
        simulated=sheet.is_simulated or is_simulated,
    )


# ---- ratings one by one ----


def _graded(sheet: Sheet, layout: Layout, options: Reading) -> Grades:
    # what is no rater by its name may hold anything
    try:
        return graded(sheet, layout.grades, options)
    except RatingsError:
        refuse_named(sheet, layout, options)
        raise


def _rated(
    sheet: Sheet, layout: Layout, options: Reading, findings: list[Finding]
) -> RatingsFile:
    # a long or a wide table
    n_rows, n_raters = len(sheet.numbers), len(layout.raters)
    keeps_each, row = options.repeated == "each", np.arange(n_rows)
    item = named(sheet, "item", layout.item)
    grades = _graded(sheet, layout, options)
    codes = grades.codes.ravel()
    if layout.kind == "long":
        rater = named(sheet, "rater", layout.raters)
        findings = findings + doubt_items(sheet, layout, len(item.texts), n_rows)
    else:
        names = [sheet.header[place] for place in layout.raters]
        pairs = layout.criteria or [("", name) for name in names]
        of_column = Column.of(np.arange(n_raters), [name for _, name in pairs])
        rater = Column(np.tile(of_column.codes, n_rows), of_column.texts)
        findings = findings + doubt_columns(
            sheet, layout, options, grades.codes, grades.scale, sheet.freq
        )
        row = np.repeat(row, n_raters)
    findings += doubt_names("raters", rater.texts) + doubt_item_names(sheet, item)
    # sessions are no parts where they are repeats
    of_parts = replace(layout, session=None) if keeps_each else layout
    part, names_of_parts = _parts(sheet, of_parts)
    part = part[row]
    if layout.criteria:
        criterion = Column.of(np.arange(n_raters), [of for of, _ in layout.criteria])
        part = part * len(criterion.texts) + np.tile(criterion.codes, n_rows)
        names_of_parts = [
            {**names, "group": text}
            for names in names_of_parts
            for text in criterion.texts
        ]
    groups = sorted({names.get("group", "") for names in names_of_parts})
    findings += doubt_names("groups", groups)
    # part, item, rater, grade and row of each rating
    ratings = [part, item.codes[row], rater.codes, codes, row]
    if keeps_each:
        ratings[1], item = _each(sheet, layout, ratings, item)
    once, scale = _one_each(sheet, layout, options, ratings, item, rater, grades.scale)
    parts = []
    for k, of in enumerate(names_of_parts):
        of_part = [values[once[0] == k] for values in once]
        items = Column(of_part[1], item.texts).rows(slice(None))
        raters = Column(of_part[2], rater.texts).rows(slice(None))
        parts.append(
            RatingsPart(
                group=of.get("group"),
                session=of.get("session"),
                items=tuple(items.texts),
                raters=tuple(raters.texts),
                ratings=_put_together(items, raters, of_part[3], scale),
                clusters=()
                if layout.clusters is None
                else _clusters(sheet, layout.clusters, items, of_part[4]),
            )
        )
    n_repeated = len(row) - len(once[0])
    facts: dict[str, Any] = {"by": "criterion"} if layout.criteria else {}
    if layout.clusters is not None:
        facts["clusters"] = sheet.header[layout.clusters]
        facts["n_clusters"] = len({name for part in parts for name in part.clusters})
    return _file_of(
        sheet,
        layout,
        options,
        replace(grades, scale=scale),
        parts,
        np.bincount(once[3] + 1, minlength=len(scale.grades) + 1)[1:],
        findings,
        raters=Column(once[2], rater.texts).rows(slice(None)).texts,
        n_items=len({*item.texts}),
        n_raters=len(rater.texts),
        n_missing=int((codes < 0).sum()),
        n_repeated=n_repeated,
        repeated=options.repeated if n_repeated or keeps_each else None,
        **facts,
    )


def _parts(sheet: Sheet, layout: Layout) -> tuple[Codes, list[dict[str, str]]]:
    # the part of every row, and the group and session of every part
    session = None if layout.session == layout.by else layout.session
    roles = {"group": layout.by, "session": session}
    places = {role: place for role, place in roles.items() if place is not None}
    for place in places.values():
        if (is_empty := sheet.columns[place].is_text("")).any():
            raise sheet.refuse("no value", sheet.where(int(np.argmax(is_empty))), place)
    if not places:
        return np.zeros(len(sheet.numbers), dtype=np.int64), [{}]
    codes, names = together([sheet.columns[place] for place in places.values()])
    return codes, [dict(zip(places, texts, strict=True)) for texts in names]


def _each(
    sheet: Sheet, layout: Layout, ratings: list[Codes], item: Column
) -> tuple[Codes, Column]:
    # an item of the same name for every time that one was rated, in its session
    part, items, raters, _, row = ratings
    session = (
        0 * row if layout.session is None else sheet.columns[layout.session].codes[row]
    )
    of_key = np.unique(
        np.column_stack([part, items, session, raters]), axis=0, return_inverse=True
    )[1].ravel()
    order = np.argsort(of_key, kind="stable")
    time = np.argsort(order) - np.searchsorted(of_key[order], of_key)
    keys, codes = np.unique(
        np.column_stack([items, session, time]), axis=0, return_inverse=True
    )
    texts = [item.texts[k] for k in keys[:, 0].tolist()]
    return codes.ravel(), Column(codes.ravel(), texts)


def _one_each(
    sheet: Sheet,
    layout: Layout,
    options: Reading,
    ratings: list[Codes],
    item: Column,
    rater: Column,
    scale: Scale,
) -> tuple[list[Codes], Scale]:
    # one rating of each item by each rater in each part
    part, items, raters, grade, row = ratings
    key = (part * len(item.texts) + items) * len(rater.texts) + raters
    if np.diff(np.sort(key)).all():
        return ratings, scale
    of_key = np.unique(key, return_inverse=True)[1]
    if options.repeated == "error":
        first = int(np.argmax((np.bincount(of_key) > 1)[of_key]))
        second = first + 1 + int(np.argmax(of_key[first + 1 :] == of_key[first]))
        names = item.texts[items[first]], rater.texts[raters[first]]
        raise rated_twice(sheet, layout, row[[first, second]], *names)
    if options.repeated == "mean":
        grade, scale = _means(sheet, grade, of_key, scale)
    # grades before missing ones, so that none is lost to an empty cell
    place = np.arange(len(key)) * (-1 if options.repeated == "last" else 1)
    order = np.lexsort((place, grade < 0, of_key))
    chosen = np.sort(order[np.unique(of_key[order], return_index=True)[1]])
    return [values[chosen] for values in (part, items, raters, grade, row)], scale


def _means(
    sheet: Sheet, grade: Codes, of_key: Codes, scale: Scale
) -> tuple[Codes, Scale]:
    # of the grades that an item has of one rater
    if scale.name != "observed" or not all(map(is_number, scale.grades)):
        raise sheet.refuse("means", grades=", ".join(scale.grades[:6]))
    rated = grade >= 0
    n_grades = np.bincount(of_key, rated)
    values = np.where(rated, np.array(scale.values)[grade], 0)
    mean = np.bincount(of_key, values) / np.where(n_grades, n_grades, np.nan)
    met = np.unique(mean[n_grades > 0])
    codes = np.where(n_grades > 0, np.searchsorted(met, mean), -1)
    grades = tuple(f"{x:.0f}" if x.is_integer() else repr(x) for x in met.tolist())
    return codes[of_key], Scale(name="observed", grades=grades)


def _put_together(
    items: Column, raters: Column, grade: Codes, scale: Scale
) -> CodedRatings | CountedRatings:
    # item by rater, or counted where that were many empty places
    shape, q = (len(items.texts), len(raters.texts)), len(scale.grades)

    def laid_out() -> CodedRatings:
        codes = np.full(shape, -1, dtype=np.min_scalar_type(-q - 1))
        codes[items.codes, raters.codes] = grade
        return CodedRatings(
            codes=read_only(codes),
            categories=scale.values,
            declared=_is_declared(scale),
        )

    is_dense = shape[0] * shape[1] <= max(_MAX_DENSE, _MAX_SPARSE * len(grade))
    if is_dense or shape[0] * q > _MAX_COUNTS:
        return laid_out()
    rated = grade >= 0
    keys = items.codes[rated] * q + grade[rated]
    counts = np.bincount(keys, minlength=shape[0] * q).reshape(shape[0], q)
    return replace(
        count_items(counts, categories=scale.values),
        n_raters=len(np.unique(raters.codes[rated])),
        source=laid_out,  # if who rated what must be known
    )


def _clusters(sheet: Sheet, place: int, items: Column, row: Codes) -> tuple[str, ...]:
    # the cluster of every item, by the column at this place
    cluster = named(sheet, "cluster", (place,))
    of_rating = cluster.codes[row]
    of_item = np.zeros(len(items.texts), dtype=np.int64)
    of_item[items.codes] = of_rating
    if len(differs := np.flatnonzero(of_item[items.codes] != of_rating)):
        item = items.codes[differs[0]]
        two = [int(differs[0]), int(np.flatnonzero(items.codes == item)[-1])]
        raise sheet.refuse(
            "two clusters",
            rows=" and ".join(sheet.where(int(row[k])) for k in two),
            item=items.texts[item],
            column=sheet.header[place],
            both=" and ".join(repr(cluster.texts[of_rating[k]]) for k in two),
        )
    return tuple(cluster.texts[code] for code in of_item.tolist())


# ---- rows that stand for several items ----


def _standing_for(sheet: Sheet, place: int, options: Reading) -> Sheet:
    # the rows that stand for an item at least
    freq = _whole_numbers(sheet, place, "frequency", options)
    rows = freq > 0
    if not rows.any():
        raise sheet.refuse("no counts", kind="frequency")
    return replace(
        sheet,
        columns=tuple(column.rows(rows) for column in sheet.columns),
        numbers=sheet.numbers[rows],
        freq=freq[rows],
    )


def _patterns(
    sheet: Sheet, layout: Layout, options: Reading, findings: list[Finding]
) -> RatingsFile:
    # a wide table whose rows are patterns of ratings
    names = [sheet.header[place] for place in layout.raters]
    grades, freq = _graded(sheet, layout, options), sheet.freq
    findings = findings + doubt_columns(
        sheet, layout, options, grades.codes, grades.scale, freq
    )
    findings += doubt_names("raters", names)
    if layout.item:
        findings += doubt_item_names(sheet, named(sheet, "item", layout.item))
    part, names_of_parts = _parts(sheet, layout)
    parts = [
        RatingsPart(
            group=of.get("group"),
            session=of.get("session"),
            raters=tuple(names),
            ratings=_distinct(grades.codes[part == k], freq[part == k], grades.scale),
        )
        for k, of in enumerate(names_of_parts)
    ]
    n_missing, *counts = _often(grades, freq).tolist()
    return _file_of(
        *(sheet, layout, options, grades, parts, np.array(counts), findings),
        item=[],  # names are those of rows
        frequency=sheet.header[layout.frequency or 0],
        raters=names,
        n_items=int(freq.sum()),
        n_raters=len(names),
        n_missing=n_missing,
    )


# ---- tables of counts ----


def _counted(
    sheet: Sheet, layout: Layout, options: Reading, findings: list[Finding]
) -> RatingsFile:
    # a table of counts, or a contingency table
    names = [sheet.header[place] for place in layout.raters]
    table = np.column_stack(
        [_whole_numbers(sheet, place, layout.kind, options) for place in layout.raters]
    )
    if not table.any():
        raise sheet.refuse("no counts", kind=layout.kind)
    findings = findings + doubt_counts(sheet, layout, options, table)
    rows, sides = names, ("", "")
    if layout.kind == "table":
        rows, names, sides = _categories_of(sheet, layout, names)
    name, order = "observed", list(range(len(names)))
    if options.categories is not None:
        if set(options.categories) != set(names):
            raise sheet.refuse(
                "other categories",
                names=", ".join(names),
                categories=", ".join(options.categories),
            )
        name, order = "declared", [names.index(name) for name in options.categories]
    elif all(map(is_number, names)):
        order.sort(key=lambda k: float(names[k]))
    scale = Scale(name=name, grades=tuple(names[k] for k in order))
    part, names_of_parts = _parts(sheet, layout)
    groups = sorted(names.get("group", "") for names in names_of_parts)
    findings += doubt_names("groups", groups)
    if layout.kind == "table":
        table = table[np.ix_([rows.index(names[k]) for k in order], order)]
        counted = count_table(table, categories=scale.values)
        raters = (sides[0] or "rows", sides[1] or "columns")
        parts = [RatingsPart(raters=raters, ratings=counted)]
        n_items, n_raters = int(table.sum()), 2
        counts = table.sum(axis=0) + table.sum(axis=1)
    else:
        table = table[:, order]
        of_item, counts = table.sum(axis=1), table.sum(axis=0)
        n_items, n_raters = int((of_item > 0).sum()), int(of_item.max())
        parts = [
            RatingsPart(
                group=of.get("group"),
                session=of.get("session"),
                ratings=count_items(table[part == k], categories=scale.values),
            )
            for k, of in enumerate(names_of_parts)
        ]
    grades = Grades(scale=scale, codes=np.arange(len(names)))
    return _file_of(
        *(sheet, layout, options, grades, parts, counts, findings),
        raters=list(parts[0].raters) if any(sides) else [],
        n_items=n_items,
        n_raters=n_raters,
    )


def _whole_numbers(sheet: Sheet, place: int, kind: str, options: Reading) -> Codes:
    # -> (n_rows,)
    column, empty = sheet.columns[place], "" if kind == "frequency" else "0"
    numbers = [count_of(text or empty, options) for text in column.texts]
    for text, n in zip(column.texts, numbers, strict=True):
        if not (n >= 0 and n.is_integer() and n <= _MAX_COUNT):
            where = sheet.where(int(np.argmax(column.is_text(text))))
            hint = if_thousands(text)
            raise sheet.refuse("count", where, place, kind=kind, text=text, hint=hint)
    return np.array(numbers, dtype=np.int64)[column.codes]


def _categories_of(
    sheet: Sheet, layout: Layout, names: list[str]
) -> tuple[list[str], list[str], tuple[str, str]]:
    # the categories of the rows and columns of a contingency table, and the raters
    if (n_rows := len(sheet.numbers)) != len(names):
        raise sheet.refuse("rows of table", n=len(names), n_rows=n_rows)
    rows = sheet.columns[layout.item[0]].cells() if layout.item else names
    sides = sides_of(rows, names)
    if sides is None:
        raise sheet.refuse(
            "names of table",
            rows=", ".join(map(repr, rows)),
            names=", ".join(map(repr, names)),
        )
    return sides


# ---- a matrix of weights ----


@long_cells()
def read_weights(
    path: Path, grades: Sequence[str] = (), *, is_ordered: bool = True
) -> Weights:
    """Return the weights in a file: a matrix, or a table with the grades around it."""
    # grades: of the scale, in the order that a matrix needs if they have one; where
    # none are known it is a matrix
    sheet = _read_sheet(path, Reading(no_header=True, delimiter=None))
    columns = [[text.replace(",", ".") for text in c.cells()] for c in sheet.columns]
    labels, names = [c[0] for c in columns[1:]], [g.replace(",", ".") for g in grades]
    rows, places = [*range(len(columns[0]))], [*range(len(columns))]
    if names and not (is_number(columns[0][0]) and is_ordered):
        for stated in (labels, columns[0][1:]):
            if sorted(stated) != sorted(names):
                raise ParameterError(
                    f"{path}: needs the grades {', '.join(names)} in its first row and "
                    "its first column, each once, or numbers alone in the order of "
                    "--categories; missing: "
                    f"{', '.join(sorted({*names} - {*stated})) or 'none'}; not among "
                    f"them: {', '.join(sorted({*stated} - {*names})) or 'none'}"
                )
        rows = [columns[0].index(name, 1) for name in names]
        places = [1 + labels.index(name) for name in names]
    for k, m in ((k, m) for k in rows for m in places):
        if not is_number(columns[m][k]):
            raise ParameterError(
                f"{path}: {sheet.where(k)}, column {m + 1}: needs a number, got "
                f"{columns[m][k]!r}"
            )
    return replace(
        declared_weights(
            [[float(columns[m][k]) for m in places] for k in rows],
            names or sheet.header,
        ),
        name=path.name,
    )


# ---- spans ----

# What columns are called, letter case and signs between words aside.
_OF_SPANS = {
    "label": ("label", "category", "type", "tag", "class", "code", "entity"),
    "observer": (*USUAL_NAMES["rater"], "user", "username"),
    "begin": ("begin", "start", "start_offset", "begin_offset", "onset", "start_char"),
    "end": ("end", "stop", "end_offset", "offset", "end_char"),
    "document": (
        *("document", "document_id", "doc", "doc_id", "file", "filename", "file_name"),
        *("text_id", "recording", *USUAL_NAMES["item"]),
    ),
    "length": ("document_length", "text_length", "recording_length"),
    "text": ("document_text",),
}


def read_spans(
    path: Path, options: Reading, columns: Mapping[str, Any], step: float | None
) -> tuple[list[tuple[Any, ...]], dict[str, int], float]:
    """Return rows of spans, known lengths of documents, and the largest rounding."""
    # columns: what those of a table are called, by their role; step: what places are
    # counted in and rounded to; -> rows of document, observer, label, begin, length
    rows, lengths, off = list[tuple[Any, ...]](), Counter[str](), 0.0
    annotations = _spans(path, options, columns)

    @cache
    def placed(text: str) -> tuple[int, int, float]:
        """Return the nearest step, the next one, and the distance to the nearest."""
        exact = Fraction(text) / Fraction(str(step or 1))
        return round(exact), math.ceil(exact), float(abs(exact - round(exact)))

    try:
        for of in annotations:
            document, span = str(of.item), of.grades
            text = of.text if step is None and isinstance(of.text, str) else ""
            length = placed(str(span.get("length") or len(text)))[1]
            lengths[document] = max(lengths[document], length)
            begin, _, off_begin = placed(str(span.get("begin", 0)))
            end, _, off_end = placed(str(span.get("end", 0)))
            off = max(off, off_begin, off_end)
            row = document, str(of.rater), span.get("label"), begin, end - begin
            rows.append(row)
    except (TypeError, AttributeError, LookupError, ValueError) as error:
        raise refusal(str(path), "no spans", error=error) from error
    if step is None and off:
        raise refusal(str(path), "no step")
    return rows, {of: n for of, n in lengths.items() if n}, off


def _spans(
    path: Path, options: Reading, columns: Mapping[str, Any]
) -> Iterator[Annotation]:
    # each is made of its record when it is asked for
    if path.is_dir():
        return (of for at, file in _brat_files(path) for of in brat_spans(at, file))
    if options.source is None:
        return _spans_of_table(path, options, columns)
    from masrel.ratings._exports import _records  # with pandas

    return (
        of
        for at, task in [*_records(str(path), path.suffix, bytes_of(path), "")]
        for of in label_studio_spans(at, task)
        if not of.why
    )


def _brat_files(folder: Path) -> Iterator[tuple[str, dict[str, str]]]:
    # by folders of annotators; the text is beside each, or once for all
    for file in sorted(folder.rglob("*.ann")):
        place = file.relative_to(folder).with_suffix(".txt")
        texts = file, folder / place, folder.joinpath(*place.parts[1:])
        parts = [of.read_bytes().decode() for of in texts if of.is_file()]
        yield (
            place.with_suffix("").as_posix(),
            {"ann": parts[0], "text": "".join(parts[1:2])},
        )


def _spans_of_table(
    path: Path, options: Reading, columns: Mapping[str, Any]
) -> Iterator[Annotation]:
    sheet, cells = _read_sheet(path, options), dict[str, list[str]]()
    names = {re.sub(r"\W+", "_", name.casefold()): name for name in sheet.header}
    for role, usual in _OF_SPANS.items():
        name = columns[role] or next(filter(None, map(names.get, usual)), None)
        if name is not None:
            cells[role] = sheet.columns[columns_of(sheet, role, name)[0]].cells()
        elif role in ("label", "observer", "begin", "end"):
            raise sheet.refuse("no role", role=role, columns=listed(sheet.header, 12))
    cells.setdefault("document", [path.stem] * len(sheet.numbers))
    return (
        # a row without a label says that somebody looked
        Annotation(
            *(row["document"], row["observer"]),
            row if row["label"] else {"length": row.get("length")},
            row.get("text"),
        )
        for of in zip(*cells.values(), strict=True)
        for row in [dict(zip(cells, of, strict=True))]
    )
