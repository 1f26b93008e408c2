"""Ratings put together item by rater, with repeats and groups; tables of counts."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from masrel.agreement import CodedRatings, CountedRatings, count_ratings
from masrel.agreement._labels import code_type
from masrel.agreement._rows import count_items, count_table
from masrel.errors import ParameterError, RatingsError
from masrel.ratings._findings import USUAL_MISSING, Finding, ReadingOptions
from masrel.ratings._grade_texts import Grades, is_number, read_grades
from masrel.ratings._layout import (
    Layout,
    doubt_columns,
    doubt_counts,
    doubt_long,
    doubt_names,
)
from masrel.ratings._sheet import Codes, Column, Sheet, first_met, first_rows
from masrel.scales import Scale

_MAX_DENSE = 20_000_000  # places, items by raters, that are always kept one by one
_MAX_SPARSE = 8  # places a rating beyond which only counts are kept
_MAX_LAID_OUT = 200_000_000  # ratings of a stream that are laid out one by one
_MAX_COUNTS = 200_000_000  # places, items by categories, of counts


@dataclass(frozen=True, kw_only=True)
class RatingsPart:
    """The ratings of one group and session of a file.

    Attributes
    ----------
    group : str or None
        What the column of groups says of them; None where there is none.
    session : str or None
        Their session; None where the file has no such column.
    items, raters : tuple of str
        Names, in the order in which they are met; raters without a name have none.
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
class Contents:
    """What a file of ratings holds, on a scale."""

    parts: list[RatingsPart]
    grades: Grades
    scale: Scale  # of these grades, or of means of them
    freq: Codes  # (n_grades,): how often each grade of the scale is there
    raters: list[str]  # none where they have no names
    n_items: int
    n_raters: int
    n_missing: int | None  # None where counts do not say
    findings: list[Finding]
    n_repeated: int = 0
    facts: dict[str, Any] = field(default_factory=dict)  # what else the record has
    is_simulated: bool = False  # whether a row says so


@dataclass(frozen=True, slots=True, kw_only=True)
class _Triples:
    """Ratings as places in lists of names, in the order met, one entry a rating."""

    item: Column
    rater: Column
    grade: Codes  # (n_ratings,); -1 is missing
    row: Codes  # of the sheet

    def part(self, chosen: NDArray[np.bool_] | Codes) -> "_Triples":
        """Return some of the ratings, with the names of these alone."""
        return _Triples(
            item=self.item.rows(chosen),
            rater=self.rater.rows(chosen),
            grade=self.grade[chosen],
            row=self.row[chosen],
        )


# ---- ratings one by one ----


def rated_contents(sheet: Sheet, layout: Layout, options: ReadingOptions) -> Contents:
    """Read a long or a wide table."""
    read = _long if layout.kind == "long" else _wide
    triples, grades, findings = read(sheet, layout, options)
    n_missing, n_items = int((triples.grade < 0).sum()), len(triples.item.texts)
    of_row, names = _parts(sheet, layout)
    part = of_row[triples.row]
    triples, part, scale, n_repeated = _without_repeats(
        sheet, layout, triples, part, grades.scale, options.repeated
    )
    of_parts = [triples]
    if len(names) > 1:
        of_parts = [triples.part(part == k) for k in range(len(names))]
    parts = []
    facts: dict[str, Any] = {"repeated": options.repeated if n_repeated else None}
    for ratings, (group, session) in zip(of_parts, names, strict=True):
        clusters = () if layout.clusters is None else _clusters(sheet, layout, ratings)
        parts.append(
            RatingsPart(
                group=group,
                session=session,
                items=tuple(ratings.item.texts),
                raters=tuple(ratings.rater.texts),
                ratings=_put_together(ratings, scale),
                clusters=clusters,
            )
        )
    if layout.clusters is not None:
        facts["clusters"] = sheet.header[layout.clusters]
        facts["n_clusters"] = len({name for part in parts for name in part.clusters})
    rated = triples.grade[triples.grade >= 0]
    groups = sorted({group or "" for group, _ in names})
    return Contents(
        parts=parts,
        grades=grades,
        scale=scale,
        freq=np.bincount(rated, minlength=len(scale.grades)),
        raters=triples.rater.texts,
        n_items=n_items,
        n_raters=len(triples.rater.texts),
        n_missing=n_missing,
        findings=findings + doubt_names("groups", groups),
        n_repeated=n_repeated,
        facts=facts,
    )


