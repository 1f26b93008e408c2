"""Any file of ratings, in whatever shape its program left it, as ratings.

In: a path and what the caller says of it. Out: a `RatingsFile` with what was read. The
stages: `_text_cells` (bytes to cells of text), `_layout` (which column is what),
`_grade_texts` (which grade a text is), `_doubts` (what looks like something else),
`_parts` (ratings put together item by rater).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from masrel.agreement._count_tables import count_items, count_table
from masrel.errors import ParameterError, RatingsError
from masrel.ratings._doubts import (
    doubt_columns,
    doubt_counts,
    doubt_errors,
    doubt_long,
    doubt_names,
    without_second_header,
)
from masrel.ratings._grade_texts import (
    USUAL_MISSING,
    GradeOptions,
    Grades,
    coded_texts,
    is_number,
    read_grades,
)
from masrel.ratings._large_files import LargeFile, NoStreamError, large_file
from masrel.ratings._layout import Layout, LayoutOptions, find_layout
from masrel.ratings._parts import (
    Codes,
    RatingsPart,
    Repeated,
    Triples,
    part_clusters,
    part_codes,
    patterns_part,
    put_together,
    without_repeats,
)
from masrel.ratings._stream_codes import merged_rows
from masrel.ratings._streams import Streamed, stream_long, stream_wide
from masrel.ratings._text_cells import Sheet, SheetOptions, read_sheet
from masrel.scales import Scale


@dataclass(frozen=True, slots=True, kw_only=True)
class RatingsFile:
    """A file of ratings, and what was read of it.

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
    warnings : tuple of str
        What may have been read wrongly, and which option would tell.
    simulated : bool
        Whether any rating is simulated.
    """

    parts: tuple[RatingsPart, ...]
    scale: Scale
    is_ordered: bool
    read: dict[str, Any] = field(repr=False)
    warnings: tuple[str, ...]
    simulated: bool


def read_ratings(
    path: Path | str,
    *,
    item: str | Sequence[str] = (),
    rater: str | None = None,
    grade: str | None = None,
    raters: Sequence[str] = (),
    ignore: Sequence[str] = (),
    no_item: bool = False,
    no_header: bool = False,
    session: str | None = None,
    by: str | None = None,
    clusters: str | None = None,
    repeated: Repeated = "error",
    categories: Sequence[str] | None = None,
    missing_codes: Sequence[str] = (),
    decimal: str = ".",
    delimiter: str | None = None,
    encoding: str | None = None,
    sheet: str | None = None,
    transpose: bool = False,
    counts: bool = False,
    table: bool = False,
    source: str | None = None,
    stream: bool | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> RatingsFile:
    r"""Read any file of ratings, or say in one sentence which option would.

    Parameters
    ----------
    path : Path or str
        The file; "-" is standard input. Text, workbooks, Parquet, Feather, JSON,
        SPSS, Stata and SAS, packed or not; ``docs/ratings.md`` has every shape.
    item : str or sequence of str, optional
        Column of the items; several name an item together.
    rater, grade : str, optional
        Columns of a long table, one row a rating.
    raters, ignore : sequence of str, optional
        Columns of a wide table that are raters, and columns that are left aside.
    no_item, no_header : bool, optional
        Whether no column names the items; whether the first line is a row.
    session, by : str, optional
        Columns of the sessions, and of groups that are told apart.
    clusters : str, optional
        Column of the clusters that items come in, such as patients with several
        sites: one of each item.
    repeated : {"error", "first", "last", "mean"}, optional
        What becomes of a second grade of an item by the same rater.
    categories : sequence of str, optional
        Every grade of the scale, in order; the grades met unless given.
    missing_codes : sequence of str, optional
        Cells that stand for a missing grade, beside empty ones and NA.
    decimal, delimiter, encoding, sheet : str, optional
        Decimal mark, separator of cells, encoding, and sheet of a workbook.
    transpose : bool, optional
        Whether a row is a rater and a column an item.
    counts, table : bool, optional
        Whether it is a table of counts, items by categories, or a contingency table
        of two raters, the first of them in the rows.
    source : str, optional
        The annotation tool whose export it is.
    stream : bool, optional
        Whether only the distinct rows of ratings are kept, batch by batch, so that a
        file may be larger than memory; by its size unless given.
    progress : callable, optional
        Takes how many bytes of how many are read, batch by batch, of a stream.

    Returns
    -------
    RatingsFile
        The ratings, and what was read.

    Raises
    ------
    RatingsError
        If the file is no table of ratings, or could be more than one.
    ParameterError
        If options contradict each other, or `categories` are no scale.

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
    form = SheetOptions(
        delimiter=delimiter,
        encoding=encoding,
        sheet=sheet,
        no_header=no_header,
        transpose=transpose,
        source=source,
        grade=grade if source is not None else None,
    )
    columns = LayoutOptions(
        item=(item,) if isinstance(item, str) else tuple(item),
        rater=rater,
        grade=grade,
        session=session,
        by=by,
        clusters=clusters,
        raters=tuple(raters),
        ignore=tuple(ignore),
        no_item=no_item,
        counts=counts,
        table=table,
    )
    options = GradeOptions(
        categories=None if categories is None else tuple(categories),
        missing_codes=tuple(missing_codes),
        decimal=decimal,
    )
    large = large_file(path, form, _may_stream(stream, columns, repeated))
    if large is not None:
        streamed = _streamed(large, columns, options, stream, progress)
        if streamed is not None:
            return streamed
    cells, warnings = without_second_header(read_sheet(path, form))
    if not len(cells.cells):
        raise cells.error("needed rows of ratings below the names, got none")
    warnings += doubt_errors(cells)
    layout = find_layout(cells, columns)
    if layout.kind in ("counts", "table"):
        return _counted(cells, layout, options, warnings)
    return _rated(cells, layout, options, repeated, warnings)


