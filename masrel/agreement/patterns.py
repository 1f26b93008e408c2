"""Distinct rows of codes, rater by rater, with how often each occurs."""

import numpy as np
from numpy.typing import NDArray

from masrel.agreement.coding import Codes

__all__ = ["distinct_patterns"]

Integers = NDArray[np.int64]

_MOST_KEYS = 1 << 22  # patterns that are counted in a table rather than sorted
_BLOCK = 1 << 16  # items counted at once, so that they stay in the cache
_FEW = 1 << 10  # items for which one call costs less than a few for each rater


def distinct_patterns(codes: Codes, n_categories: int) -> tuple[Integers, Integers]:
    """Put equal rows of codes together."""
    # Takes codes (n_items, n_raters)
    n_items, n_raters = codes.shape
    base = n_categories + 1
    n_keys = base**n_raters  # a row is one number with n_raters digits
    if n_keys > 2**62:
        rows, times = np.unique(codes, axis=0, return_counts=True)
        return rows.astype(np.int64), times.astype(np.int64)
    if n_items <= _FEW:
        return _sorted(codes, _keys(codes, base))
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


def _sorted(codes: Codes, keys: Integers) -> tuple[Integers, Integers]:
    # distinct rows in the order of their keys, by the last of those that are equal
    order = keys.argsort()
    ascending = keys[order]
    is_last = np.ones(keys.size, dtype=bool)
    np.not_equal(ascending[1:], ascending[:-1], out=is_last[:-1])
    (last,) = is_last.nonzero()
    times = last + 1
    times[1:] -= times[:-1]  # numpy sees that they overlap
    return codes[order[last]].astype(np.int64), times


def _keys(codes: Codes, base: int) -> Integers:
    # Σ_r (code_r + 1) base^r, of many items by Horner's rule
    if len(codes) <= _FEW:
        digits = base ** np.arange(codes.shape[1], dtype=np.int64)
        return np.asarray((codes.astype(np.int64) + 1) @ digits, dtype=np.int64)
    keys = codes[:, -1].astype(np.int64) + 1
    for column in codes.T[-2::-1]:
        keys *= base
        keys += column
        keys += 1
    return keys
