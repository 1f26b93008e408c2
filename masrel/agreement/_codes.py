"""Ratings in any form, checked once: codes, and distinct rows of them.

In: lists, arrays, frames, counts of items, or a table of two raters. Out:
`CodedRatings` item by item, and `CountedRatings`, which every kappa takes.
"""

import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from masrel._input import USUAL_NAMES, check_option, refuse, shown
from masrel.agreement._labels import (
    MISSING,
    Codes,
    Label,
    check_categories,
    is_missing,
    is_row,
    label_codes,
    warn_of_texts,
)
from masrel.agreement._weights import Floats, category_values
from masrel.errors import CountsError, ParameterError, RatingsError

Integers = NDArray[np.int64]

_NOTHING = "ratings: needs a table (items, raters) with at least one item and one rater"

_MAX_SPAN = 1 << 14  # of whole numbers that are codes but for a shift
_MAX_KEYS = 1 << 22  # different rows that are counted in a table rather than sorted
_BLOCK = 1 << 14  # items at once: they stay in the cache, and BLAS starts no threads
_MAX_PLACES = 100_000_000  # that are made of counts, where ratings are gone through
_MAX_MARGINS = 20_000_000  # raters by categories
_MAX_SIDE = 4000  # categories of a table of pairs
_NAME = re.compile(r"\d+(\.0)?|.*[^\d.].*")  # of an item: a number of it, or text
_TO_LIST = ("to_pylist", "tolist")  # of arrays of Arrow; and of numpy and pandas
_MEASURED = 0.8  # of the ratings are different numbers where those are measurements

