"""Any file of ratings, in whatever shape its program left it, as ratings.

In: a path and what the caller says of it. Out: a `RatingsFile` with what was read. The
stages: `_text_cells` (bytes to cells of text), `_layout` (which column is what),
`_grade_texts` (which grade a text is), `_doubts` (what looks like something else),
`_parts` (ratings put together item by rater). `_tables_of_counts` reads tables without
ratings one by one, `_stream_contents` files larger than memory.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from masrel.errors import ParameterError, RatingsError
from masrel.ratings._doubts import (
    doubt_columns,
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
    read_grades,
)
from masrel.ratings._large_files import LargeFile, NoStreamError, large_file
from masrel.ratings._layout import Layout, LayoutOptions, find_layout
from masrel.ratings._parts import (
    Codes,
    Contents,
    RatingsPart,
    Repeated,
    Triples,
    first_met,
    part_clusters,
    part_codes,
    put_together,
    without_repeats,
)
from masrel.ratings._tables_of_counts import counts_contents
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
    sha256 : callable
        Returns the hash of the file's bytes; that of a stream is read again for it.
    warnings : tuple of str
        What may have been read wrongly, and which option would tell.
    simulated : bool
        Whether any rating is simulated.
    """

    parts: tuple[RatingsPart, ...]
    scale: Scale
    is_ordered: bool
    read: dict[str, Any] = field(repr=False)
    sha256: Callable[[], str] = field(repr=False, compare=False)
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
        file = _streamed(large, columns, options, stream, progress)
        if file is not None:
            return file
    cells, warnings = without_second_header(read_sheet(path, form))
    if not len(cells.cells):
        raise cells.error("needed rows of ratings below the names, got none")
    warnings += doubt_errors(cells)
    layout = find_layout(cells, columns)
    if layout.kind in ("counts", "table"):
        contents = counts_contents(cells, layout, options)
    else:
        contents = _rated(cells, layout, options, repeated)
    return _file(cells, layout, options, contents, warnings)


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
    # batch by batch; None if the file is to be read as a whole
    from masrel.ratings._stream_contents import stream_contents

    sheet, warnings = without_second_header(large.sheet)
    if warnings or not len(sheet.cells):
        return None
    layout = find_layout(sheet, columns)
    if layout.session is not None:
        return None
    try:
        contents = stream_contents(
            large, layout, options, progress or (lambda _, __: None)
        )
    except NoStreamError as error:
        if stream:
            raise sheet.error(f"{error}; --no-stream reads it as a whole") from error
        return None
    return _file(sheet, layout, options, contents, ())


def _rated(
    sheet: Sheet, layout: Layout, options: GradeOptions, repeated: Repeated
) -> Contents:
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
    of_parts = [triples]
    if len(names) > 1:
        of_parts = [triples.part(part_of == k) for k in range(len(names))]
    parts = [
        put_together(part, scale, name)
        for part, name in zip(of_parts, names, strict=True)
    ]
    facts: dict[str, Any] = {"repeated": repeated if n_repeated else None}
    if layout.clusters is not None:
        parts = _clustered(sheet, layout.clusters, of_parts, parts)
        facts |= {
            "clusters": sheet.header[layout.clusters],
            "n_clusters": len({name for part in parts for name in part.clusters}),
        }
    return Contents(
        parts=parts,
        grades=grades,
        scale=scale,
        freq=np.bincount(rated, minlength=len(scale.grades)),
        raters=triples.rater_names,
        n_items=len(triples.item_names),
        n_raters=len(triples.rater_names),
        n_missing=n_missing,
        doubts=doubts,
        n_repeated=n_repeated,
        facts=facts,
    )


def _clustered(
    sheet: Sheet, column: int, of_parts: list[Triples], parts: list[RatingsPart]
) -> list[RatingsPart]:
    # the parts with the cluster of every item
    of_row, names = _named(sheet, "cluster", (column,))
    return [
        replace(part, clusters=part_clusters(sheet, triples, of_row, names, column))
        for triples, part in zip(of_parts, parts, strict=True)
    ]


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
        codes, order = first_met(codes)
        names = [
            f"{names[k // len(texts)]} {texts[k % len(texts)]}" for k in met[order]
        ]
    return codes, names


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
    cells = np.take(sheet.cells, places, axis=1).ravel()
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


def _file(
    sheet: Sheet,
    layout: Layout,
    options: GradeOptions,
    contents: Contents,
    warnings: Sequence[str],
) -> RatingsFile:
    messages = (*warnings, *contents.doubts, *contents.grades.warnings)
    return RatingsFile(
        parts=tuple(contents.parts),
        scale=contents.scale,
        is_ordered=contents.grades.is_ordered,
        read={
            "file": sheet.name,
            **_record(sheet, layout, options, contents),
            "warnings": list(messages),
        },
        sha256=sheet.sha256,
        warnings=messages,
        simulated=contents.is_simulated or _is_simulated(sheet),
    )


def _record(
    sheet: Sheet, layout: Layout, options: GradeOptions, contents: Contents
) -> dict[str, Any]:
    names = [sheet.header[place] for place in layout.item]
    used = {*layout.item, *layout.raters, layout.rater, layout.grade}
    used |= {layout.session, layout.by, layout.clusters}
    scale = contents.scale
    counted = zip(scale.grades, contents.freq.tolist(), strict=True)
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
        "missing": contents.grades.n_missing,
        "merged": contents.grades.merged,
        "dropped": sheet.dropped,
        "scale": {
            "name": scale.name,
            "grades": list(scale.grades),
            "declared": options.categories is not None,
        },
        "raters": contents.raters,
        "n_items": contents.n_items,
        "n_raters": contents.n_raters,
        "n_ratings": int(contents.freq.sum()),
        "n_missing": contents.n_missing,
        "n_repeated": contents.n_repeated,
        "repeated": None,
        **contents.facts,
    }


def _name(sheet: Sheet, place: int | None) -> str | None:
    return None if place is None else sheet.header[place]


def _is_simulated(sheet: Sheet) -> bool:
    if sheet.is_simulated or "source" not in sheet.header:
        return sheet.is_simulated
    sources = sheet.column(sheet.header.index("source"))
    return bool((sources == "simulated").any())
