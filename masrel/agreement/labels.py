"""Labels of ratings: which there are, and their codes, array by array."""

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np

from masrel.errors import RatingsError

__all__ = [
    "Label",
    "check_categories",
    "code_type",
    "is_missing",
    "labels_met",
    "lookup",
]

Label = str | int | float
"""What a grade is called: text or a number."""


def is_missing(label: object) -> bool:
    """Return whether a label is None, ``nan``, or pandas' NA or NaT."""
    if label is None:
        return True
    if isinstance(label, str):
        return False
    same = label == label
    if isinstance(same, bool | np.bool_):
        return not same
    return same is label  # pandas' NA, which does not know whether it is itself


def check_categories(categories: Sequence[Label]) -> tuple[Label, ...]:
    """Check a declared scale."""
    if isinstance(categories, str) or not isinstance(categories, Iterable):
        raise RatingsError(
            f"categories: needs a sequence of at least one label, got {categories!r}"
        )
    declared = tuple(
        label.item() if isinstance(label, np.generic) else label for label in categories
    )
    if not declared:
        raise RatingsError("categories: needs a sequence of at least one label, got ()")
    if any(is_missing(label) for label in declared):
        raise RatingsError("categories: a missing value cannot be a category")
    _one_kind(declared, "categories")
    if len(set(declared)) < len(declared):
        repeated = [label for i, label in enumerate(declared) if label in declared[:i]]
        raise RatingsError(f"categories: each label once, repeated: {repeated}")
    return declared


def labels_met(labels: Iterable[object]) -> tuple[Label, ...]:
    """Return the distinct labels in order: numbers by value, text by alphabet."""
    try:
        met: set[Any] = set(labels)
    except TypeError as error:
        raise RatingsError(
            f"ratings: labels need to be text or numbers ({error})"
        ) from error
    if set(map(type, met)) != {str}:  # text alone needs no more care
        met = {label for label in met if not is_missing(label)}
        _one_kind(met, "ratings")
    return tuple(sorted(met))


def _one_kind(labels: Iterable[Any], where: str) -> None:
    kinds = {isinstance(label, str): label for label in labels}
    if len(kinds) > 1:
        raise RatingsError(
            f"{where}: text and numbers cannot be mixed, got {kinds[True]!r} "
            f"and {kinds[False]!r}"
        )
    if kinds and not isinstance(label := next(iter(kinds.values())), str | int | float):
        if not isinstance(label, np.number):
            raise RatingsError(
                f"{where}: labels need to be text or numbers, got {label!r}"
            )


def code_type(n_categories: int) -> type[np.signedinteger[Any]]:
    """Return the smallest integers that hold the codes of some categories."""
    if n_categories <= 127:
        return np.int8
    return np.int16 if n_categories <= 32_767 else np.int32


def lookup(
    label: object, position: dict[object, int], row: int, column: int | str
) -> int:
    """Return the code of one label."""
    if is_missing(label):
        return -1
    try:
        return position[label]
    except (KeyError, TypeError) as error:
        known = ", ".join(repr(k) for k in position if k is not None)
        raise RatingsError(
            f"ratings: row {row}, column {column!r}: needs one of {known} or a missing "
            f"value, got {label!r}"
        ) from error
