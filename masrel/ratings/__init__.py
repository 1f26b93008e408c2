"""Tables of ratings: where they come from, and how statistics take them.

In: session logs, or any CSV file of ratings. Out: a checked table, the item by
rater matrix of one session, and the pairs of two.
"""

import importlib
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from masrel.ratings.files import read_ratings
    from masrel.ratings.in_person import InPerson, InPersonRow, read_in_person
    from masrel.ratings.logs import ratings_from_logs
    from masrel.ratings.matrices import (
        RatingMatrix,
        RetestPairs,
        rating_matrix,
        retest_pairs,
    )
    from masrel.ratings.table import (
        DEFAULT_SESSION,
        RATING_COLUMNS,
        SOURCES,
        Ratings,
        ratings_from_rows,
    )
    from masrel.ratings.writing import ratings_hash, write_ratings

__all__ = [
    "DEFAULT_SESSION",
    "RATING_COLUMNS",
    "SOURCES",
    "InPerson",
    "InPersonRow",
    "RatingMatrix",
    "Ratings",
    "RetestPairs",
    "rating_matrix",
    "ratings_from_logs",
    "ratings_from_rows",
    "ratings_hash",
    "read_in_person",
    "read_ratings",
    "retest_pairs",
    "write_ratings",
]

_HOMES = {
    "files": ("read_ratings",),
    "in_person": ("InPerson", "InPersonRow", "read_in_person"),
    "logs": ("ratings_from_logs",),
    "matrices": ("RatingMatrix", "RetestPairs", "rating_matrix", "retest_pairs"),
    "table": (
        "DEFAULT_SESSION",
        "RATING_COLUMNS",
        "SOURCES",
        "Ratings",
        "ratings_from_rows",
    ),
    "writing": ("ratings_hash", "write_ratings"),
}


def __getattr__(name: str) -> object:
    for module, names in _HOMES.items():
        if name in names:
            return getattr(importlib.import_module(f"masrel.ratings.{module}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
