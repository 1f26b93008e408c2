"""From any item × rater table of labels to integer codes."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from masrel.errors import RatingsError

__all__ = ["MISSING", "CodedRatings", "code_ratings"]

MISSING = -1
"""Code of a rating that was not given."""

Label = str | int | float


@dataclass(frozen=True, slots=True, kw_only=True)
class CodedRatings:
    """Ratings as positions in the declared categories.

    Attributes
    ----------
    codes : ndarray of int64, shape (n_items, n_raters)
        Position of each rating in `categories`; -1 where there is none.
    categories : tuple of str, int or float
        Declared categories in order.
    """

    codes: NDArray[np.int64] = field(compare=False, repr=False)
    categories: tuple[Label, ...]

    @property
    def n_items(self) -> int:
        """Items with at least one rating."""
        return int((self.codes != MISSING).any(axis=1).sum())

    @property
    def n_raters(self) -> int:
        """Raters with at least one rating."""
        return int((self.codes != MISSING).any(axis=0).sum())

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
    if isinstance(ratings, CodedRatings):
        return ratings
    rows = _rows(ratings)
    declared = _declared(rows, categories)
    position = {label: code for code, label in enumerate(declared)}
    codes = np.empty((len(rows), len(rows[0])), dtype=np.int64)
    for i, row in enumerate(rows):
        for j, label in enumerate(row):
            codes[i, j] = _code(label, position, i, j)
    codes.setflags(write=False)
    return CodedRatings(codes=codes, categories=declared)


def _rows(ratings: Any) -> list[list[object]]:
    # any table -> n_items lists of n_raters labels
    if hasattr(ratings, "to_numpy"):  # a DataFrame, without importing pandas
        ratings = ratings.to_numpy(dtype=object)
    if isinstance(ratings, np.ndarray):
        if ratings.ndim != 2:
            raise RatingsError(
                "ratings: needs two dimensions (items, raters), "
                f"got {ratings.ndim} with shape {ratings.shape}"
            )
        ratings = ratings.tolist()
    if isinstance(ratings, str) or not isinstance(ratings, Iterable):
        raise RatingsError(
            f"ratings: needs an item × rater table, got {type(ratings).__name__}"
        )
    rows = [_row(row, i) for i, row in enumerate(ratings)]
    if not rows or not rows[0]:
        raise RatingsError("ratings: needs at least one item and one rater, got none")
    for i, row in enumerate(rows):
        if len(row) != len(rows[0]):
            raise RatingsError(
                f"ratings: row {i} needs {len(rows[0])} ratings as row 0 has, "
                f"got {len(row)}"
            )
    return rows


def _row(row: object, i: int) -> list[object]:
    if isinstance(row, str) or not isinstance(row, Iterable):
        raise RatingsError(f"ratings: row {i} needs one rating per rater, got {row!r}")
    return list(row)


def _is_missing(label: object) -> bool:
    # None, nan, and pandas' NA and NaT, which are not equal to themselves
    if label is None:
        return True
    if isinstance(label, str):
        return False
    same = label == label  # not so for nan
    return not isinstance(same, bool | np.bool_) or not bool(same)


def _declared(
    rows: list[list[object]], categories: Sequence[Label] | None
) -> tuple[Label, ...]:
    if categories is None:
        met = {label for row in rows for label in row if not _is_missing(label)}
        _one_kind(met, "ratings")
        return tuple(sorted(met))  # type: ignore[arg-type]
    declared = tuple(categories)
    if not declared or isinstance(categories, str):
        raise RatingsError(
            f"categories: needs a sequence of at least one label, got {categories!r}"
        )
    if any(_is_missing(label) for label in declared):
        raise RatingsError("categories: a missing value cannot be a category")
    _one_kind(set(declared), "categories")
    repeated = [label for i, label in enumerate(declared) if label in declared[:i]]
    if repeated:
        raise RatingsError(f"categories: each label once, repeated: {repeated}")
    return declared


def _one_kind(labels: set[Any], where: str) -> None:
    texts = {label for label in labels if isinstance(label, str)}
    if texts and len(texts) != len(labels):
        other = next(label for label in labels if label not in texts)
        raise RatingsError(
            f"{where}: text and numbers cannot be mixed, got {min(texts)!r} "
            f"and {other!r}"
        )


def _code(label: Any, position: dict[Label, int], i: int, j: int) -> int:
    if _is_missing(label):
        return MISSING
    try:
        return position[label]
    except (KeyError, TypeError) as error:
        raise RatingsError(
            f"ratings: row {i}, column {j}: needs one of "
            f"{', '.join(map(repr, position))} or a missing value, got {label!r}"
        ) from error
