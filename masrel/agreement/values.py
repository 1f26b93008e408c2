"""Ratings as numbers, for statistics of means and ranks."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from masrel.agreement.coding import Label, code_ratings, unmasked
from masrel.agreement.weights import category_values
from masrel.errors import RatingsError

__all__ = ["complete_values"]


def complete_values(
    ratings: Any, categories: Sequence[Label] | None
) -> NDArray[np.float64]:
    """Return the values of items that every rater rated."""
    # ratings (n_items, n_raters) -> (n_complete_items, n_raters)
    if isinstance(ratings, np.ma.MaskedArray):
        ratings = unmasked(ratings)
    if categories is None and isinstance(ratings, np.ndarray):
        if ratings.ndim == 2 and ratings.dtype.kind in "iuf" and ratings.size:
            values = ratings.astype(np.float64)
            if np.isinf(values).any():
                row, column = np.argwhere(np.isinf(values))[0].tolist()
                raise RatingsError(
                    f"ratings: row {row}, column {column}: needs a finite number, got "
                    f"{values[row, column]}"
                )
            return values[~np.isnan(values).any(axis=1)]
    coded = code_ratings(ratings, categories)
    if not coded.categories:
        return np.empty((0, coded.codes.shape[1]))
    if categories is None and isinstance(coded.categories[0], str):
        raise RatingsError(
            "categories: needs the declared scale in order, because the ratings are "
            f"text, such as {coded.categories[0]!r}"
        )
    known = [float(value) for value in category_values(coded.categories)]
    values = np.array([*known, np.nan])[coded.codes]  # missing, -1, is the last
    return values[~np.isnan(values).any(axis=1)]