def _may_stream(
    stream: bool | None, columns: LayoutOptions, repeated: Repeated
) -> bool | None:
    # False where only the whole file has the answer
    whole = {
        "--by": columns.by,
        "--session": columns.session,
        "--clusters": columns.clusters,
        "--counts": columns.counts,
        "--table": columns.table,
        f"--repeated {repeated}": repeated != "error",
    }
    options = [option for option, is_given in whole.items() if is_given]
    if not options:
        return stream
    if stream:
        raise ParameterError(
            f"{options[0]}: needs the whole file in memory, and not --stream"
        )
    return False


def _streamed(
    large: LargeFile,
    columns: LayoutOptions,
    options: GradeOptions,
    stream: bool | None,
    progress: Callable[[int, int], None] | None,
) -> RatingsFile | None:
    # of a long or a wide table, batch by batch; None if it is to be read as a whole
    sheet, warnings = without_second_header(large.sheet)
    if warnings or not len(sheet.cells):
        return None
    layout = find_layout(sheet, columns)
    if layout.session is not None:
        return None
    read = stream_long if layout.kind == "long" else stream_wide
    try:
        ratings = read(large, layout, progress or (lambda _, __: None))
    except NoStreamError as error:
        if stream:
            raise sheet.error(f"{error}; --no-stream reads it as a whole") from error
        return None
    codes, grades = _streamed_grades(large, ratings, options)
    rows, freq = merged_rows(codes, ratings.freq)
    scale = grades.scale
    doubts = [*ratings.doubts, *doubt_names("raters", ratings.raters)]
    if layout.kind == "wide":
        doubts = [*_doubts_of_rows(sheet, layout, ratings, grades, rows, freq), *doubts]
    doubts.append(
        "read as a stream: names of items that differ by spelling alone, or sum up "
        "others, are not looked for"
    )
    rated = rows >= 0
    counted = [
        int(freq @ (rows == code).sum(axis=1)) for code in range(len(scale.grades))
    ]
    record = _record(sheet, layout, options, grades, scale, np.array(counted))
    n_cells = int(ratings.freq @ (ratings.rows >= 0).sum(axis=1))
    record |= {
        "raters": ratings.raters,
        "n_items": ratings.n_items,
        "n_raters": len(ratings.raters),
        "n_ratings": int(freq @ rated.sum(axis=1)),
        "n_missing": n_cells - int(freq @ rated.sum(axis=1)),
        "n_repeated": 0,
        "repeated": None,
        "dropped": {"blank": ratings.n_blank} if ratings.n_blank else {},
    }
    part = patterns_part(rows, freq, ratings.raters, scale)
    file = _file(sheet, [part], scale, grades, record, doubts)
    return replace(file, simulated=file.simulated or ratings.is_simulated)


def _streamed_grades(
    large: LargeFile, ratings: Streamed, options: GradeOptions
) -> tuple[NDArray[np.int8], Grades]:
    # the rows on the scale, (n_distinct, n_raters)
    sheet, n = large.sheet, len(ratings.texts)
    freq = np.array(
        [int(ratings.freq @ (ratings.rows == k).sum(axis=1)) for k in range(n)],
        dtype=np.int64,
    )

    def where(text: int) -> str:
        row, column = ratings.places[text]
        return f"{large.where(row)}, column {sheet.header[column]!r}"

    try:
        grades = read_grades(ratings.texts, freq, options, where)
    except RatingsError as error:
        raise sheet.error(str(error)) from None
    codes = np.append(grades.codes, -1).astype(np.int8)
    return codes[ratings.rows], grades


