"""Ratings from any file: what was read, checked and put together item by rater."""

import importlib
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from masrel.ratings._findings import Finding, Repeated
    from masrel.ratings._reader import RatingsFile, RatingsPart, read_ratings

__all__ = ["Finding", "RatingsFile", "RatingsPart", "Repeated", "read_ratings"]


def __getattr__(name: str) -> object:
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(importlib.import_module("masrel.ratings._reader"), name)
