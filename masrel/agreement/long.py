"""Long tables, one row a rating, to codes."""

from collections.abc import Sequence
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from masrel.agreement.coding import MISSING, CodedRatings
from masrel.agreement.labels import (
    Label,
    check_categories,
    code_type,
    labels_met,
    lookup,
)
from masrel.errors import ParameterError, RatingsError

__all__ = ["Repeated", "code_long"]

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
        the categories, or a rating is repeated.
    ParameterError
        If `repeated` is none of the three.

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
    found, labels = column.factorize()
    known = labels.tolist()
    declared = labels_met(known) if categories is None else check_categories(categories)
    position: dict[object, int] = {label: code for code, label in enumerate(declared)}
    table = np.full(len(known) + 1, MISSING, dtype=code_type(len(declared)))
    for code, label in enumerate(known):
        try:
            table[code] = position[label]
        except KeyError:
            row = int(np.argmax(found == code))
            lookup(label, position, row, name)
    return table[found], declared  # missing, -1, is the last


def _refuse_repeats(
    places: NDArray[np.intp], n_places: int, items: Any, raters: Any
) -> None:
    times = np.bincount(places, minlength=n_places)
    if len(places) == 0 or times.max() < 2:
        return
    met = [divmod(int(place), len(raters)) for place in np.flatnonzero(times > 1)[:5]]
    items, raters = items.tolist(), raters.tolist()  # without numpy's types
    named = "; ".join(f"{items[i]!r} by {raters[r]!r}" for i, r in met)
    more = int((times > 1).sum()) - len(met)
    raise RatingsError(
        f"ratings: each rater needs to rate an item once, rated more than once: {named}"
        + (f" and {more} more" if more else "")
        + '; repeated="first" or "last" keeps one of them'
    )