def _doubts_of_rows(
    sheet: Sheet,
    layout: Layout,
    ratings: Streamed,
    grades: Grades,
    rows: NDArray[np.int8],
    freq: NDArray[np.int64],
) -> list[str]:
    # of a wide table whose rows are counted: its first row, and the others
    first = np.append(grades.codes, -1)[ratings.first]
    others = freq - (rows == first).all(axis=1)
    codes = np.concatenate([first[None, :], rows[others > 0]]).astype(np.int64)
    weights = np.append(1, others[others > 0])
    doubts = doubt_columns(sheet, layout, codes, grades.scale, weights)
    unrated = (rows < 0).all(axis=0)
    doubts += [
        f"{ratings.raters[k]!r} has no grade" for k in np.flatnonzero(unrated)[:6]
    ]
    return doubts


def _rated(
    sheet: Sheet,
    layout: Layout,
    options: GradeOptions,
    repeated: Repeated,
    warnings: list[str],
) -> RatingsFile:
    # of a long or a wide table
    read = _long if layout.kind == "long" else _wide
    triples, grades, doubts = read(sheet, layout, options)
    n_missing = int((triples.grade < 0).sum())
    part_of, names = part_codes(sheet, layout, triples.row)
    doubts += doubt_names("groups", sorted({group or "" for group, _ in names}))
    triples, part_of, scale, n_repeated = without_repeats(
        sheet, layout, triples, part_of, grades.scale, repeated
    )
    rated = triples.grade[triples.grade >= 0]
    freq = np.bincount(rated, minlength=len(scale.grades))
    record = _record(sheet, layout, options, grades, scale, freq)
    parts = [
        put_together(triples if len(names) == 1 else triples[part_of == k], scale, name)
        for k, name in enumerate(names)
    ]
    if layout.clusters is not None:
        of_row, clusters = _named(sheet, "cluster", (layout.clusters,))
        record |= {
            "clusters": sheet.header[layout.clusters],
            "n_clusters": len(np.unique(of_row[triples.row])),
        }
        parts = [
            replace(
                part,
                clusters=part_clusters(
                    sheet, triples[part_of == k], of_row, clusters, layout.clusters
                ),
            )
            for k, part in enumerate(parts)
        ]
    record |= {
        "raters": triples.rater_names,
        "n_items": len(triples.item_names),
        "n_raters": len(triples.rater_names),
        "n_ratings": len(rated),
        "n_missing": n_missing,
        "n_repeated": n_repeated,
        "repeated": repeated if n_repeated else None,
    }
    return _file(sheet, parts, scale, grades, record, [*warnings, *doubts])


def _grades_of(
    sheet: Sheet,
    cells: NDArray[np.object_],
    columns: Sequence[int],
    options: GradeOptions,
) -> tuple[Codes, Grades]:
    # (n_rows * n_columns,) cells row by row -> the place of each in the scale
    codes, texts = coded_texts(cells)
    freq = np.bincount(codes, minlength=len(texts))

    def where(text: int) -> str:
        row, column = divmod(int(np.argmax(codes == text)), len(columns))
        return f"{sheet.where(row)}, column {sheet.header[columns[column]]!r}"

    try:
        grades = read_grades(texts, freq, options, where)
    except RatingsError as error:
        raise sheet.error(str(error)) from None
    return grades.codes[codes], grades


def _long(
    sheet: Sheet, layout: Layout, options: GradeOptions
) -> tuple[Triples, Grades, list[str]]:
    if layout.rater is None or layout.grade is None:
        raise ParameterError("a long table needs columns for the rater and the grade")
    item, items = _named(sheet, "item", layout.item)
    rater, raters = _named(sheet, "rater", (layout.rater,))
    grade, grades = _grades_of(
        sheet, sheet.column(layout.grade), [layout.grade], options
    )
    triples = Triples(
        item=item,
        rater=rater,
        grade=grade,
        row=np.arange(len(item)),
        item_names=items,
        rater_names=raters,
    )
    doubts = doubt_long(sheet, layout, item, rater)
    doubts += doubt_names("raters", raters) + doubt_names("items", items)
    return triples, grades, doubts