def _long(
    sheet: Sheet, layout: Layout, options: ReadingOptions
) -> tuple[_Triples, Grades, list[Finding]]:
    item = named(sheet, "item", layout.item)
    rater = named(sheet, "rater", (layout.rater,))
    cells = sheet.columns[layout.grade]
    grades = graded(sheet, cells, (layout.grade,), options)
    triples = _Triples(
        item=item,
        rater=rater,
        grade=grades.codes[cells.codes],
        row=np.arange(len(item.codes)),
    )
    findings = doubt_long(sheet, layout, item.codes, rater.codes)
    findings += doubt_names("raters", rater.texts) + doubt_names("items", item.texts)
    return triples, grades, findings


def _wide(
    sheet: Sheet, layout: Layout, options: ReadingOptions
) -> tuple[_Triples, Grades, list[Finding]]:
    n_rows, n_raters = len(sheet.numbers), len(layout.raters)
    cells = joined(sheet, layout.raters)
    grades = graded(sheet, cells, layout.raters, options)
    grade = grades.codes[cells.codes]
    raters = [sheet.header[place] for place in layout.raters]
    table = grade.reshape(n_rows, n_raters)
    findings = doubt_columns(sheet, layout, table, grades.scale)
    item = Column(np.arange(n_rows), [str(n) for n in range(1, n_rows + 1)])
    if layout.item:
        item = named(sheet, "item", layout.item)
    findings += unrated(raters, table)
    findings += doubt_names("raters", raters) + doubt_names("items", item.texts)
    triples = _Triples(
        item=Column(np.repeat(item.codes, n_raters), item.texts),
        rater=Column(np.tile(np.arange(n_raters), n_rows), raters),
        grade=grade,
        row=np.repeat(np.arange(n_rows), n_raters),
    )
    return triples, grades, findings


def joined(sheet: Sheet, places: Sequence[int]) -> Column:
    """Return the cells of some columns, row by row."""
    number: dict[str, int] = {}
    codes = np.empty((len(sheet.numbers), len(places)), dtype=np.int64)
    for k, column in enumerate(sheet.columns[place] for place in places):
        of_text = [number.setdefault(text, len(number)) for text in column.texts]
        codes[:, k] = np.array(of_text, dtype=np.int64)[column.codes]
    return Column(codes.ravel(), list(number)).rows(slice(None))


def graded(
    sheet: Sheet,
    cells: Column,
    places: Sequence[int],
    options: ReadingOptions,
    freq: Codes | None = None,
) -> Grades:
    """Return which grades the cells of some columns are; freq: of each row, else 1."""
    first = first_rows(cells.codes, len(cells.texts))

    def where(text: int) -> str:
        row, k = divmod(int(first[text]), len(places))
        return f"{sheet.where(row)}, column {sheet.header[places[k]]!r}"

    weights = None if freq is None else np.repeat(freq, len(places))
    n_cells = np.bincount(cells.codes, weights, len(cells.texts)).astype(np.int64)
    return read_grades(sheet, cells.texts, n_cells, options, where)


def unrated(raters: Sequence[str], codes: Codes) -> list[Finding]:
    """Warn of raters without a grade; codes (n_items, n_raters)."""
    alone = np.flatnonzero((codes < 0).all(axis=0))[:6]
    return [Finding("no grade of", rater=raters[k]) for k in alone]


def named(sheet: Sheet, role: str, places: Sequence[int]) -> Column:
    """Return what items or raters are called, by one column or several together."""
    for place in places:
        column = sheet.columns[place]
        for text in set(USUAL_MISSING).intersection(column.texts):
            row = int(np.argmax(column.is_text(text)))
            raise sheet.refuse("unnamed", sheet.where(row), place, role=role, got=text)
    names = sheet.columns[places[0]]
    for place in places[1:]:
        more, n = sheet.columns[place], len(sheet.columns[place].texts)
        joint, codes = np.unique(names.codes * n + more.codes, return_inverse=True)
        codes, met = first_met(codes)
        pairs = zip(*np.divmod(joint[met], n), strict=True)
        names = Column(codes, [f"{names.texts[k]} {more.texts[j]}" for k, j in pairs])
    return names


