"""Labels of ratings: what may be one, what is missing, and the scale they make."""

import sys
import warnings
from collections.abc import Iterable, Mapping, Sequence, Set
from itertools import chain
from typing import Any, TypeGuard

import numpy as np
from numpy.typing import NDArray

from masrel.errors import RatingsError, RatingsWarning

Label = str | int | float
"""What a grade is called: text or a number."""

Codes = NDArray[np.signedinteger[Any]]
"""Codes in the smallest integers that hold them and -(n_categories + 1)."""

MISSING = -1
"""Code of a rating that was not given."""

SET_SEPARATOR, EMPTY_SET = "; ", "∅"

_NEED_NO_CARE = {str, int, type(None)}  # kinds of labels of which none is wrong
_TEXTS_OF_NOTHING = ("nan", "None", "NaT", "<NA>")


def shown(value: object) -> str:
    """Return what a message shows of a value: one line, and not a long one."""
    text = " ".join(f"{value!r}".split())
    return text if len(text) <= 80 else f"{text[:77]}..."


def is_row(row: object) -> TypeGuard[Iterable[Any]]:
    """Return whether something is a sequence of labels or of rows."""
    # a mapping would give its keys, a set its labels in any order
    is_iterable = isinstance(row, Iterable) and getattr(row, "ndim", 1) > 0
    return is_iterable and not isinstance(row, str | bytes | Mapping | Set)


def is_missing(label: object) -> bool:
    """Return whether a label is None, ``nan``, or pandas' NA or NaT."""
    if label is None or isinstance(label, str):
        return label is None
    try:
        return not label == label
    except TypeError:  # pandas' NA, which does not know whether it is itself
        return True
    except (ArithmeticError, ValueError):  # an array, a signalling nan of decimals
        return False


class SetText(str):
    """Text that stands for a set, in which no separator needs to be looked for."""

    __slots__ = ()


def text_of_set(labels: Set[Any]) -> SetText:
    """Return the text that stands for a set of labels: its elements in order."""
    elements = sorted(map(str, labels))
    if any(SET_SEPARATOR.strip() in element for element in elements):
        raise RatingsError(
            "ratings: labels in a set need to have no semicolon, which separates them, "
            f"got {elements}"
        )
    return SetText(SET_SEPARATOR.join(elements) or EMPTY_SET)


def check_categories(categories: Sequence[Label]) -> tuple[Label, ...]:
    """Check a declared scale."""
    labels = list(categories) if is_row(categories) else []
    if not labels:
        raise RatingsError(
            "categories: needs a sequence of at least one label, got "
            f"{shown(categories)}"
        )
    for place, label in enumerate(labels):
        if isinstance(label, np.generic):
            labels[place] = label.item()
        elif isinstance(label, Set):
            labels[place] = text_of_set(label)
        if is_missing(label):
            raise RatingsError("categories: a missing value cannot be a category")
    _check_kinds(labels, "categories")
    if len(set(labels)) < len(labels):
        repeated = [label for i, label in enumerate(labels) if label in labels[:i]]
        raise RatingsError(f"categories: each label once, repeated: {repeated}")
    return tuple(labels)


def labels_met(labels: Iterable[Any]) -> tuple[Label, ...]:
    """Return the distinct labels in order: numbers by value, text by alphabet."""
    met = {label for label in labels if not is_missing(label)}
    _check_kinds(met, "ratings")
    return tuple(sorted(met))


def _check_kinds(labels: Iterable[Any], where: str) -> None:
    kinds: dict[bool, Any] = {}
    for label in labels:
        if not isinstance(label, Label | np.number):
            raise RatingsError(
                f"{where}: labels need to be text or numbers, got {shown(label)}"
            )
        kinds[isinstance(label, str)] = label
    if len(kinds) > 1:
        raise RatingsError(
            f"{where}: text and numbers cannot be mixed, got {kinds[True]!r} "
            f"and {kinds[False]!r}"
        )


def label_codes(
    rows: list[list[Any]], declared: tuple[Label, ...] | None
) -> tuple[Codes, tuple[Label, ...]]:
    """Return codes of rows of labels, and the scale: labels met unless declared."""
    # -> (n_items, n_raters)
    if not set(map(type, chain.from_iterable(rows))) <= _NEED_NO_CARE:
        rows = [
            [_plain_label(label, i, j) for j, label in enumerate(row)]
            for i, row in enumerate(rows)
        ]
    known = labels_met(set(chain.from_iterable(rows))) if declared is None else declared
    position: dict[Any, int] = {label: code for code, label in enumerate(known)}
    position[None] = MISSING
    try:
        codes = [[position[label] for label in row] for row in rows]
    except KeyError:
        i, j = next(
            (i, j)
            for i, row in enumerate(rows)
            for j, label in enumerate(row)
            if label not in position
        )
        raise no_category(rows[i][j], known, i, j) from None
    coded = np.array(codes, dtype=np.min_scalar_type(-len(known) - 1))
    if declared is None and known and isinstance(known[0], str):
        doubt_texts(known, coded)
    return coded, known


def _plain_label(label: Any, row: int, column: int) -> Any:
    # sets as text, and None for what is missing
    if isinstance(label, Set):
        return text_of_set(label)
    if is_missing(label):
        return None
    if not isinstance(label, Label | np.number):
        raise RatingsError(
            f"ratings: row {row}, column {column}: labels need to be text or numbers, "
            f"or sets of them, got {shown(label)}"
        )
    return label


def no_category(
    label: object, known: Sequence[Label], row: int, column: int | str
) -> RatingsError:
    """Return the error of a label that is none of the categories."""
    return RatingsError(
        f"ratings: row {row}, column {column!r}: needs one of "
        f"{', '.join(map(repr, known))} or a missing value, got {label!r}"
    )


def doubt_texts(labels: Sequence[Label], codes: Codes, column: str = "") -> None:
    """Refuse "" where nobody declared it, and warn of what astype(str) leaves."""
    # codes (n_items, n_raters), or of the ratings of a column
    if labels[0] == "":  # the first in the order of the alphabet
        row, *rest = np.argwhere(codes == 0)[0].tolist()
        raise RatingsError(
            f"ratings: row {row}, column {rest[0] if rest else column!r}: needs a "
            "label, or None for a missing rating, got ''; it is one where categories "
            "declare it"
        )
    doubtful = [
        f"{label!r} ({np.count_nonzero(codes == code)} times)"
        for code, label in enumerate(labels)
        if label in _TEXTS_OF_NOTHING
    ]
    if doubtful:
        warn_caller(
            "ratings: text that looks like a missing rating counts as a grade: "
            f"{', '.join(doubtful)}; give None for a missing rating, or declare the "
            "text in categories",
            RatingsWarning,
        )


def warn_caller(message: str, category: type[Warning]) -> None:
    """Warn whoever called this package."""
    frame, level = sys._getframe(1), 2
    while frame.f_back and str(frame.f_globals.get("__name__")).startswith("masrel."):
        frame, level = frame.f_back, level + 1
    warnings.warn(message, category, stacklevel=level)