def _named(sheet: Sheet, role: str, places: tuple[int, ...]) -> tuple[Codes, list[str]]:
    # what items or raters are called, by one column or several together
    codes, names = coded_texts(sheet.column(places[0]))
    _refuse_unnamed(sheet, role, places[0], codes, names)
    for place in places[1:]:
        more, texts = coded_texts(sheet.column(place))
        _refuse_unnamed(sheet, role, place, more, texts)
        joint = codes * len(texts) + more
        met, codes = np.unique(joint, return_inverse=True)
        names = [f"{names[k // len(texts)]} {texts[k % len(texts)]}" for k in met]
    return np.asarray(codes, dtype=np.int64), names


def _refuse_unnamed(
    sheet: Sheet, role: str, place: int, codes: Codes, names: list[str]
) -> None:
    unnamed = set(USUAL_MISSING).intersection(names)
    for code, name in enumerate(names if unnamed else ()):
        if name in unnamed:
            row = int(np.argmax(codes == code))
            raise sheet.error(
                f"{sheet.where(row)}, column {sheet.header[place]!r}: needed the "
                f"{role}, got {name!r}"
            )


def _wide(
    sheet: Sheet, layout: Layout, options: GradeOptions
) -> tuple[Triples, Grades, list[str]]:
    n_rows, n_raters = len(sheet.cells), len(layout.raters)
    places = list(layout.raters)
    cells = sheet.cells[:, places].ravel()
    grade, grades = _grades_of(sheet, cells, places, options)
    doubts = doubt_columns(sheet, layout, grade.reshape(n_rows, n_raters), grades.scale)
    if layout.item:
        of_row, items = _named(sheet, "item", layout.item)
    else:
        of_row, items = np.arange(n_rows), [str(n) for n in range(1, n_rows + 1)]
    raters = [sheet.header[place] for place in places]
    triples = Triples(
        item=np.repeat(of_row, n_raters),
        rater=np.tile(np.arange(n_raters), n_rows),
        grade=grade,
        row=np.repeat(np.arange(n_rows), n_raters),
        item_names=items,
        rater_names=raters,
    )
    unrated = (grade.reshape(n_rows, n_raters) < 0).all(axis=0)
    doubts += [f"{raters[k]!r} has no grade" for k in np.flatnonzero(unrated)[:6]]
    doubts += doubt_names("raters", raters) + doubt_names("items", items)
    return triples, grades, doubts


def _counted(
    sheet: Sheet, layout: Layout, options: GradeOptions, warnings: list[str]
) -> RatingsFile:
    # of a table of counts, or a contingency table
    if options.missing_codes:
        raise ParameterError(
            f"--missing: names grades that are missing, and cells of --{layout.kind} "
            f"are numbers of ratings; got {', '.join(options.missing_codes)}"
        )
    names = [sheet.header[place] for place in layout.raters]
    table = _whole_numbers(sheet, layout)
    warnings = [*warnings, *doubt_counts(sheet, layout, table)]
    if not table.any():
        raise sheet.error(f"--{layout.kind}: needed at least one rating, got none")
    order = _order_of(sheet, names, options)
    scale = Scale(
        name="observed" if options.categories is None else "declared",
        grades=tuple(names[k] for k in order),
    )
    grades = Grades(scale=scale, codes=np.arange(len(names)))
    part_of, parts_named = part_codes(sheet, layout, np.arange(len(table)))
    warnings += doubt_names("groups", sorted({group or "" for group, _ in parts_named}))
    n_raters = 2
    if layout.kind == "table":
        rows = _table_rows(sheet, layout, names)
        table = table[np.ix_([rows.index(names[k]) for k in order], order)]
        parts = [_table_part(table, scale)]
        freq = table.sum(axis=0) + table.sum(axis=1)
        n_items = int(table.sum())
    else:
        table = table[:, order]
        parts = [
            _counts_part(table[part_of == k], scale, name)
            for k, name in enumerate(parts_named)
        ]
        freq, n_items = table.sum(axis=0), int((table.sum(axis=1) > 0).sum())
        n_raters = int(table.sum(axis=1).max(initial=0))
    record = _record(sheet, layout, options, grades, scale, freq)
    record |= {
        "raters": [],
        "n_items": n_items,
        "n_raters": n_raters,
        "n_ratings": int(freq.sum()),
        "n_missing": None,
        "n_repeated": 0,
        "repeated": None,
    }
    return _file(sheet, parts, scale, grades, record, warnings)


