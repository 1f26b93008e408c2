"""Ratings as the latent-trait model takes them."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from masrel.agreement import Label, code_ratings
from masrel.agreement._labels import Codes
from masrel.errors import ParameterError, RatingsError

__all__ = ["Items", "LatentRatings"]

Items = Literal["fixed", "random"]
"""Whether kappa speaks of these items, or of new ones of their population."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LatentRatings:
    """Checked ratings, without items or raters that have none."""

    # (n_items, n_raters): positions in the scale, -1 where missing
    codes: Codes = field(compare=False, repr=False)
    categories: tuple[Label, ...]  # the declared scale
    # items, raters: names: of the index and the columns of a DataFrame, or numbers from
    # 1
    items: tuple[str, ...]
    raters: tuple[str, ...]

    @classmethod
    def of(cls, ratings: object, categories: Sequence[Label] | None) -> "LatentRatings":
        """Check ratings."""
        # Takes ratings (n_items, n_raters)
        coded = code_ratings(ratings, categories)
        if not coded.declared and isinstance(coded.categories[0], str):
            raise ParameterError(
                "categories: the model needs the declared scale in order, the ratings "
                "are text"
            )
        if coded.n_categories < 2:
            raise ParameterError("categories: the model needs two, got one")
        given = coded.codes >= 0
        if not (given.sum(axis=1) >= 2).any():
            raise RatingsError("ratings: the model needs an item rated by two raters")
        rows = np.flatnonzero(given.any(axis=1))
        _check_spread(coded.codes, given)
        columns = np.flatnonzero(given.any(axis=0))
        return cls(
            codes=coded.codes[rows][:, columns],
            categories=coded.categories,
            items=_names(getattr(ratings, "index", None), "item", rows.tolist()),
            raters=_names(getattr(ratings, "columns", None), "rater", columns.tolist()),
        )


def _check_spread(codes: Codes, given: NDArray[np.bool_]) -> None:
    n_items = int(given.any(axis=1).sum())
    if n_items < 2:
        raise RatingsError(
            "ratings: the model needs two items to say how far apart they are, got "
            f"{n_items}"
        )
    highest = np.where(given, codes, -1).max(axis=1)
    lowest = np.where(given, codes, codes.max()).min(axis=1)
    if (highest <= lowest).all():
        raise RatingsError(
            "ratings: no two raters disagree on any item, so that nothing tells how "
            "small biases and noises are; masrel.intervals.posterior bounds kappa here"
        )


def _names(labels: object, what: str, kept: list[int]) -> tuple[str, ...]:
    # of the rows or columns of a DataFrame; otherwise counted from 1
    if isinstance(labels, Iterable):  # the index of a list is a method
        every = list(labels)
        return tuple(str(every[i]) for i in kept)
    return tuple(f"{what} {i + 1}" for i in kept)
