"""Ratings from any file: what was read, checked and put together item by rater."""

import importlib
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from masrel.ratings._findings import Finding, Repeated
    from masrel.ratings._parts import RatingsPart
    from masrel.ratings.reader import RatingsFile, read_ratings

__all__ = ["Finding", "RatingsFile", "RatingsPart", "Repeated", "read_ratings"]

_HOMES = {"Finding": "_findings", "Repeated": "_findings", "RatingsPart": "_parts"}


def __getattr__(name: str) -> object:
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    home = f"masrel.ratings.{_HOMES.get(name, 'reader')}"
    return getattr(importlib.import_module(home), name)
