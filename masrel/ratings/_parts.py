"""Ratings one by one, put together item by rater: repeats, groups, many raters."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from masrel.agreement import CodedRatings, CountedRatings, count_ratings
from masrel.agreement._labels import code_type
from masrel.agreement._rows import count_items
from masrel.errors import RatingsError
from masrel.ratings._grade_texts import Grades, coded_texts, is_number
from masrel.ratings._layout import Layout
from masrel.ratings._text_cells import Sheet
from masrel.scales import Scale

Repeated = Literal["error", "first", "last", "mean"]
"""What becomes of a second grade of an item by the same rater."""

Codes = NDArray[np.int64]

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

    group: str | None
    session: str | None
    items: tuple[str, ...] = field(repr=False)
    raters: tuple[str, ...] = field(repr=False)
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
    doubts: list[str]
    n_repeated: int = 0
    facts: dict[str, Any] = field(default_factory=dict)  # what else the record has
    is_simulated: bool = False  # whether a row says so


@dataclass(frozen=True, slots=True, kw_only=True)
class Triples:
    """Ratings as places in lists of names, in the order met, one entry a rating."""

    # (n_ratings,) each; a grade of -1 is missing; row: of the sheet
    item: Codes
    rater: Codes
    grade: Codes
    row: Codes
    item_names: list[str]
    rater_names: list[str]

    def part(self, chosen: NDArray[np.bool_] | Codes) -> "Triples":
        """Return some of the ratings, with the names of these alone."""
        item, item_names = _names_met(self.item[chosen], self.item_names)
        rater, rater_names = _names_met(self.rater[chosen], self.rater_names)
        return Triples(
            item=item,
            rater=rater,
            grade=self.grade[chosen],
            row=self.row[chosen],
            item_names=item_names,
            rater_names=rater_names,
        )


def part_codes(
    sheet: Sheet, layout: Layout, rows: Codes
) -> tuple[Codes, list[tuple[str | None, str | None]]]:
    """Return the part of every rating, and the group and session of every part."""
    session = None if layout.session == layout.by else layout.session
    columns: list[tuple[Codes, list[str | None]]] = []
    for place in (layout.by, session):
        if place is None:
            columns.append((np.zeros(len(sheet.cells), dtype=np.int64), [None]))
            continue
        codes, texts = coded_texts(sheet.column(place))
        empty = [k for k, text in enumerate(texts) if not text]
        if empty:
            row = int(np.argmax(codes == empty[0]))
            raise sheet.error(
                f"{sheet.where(row)}, column {sheet.header[place]!r}: needed a value"
            )
        columns.append((codes, list(texts)))
    (of_group, groups), (of_session, sessions) = columns
    key = of_group * len(sessions) + of_session
    codes, met = first_met(key)
    n = len(sessions)
    names = [(groups[k // n], sessions[k % n]) for k in met.tolist()]
    return codes[rows], names


def without_repeats(
    sheet: Sheet,
    layout: Layout,
    triples: Triples,
    parts: Codes,
    scale: Scale,
    repeated: Repeated,
) -> tuple[Triples, Codes, Scale, int]:
    """Keep one rating of each item by each rater; say how many others there were."""
    n_items, n_raters = len(triples.item_names), len(triples.rater_names)
    if layout.kind == "wide" and n_items == len(sheet.cells):  # a row each
        return triples, parts, scale, 0
    key = (parts * n_items + triples.item) * n_raters + triples.rater
    n_keys = (int(parts.max(initial=0)) + 1) * n_items * n_raters
    if n_keys <= max(_MAX_DENSE, _MAX_SPARSE * len(key)):
        is_unique = int(np.bincount(key).max(initial=0)) <= 1
        if is_unique:
            return triples, parts, scale, 0
    keys, first, of_key, freq = np.unique(
        key, return_index=True, return_inverse=True, return_counts=True
    )
    n_repeated = len(key) - len(keys)
    if not n_repeated:
        return triples, parts, scale, 0
    if repeated == "error":
        raise _repeats(sheet, layout, triples, key, int(first[np.argmax(freq > 1)]))
    # grades before missing ones, so that none is lost to an empty cell
    order = np.arange(len(key))[:: -1 if repeated == "last" else 1]
    order = order[np.argsort(triples.grade[order] < 0, kind="stable")]
    chosen = np.sort(order[np.unique(key[order], return_index=True)[1]])
    if repeated == "mean":
        triples, scale = _means(sheet, triples, of_key, len(keys), scale)
    return triples.part(chosen), parts[chosen], scale, n_repeated


def _repeats(
    sheet: Sheet, layout: Layout, triples: Triples, key: Codes, first: int
) -> RatingsError:
    # the error of a rating that is there twice, with what may tell the two apart
    second = first + 1 + int(np.argmax(key[first + 1 :] == key[first]))
    lines = " and ".join(sheet.where(int(triples.row[k])) for k in (first, second))
    item, rater = (
        triples.item_names[triples.item[first]],
        triples.rater_names[triples.rater[first]],
    )
    used = {*layout.item, *layout.raters, layout.rater, layout.grade, layout.by}
    used.add(layout.clusters)
    columns = []
    for place, name in enumerate(sheet.header):
        if place not in {*used, layout.session}:
            codes, texts = coded_texts(sheet.column(place))
            full = key * len(texts) + codes[triples.row]
            if 1 < len(texts) < len(sheet.cells) and len(np.unique(full)) == len(key):
                columns.append(name)
    hint = f" (--by {columns[0]!r} would)" if columns else ""
    if layout.kind == "wide":
        guess = ", --rater and --grade name the columns of one row a rating"
    else:
        guess = ""
    guess += ", --no-item says that no column names items" * layout.is_item_guessed
    return sheet.error(
        f"{lines}: {rater!r} graded {item!r} more than once: --by or --session names a "
        f"column that tells such ratings apart{hint}, --repeated first, last or mean "
        f"keeps one{guess}"
    )


def _means(
    sheet: Sheet, triples: Triples, of_key: Codes, n_keys: int, scale: Scale
) -> tuple[Triples, Scale]:
    if scale.name != "observed" or not all(map(is_number, scale.grades)):
        raise sheet.error(
            "--repeated mean: needs grades that are numbers without a declared scale, "
            f"got {', '.join(scale.grades[:6])}"
        )
    values = np.array(scale.values)
    rated = triples.grade >= 0
    total = np.bincount(
        of_key[rated], weights=values[triples.grade[rated]], minlength=n_keys
    )
    n_grades = np.bincount(of_key[rated], minlength=n_keys)
    mean = np.divide(total, n_grades, out=np.full(n_keys, np.nan), where=n_grades > 0)
    met = np.unique(mean[n_grades > 0])
    codes = np.where(n_grades > 0, np.searchsorted(met, mean), -1)
    grades = tuple(f"{x:.0f}" if x.is_integer() else repr(x) for x in met.tolist())
    return replace(triples, grade=codes[of_key]), Scale(name="observed", grades=grades)


def put_together(
    triples: Triples, scale: Scale, names: tuple[str | None, str | None]
) -> RatingsPart:
    """Arrange the ratings of one part item by rater."""
    item, rater, q = triples.item, triples.rater, len(scale.grades)
    shape = len(triples.item_names), len(triples.rater_names)
    dense = partial(_dense, item, rater, triples.grade, shape, scale)
    n_places = shape[0] * shape[1]
    ratings: CodedRatings | CountedRatings
    if (
        n_places <= max(_MAX_DENSE, _MAX_SPARSE * len(item))
        or shape[0] * q > _MAX_COUNTS
    ):
        ratings = dense()
    else:
        rated = triples.grade >= 0
        keys = item[rated] * q + triples.grade[rated]
        counts = np.bincount(keys, minlength=shape[0] * q).reshape(shape[0], q)
        ratings = replace(
            count_items(counts, categories=scale.values),
            n_known=len(np.unique(rater[rated])),
            source=dense,  # only if a coefficient needs to know who rated what
        )
    return RatingsPart(
        group=names[0],
        session=names[1],
        items=tuple(triples.item_names),
        raters=tuple(triples.rater_names),
        ratings=ratings,
    )


def patterns_part(
    rows: NDArray[np.int8], freq: Codes, raters: Sequence[str], scale: Scale
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
    return RatingsPart(
        group=None, session=None, items=(), raters=tuple(raters), ratings=ratings
    )


def part_clusters(
    sheet: Sheet, triples: Triples, of_row: Codes, names: list[str], column: int
) -> tuple[str, ...]:
    """Return the cluster of every item, in the order of the part's items."""
    # of_row (n_rows,): the cluster of every row of the sheet, a place in the names
    item, items = triples.item, triples.item_names
    of_rating = of_row[triples.row]
    of_item = np.zeros(len(items), dtype=np.int64)
    of_item[item] = of_rating
    differs = np.flatnonzero(of_item[item] != of_rating)
    if len(differs):
        second = int(np.flatnonzero(item == item[differs[0]])[-1])
        rows = " and ".join(
            sheet.where(int(triples.row[k])) for k in (int(differs[0]), second)
        )
        both = " and ".join(
            repr(names[of_rating[k]]) for k in (int(differs[0]), second)
        )
        raise sheet.error(
            f"{rows}: needed one cluster of item {items[item[differs[0]]]!r} in column "
            f"{sheet.header[column]!r}, got {both}; if items are numbered in each "
            f"cluster, --item names both columns"
        )
    return tuple(names[cluster] for cluster in of_item.tolist())


def first_met(codes: Codes) -> tuple[Codes, Codes]:
    """Return codes numbered in the order in which they are met, and which they were."""
    first = np.full(int(codes.max(initial=0)) + 1, len(codes))
    first[codes[::-1]] = np.arange(len(codes) - 1, -1, -1)
    places = np.argsort(first, kind="stable")[: int((first < len(codes)).sum())]
    rank = np.zeros(len(first), dtype=np.int64)
    rank[places] = np.arange(len(places))
    return rank[codes], places


def _names_met(codes: Codes, names: list[str]) -> tuple[Codes, list[str]]:
    # codes of the names that occur, in the order in which they do
    met, places = first_met(codes)
    return met, list(map(names.__getitem__, places.tolist()))


def _dense(
    item: Codes, rater: Codes, grade: Codes, shape: tuple[int, int], scale: Scale
) -> CodedRatings:
    codes = np.full(shape, -1, dtype=code_type(len(scale.grades)))
    codes[item, rater] = grade
    codes.setflags(write=False)
    # numbers that nobody declared may be measurements rather than grades
    declared = scale.name != "observed" or not all(map(is_number, scale.grades))
    return CodedRatings(codes=codes, categories=scale.values, declared=declared)
