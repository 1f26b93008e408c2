"""Labels of ratings, the scale they make, and rows of a list of them."""

import contextlib
import itertools
import sys
import warnings
from collections.abc import Iterable, Mapping, Sequence, Set
from typing import Any, TypeGuard

import numpy as np
from numpy.typing import NDArray

from masrel.errors import RatingsError, RatingsWarning

Label = str | int | float
"""What a grade is called: text or a number."""

Codes = NDArray[np.signedinteger[Any]]
"""Codes in the smallest integers that hold them."""


_PLAIN = ({str}, {int})


def shown(value: object) -> str:
    """Return what a message shows of a value: one line, and not a long one."""
    text = " ".join(f"{value!r}".split())
    return text if len(text) <= 80 else f"{text[:77]}..."


SET_SEPARATOR, EMPTY_SET = "; ", "∅"


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


def is_missing(label: object) -> bool:
    """Return whether a label is None, ``nan``, or pandas' NA or NaT."""
    if label is None:
        return True
    if isinstance(label, str):
        return False
    try:
        same = label == label
    except (ArithmeticError, TypeError, ValueError):  # a signalling nan of decimals
        return False
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
        label.item()
        if isinstance(label, np.generic)
        else text_of_set(label)
        if isinstance(label, Set)
        else label
        for label in categories
    )
    if not declared:
        raise RatingsError("categories: needs a sequence of at least one label, got ()")
    kinds = set(map(type, declared))
    has_nan = kinds == {float} and any(label != label for label in declared)
    if has_nan or kinds not in (*_PLAIN, {float}):  # those need no more care
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
    if set(map(type, met)) not in _PLAIN:  # those need no more care
        met = {label for label in met if not is_missing(label)}
        _one_kind(met, "ratings")
    return tuple(sorted(met))


def _one_kind(labels: Iterable[Any], where: str) -> None:
    kinds = {}
    for label in labels:
        if not _is_label(label):
            raise RatingsError(
                f"{where}: labels need to be text or numbers, got {label!r}"
            )
        kinds[isinstance(label, str)] = label
    if len(kinds) > 1:
        raise RatingsError(
            f"{where}: text and numbers cannot be mixed, got {kinds[True]!r} "
            f"and {kinds[False]!r}"
        )


def _is_label(label: object) -> bool:
    return isinstance(label, str | int | float | np.number)


def sets_as_text(
    rows: list[list[object]],
) -> tuple[list[list[object]], tuple[Label, ...]]:
    """Return rows with sets as text, and the distinct labels in order."""
    # of a label that is neither text, number nor set, the row and column are named
    plain = [
        [text_of_set(label) if isinstance(label, Set) else label for label in row]
        for row in rows
    ]
    for i, row in enumerate(plain):
        for j, label in enumerate(row):
            if not is_missing(label) and not _is_label(label):
                raise RatingsError(
                    f"ratings: row {i}, column {j}: labels need to be text or numbers, "
                    f"or sets of them, got {label!r}"
                )
    return plain, labels_met(itertools.chain.from_iterable(plain))


_TEXTS_OF_NOTHING = frozenset({"nan", "None", "NaT", "<NA>"})


def has_doubtful_text(labels: Sequence[Label]) -> bool:
    """Return whether text that nobody declared may be no grades."""
    return labels[0] == "" or not _TEXTS_OF_NOTHING.isdisjoint(labels)


def doubt_texts(labels: Sequence[Label], codes: Codes, column: str = "") -> None:
    """Refuse "" where nobody declared it, and warn of what astype(str) leaves."""
    # codes (n_items, n_raters), or of the ratings of a column
    if not has_doubtful_text(labels):
        return
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
    warnings.warn(
        f"ratings: text that looks like a missing rating counts as a grade: "
        f"{', '.join(doubtful)}; give None for a missing rating, or declare the text "
        "in categories",
        RatingsWarning,
        stacklevel=_outside(),
    )


def _outside() -> int:
    # the stacklevel, from a function that calls this one, of who called the package
    frame, level = sys._getframe(1), 1
    while frame.f_back and str(frame.f_globals.get("__name__")).startswith("masrel."):
        frame, level = frame.f_back, level + 1
    return level


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
        return position[text_of_set(label) if isinstance(label, Set) else label]
    except (KeyError, TypeError) as error:
        known = ", ".join(repr(k) for k in position if k is not None)
        raise RatingsError(
            f"ratings: row {row}, column {column!r}: needs one of {known} or a missing "
            f"value, got {label!r}"
        ) from error


NOTHING = "ratings: needs at least one item and one rater, got none"


def label_rows(
    ratings: object, categories: Sequence[Label] | None
) -> tuple[list[list[object]], tuple[Label, ...]]:
    """Check the shape of a nested sequence of labels, and return its rows and scale."""
    # Takes ratings (n_items, n_raters)
    if type(ratings) is list and set(map(type, ratings)) == {list}:
        rows = list(map(list, ratings))
    else:
        rows = _rows(ratings)
    if len(widths := set(map(len, rows))) != 1 or 0 in widths:
        _refuse_shape(rows)
    if categories is not None:
        return rows, check_categories(categories)
    with contextlib.suppress(RatingsError):
        return rows, labels_met(itertools.chain.from_iterable(rows))
    return sets_as_text(rows)


def _rows(ratings: Any) -> list[list[object]]:
    # nested sequences -> n_items lists of labels
    if not is_row(ratings):
        raise RatingsError(
            f"ratings: needs an item × rater table, got {type(ratings).__name__}"
        )
    rows: list[list[object]] = []
    for row in ratings:
        if not is_row(row):
            raise RatingsError(
                f"ratings: row {len(rows)} needs one rating per rater, got {row!r}"
            )
        rows.append(list(row))
    return rows


def is_row(row: object) -> TypeGuard[Iterable[Any]]:
    """Return whether something is a sequence of labels or of rows."""
    # a mapping would give its keys, a set its labels in any order
    is_iterable = isinstance(row, Iterable) and getattr(row, "ndim", 1) > 0
    return is_iterable and not isinstance(row, str | bytes | Mapping | Set)


def _refuse_shape(rows: list[list[object]]) -> None:
    if not rows or not rows[0]:
        raise RatingsError(NOTHING)
    for i, row in enumerate(rows):
        if len(row) != len(rows[0]):
            raise RatingsError(
                f"ratings: row {i} needs {len(rows[0])} ratings as row 0 has, "
                f"got {len(row)}"
            )
