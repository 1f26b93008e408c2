"""From features in floats to the fractions they are, over a common denominator."""

import math

import numpy as np
from numpy.typing import NDArray

from masrel.agreement._kernel import Floats

__all__ = ["Integers", "numerators_of"]

Integers = NDArray[np.int64]

_LARGEST = 10**5  # denominators above this are taken for irrational numbers
_MOST = 2.0**52  # integers that a float still holds
_WHOLE = 1e-13  # of a number: as near to an integer as that it is one, but for rounding


def numerators_of(rows: Floats, n: int) -> tuple[Integers, Floats] | None:
    """Write rational numbers as integers over one denominator a column."""
    # Takes rows (n_rows, n_features)
    denominators = _denominators(rows)
    if denominators is None:
        return None
    numerators = np.rint(rows * denominators)
    if np.abs(numerators).max() * max(n, 1) > _MOST:
        return None
    return numerators.astype(np.int64), denominators


def _denominators(rows: Floats) -> Floats | None:
    # (n_features,): the least common denominator of each column
    common = np.ones(rows.shape[1])
    scaled = rows
    while True:
        off = np.abs(scaled - np.rint(scaled)) > _WHOLE * np.maximum(np.abs(scaled), 1)
        at = np.argmax(off, axis=0)
        columns = np.flatnonzero(off[at, np.arange(at.size)])
        if columns.size == 0:
            return common
        for column in columns.tolist():
            common[column] *= _denominator(float(scaled[at[column], column]))
        if common.max() > _MOST:
            return None
        scaled = rows * common


def _denominator(number: float) -> float:
    # of the first convergent of its continued fraction that is the number; infinity if
    # that is none of the fractions known here
    rest, before, found = number - math.floor(number), 0, 1
    while found <= _LARGEST:
        scaled = number * found
        if abs(scaled - round(scaled)) <= _WHOLE * max(abs(scaled), 1.0):
            return float(found)
        rest = 1.0 / rest
        whole = math.floor(rest)
        rest -= whole
        before, found = found, whole * found + before
    return math.inf
