"""Labels of ratings: which are valid, which are missing, and the scale they make.

Also rows of named fields, such as an item, a rater and a grade, as columns.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence, Set
from itertools import chain
from typing import Any, TypeGuard

import numpy as np
from numpy.typing import NDArray

from masrel._input import USUAL_NAMES, listed, refuse, shown, warn_caller
from masrel.errors import RatingsError, RatingsWarning

Label = str | int | float
"""The name of a grade: text or a number."""

Codes = NDArray[np.signedinteger[Any]]
"""Codes in the smallest integer type that holds them and -(n_categories + 1)."""

MISSING = -1
"""Code of a missing rating."""

SET_SEPARATOR, EMPTY_SET = "; ", "∅"

_NEED_NO_CARE = {str, int, type(None)}  # kinds of labels of which none is wrong
_TEXTS_OF_NOTHING = ("nan", "None", "NaT", "<NA>")


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
    """Text that means a set, in which no separator needs to be looked for."""

    __slots__ = ()


def text_of_set(labels: Set[Any]) -> SetText:
    """Return the text that means a set of labels: its elements in order."""
    elements = sorted(map(str, labels))
    if any(SET_SEPARATOR.strip() in element for element in elements):
        raise RatingsError(
            "ratings: labels in a set cannot contain a semicolon, which separates "
            f"them, got {elements}"
        )
    return SetText(SET_SEPARATOR.join(elements) or EMPTY_SET)


def plain_label(label: Any, where: Callable[..., str], *place: int) -> Label | None:
    """Return a label as text or a number of Python; None for what is missing."""
    if isinstance(label, Set):
        return text_of_set(label)
    if is_missing(label):
        return None
    if isinstance(label, np.generic):
        label = label.item()
    if not isinstance(label, Label):
        raise RatingsError(
            f"{where(*place)}: labels need to be text or numbers, or sets of them, got "
            f"{shown(label)}"
        )
    return label


def check_categories(categories: Sequence[Label]) -> tuple[Label, ...]:
    """Check a declared scale."""
    declared = categories if is_row(categories) else []
    labels = [plain_label(label, lambda: "categories") for label in declared]
    known = tuple(label for label in labels if label is not None)
    refuse(
        (
            not labels,
            "categories: needs a sequence of at least one label, got "
            f"{shown(categories)}",
        ),
        (
            len(known) < len(labels),
            "categories: a missing value cannot be a category",
        ),
        error=RatingsError,
    )
    check_kinds(known, "categories")
    if len(set(known)) < len(known):
        repeated = [label for i, label in enumerate(known) if label in known[:i]]
        raise RatingsError(f"categories: needs each label once, repeated: {repeated}")
    return known


def check_kinds(labels: Iterable[Any], where: str) -> None:
    """Check that labels are all text or all numbers."""
    if len(kinds := {isinstance(label, str): label for label in labels}) > 1:
        raise RatingsError(
            f"{where}: text and numbers cannot be mixed, got {kinds[True]!r} "
            f"and {kinds[False]!r}"
        )


def _cell(row: int, column: int) -> str:
    return f"ratings: row {row}, column {column}"


def label_codes(
    rows: list[list[Any]],
    declared: tuple[Label, ...] | None,
    where: Callable[[int, int], str] = _cell,
) -> tuple[Codes, tuple[Label, ...]]:
    """Return codes of rows of labels, and the scale: labels met unless declared."""
    # -> (n_items, n_raters); where: from row and column to the place, for messages
    kinds = set(map(type, chain.from_iterable(rows)))
    if kinds - _NEED_NO_CARE == {float}:  # of which nan alone is missing
        rows = [[None if label != label else label for label in row] for row in rows]
    elif not kinds <= _NEED_NO_CARE:
        rows = [
            [plain_label(label, where, i, j) for j, label in enumerate(row)]
            for i, row in enumerate(rows)
        ]
    met = set(chain.from_iterable(rows)) - {None, ""} if declared is None else ()
    check_kinds(met, "ratings")
    known = tuple(sorted(met)) if declared is None else declared
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
        rule = (
            "needs a label, or None for a missing rating, got ''; to use '' as a "
            "label, declare it in categories"
            if declared is None
            else f"needs one of {', '.join(map(repr, known))} or a missing value, got "
            f"{rows[i][j]!r}"
        )
        raise RatingsError(f"{where(i, j)}: {rule}") from None
    return np.array(codes, dtype=np.min_scalar_type(-len(known) - 1)), known


def warn_of_texts(labels: Sequence[Label], codes: Codes, *, declared: bool) -> None:
    """Warn of labels that nobody declared, and that astype(str) leaves."""
    doubtful = [
        f"{label!r} ×{np.count_nonzero(codes == code)}"
        for code, label in enumerate(labels)
        if label in _TEXTS_OF_NOTHING and not declared
    ]
    if doubtful:
        warn_caller(
            "ratings: text that looks like a missing rating is counted as a grade: "
            f"{', '.join(doubtful)}; give None for a missing rating, or declare the "
            "text in categories",
            RatingsWarning,
        )


# -- rows of named fields, as tuples or a long DataFrame -------------------------------


def columns_of(rows: Any, fields: Sequence[str]) -> list[list[Any]]:
    """Return a column for each field, from rows in this order or by name."""
    if hasattr(rows, "items"):  # a DataFrame, met without importing pandas, or a dict
        columns = {str(name).casefold(): list(of) for name, of in rows.items()}
        names = [
            next((n for n in USUAL_NAMES.get(field, ()) if n in columns), field)
            for field in fields
        ]
        refuse(
            (
                not columns.keys() >= {*names},
                f"ratings: needs columns {', '.join(fields)}, got {listed(columns)}",
            ),
            error=RatingsError,
        )
        return [columns[name] for name in names]
    table = list(rows) if is_row(rows) else [rows]
    for place, row in enumerate(table):
        if not is_row(row) or len(row) != len(fields):  # type: ignore[arg-type]
            raise RatingsError(
                f"ratings: row {place}: needs {', '.join(fields)}, got {shown(row)}"
            )
    return [list(of) for of in zip(*table, strict=True)] or [[] for _ in fields]


def coded(column: Sequence[Any], field: str) -> tuple[NDArray[np.int64], list[Any]]:
    """Return labels as numbers, in the order in which they are met."""
    places: dict[Any, int] = {}
    try:
        codes = [places.setdefault(label, len(places)) for label in column]
    except TypeError as error:
        raise RatingsError(f"ratings: column {field}: {error}") from None
    labels = [of.item() if isinstance(of, np.generic) else of for of in places]
    if any(map(is_missing, labels)):
        row = next(row for row, label in enumerate(column) if is_missing(label))
        raise RatingsError(f"ratings: row {row}: needs the {field}, got none")
    return np.array(codes, dtype=np.int64), labels
