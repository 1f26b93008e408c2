"""DataFrames of labels to codes, without importing pandas."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from masrel.agreement.arrays import array_codes
from masrel.agreement.labels import (
    Label,
    check_categories,
    code_type,
    labels_met,
    lookup,
)
from masrel.errors import RatingsError

__all__ = ["frame_codes"]

Codes = NDArray[np.signedinteger[Any]]

_MISSING, _UNKNOWN = -1, -2


def frame_codes(
    frame: Any, declared: tuple[Label, ...] | None
) -> tuple[Codes, tuple[Label, ...], bool]:
    """Turn a DataFrame of labels into codes, without importing pandas."""
    # Takes frame (n_items, n_raters)
    if len(frame.shape) != 2:
        raise RatingsError(
            "ratings: needs two dimensions (items, raters), got shape "
            f"{' × '.join(map(str, frame.shape))}"
        )
    if 0 in frame.shape:
        raise RatingsError(
            "ratings: needs at least one item and one rater, got shape "
            f"{frame.shape[0]} × {frame.shape[1]}"
        )
    if not hasattr(frame, "iloc"):  # not pandas, whose own types are told apart here
        codes, known = array_codes(np.asarray(frame.to_numpy()), declared)
        return codes, known, declared is not None
    if all(hasattr(dtype, "categories") for dtype in frame.dtypes):
        return _categorical_codes(frame, declared)
    plain = all(isinstance(d, np.dtype) and d.kind in "iuf" for d in frame.dtypes)
    codes, known = array_codes(frame.to_numpy(None if plain else object), declared)
    return codes, known, declared is not None


def _categorical_codes(
    frame: Any, declared: tuple[Label, ...] | None
) -> tuple[Codes, tuple[Label, ...], bool]:
    columns = [frame.iloc[:, j].array for j in range(frame.shape[1])]
    of_columns = [column.categories.tolist() for column in columns]
    ordered = all(column.ordered for column in columns)
    if declared is None and ordered and all(c == of_columns[0] for c in of_columns):
        declared = check_categories(of_columns[0])
    known = declared
    if known is None:
        # categories nobody was given are not labels met
        known = labels_met(
            labels[code]
            for column, labels in zip(columns, of_columns, strict=True)
            for code in np.unique(column.codes[column.codes >= 0]).tolist()
        )
    position: dict[object, int] = {label: code for code, label in enumerate(known)}
    codes = np.empty(frame.shape, dtype=code_type(len(known)))
    for j, (column, labels) in enumerate(zip(columns, of_columns, strict=True)):
        table = [position.get(label, _UNKNOWN) for label in labels] + [_MISSING]
        codes[:, j] = np.array(table)[column.codes]
        if codes[:, j].min() == _UNKNOWN:
            i = int(np.argmin(codes[:, j]))
            lookup(labels[int(column.codes[i])], position, i, j)
    return codes, known, declared is not None
