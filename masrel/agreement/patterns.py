"""Distinct rows of codes, rater by rater, with how often each occurs."""

import numpy as np
from numpy.typing import NDArray

from masrel.agreement.coding import Codes

__all__ = ["distinct_patterns"]

_MOST_KEYS = 1 << 22  # patterns that are counted in a table rather than sorted
_BLOCK = 1 << 16  # items counted at once, so that they stay in the cache


def distinct_patterns(
    codes: Codes, n_categories: int
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Put equal rows of codes together.

    Parameters
    ----------
    codes : ndarray of int, shape (n_items, n_raters)
        Codes, -1 where missing.
    n_categories : int
        Declared categories.

    Returns
    -------
    tuple of ndarray of int64
        Distinct rows, shape (n_distinct, n_raters), and how often each occurs.
    """
    n_items, n_raters = codes.shape
    base = n_categories + 1
    n_keys = base**n_raters  # a row is one number with n_raters digits
    if n_keys > 2**62:
        rows, times = np.unique(codes, axis=0, return_counts=True)
        return rows.astype(np.int64), times.astype(np.int64)
    if n_keys > min(_MOST_KEYS, 16 * n_items):
        met, times = np.unique(_keys(codes, base), return_counts=True)
    else:
        counted = np.zeros(n_keys, dtype=np.int64)
        for start in range(0, n_items, _BLOCK):
            keys = _keys(codes[start : start + _BLOCK], base)
            counted += np.bincount(keys, minlength=n_keys)
        met = np.flatnonzero(counted)
        times = counted[met]
    digits = base ** np.arange(n_raters, dtype=np.int64)
    return met[:, None] // digits % base - 1, times.astype(np.int64)


def _keys(codes: Codes, base: int) -> NDArray[np.int64]:
    # Σ_r (code_r + 1) base^r, by Horner's rule
    keys = codes[:, -1].astype(np.int64) + 1
    for column in codes.T[-2::-1]:
        keys *= base
        keys += column
        keys += 1
    return keys
