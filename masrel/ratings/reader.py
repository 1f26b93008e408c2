"""Any file of ratings, in whatever shape its program left it, as ratings.

In: a path and what the caller says of it. Out: a `RatingsFile` with what was read. The
stages: `_sheet` or `_exports` (a file as columns of text), `_layout` (which column is
what), `_grade_texts` (which grade a text is), `_parts` (ratings item by rater);
`_large` is for files larger than memory. `_findings` has the texts of all that is
refused or warned of.
"""

import hashlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

from masrel.errors import ParameterError, RatingsError
from masrel.ratings._findings import Finding, ReadingOptions, Repeated, refusal
from masrel.ratings._large import NoStreamError, Scan, large_contents, large_file
from masrel.ratings._layout import Layout, find_layout, without_second_header
from masrel.ratings._parts import (
    Contents,
    RatingsPart,
    counts_contents,
    rated_contents,
)
from masrel.ratings._sheet import (
    TEXT_FORMATS,
    TYPED_FORMATS,
    Sheet,
    bytes_of,
    decoded,
    finished,
    read_text,
    unpacked,
)
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
        Whether DuckDB groups it to the rows of ratings that differ, so that a
        file may be larger than memory; by its size unless given.
    progress : callable, optional
        Takes how many bytes of how many are read of a stream.

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
    options = ReadingOptions(
        item=(item,) if isinstance(item, str) else tuple(item),
        rater=rater,
        grade=grade,
        raters=tuple(raters),
        ignore=tuple(ignore),
        no_item=no_item,
        no_header=no_header,
        session=session,
        by=by,
        clusters=clusters,
        repeated=repeated,
        categories=None if categories is None else tuple(categories),
        missing_codes=tuple(missing_codes),
        decimal=decimal,
        delimiter=delimiter or "auto",
        encoding=encoding,
        sheet=sheet,
        transpose=transpose,
        counts=counts,
        table=table,
        source=source,
        stream=_may_stream(stream, by, session, clusters, counts, table, repeated),
    )
    options.mark()  # refused whatever the file is
    large = large_file(path, options)
    if large is not None:
        file = _streamed(*large, options, progress or (lambda *_: None))
        if file is not None:
            return file
    cells, findings = without_second_header(_read_sheet(path, options))
    if not len(cells.numbers):
        raise cells.refuse("no rows")
    if errors := cells.facts.get("errors"):
        shown = ", ".join(f"{text} ×{n}" for text, n in errors.items())
        findings.append(Finding("errors", errors=shown))
    layout = find_layout(cells, options)
    is_counted = layout.kind in ("counts", "table")
    contents = (counts_contents if is_counted else rated_contents)(
        cells, layout, options
    )
    return _file(cells, layout, options, contents, findings)


def _read_sheet(path: Path | str, options: ReadingOptions) -> Sheet:
    """Read a file of any format as columns of text."""
    name, data = str(path), bytes_of(path)
    if not data:
        raise refusal(name, "empty")
    sha256 = partial(str, hashlib.sha256(data).hexdigest())  # which pickle takes
    inner, data = unpacked(name, data, is_export=options.source is not None)
    suffix = Path(inner).suffix.lower()
    if options.source is not None or suffix in TYPED_FORMATS:
        from masrel.ratings._exports import read_typed

        return finished(read_typed(name, sha256, suffix, data, options), options)
    text = decoded(name, data, options.encoding)
    kind = TEXT_FORMATS.get(suffix, "text")
    return finished(read_text(name, sha256, text, kind, options), options)


def _may_stream(stream: bool | None, *options: object) -> bool | None:
    # False where only the whole file has the answer
    *chosen, repeated = options
    names = ("--by", "--session", "--clusters", "--counts", "--table")
    whole = [name for name, value in zip(names, chosen, strict=True) if value]
    whole += [f"--repeated {repeated}"] * (repeated != "error")
    if stream and whole:
        raise ParameterError(
            f"{whole[0]}: needs the whole file in memory, and not --stream"
        )
    return False if whole else stream


def _streamed(
    sheet: Sheet,
    scan: Scan,
    options: ReadingOptions,
    progress: Callable[[int, int], None],
) -> RatingsFile | None:
    # by DuckDB; None if the file is to be read as a whole
    sheet, findings = without_second_header(sheet)
    if findings or not len(sheet.numbers):
        return None
    layout = find_layout(sheet, options)
    if layout.session is not None:
        return None
    try:
        contents = large_contents(sheet, scan, layout, options, progress)
    except NoStreamError as error:
        if options.stream:
            text = f"{sheet.name}: {error}; --no-stream reads it as a whole"
            raise RatingsError(text) from error
        return None
    return _file(sheet, layout, options, contents, [])


def _file(
    sheet: Sheet,
    layout: Layout,
    options: ReadingOptions,
    contents: Contents,
    findings: Sequence[Finding],
) -> RatingsFile:
    warnings = (*findings, *contents.findings, *contents.grades.findings)
    scale, header, used = contents.scale, sheet.header, layout.used
    counted = zip(scale.grades, contents.freq.tolist(), strict=True)
    is_long = layout.kind == "long"
    roles = {
        "rater": layout.rater if is_long else None,
        "grade": layout.grade if is_long else None,
        "session": layout.session,
        "by": layout.by,
    }
    record = {
        "file": sheet.name,
        **sheet.facts,
        "layout": layout.kind,
        "item": [header[place] for place in layout.item],
        **{role: None if p is None else header[p] for role, p in roles.items()},
        "ignored": [name for k, name in enumerate(header) if k not in used],
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
        "warnings": list(map(str, warnings)),
    }
    named = dict(zip(header, sheet.columns, strict=True))
    is_simulated = "source" in named and "simulated" in named["source"].texts
    return RatingsFile(
        parts=tuple(contents.parts),
        scale=scale,
        is_ordered=contents.grades.is_ordered,
        read=record,
        sha256=sheet.sha256,
        warnings=warnings,
        simulated=sheet.is_simulated or contents.is_simulated or is_simulated,
    )
