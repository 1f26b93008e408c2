"""Ratings in any form, checked once, as integer codes."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from masrel.agreement._array_codes import array_codes, frame_codes
from masrel.agreement._labels import (
    NOTHING,
    Codes,
    Label,
    check_categories,
    code_type,
    doubt_texts,
    is_row,
    label_rows,
    labels_met,
    lookup,
    shown,
)
from masrel.agreement._weights import category_values
from masrel.errors import ParameterError, RatingsError

MISSING = -1
"""Code of a rating that was not given."""

_MANY_GRADES = 128  # up to which numbers are grades, however few are alike
_MEASURED = 0.8  # of the ratings are different numbers where those are measurements
_FEW_LABELS = 64  # up to here a list of labels is coded faster than an array
_FIRST = 100  # items that as a rule show every rater


@dataclass(frozen=True, slots=True, kw_only=True)
class CodedRatings:
    """Ratings as positions in the declared categories.

    Attributes
    ----------
    codes : ndarray of signed integers, shape (n_items, n_raters)
        Position of each rating in `categories`; -1 where there is none.
    categories : tuple of str, int or float
        Declared categories in order.
    declared : bool
        False if nobody declared them, and they are the labels met.
    """

    codes: Codes = field(compare=False, repr=False)
    categories: tuple[Label, ...]
    declared: bool = True

    @property
    def n_items(self) -> int:
        """Items with at least one rating."""
        rated = self.codes[:, 0] != MISSING
        for column in self.codes.T[1:]:
            if rated.all():  # as a rule after the first column
                break
            rated |= column != MISSING
        return int(rated.sum())

    @property
    def n_items_paired(self) -> int:
        """Items with ratings of at least two raters."""
        n_ratings = np.zeros(len(self.codes), dtype=np.int64)
        for column in self.codes.T:
            n_ratings += column != MISSING
        return int((n_ratings > 1).sum())

    @property
    def n_raters(self) -> int:
        """Raters with at least one rating."""
        # As a rule every rater has one of the first ratings: look no further.
        rates = (self.codes[:_FIRST] != MISSING).any(axis=0)
        if not rates.all():
            rates = (self.codes != MISSING).any(axis=0)
        return int(rates.sum())

    @property
    def n_categories(self) -> int:
        """Declared categories."""
        return len(self.categories)


def code_ratings(
    ratings: object, categories: Sequence[Label] | None = None
) -> CodedRatings:
    """Check an item × rater table of labels and turn it into codes.

    Parameters
    ----------
    ratings : nested sequence, array_like or DataFrame, shape (n_items, n_raters)
        Labels or numbers; None, ``nan`` and pandas' missing values are missing.
    categories : sequence of str, int or float, optional
        The declared scale in order. Without it, the labels met: numbers by value,
        text by alphabet, which is an order for unweighted coefficients only.

    Returns
    -------
    CodedRatings
        The codes and the categories they point to.

    Raises
    ------
    RatingsError
        If the table is empty, ragged or not of two dimensions, a label is not
        among the categories, or is "" and nobody declared it, or categories repeat or
        mix text and numbers.

    Warns
    -----
    RatingsWarning
        If nobody declared the categories, and some labels are the text "nan", "None",
        "NaT" or "<NA>", which ``astype(str)`` makes of a missing rating.

    Examples
    --------
    >>> code_ratings([["1", "1+"], ["2", None]], ["1", "1+", "2"]).codes.tolist()
    [[0, 1], [2, -1]]
    """
    if hasattr(ratings, "knows_raters") and hasattr(ratings, "coded"):  # counted
        if not ratings.knows_raters:
            raise RatingsError(
                "ratings: needs to know who rated what, got counts of a table"
            )
        ratings = ratings.coded
    if isinstance(ratings, CodedRatings):
        if categories is not None:
            check_scale(ratings.categories, categories)
        return ratings
    if (
        type(ratings) is np.ndarray
        and ratings.ndim == 2
        and 0 < ratings.size <= _FEW_LABELS
    ):
        ratings = ratings.tolist()
    if hasattr(ratings, "to_numpy") or isinstance(ratings, np.ndarray):
        codes, known, declared = _table_codes(ratings, categories)
    else:
        rows, known = label_rows(ratings, categories)
        declared = categories is not None
        position: dict[object, int] = {label: code for code, label in enumerate(known)}
        position[None] = MISSING
        try:
            of_rows = [[position[label] for label in row] for row in rows]
        except (KeyError, TypeError):  # nan, or a label of no category
            of_rows = [
                [lookup(label, position, i, j) for j, label in enumerate(row)]
                for i, row in enumerate(rows)
            ]
        codes = np.array(of_rows, dtype=code_type(len(known)))
    if not declared and known and isinstance(known[0], str):
        doubt_texts(known, codes)
    codes.setflags(write=False)
    return CodedRatings(codes=codes, categories=known, declared=declared)


def _table_codes(
    ratings: Any, categories: Sequence[Label] | None
) -> tuple[Codes, tuple[Label, ...], bool]:
    # of an array or a frame: codes, scale, and whether that was declared
    declared = None if categories is None else check_categories(categories)
    if type(ratings) is not np.ndarray:
        ratings = plain_array(ratings)
    if not isinstance(ratings, np.ndarray):  # a DataFrame, without importing pandas
        return frame_codes(ratings, declared)
    if ratings.ndim != 2:
        raise RatingsError(
            "ratings: needs two dimensions (items, raters), "
            f"got {ratings.ndim} with shape {ratings.shape}"
        )
    if 0 in ratings.shape:
        raise RatingsError(NOTHING)
    return *array_codes(ratings, declared), declared is not None


def check_scale(known: tuple[Label, ...], categories: Sequence[Label]) -> None:
    """Check that ratings which have a scale are asked for on no other."""
    if check_categories(categories) != known:
        raise ParameterError(
            f"categories: the ratings are on the scale {known}, got {tuple(categories)}"
        )


def plain_array(ratings: Any) -> Any:
    """Return a matrix or a masked array as a plain one, and all else as it is."""
    if isinstance(ratings, np.ma.MaskedArray):
        return _unmasked(ratings)
    is_other = isinstance(ratings, np.ndarray) and type(ratings) is not np.ndarray
    return np.asarray(ratings) if is_other else ratings


def _unmasked(ratings: Any) -> NDArray[Any]:
    # what is masked is missing
    masked = np.ma.getmaskarray(ratings)
    if not masked.any():
        return np.asarray(ratings.data)
    plain = ratings.data.astype(float if ratings.dtype.kind == "f" else object)
    plain[masked] = None  # nan among floats
    return np.asarray(plain)


def raters_who_rate(coded: CodedRatings) -> CodedRatings:
    """Leave raters without any rating out, where two others are left."""
    if coded.n_raters in (0, 1, coded.codes.shape[1]):
        return coded
    return replace(coded, codes=coded.codes[:, (coded.codes != MISSING).any(axis=0)])


def complete(coded: CodedRatings) -> CodedRatings:
    """Keep the items that every rater rated."""
    whole = (coded.codes >= 0).all(axis=1)
    if whole.all():
        return coded
    return replace(coded, codes=coded.codes[whole])


def refuse_measurements(ratings: Any) -> None:
    """Refuse numbers of which hardly any two are alike, where only alike ones agree."""
    # takes coded or counted ratings; many of a few grades are no measurements
    known = ratings.categories
    if ratings.declared or len(known) <= _MANY_GRADES or isinstance(known[0], str):
        return
    n_ratings = int((ratings.codes >= 0).sum())
    if len(known) > _MEASURED * n_ratings:
        raise RatingsError(
            f"ratings: {len(known)} different numbers among {n_ratings} ratings are "
            "measurements, which hardly ever agree without weights: an intraclass "
            'correlation (ICC) takes them as they are, and so do metric="interval" of '
            'Krippendorff\'s alpha and weights such as "quadratic"'
        )


Repeated = Literal["error", "first", "last"]
"""What to do with a second rating of the same item by the same rater."""


def code_long(
    frame: Any,
    *,
    item: str = "item",
    rater: str = "rater",
    grade: str = "grade",
    categories: Sequence[Label] | None = None,
    repeated: Repeated = "error",
) -> CodedRatings:
    """Arrange a long DataFrame, one row a rating, item by rater.

    Parameters
    ----------
    frame : DataFrame
        Ratings; rows whose grade is missing are missing ratings.
    item, rater, grade : str, optional
        Names of its columns.
    categories : sequence of str, int or float, optional
        The declared scale in order; the labels met when not given.
    repeated : {"error", "first", "last"}, optional
        What to do when a rater rated an item more than once: refuse, or keep the
        first or the last of them in the order of the rows.

    Returns
    -------
    CodedRatings
        Codes that every coefficient takes as `ratings`; items and raters in the
        order in which they are first met.

    Raises
    ------
    RatingsError
        If a column is not there, an item or a rater is missing, a grade is not among
        the categories, or is "" and nobody declared it, or a rating is repeated.
    ParameterError
        If `repeated` is not one of the three.

    Warns
    -----
    RatingsWarning
        As `code_ratings`.

    Examples
    --------
    >>> import pandas as pd
    >>> frame = pd.DataFrame({"item": ["x", "x", "y"], "rater": ["A", "B", "A"],
    ...                       "grade": ["1", "1+", "2"]})
    >>> code_long(frame, categories=["1", "1+", "2"]).codes.tolist()
    [[0, 1], [2, -1]]
    """
    if repeated not in get_args(Repeated):
        raise ParameterError(
            f"repeated: needs one of {', '.join(get_args(Repeated))}, got {repeated!r}"
        )
    if not hasattr(frame, "columns") or not hasattr(frame, "iloc"):
        raise RatingsError(f"frame: needs a DataFrame, got {type(frame).__name__}")
    absent = [name for name in (item, rater, grade) if name not in frame.columns]
    if absent:
        raise RatingsError(
            f"ratings: needs a column {absent[0]!r}, got "
            f"{', '.join(map(repr, frame.columns))}"
        )
    items, item_names = _factors(frame[item], item)
    raters, rater_names = _factors(frame[rater], rater)
    grades, declared = _grades(frame[grade], grade, categories)
    n_raters = len(rater_names)
    if not len(grades):
        raise RatingsError("ratings: needs at least one item and one rater, got none")
    places = items * n_raters + raters
    table = np.full(len(item_names) * n_raters, MISSING, dtype=grades.dtype)
    if repeated == "first":
        places, grades = places[::-1], grades[::-1]  # the last one written stays
    elif repeated == "error":
        _refuse_repeats(places, len(table), item_names, rater_names)
    table[places] = grades
    codes = table.reshape(-1, n_raters)
    codes.setflags(write=False)
    return CodedRatings(
        codes=codes, categories=declared, declared=categories is not None
    )


def _factors(column: Any, name: str) -> tuple[NDArray[np.intp], Any]:
    codes, names = column.factorize()
    if len(codes) and codes.min() < 0:
        row = int(np.argmin(codes))
        raise RatingsError(
            f"ratings: row {row}, column {name!r}: needs a name, got none"
        )
    return codes, names


def _grades(
    column: Any, name: str, categories: Sequence[Label] | None
) -> tuple[NDArray[np.signedinteger[Any]], tuple[Label, ...]]:
    positions, labels = column.factorize()
    known = labels.tolist()
    declared = labels_met(known) if categories is None else check_categories(categories)
    position: dict[object, int] = {label: code for code, label in enumerate(declared)}
    table = np.full(len(known) + 1, MISSING, dtype=code_type(len(declared)))
    for code, label in enumerate(known):
        try:
            table[code] = position[label]
        except KeyError:
            row = int(np.argmax(positions == code))
            lookup(label, position, row, name)
    grades = table[positions]  # missing, -1, is the last
    if categories is None and declared and isinstance(declared[0], str):
        doubt_texts(declared, grades, name)
    return grades, declared


def _refuse_repeats(
    places: NDArray[np.intp], n_places: int, items: Any, raters: Any
) -> None:
    freq = np.bincount(places, minlength=n_places)
    if len(places) == 0 or freq.max() < 2:
        return
    met = [divmod(int(place), len(raters)) for place in np.flatnonzero(freq > 1)[:5]]
    items, raters = items.tolist(), raters.tolist()  # without numpy's types
    named = "; ".join(f"{items[i]!r} by {raters[r]!r}" for i, r in met)
    more = int((freq > 1).sum()) - len(met)
    raise RatingsError(
        f"ratings: each rater needs to rate an item once, rated more than once: {named}"
        + (f" and {more} more" if more else "")
        + '; repeated="first" or "last" keeps one of them'
    )


def code_pairs(
    pairs: object, categories: Sequence[Label] | None = None
) -> CodedRatings:
    """Check pairs of ratings per rater and lay them side by side as codes."""
    # Takes pairs (n_raters, n_items, 2)
    if isinstance(pairs, CodedRatings):
        if categories is not None:
            check_scale(pairs.categories, categories)
        return pairs
    if not is_row(pairs):
        raise RatingsError(
            f"pairs: needs one table (items, 2) per rater, got {type(pairs).__name__}"
        )
    tables = [_plain(table, rater) for rater, table in enumerate(pairs)]
    if not tables:
        raise RatingsError("pairs: needs the pairs of at least one rater, got none")
    if len({len(table) for table in tables}) > 1:
        raise RatingsError(
            "pairs: every rater needs the same items, got "
            f"{', '.join(str(len(table)) for table in tables)} items"
        )
    rows = [
        [grade for pair in of_item for grade in pair]
        for of_item in zip(*tables, strict=True)
    ]
    return code_ratings(rows, categories)


def _plain(table: object, rater: int) -> list[list[object]]:
    # one rater's table -> n_items lists of 2 labels
    if not is_row(table):
        raise RatingsError(f"pairs: rater {rater} needs a table, got {shown(table)}")
    rows = []
    for item, pair in enumerate(table):
        if not is_row(pair):
            raise RatingsError(
                f"pairs: rater {rater}, item {item}: needs two grades, got "
                f"{shown(pair)}"
            )
        rows.append(list(pair))
        if len(rows[-1]) != 2:
            raise RatingsError(
                f"pairs: rater {rater}, item {item}: needs two grades, got "
                f"{len(rows[-1])}"
            )
    return rows


def pairs_of_raters(coded: CodedRatings) -> list[Codes]:
    """Return each rater's two columns of pairs that lie side by side."""
    # -> n_raters arrays (n_items, 2)
    width = coded.codes.shape[1]
    return [coded.codes[:, start : start + 2] for start in range(0, width, 2)]


