"""Ratings from any file: what was read, checked and put together item by rater."""

import importlib
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from masrel.ratings._findings import Finding, Reading, Repeated
    from masrel.ratings._reader import RatingsFile, RatingsPart, read_ratings

_HOMES = {
    "Finding": "_findings",
    "RatingsFile": "_reader",
    "RatingsPart": "_reader",
    "Reading": "_findings",
    "Repeated": "_findings",
    "read_ratings": "_reader",
}

__all__ = [
    "Finding",
    "RatingsFile",
    "RatingsPart",
    "Reading",
    "Repeated",
    "read_ratings",
]


def __getattr__(name: str) -> object:
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    home = importlib.import_module(f"masrel.ratings.{_HOMES[name]}")
    return getattr(home, name)
