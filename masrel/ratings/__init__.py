"""Ratings from any file: what was read, checked and put together item by rater."""

from typing import TYPE_CHECKING

from masrel._interpreter import loaded_from

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


__getattr__ = loaded_from(__name__, _HOMES)