def complete_values(
    ratings: Any, categories: Sequence[Label] | None
) -> NDArray[np.float64]:
    """Return the values of items that every rater rated who rated any."""
    # ratings (n_items, n_raters) -> (n_complete_items, n_raters)
    values = rating_values(ratings, categories)
    rates = ~np.isnan(values).all(axis=0)
    if 2 <= rates.sum() < rates.size:
        values = values[:, rates]
    return values[~np.isnan(values).any(axis=1)]


def rated_part(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the table without items and raters that have no rating."""
    rated = ~np.isnan(values)
    if rated.all():
        return values
    return np.asarray(values[np.ix_(rated.any(axis=1), rated.any(axis=0))])


def rating_values(
    ratings: Any, categories: Sequence[Label] | None
) -> NDArray[np.float64]:
    """Return ratings as numbers, ``nan`` where there is none."""
    # -> (n_items, n_raters)
    ratings = plain_array(ratings)
    if categories is None and isinstance(ratings, np.ndarray):
        if ratings.ndim == 2 and ratings.dtype.kind in "iuf" and ratings.size:
            values = ratings.astype(np.float64)
            if np.isinf(values).any():
                row, column = np.argwhere(np.isinf(values))[0].tolist()
                raise RatingsError(
                    f"ratings: row {row}, column {column}: needs a finite number, got "
                    f"{values[row, column]}"
                )
            return values
    coded = code_ratings(ratings, categories)
    if not coded.categories:
        return np.empty((0, coded.codes.shape[1]))
    if categories is None and isinstance(coded.categories[0], str):
        raise RatingsError(
            "categories: needs the declared scale in order, because the ratings are "
            f"text, such as {coded.categories[0]!r}"
        )
    known = category_values(coded.categories)
    return np.array([*known, np.nan])[coded.codes]  # missing, -1, is the last
