"""From any item × rater table of labels to integer codes."""

import itertools
from collections.abc import Iterable, Mapping, Sequence, Set
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from masrel.agreement.arrays import array_codes
from masrel.agreement.frames import frame_codes
from masrel.agreement.labels import (
    Label,
    check_categories,
    code_type,
    labels_met,
    lookup,
)
from masrel.errors import ParameterError, RatingsError

__all__ = [
    "MISSING",
    "CodedRatings",
    "Codes",
    "Label",
    "check_scale",
    "code_ratings",
    "complete",
    "label_rows",
    "unmasked",
]

MISSING = -1
"""Code of a rating that was not given."""

_FIRST = 100

Codes = NDArray[np.signedinteger[Any]]
"""Codes in the smallest integers that hold them."""


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
        given = self.codes[:, 0] != MISSING
        for column in self.codes.T[1:]:
            if given.all():  # as a rule after the first column
                break
            given |= column != MISSING
        return int(given.sum())

    @property
    def n_raters(self) -> int:
        """Raters with at least one rating."""
        # As a rule every rater has one of the first ratings: look no further.
        given = (self.codes[:_FIRST] != MISSING).any(axis=0)
        if not given.all():
            given = (self.codes != MISSING).any(axis=0)
        return int(given.sum())

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
        among the categories, or categories repeat or mix text and numbers.

    Examples
    --------
    >>> code_ratings([["1", "1+"], ["2", None]], ["1", "1+", "2"]).codes.tolist()
    [[0, 1], [2, -1]]
    """
    if hasattr(ratings, "coded"):  # ratings that are counted
        if ratings.coded is None:
            raise RatingsError(
                "ratings: needs to know who rated what, got counts of a table"
            )
        ratings = ratings.coded
    if isinstance(ratings, CodedRatings):
        if categories is not None:
            check_scale(ratings.categories, categories)
        return ratings
    if not (hasattr(ratings, "to_numpy") or isinstance(ratings, np.ndarray)):
        return _coded(*_row_codes(ratings, categories), categories is not None)
    declared = None if categories is None else check_categories(categories)
    if isinstance(ratings, np.ma.MaskedArray):
        ratings = unmasked(ratings)
    if not isinstance(ratings, np.ndarray):  # a DataFrame, without importing pandas
        return _coded(*frame_codes(ratings, declared))
    if ratings.ndim != 2:
        raise RatingsError(
            "ratings: needs two dimensions (items, raters), "
            f"got {ratings.ndim} with shape {ratings.shape}"
        )
    if 0 in ratings.shape:
        raise RatingsError(_NOTHING)
    return _coded(*array_codes(ratings, declared), declared is not None)


def check_scale(known: tuple[Label, ...], categories: Sequence[Label]) -> None:
    """Check that ratings which have a scale are asked for on no other."""
    if check_categories(categories) != known:
        raise ParameterError(
            f"categories: the ratings are on the scale {known}, got {tuple(categories)}"
        )


def unmasked(ratings: Any) -> NDArray[Any]:
    """Make what is masked missing."""
    masked = np.ma.getmaskarray(ratings)
    if not masked.any():
        return np.asarray(ratings.data)
    plain = ratings.data.astype(float if ratings.dtype.kind == "f" else object)
    plain[masked] = None  # nan among floats
    return np.asarray(plain)


def _coded(codes: Codes, categories: tuple[Label, ...], declared: bool) -> CodedRatings:
    codes.setflags(write=False)
    return CodedRatings(codes=codes, categories=categories, declared=declared)


def complete(coded: CodedRatings) -> CodedRatings:
    """Keep the items that every rater rated."""
    whole = (coded.codes >= 0).all(axis=1)
    if whole.all():
        return coded
    return replace(coded, codes=coded.codes[whole])


_NOTHING = "ratings: needs at least one item and one rater, got none"


def _rows(ratings: Any) -> list[list[object]]:
    # nested sequences -> n_items lists of n_raters labels
    if not _is_row(ratings):
        raise RatingsError(
            f"ratings: needs an item × rater table, got {type(ratings).__name__}"
        )
    rows: list[list[object]] = []
    for row in ratings:
        if type(row) is not list and not _is_row(row):
            raise RatingsError(
                f"ratings: row {len(rows)} needs one rating per rater, got {row!r}"
            )
        rows.append(list(row))
    if not rows or not rows[0]:
        raise RatingsError(_NOTHING)
    n_raters = len(rows[0])
    for i, row in enumerate(rows):
        if len(row) != n_raters:
            raise RatingsError(
                f"ratings: row {i} needs {n_raters} ratings as row 0 has, "
                f"got {len(row)}"
            )
    return rows


def _is_row(row: object) -> bool:
    # a mapping would give its keys, a set its labels in any order
    return isinstance(row, Iterable) and not isinstance(
        row, str | bytes | Mapping | Set
    )


def label_rows(
    ratings: object, categories: Sequence[Label] | None
) -> tuple[list[list[object]], tuple[Label, ...]]:
    """Check the shape of a nested sequence of labels and find its scale."""
    # Takes ratings (n_items, n_raters)
    rows = _rows(ratings)
    if categories is None:
        return rows, labels_met(itertools.chain.from_iterable(rows))
    return rows, check_categories(categories)


def _row_codes(
    ratings: object, categories: Sequence[Label] | None
) -> tuple[Codes, tuple[Label, ...]]:
    rows, declared = label_rows(ratings, categories)
    position: dict[object, int] = {label: code for code, label in enumerate(declared)}
    position[None] = MISSING
    try:
        codes = [[position[label] for label in row] for row in rows]
    except (KeyError, TypeError):  # nan, or a label of no category
        codes = [
            [lookup(label, position, i, j) for j, label in enumerate(row)]
            for i, row in enumerate(rows)
        ]
    return np.array(codes, dtype=code_type(len(declared))), declared
