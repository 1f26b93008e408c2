"""Ratings from any file: what was read, checked and put together item by rater."""

import importlib
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from masrel.ratings._parts import RatingsPart, Repeated
    from masrel.ratings.reader import RatingsFile, read_ratings

__all__ = ["RatingsFile", "RatingsPart", "Repeated", "read_ratings"]


def __getattr__(name: str) -> object:
    if name not in __all__:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    home = "reader" if name in ("RatingsFile", "read_ratings") else "_parts"
    return getattr(importlib.import_module(f"masrel.ratings.{home}"), name)