def _whole_numbers(sheet: Sheet, layout: Layout) -> NDArray[np.int64]:
    # -> (n_rows, n_categories)
    cells = sheet.cells[:, list(layout.raters)]
    codes, texts = coded_texts(cells.ravel())
    values = []
    for code, text in enumerate(texts):
        number = float(text) if is_number(text) else -1.0
        if text and not (number >= 0 and number.is_integer() and number < 2**53):
            row = int(np.argmax(codes == code)) // cells.shape[1]
            raise sheet.error(
                f"{sheet.where(row)}: --{layout.kind} needs whole numbers from 0, got "
                f"{text!r}"
            )
        values.append(int(number) if text else 0)
    return np.array(values, dtype=np.int64)[codes].reshape(cells.shape)


def _order_of(sheet: Sheet, names: list[str], options: GradeOptions) -> list[int]:
    # places of the categories in the order of the scale
    if options.categories is not None:
        if set(options.categories) != set(names):
            raise sheet.error(
                f"--categories: needed those of the columns, {', '.join(names)}, in "
                f"order, got {', '.join(options.categories)}"
            )
        return [names.index(category) for category in options.categories]
    if all(map(is_number, names)):
        return sorted(range(len(names)), key=lambda k: float(names[k]))
    return list(range(len(names)))


def _table_rows(sheet: Sheet, layout: Layout, names: list[str]) -> list[str]:
    # the categories of the rows of a contingency table
    if len(sheet.cells) != len(names):
        raise sheet.error(
            f"--table: needed as many rows as categories, {len(names)}, got "
            f"{len(sheet.cells)}; --no-item if no column names the rows"
        )
    if not layout.item:
        return names
    rows = [str(cell).strip() for cell in sheet.column(layout.item[0])]
    if set(rows) != set(names):
        raise sheet.error(
            f"--table: needed rows and columns of the same categories, got "
            f"{', '.join(map(repr, rows))} and {', '.join(map(repr, names))}"
        )
    return rows


def _table_part(table: NDArray[np.int64], scale: Scale) -> RatingsPart:
    ratings = count_table(table, categories=scale.values)
    return RatingsPart(
        group=None, session=None, items=(), raters=("rows", "columns"), ratings=ratings
    )


def _counts_part(
    table: NDArray[np.int64], scale: Scale, name: tuple[str | None, str | None]
) -> RatingsPart:
    ratings = count_items(table, categories=scale.values)
    return RatingsPart(
        group=name[0], session=name[1], items=(), raters=(), ratings=ratings
    )


def _record(
    sheet: Sheet,
    layout: Layout,
    options: GradeOptions,
    grades: Grades,
    scale: Scale,
    freq: NDArray[np.int64],
) -> dict[str, Any]:
    # what was read, as far as every kind of table has it
    names = [sheet.header[place] for place in layout.item]
    used = {*layout.item, *layout.raters, layout.rater, layout.grade}
    used |= {layout.session, layout.by, layout.clusters}
    counted = zip(scale.grades, freq.tolist(), strict=True)
    return {
        **sheet.facts,
        "layout": layout.kind,
        "item": names,
        "rater": _name(sheet, layout.rater),
        "grade": _name(sheet, layout.grade),
        "session": _name(sheet, layout.session),
        "by": _name(sheet, layout.by),
        "ignored": [n for p, n in enumerate(sheet.header) if p not in used],
        "grades": {grade: n for grade, n in counted if n},
        "missing": grades.n_missing,
        "merged": grades.merged,
        "dropped": sheet.dropped,
        "scale": {
            "name": scale.name,
            "grades": list(scale.grades),
            "declared": options.categories is not None,
        },
    }


def _name(sheet: Sheet, place: int | None) -> str | None:
    return None if place is None else sheet.header[place]


def _file(
    sheet: Sheet,
    parts: Sequence[RatingsPart],
    scale: Scale,
    grades: Grades,
    record: dict[str, Any],
    warnings: Sequence[str],
) -> RatingsFile:
    messages = (*warnings, *grades.warnings)
    return RatingsFile(
        parts=tuple(parts),
        scale=scale,
        is_ordered=grades.is_ordered,
        read={
            "file": sheet.name,
            "sha256": sheet.sha256,
            **record,
            "warnings": list(messages),
        },
        warnings=messages,
        simulated=_is_simulated(sheet),
    )


def _is_simulated(sheet: Sheet) -> bool:
    if sheet.is_simulated or "source" not in sheet.header:
        return sheet.is_simulated
    sources = sheet.column(sheet.header.index("source"))
    return bool((sources == "simulated").any())