# -- item by item ---------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class CodedRatings:
    """Ratings as positions in the declared categories.

    Attributes
    ----------
    codes : ndarray of signed integers, shape (n_items, n_raters)
        Position of each rating in `categories`; -1 if it is missing.
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
        return int((self.codes >= 0).any(axis=1).sum())

    @property
    def n_raters(self) -> int:
        """Raters with at least one rating."""
        return int((self.codes >= 0).any(axis=0).sum())

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
    if isinstance(ratings, CountedRatings):
        needed = (
            "ratings: needs ratings that show who rated what, got a table of counts"
        )
        refuse((not ratings.knows_raters, needed), error=RatingsError)
        ratings = ratings.coded
    if isinstance(ratings, CodedRatings):
        check_scale(ratings.categories, categories)
        return ratings
    scale = None if categories is None else check_categories(categories)
    shape = getattr(ratings, "shape", None)  # of an array or a frame
    refuse(
        (
            shape is not None and (len(shape) != 2 or 0 in shape),
            f"{_NOTHING}, got shape {shape}",
        ),
        error=RatingsError,
    )
    if type(ratings) is not np.ndarray and type(ratings) is not list:
        ratings, scale = _plain_table(ratings, scale)
    if isinstance(ratings, np.ndarray) and ratings.dtype.kind in "iuf":
        lowest, highest = ratings.min(), ratings.max()
        has_whole = ratings.dtype.kind in "iu" and int(highest) < 2**63
        span = int(highest) - int(lowest) + 1 if has_whole else _MAX_SPAN
        if span < _MAX_SPAN:
            codes = np.empty(ratings.shape, dtype=np.min_scalar_type(-span - 1))
            np.subtract(ratings, lowest, out=codes, dtype=np.int64, casting="unsafe")
            met = np.bincount(codes[:_BLOCK].ravel(), minlength=span)
            if not met.all():  # as a rule the first items have every grade
                met = np.bincount(codes.ravel(), minlength=span)
                codes = (np.cumsum(met > 0) - 1).astype(codes.dtype)[codes]
            labels = np.flatnonzero(met) + int(lowest)
        else:
            labels, codes = np.unique(ratings, return_inverse=True)
            labels, codes = labels[~np.isnan(labels)], codes.reshape(ratings.shape)
            codes[codes == len(labels)] = MISSING
        known: tuple[Label, ...] = tuple(labels.tolist())
        if scale is not None:
            codes, known = _on_scale(known, codes, scale)
    else:
        codes, known = label_codes(_rows_of(ratings), scale)
        warn_of_texts(known, codes, declared=scale is not None)
    return CodedRatings(
        codes=read_only(codes), categories=known, declared=scale is not None
    )


def read_only(array: NDArray[Any]) -> NDArray[Any]:
    """Return an array that nobody can write to any more."""
    array.setflags(write=False)
    return array


def _on_scale(
    labels: Sequence[Any],
    codes: NDArray[np.signedinteger[Any]],
    scale: tuple[Label, ...] | None,
    column: str | None = None,
) -> tuple[Codes, tuple[Label, ...]]:
    # from codes of labels as they were met, of a table or of a column of this name, to
    # those on a scale
    def where(label: int, _: int) -> str:
        row, *rest = np.argwhere(codes == label)[0].tolist()
        return f"ratings: row {row}, column {rest[0] if rest else repr(column)}"

    coded, known = label_codes([[label] for label in labels], scale, where)
    return np.append(coded.ravel(), coded.dtype.type(MISSING))[codes], known


def check_scale(known: tuple[Label, ...], categories: Sequence[Label] | None) -> None:
    """Check that ratings which have a scale are asked for on no other."""
    if categories is not None and check_categories(categories) != known:
        raise ParameterError(
            f"categories: the ratings are on the scale {known}, got {tuple(categories)}"
        )


def _rows_of(
    table: Any,
    name: str = "ratings",
    row_name: str = "ratings: row",
    width: int | None = None,
) -> list[list[Any]]:
    # an array or nested sequences -> n_items lists of labels, of such a width or as
    # the first
    if isinstance(table, np.ndarray) and width is None:
        return list(table.tolist())
    if not is_row(table):
        raise RatingsError(
            f"{name}: needs a table with one row of labels per item, got {shown(table)}"
        )
    rows: list[list[Any]] = []
    for row in table:
        labels = list(row) if is_row(row) else []
        width = width or len(labels)
        if not labels or len(labels) != width:
            raise RatingsError(
                f"{row_name} {len(rows)}: needs {width or 'a row of'} labels, got "
                f"{shown(row)}"
            )
        rows.append(labels)
    refuse((not rows, f"{_NOTHING}, got none"), error=RatingsError)
    return rows


def _plain_table(
    ratings: Any, scale: tuple[Label, ...] | None
) -> tuple[Any, tuple[Label, ...] | None]:
    # a frame, without importing its library, or an array of another kind, as a plain
    # array; and the scale, which ordered categories of a frame declare
    if isinstance(ratings, np.ma.MaskedArray):
        return np.ma.filled(ratings.astype(object), np.nan), scale
    if isinstance(ratings, np.ndarray):  # a matrix
        return np.asarray(ratings), scale
    if not hasattr(ratings, "to_numpy"):
        return ratings, scale
    if hasattr(ratings, "iloc"):  # pandas, whose own types are told apart here
        types = list(ratings.dtypes)
        if scale is None and all(getattr(of, "ordered", False) for of in types):
            scales = [check_categories(of.categories.tolist()) for of in types]
            scale = scales[0] if len(set(scales)) == 1 else None
        are_numbers = all(isinstance(of, np.dtype) and of.kind in "iuf" for of in types)
        table = ratings.to_numpy(None if are_numbers else object)
    else:
        table = np.asarray(ratings.to_numpy())
    _refuse_columns(list(map(str, getattr(ratings, "columns", ()))), table)
    return table, scale


def _refuse_columns(names: Sequence[str], table: NDArray[Any]) -> None:
    """Refuse a frame with a column of items among the raters, or one row a rating."""
    # table (n_rows, n_columns); names alone do not tell, but with the labels below them
    known = {_ROLE_OF.get(_letters(n)): k for k, n in reversed([*enumerate(names)])}
    roles = {role: known[role] for role in _LONG if role in known}
    are_text = [_is_text(labels) for labels in table.T]
    is_mixed = {True, False} <= set(are_text)
    if True not in are_text and "item" not in roles and len(roles) < 2:
        return
    labels = [list(map(str, column)) for column in table.T]
    differ = [len(set(of)) == len(of) > 1 for of in labels]
    of_text = are_text.index(True) if is_mixed and are_text.count(True) == 1 else -1
    item = roles.get("item", of_text)
    are_names = item >= 0 and differ[item] and all(map(_NAME.fullmatch, labels[item]))
    # a model may be a rater, and rank items
    is_item = are_names and not (_letters(names[item]) == "model" and all(differ))
    escape = "" if is_mixed else "; use frame.to_numpy() if that is wrong"
    if _is_long(roles, labels) or (is_mixed and len(names) > 2 and not is_item):
        columns = {role: repr(names[place]) for role, place in roles.items()}
        call = ", ".join(f"{role}={columns.get(role, '…')}" for role in _LONG)
        raise RatingsError(
            f"ratings: the columns {', '.join(map(repr, names[:6]))} look like one "
            "row per rating, but a coefficient takes one row per item and one column "
            f"per rater: masrel.agree(frame, {call}) reads them, code_long(frame, "
            f"{call}) turns them into ratings{escape}"
        )
    if is_item:
        raise RatingsError(
            f"ratings: the column {names[item]!r} names the items but would be read "
            f"as a rater: masrel.agree(frame, item={names[item]!r}) reads it as "
            f"names, and so does frame.set_index({names[item]!r}) in pandas{escape}"
        )


def _is_long(roles: dict[str, int], labels: Sequence[Sequence[str]]) -> bool:
    """Return whether columns, some with usual names, have one row per rating."""
    sets, n_rows = list(map(set, labels)), len(labels[0])
    if len(sets) < 3 or len(roles) == 3:
        return len(sets) > 2
    # as raters who use the same words never do
    are_apart = sum(map(len, sets)) == len(set().union(*sets))
    if "rater" not in roles or len(roles) < 2:
        return are_apart and all(1 < len(of) < n_rows for of in sets)
    # names of raters come again, and are in no other column; or each item once
    raters = sets[roles["rater"]]
    is_name = any(raters.isdisjoint(of) for of in sets if of is not raters)
    pairs = set(zip(*(labels[k] for k in roles.values()), strict=True))
    return 2 * len(raters) <= n_rows and (is_name or len(pairs) == n_rows)


def _letters(name: str) -> str:
    return "".join(filter(str.isalnum, name.casefold()))


def _is_text(labels: NDArray[Any]) -> bool | None:
    # of a column, by its first label; None without one
    return next((isinstance(of, str) for of in labels if not is_missing(of)), None)


_LONG = ("item", "rater", "grade")
_ROLE_OF = {
    _letters(name): role for role, names in USUAL_NAMES.items() for name in names
} | dict.fromkeys(("id", "participant", "participantid"), "item")


def side_by_side(first: Any, second: Any) -> Any:
    """Return the labels of two raters as a table, or the one table that is given."""
    if second is None:
        return first
    columns = [_labels_of(first), _labels_of(second)]
    lengths = [len(labels) for labels in columns if labels is not None]
    refuse(
        (
            len(lengths) < 2,
            "ratings, other: needs the labels of two raters, one sequence for each, "
            f"or a single table, got {type(first).__name__} and "
            f"{type(second).__name__}",
        ),
        error=RatingsError,
    )
    refuse(
        (
            lengths[0] != lengths[1],
            "ratings, other: needs a label or None for every item from both raters, "
            f"in the same order, got {lengths[0]} and {lengths[1]} labels",
        ),
        error=RatingsError,
    )
    if hasattr(first, "iloc") and hasattr(second, "iloc"):
        refuse(
            (
                not first.index.equals(second.index),
                "ratings, other: needs two Series with the same index, got different "
                "ones: pandas.concat([a, b], axis=1) matches labels by index, "
                "a.to_numpy() and b.to_numpy() by position",
            ),
            error=RatingsError,
        )
        return first.to_frame("first").assign(second=second)
    return list(zip(*columns, strict=True))


def _labels_of(rater: Any) -> list[Any] | None:
    # of a sequence of labels; None of anything else
    if not is_row(rater) or len(getattr(rater, "shape", (0,))) != 1:
        return None
    to_list = next((t for t in _TO_LIST if hasattr(rater, t)), None)
    labels = list(rater) if to_list is None else getattr(rater, to_list)()
    return None if any(map(is_row, labels)) else labels


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
    """Arrange a DataFrame with one row per rating as items by raters.

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
        As for `code_ratings`.

    Examples
    --------
    >>> import pandas as pd
    >>> frame = pd.DataFrame({"item": ["x", "x", "y"], "rater": ["A", "B", "A"],
    ...                       "grade": ["1", "1+", "2"]})
    >>> code_long(frame, categories=["1", "1+", "2"]).codes.tolist()
    [[0, 1], [2, -1]]
    """
    check_option("repeated", repeated, get_args(Repeated))
    check_frame(frame, (item, rater, grade))
    items, item_names = levels(frame[item], item)
    raters, rater_names = levels(frame[rater], rater)
    scale = None if categories is None else check_categories(categories)
    try:
        met, labels = frame[grade].factorize()
    except TypeError:  # sets have no hash
        met, labels = np.arange(len(frame)), frame[grade]
    grades, known = _on_scale(labels.tolist(), met, scale, grade)
    warn_of_texts(known, grades, declared=scale is not None)
    places = items * len(rater_names) + raters
    if repeated == "error" and np.bincount(places).max() > 1:
        raise _repeats(frame[[item, rater]])
    codes = np.full((len(item_names), len(rater_names)), MISSING, dtype=grades.dtype)
    order = slice(None, None, -1 if repeated == "first" else 1)  # the last one stays
    codes.reshape(-1)[places[order]] = grades[order]
    return CodedRatings(
        codes=read_only(codes), categories=known, declared=scale is not None
    )


def check_frame(frame: Any, columns: Iterable[str], name: str = "frame") -> None:
    """Check that something is a DataFrame of a row or more that has these columns."""
    refuse(
        (
            not (hasattr(frame, "columns") and hasattr(frame, "iloc")),
            f"{name}: needs a DataFrame, got {type(frame).__name__}",
        ),
        error=RatingsError,
    )
    refuse(
        *(
            (
                column not in frame.columns,
                f"ratings: needs a column {column!r}, got "
                f"{', '.join(map(repr, frame.columns))}",
            )
            for column in columns
        ),
        (not len(frame), f"{_NOTHING}, got no row"),
        error=RatingsError,
    )


def numbers(column: Any, name: str) -> NDArray[np.float64]:
    """Return a column of a DataFrame as numbers; ``nan`` if missing."""
    try:
        values = column.to_numpy(np.float64, na_value=np.nan)
    except (TypeError, ValueError) as error:
        raise RatingsError(
            f"ratings: column {name!r} needs numbers: {error}"
        ) from error
    refuse(
        (
            np.isinf(values).any(),
            f"ratings: row {np.isinf(values).argmax()}, column {name!r}: needs a "
            "finite number, got infinity",
        ),
        error=RatingsError,
    )
    return np.asarray(values)


def levels(column: Any, name: str) -> tuple[NDArray[np.intp], Any]:
    """Return the level of each row of a column of a DataFrame, and their names."""
    places, names = column.factorize()
    where = f"ratings: row {np.argmin(places)}, column {name!r}"
    refuse((places.min() < 0, f"{where}: needs a name, got none"), error=RatingsError)
    return places, names


def _repeats(names: Any) -> RatingsError:
    # names of items and of raters, a frame of two columns
    again = names[names.duplicated()].drop_duplicates().to_numpy(object).tolist()
    named = "; ".join(f"{item!r} by {rater!r}" for item, rater in again[:5])
    return RatingsError(
        "ratings: each rater needs to rate an item once; rated more than once: "
        + named
        + (f" and {len(again) - 5} more" if len(again) > 5 else "")
        + '; repeated="first" or "last" keeps one of them'
    )


def code_pairs(
    pairs: object, categories: Sequence[Label] | None = None
) -> CodedRatings:
    """Check pairs of ratings per rater and lay them side by side as codes."""
    # Takes pairs (n_raters, n_items, 2)
    if isinstance(pairs, CodedRatings):
        n_columns = pairs.codes.shape[1]
        needed = (
            f"pairs: needs two columns of ratings per rater, got {n_columns} columns"
        )
        refuse((n_columns % 2, needed), error=RatingsError)
        return code_ratings(pairs, categories)
    if not is_row(pairs):
        raise RatingsError(
            f"pairs: needs one table (items, 2) per rater, got {type(pairs).__name__}"
        )
    tables = [
        _rows_of(table, f"pairs: rater {rater}", f"pairs: rater {rater}, item", 2)
        for rater, table in enumerate(pairs)
    ]
    refuse(
        (
            len({len(table) for table in tables}) != 1,
            "pairs: needs at least one rater, and the same items for every rater, got "
            f"{', '.join(str(len(table)) for table in tables) or 'no'} items",
        ),
        error=RatingsError,
    )
    rows = [
        [grade for pair in of_item for grade in pair]
        for of_item in zip(*tables, strict=True)
    ]
    return code_ratings(rows, categories)


# -- distinct rows ---------------------------------------------------------------------


@dataclass(slots=True, kw_only=True, eq=False)
class CountedRatings:
    """Rows of ratings with how often each occurs, for several coefficients at once.

    Attributes
    ----------
    codes : ndarray of signed integers, shape (n_rows, n_raters)
        Position of each rating in `categories`; -1 if it is missing.
    freq : ndarray of int, shape (n_rows,)
        How often each row occurs.
    categories : tuple of str, int or float
        Declared categories in order.
    n_raters : int
        Raters with at least one rating; of counts, the most ratings of an item.
    declared : bool
        False if nobody declared the categories, and they are the labels met.
    tells_raters_apart : bool
        False if columns are places of ratings and not raters: only counts are known.
    repeats : ndarray of int, shape (n_rows, n_raters), or None
        How often each code is there; None for once.
    source : CodedRatings, callable or None
        The ratings item by item, or a call that gives them; None to lay the rows out.
    """

    codes: Codes
    freq: Integers
    categories: tuple[Label, ...]
    n_raters: int
    declared: bool = True
    tells_raters_apart: bool = True
    repeats: Integers | None = None
    source: CodedRatings | Callable[[], CodedRatings] | None = None

    @property
    def n_categories(self) -> int:
        """Declared categories."""
        return len(self.categories)

    @property
    def size(self) -> Integers:
        """Ratings of each row, (n_rows,)."""
        there = self.codes >= 0 if self.repeats is None else self.repeats
        return np.asarray(there.sum(axis=1))

    @property
    def knows_raters(self) -> bool:
        """Whether it is known who rated what."""
        return self.tells_raters_apart or self.source is not None

    @property
    def coded(self) -> CodedRatings:
        """The ratings item by item; of counts, equal items together."""
        if self.source is None:
            return CodedRatings(
                codes=self._laid_out(),
                categories=self.categories,
                declared=self.declared,
            )
        if callable(self.source):
            self.source = self.source()
        return self.source

    def _laid_out(self) -> Codes:
        # codes whose columns are raters, or places of ratings
        codes, n_items = self.codes, int(self.freq.sum())
        width = (
            codes.shape[1]
            if self.repeats is None
            else max(int(self.size.max(initial=0)), 2)
        )
        refuse(
            (
                n_items * width > _MAX_PLACES,
                f"ratings: needs at most {_MAX_PLACES:.0e} ratings to arrange them "
                f"item by item, got {n_items} items with up to {width} each",
            ),
            error=CountsError,
        )
        if self.repeats is not None:
            codes = np.full((len(codes), width), MISSING, dtype=codes.dtype)
            places = np.arange(width) < self.size[:, None]
            codes[places] = self.codes.ravel().repeat(self.repeats.ravel())
        return read_only(np.repeat(codes, self.freq, axis=0))

    def chosen(
        self, raters: NDArray[np.bool_] | None = None, rows: Any = slice(None)
    ) -> "CountedRatings":
        """Keep some raters, or some rows."""
        codes = (self.codes if raters is None else self.codes[:, raters])[rows]
        return replace(
            self,
            codes=codes,
            freq=self.freq[rows],
            n_raters=int((codes >= 0).any(axis=0).sum()),
            repeats=None if self.repeats is None else self.repeats[rows],
            source=None,
        )


def count_ratings(
    ratings: object, categories: Sequence[Label] | None = None
) -> CountedRatings:
    """Check ratings once, and count distinct rows once, for several coefficients.

    Parameters
    ----------
    ratings : nested sequence, array_like or DataFrame, shape (n_items, n_raters)
        Labels or numbers; None and ``nan`` are missing.
    categories : sequence of str, int or float, optional
        The declared scale in order; the labels met when not given.

    Returns
    -------
    CountedRatings
        What every coefficient takes in place of ratings.

    Raises
    ------
    RatingsError
        If the ratings are not such a table.

    Warns
    -----
    RatingsWarning
        As for `code_ratings`.

    Examples
    --------
    >>> from masrel.agreement import fleiss_kappa, gwet_ac
    >>> counted = count_ratings([["a", "a"], ["b", "b"], ["a", "b"]])
    >>> fleiss_kappa(counted).value == gwet_ac(counted).value
    True
    """
    if isinstance(ratings, CountedRatings):
        check_scale(ratings.categories, categories)
        return ratings
    coded = code_ratings(ratings, categories)
    codes, (n_items, n_raters) = coded.codes, coded.codes.shape
    if (len(coded.categories) + 1) ** n_raters <= min(4 * n_items, _MAX_KEYS):
        codes, freq = distinct_rows(codes, len(coded.categories))
    else:
        freq = np.ones(n_items, dtype=np.int64)
    return CountedRatings(
        codes=codes,
        freq=freq,
        categories=coded.categories,
        n_raters=int((codes >= 0).any(axis=0).sum()),
        declared=coded.declared,
        source=coded,
    )


def distinct_rows(codes: Codes, n_categories: int) -> tuple[Codes, Integers]:
    """Put equal rows of codes together: the rows, and how often each occurs."""
    # codes (n_items, n_raters) -> (n_distinct, n_raters), (n_distinct,)
    (n_items, n_raters), base = codes.shape, n_categories + 1
    if base**n_raters > 2**53:
        return np.unique(codes, axis=0, return_counts=True)
    # a row is one number with n_raters digits, code + 1 each
    powers = base ** np.arange(n_raters, dtype=np.int64)
    keys = np.empty(n_items, dtype=np.int64)
    for start in range(0, n_items, _BLOCK):
        rows = slice(start, start + _BLOCK)
        keys[rows] = codes[rows].astype(np.float64) @ powers + powers.sum()
    if base**n_raters <= min(16 * n_items, _MAX_KEYS):
        counts = np.bincount(keys)
        keys = np.flatnonzero(counts)
        freq = counts[keys]
    else:
        keys, freq = np.unique(keys, return_counts=True)
    return keys[:, None] // powers % base - 1, freq


def raters_told_apart(
    ratings: object, categories: Sequence[Label] | None = None
) -> CountedRatings:
    """Count ratings of raters who are told apart; those without any are left out."""
    counted = count_ratings(ratings, categories)
    if not counted.tells_raters_apart:
        counted = count_ratings(code_ratings(counted))  # or an error
    n_raters, q = counted.codes.shape[1], len(counted.categories)
    refuse(
        (
            n_raters * q > _MAX_MARGINS,
            f"ratings: {n_raters} raters and {q} different grades are too many for "
            "this statistic, which counts how often each rater gave each grade",
        )
    )
    if counted.n_raters in (0, 1, counted.codes.shape[1]):  # unless two others are left
        return counted
    return counted.chosen(raters=np.asarray((counted.codes >= 0).any(axis=0)))


def two_raters(
    ratings: object, categories: Sequence[Label] | None, title: str
) -> CountedRatings:
    """Count the items that both of two raters rated."""
    counted = raters_told_apart(ratings, categories)
    refuse(
        (
            counted.codes.shape[1] != 2,
            f"{title} needs the ratings of two raters, got {counted.codes.shape[1]}",
        ),
        error=RatingsError,
    )
    return complete_rows(counted)


def complete_rows(ratings: CountedRatings) -> CountedRatings:
    """Keep the rows that every rater rated."""
    whole = (ratings.codes >= 0).all(axis=1)
    return ratings if whole.all() else ratings.chosen(rows=whole)


def refuse_measurements(ratings: CodedRatings | CountedRatings) -> None:
    """Refuse numbers that are nearly all different where only equal ones agree."""
    n_known, n_ratings = len(ratings.categories), int((ratings.codes >= 0).sum())
    refuse(
        (
            n_known > _MEASURED * n_ratings
            and not isinstance(ratings.categories[0], str),
            f"ratings: {n_known} different numbers among {n_ratings} ratings are "
            "measurements, which rarely agree exactly: use an intraclass correlation, "
            "such as icc_a1, Krippendorff's alpha with the interval metric, or "
            "quadratic weights",
        ),
        error=RatingsError,
    )


# -- counts and tables -----------------------------------------------------------------


def pair_table(
    codes: Codes, n_categories: int, freq: Integers | None = None
) -> Integers:
    """Count the pairs of two columns of codes."""
    # codes (n_items, 2) -> (n_categories, n_categories)
    refuse(
        (
            n_categories > _MAX_SIDE,
            f"ratings: {n_categories} different grades are too many for this "
            "statistic, which needs a table of their pairs",
        )
    )
    side = n_categories + 1
    # Missing, -1, becomes the last row and column, which is cut off.
    flat = codes[:, 0].astype(np.int32) * side + codes[:, 1] + side + 1
    table = np.bincount(flat, freq, minlength=side * side).reshape(side, side)
    return table[1:, 1:].astype(np.int64)


def item_counts(
    codes: Codes, n_categories: int, repeats: Integers | None = None
) -> Integers:
    """Count the raters of each category, row by row."""
    # -> (n_rows, n_categories)
    n_rows, width = len(codes), n_categories + 1  # code -1 is the first
    places = codes + np.arange(1, width * n_rows + 1, width)[:, None]
    often = None if repeats is None else repeats.ravel()
    counted = np.bincount(places.ravel(), often, minlength=width * n_rows)
    return counted.reshape(n_rows, width)[:, 1:].astype(np.int64, copy=False)


def count_table(
    table: ArrayLike, *, categories: Sequence[Label] | None = None
) -> CountedRatings:
    """Return counted ratings from a contingency table of two raters.

    Parameters
    ----------
    table : array_like of int, shape (n_categories, n_categories)
        Items per category of the first (rows) and of the second rater (columns).
    categories : sequence of str, int or float, optional
        The declared scale in order; 1 to n_categories unless given.

    Returns
    -------
    CountedRatings
        What every coefficient of two raters and more, and every interval, takes in
        place of ratings.

    Raises
    ------
    CountsError
        If it is not a square table of counts.
    ParameterError
        If there are not as many categories as columns.

    Examples
    --------
    >>> from masrel.agreement import cohen_kappa, gwet_ac
    >>> counted = count_table([[20, 5], [10, 15]])
    >>> cohen_kappa(counted).value
    0.4
    >>> gwet_ac(counted).value
    0.40594059405940597
    """
    checked = check_table(table)
    cells, freq = np.indices(checked.shape).reshape(2, -1).T, checked.ravel()
    return CountedRatings(
        codes=cells[freq > 0],
        freq=freq[freq > 0],
        categories=_column_categories(categories, len(checked)),
        n_raters=2 if freq.any() else 0,
    )


def count_items(
    counts: ArrayLike, *, categories: Sequence[Label] | None = None
) -> CountedRatings:
    """Return counted ratings from the number of raters per item and category.

    Parameters
    ----------
    counts : array_like of int, shape (n_items, n_categories)
        Raters per item and category; rows may have different sums.
    categories : sequence of str, int or float, optional
        The declared scale in order; 1 to n_categories unless given.

    Returns
    -------
    CountedRatings
        What coefficients that do not tell raters apart take in place of ratings:
        percent agreement, Fleiss' kappa, Brennan-Prediger's, Gwet's AC and
        Krippendorff's alpha; so do their intervals for other items. `n_raters` is the
        largest row sum.

    Raises
    ------
    CountsError
        If it is not a table of counts.
    ParameterError
        If there are not as many categories as columns.

    Examples
    --------
    >>> from masrel.agreement import fleiss_kappa
    >>> counted = count_items([[3, 0], [2, 1], [0, 3], [0, 2]])
    >>> round(fleiss_kappa(counted).value, 3)
    0.657
    """
    table = check_counts(counts)
    n_columns = table.shape[1]
    codes = np.arange(n_columns, dtype=np.min_scalar_type(-n_columns - 1))
    return CountedRatings(
        codes=np.where(table > 0, codes, codes.dtype.type(MISSING)),
        freq=np.ones(len(table), dtype=np.int64),
        categories=_column_categories(categories, n_columns),
        n_raters=int(table.sum(axis=1).max()),
        tells_raters_apart=False,
        repeats=table,
    )


def check_counts(counts: ArrayLike) -> Integers:
    """Check a table of counts."""
    # counts (n_items, n_categories) -> (n_items, n_categories)
    try:
        table = np.asarray(counts)
    except ValueError as error:
        raise CountsError("counts: needs rows of the same length") from error
    refuse(
        (
            table.ndim != 2 or 0 in table.shape,
            "counts: needs a table (items, categories) of at least one of each, "
            f"got shape {table.shape}",
        ),
        (
            table.dtype.kind not in "iuf",
            f"counts: needs whole numbers, got {table.dtype}",
        ),
        error=CountsError,
    )
    values = table.astype(np.float64)
    wrong = ~((values >= 0) & (values == np.floor(values)) & (values < 2**53))
    if wrong.any():
        row, column = np.argwhere(wrong)[0]
        raise CountsError(
            f"counts: row {row}, column {column}: needs a whole number of at least 0 "
            f"and below 2^53, got {table[row, column]}"
        )
    return table.astype(np.int64)


def check_table(table: ArrayLike) -> Integers:
    """Check a contingency table of two raters."""
    # table (n_categories, n_categories) -> (n_categories, n_categories)
    checked = check_counts(table)
    needed = f"table: needs as many rows as columns, got shape {checked.shape}"
    refuse((checked.shape[0] != checked.shape[1], needed), error=CountsError)
    return checked


def check_two_by_two(table: ArrayLike) -> list[list[int]]:
    """Check a contingency table of two categories."""
    cells = check_table(table)
    needed = f"table: needs 2 × 2, got {len(cells)} × {len(cells)}"
    refuse((cells.shape != (2, 2), needed), error=CountsError)
    return [[int(n) for n in row] for row in cells]


def _column_categories(
    categories: Sequence[Label] | None, n_columns: int
) -> tuple[Label, ...]:
    # the declared scale of a table of counts, 1 to n_columns unless given
    declared = check_categories(
        range(1, n_columns + 1) if categories is None else categories
    )
    refuse(
        (
            len(declared) != n_columns,
            f"categories: needs {n_columns}, one per column of counts, got "
            f"{len(declared)}",
        )
    )
    return declared


# -- numbers ---------------------------------------------------------------------------


def rating_values(ratings: Any, categories: Sequence[Label] | None) -> Floats:
    """Return ratings as numbers, ``nan`` if missing."""
    # -> (n_items, n_raters)
    coded = code_ratings(ratings, categories)
    known = coded.categories
    if not known:
        return np.empty((0, coded.codes.shape[1]))
    refuse(
        (
            not coded.declared and isinstance(known[0], str),
            "categories: needs the declared scale in order, because the ratings are "
            f"text, such as {known[0]!r}",
        ),
        error=RatingsError,
    )
    # missing, -1, is the last
    values = np.array([*category_values(known), np.nan])[coded.codes]
    if np.isinf(values).any():
        row, column = np.argwhere(np.isinf(values))[0].tolist()
        raise RatingsError(
            f"ratings: row {row}, column {column}: needs a finite number, got "
            f"{values[row, column]}"
        )
    return values


def complete_values(ratings: Any, categories: Sequence[Label] | None) -> Floats:
    """Return the values of items that every rater rated who rated any."""
    # ratings (n_items, n_raters) -> (n_complete_items, n_raters)
    values = rating_values(ratings, categories)
    rates = ~np.isnan(values).all(axis=0)
    if 2 <= rates.sum() < rates.size:
        values = values[:, rates]
    return values[~np.isnan(values).any(axis=1)]


def rated_part(values: Floats) -> Floats:
    """Return the table without items and raters that have no rating."""
    rated = ~np.isnan(values)
    return np.asarray(values[np.ix_(rated.any(axis=1), rated.any(axis=0))])