def _parts(
    sheet: Sheet, layout: Layout
) -> tuple[Codes, list[tuple[str | None, str | None]]]:
    # the part of every row, and the group and session of every part
    nothing = Column(np.zeros(len(sheet.numbers), dtype=np.int64), [""])
    session = None if layout.session == layout.by else layout.session
    columns = []
    for place in (layout.by, session):
        column = nothing if place is None else sheet.columns[place]
        if place is not None and "" in column.texts:
            row = int(np.argmax(column.is_text("")))
            raise sheet.refuse("no value", sheet.where(row), place)
        columns.append(column)
    n = len(columns[1].texts)
    codes, met = first_met(columns[0].codes * n + columns[1].codes)
    names = [
        (columns[0].texts[k // n] or None, columns[1].texts[k % n] or None)
        for k in met.tolist()
    ]
    return codes, names


def _without_repeats(
    sheet: Sheet,
    layout: Layout,
    triples: _Triples,
    part: Codes,
    scale: Scale,
    repeated: str,
) -> tuple[_Triples, Codes, Scale, int]:
    # one rating of each item by each rater, and how many others there were
    n_items, n_raters = len(triples.item.texts), len(triples.rater.texts)
    key = (part * n_items + triples.item.codes) * n_raters + triples.rater.codes
    n_keys = (int(part.max(initial=0)) + 1) * n_items * n_raters
    if n_keys <= max(_MAX_DENSE, _MAX_SPARSE * len(key)):
        if int(np.bincount(key).max(initial=0)) <= 1:
            return triples, part, scale, 0
    keys, of_key = np.unique(key, return_inverse=True)
    n_repeated = len(key) - len(keys)
    if not n_repeated:
        return triples, part, scale, 0
    if repeated == "error":
        raise _twice(sheet, layout, triples, of_key)
    # grades before missing ones, so that none is lost to an empty cell
    order = np.arange(len(key))[:: -1 if repeated == "last" else 1]
    order = order[np.argsort(triples.grade[order] < 0, kind="stable")]
    chosen = np.sort(order[np.unique(key[order], return_index=True)[1]])
    if repeated == "mean":
        triples, scale = _means(sheet, triples, of_key, len(keys), scale)
    return triples.part(chosen), part[chosen], scale, n_repeated


def _twice(
    sheet: Sheet, layout: Layout, triples: _Triples, of_key: Codes
) -> RatingsError:
    # the error of a rating that is there twice, with what may tell the two apart
    first = int(np.argmax((np.bincount(of_key) > 1)[of_key]))
    second = first + 1 + int(np.argmax(of_key[first + 1 :] == of_key[first]))
    names, used = [], layout.used
    for place, column in enumerate(sheet.columns):
        n = len(column.texts)
        if place not in used and 1 < n < len(sheet.numbers):
            full = of_key * n + column.codes[triples.row]
            if len(np.unique(full)) == len(of_key):
                names.append(sheet.header[place])
    return repeated_rating(
        sheet,
        layout,
        rows=[sheet.where(int(triples.row[k])) for k in (first, second)],
        rater=triples.rater.texts[triples.rater.codes[first]],
        item=triples.item.texts[triples.item.codes[first]],
        hint=f" (--by {names[0]!r} would)" if names else "",
    )


def repeated_rating(
    sheet: Sheet,
    layout: Layout,
    *,
    rows: Sequence[str],
    rater: str,
    item: str,
    hint: str = "",
) -> RatingsError:
    """Return the error of a rating that is there twice."""
    guess = ""
    if layout.kind == "wide":
        guess = ", --rater and --grade name the columns of one row a rating"
    guess += ", --no-item says that no column names items" * layout.is_item_guessed
    where = " and ".join(rows)
    return sheet.refuse(
        "twice", rows=where, rater=rater, item=item, hint=hint, guess=guess
    )


def _means(
    sheet: Sheet, triples: _Triples, of_key: Codes, n_keys: int, scale: Scale
) -> tuple[_Triples, Scale]:
    if scale.name != "observed" or not all(map(is_number, scale.grades)):
        raise sheet.refuse("means", grades=", ".join(scale.grades[:6]))
    rated = triples.grade >= 0
    values = np.array(scale.values)[triples.grade[rated]]
    total = np.bincount(of_key[rated], weights=values, minlength=n_keys)
    n_grades = np.bincount(of_key[rated], minlength=n_keys)
    mean = np.divide(total, n_grades, out=np.full(n_keys, np.nan), where=n_grades > 0)
    met = np.unique(mean[n_grades > 0])
    codes = np.where(n_grades > 0, np.searchsorted(met, mean), -1)
    grades = tuple(f"{x:.0f}" if x.is_integer() else repr(x) for x in met.tolist())
    return replace(triples, grade=codes[of_key]), Scale(name="observed", grades=grades)


def _put_together(triples: _Triples, scale: Scale) -> CodedRatings | CountedRatings:
    # item by rater, or counted where that were many empty places
    shape, q = (len(triples.item.texts), len(triples.rater.texts)), len(scale.grades)

    def laid_out() -> CodedRatings:
        codes = np.full(shape, -1, dtype=code_type(q))
        codes[triples.item.codes, triples.rater.codes] = triples.grade
        codes.setflags(write=False)
        # numbers that nobody declared may be measurements rather than grades
        is_text = not all(map(is_number, scale.grades))
        declared = scale.name != "observed" or is_text
        return CodedRatings(codes=codes, categories=scale.values, declared=declared)

    is_dense = shape[0] * shape[1] <= max(_MAX_DENSE, _MAX_SPARSE * len(triples.grade))
    if is_dense or shape[0] * q > _MAX_COUNTS:
        return laid_out()
    rated = triples.grade >= 0
    keys = triples.item.codes[rated] * q + triples.grade[rated]
    counts = np.bincount(keys, minlength=shape[0] * q).reshape(shape[0], q)
    return replace(
        count_items(counts, categories=scale.values),
        n_known=len(np.unique(triples.rater.codes[rated])),
        source=laid_out,  # if who rated what must be known
    )


def _clusters(sheet: Sheet, layout: Layout, triples: _Triples) -> tuple[str, ...]:
    # the cluster of every item
    place, item = int(layout.clusters or 0), triples.item
    cluster = named(sheet, "cluster", (place,))
    of_rating = cluster.codes[triples.row]
    of_item = np.zeros(len(item.texts), dtype=np.int64)
    of_item[item.codes] = of_rating
    differs = np.flatnonzero(of_item[item.codes] != of_rating)
    if len(differs):
        second = int(np.flatnonzero(item.codes == item.codes[differs[0]])[-1])
        two = int(differs[0]), second
        raise sheet.refuse(
            "two clusters",
            rows=" and ".join(sheet.where(int(triples.row[k])) for k in two),
            item=item.texts[item.codes[second]],
            column=sheet.header[place],
            both=" and ".join(repr(cluster.texts[of_rating[k]]) for k in two),
        )
    return tuple(cluster.texts[code] for code in of_item.tolist())


def patterns_part(
    rows: NDArray[np.signedinteger[Any]],
    freq: Codes,
    raters: Sequence[str],
    scale: Scale,
) -> RatingsPart:
    """Make the part of a stream: distinct rows of codes, and how often each occurs."""
    # takes rows (n_distinct, n_raters) of codes
    n_items = int(freq.sum())

    def laid_out() -> CodedRatings:
        if n_items * rows.shape[1] > _MAX_LAID_OUT:
            raise RatingsError(
                f"ratings: {n_items} items by {rows.shape[1]} raters are read as a "
                "stream, which has counts of items, and not who rated what, for more "
                f"than {_MAX_LAID_OUT} ratings"
            )
        codes = np.repeat(rows, freq, axis=0)
        codes.setflags(write=False)
        return CodedRatings(codes=codes, categories=scale.values)

    ratings = CountedRatings(
        codes=rows, freq=freq, categories=scale.values, source=laid_out
    )
    return RatingsPart(raters=tuple(raters), ratings=ratings)


# ---- tables of counts ----


def counts_contents(sheet: Sheet, layout: Layout, options: ReadingOptions) -> Contents:
    """Read a table of counts, or a contingency table."""
    names = [sheet.header[place] for place in layout.raters]
    table = _whole_numbers(sheet, layout, options)
    findings = doubt_counts(sheet, layout, table)
    order = _order_of(sheet, names, options)
    scale = Scale(
        name="observed" if options.categories is None else "declared",
        grades=tuple(names[k] for k in order),
    )
    part, groups = _parts(sheet, layout)
    if layout.kind == "table":
        rows = _table_rows(sheet, layout, names)
        table = table[np.ix_([rows.index(names[k]) for k in order], order)]
        ratings = count_table(table, categories=scale.values)
        parts = [RatingsPart(raters=("rows", "columns"), ratings=ratings)]
        n_items, n_raters = int(table.sum()), 2
        freq = table.sum(axis=0) + table.sum(axis=1)
    else:
        table = table[:, order]
        of_item, freq = table.sum(axis=1), table.sum(axis=0)
        n_items, n_raters = int((of_item > 0).sum()), int(of_item.max(initial=0))
        counted = [
            count_items(table[part == k], categories=scale.values)
            for k in range(len(groups))
        ]
        parts = [
            RatingsPart(group=group, session=session, ratings=ratings)
            for (group, session), ratings in zip(groups, counted, strict=True)
        ]
    return Contents(
        parts=parts,
        grades=Grades(scale=scale, codes=np.arange(len(names))),
        scale=scale,
        freq=freq,
        raters=[],
        n_items=n_items,
        n_raters=n_raters,
        n_missing=None,
        findings=findings + doubt_names("groups", sorted(g or "" for g, _ in groups)),
    )


def _whole_numbers(sheet: Sheet, layout: Layout, options: ReadingOptions) -> Codes:
    # -> (n_rows, n_categories)
    if options.missing_codes:
        raise ParameterError(
            f"--missing: names grades that are missing, and cells of --{layout.kind} "
            f"are numbers of ratings; got {', '.join(options.missing_codes)}"
        )
    table = []
    for column in (sheet.columns[place] for place in layout.raters):
        texts = [text or "0" for text in column.texts]
        numbers = [float(text) if is_number(text) else -1.0 for text in texts]
        for code, n in enumerate(numbers):
            if not (n >= 0 and n.is_integer() and n < 2**53):
                row, text = int(np.argmax(column.codes == code)), column.texts[code]
                where = sheet.where(row)
                raise sheet.refuse("count", where, kind=layout.kind, text=text)
        table.append(np.array(numbers, dtype=np.int64)[column.codes])
    if not any(column.any() for column in table):
        raise sheet.refuse("no counts", kind=layout.kind)
    return np.column_stack(table)


def _order_of(sheet: Sheet, names: list[str], options: ReadingOptions) -> list[int]:
    # places of the categories in the order of the scale
    if options.categories is not None:
        if set(options.categories) != set(names):
            declared = ", ".join(options.categories)
            known = ", ".join(names)
            raise sheet.refuse("other categories", names=known, categories=declared)
        return [names.index(category) for category in options.categories]
    if all(map(is_number, names)):
        return sorted(range(len(names)), key=lambda k: float(names[k]))
    return list(range(len(names)))


def _table_rows(sheet: Sheet, layout: Layout, names: list[str]) -> list[str]:
    # the categories of the rows of a contingency table
    n_rows = len(sheet.numbers)
    if n_rows != len(names):
        raise sheet.refuse("rows of table", n=len(names), n_rows=n_rows)
    rows = sheet.columns[layout.item[0]].cells() if layout.item else names
    if set(rows) != set(names):
        met, known = ", ".join(map(repr, rows)), ", ".join(map(repr, names))
        raise sheet.refuse("names of table", rows=met, names=known)
    return rows
