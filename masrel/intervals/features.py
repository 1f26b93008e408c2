"""The features of items, whose sums are what a coefficient depends on."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from masrel.agreement import CodedRatings
from masrel.agreement._kernel import Floats, Kernel

__all__ = ["blocks", "features_of"]

_BLOCK = 1 << 14  # items at once: what is made of them takes more room than they do


def blocks(n_items: int) -> Iterator[slice]:
    """Cut items into blocks, so that what is made of them stays small."""
    for start in range(0, n_items, _BLOCK):
        yield slice(start, min(start + _BLOCK, n_items))


def features_of(kernel: Kernel, coded: CodedRatings, v: Floats) -> Floats:
    """Return the features of items, made a block at a time."""
    # v (n_categories, n_categories) -> (n_items, n_features)
    n_items = len(coded.codes)
    if n_items <= _BLOCK:
        return kernel.features(coded, v)
    found = None
    for items in blocks(n_items):
        rows = kernel.features(replace(coded, codes=coded.codes[items]), v)
        if found is None:
            found = np.empty((n_items, rows.shape[1]))
        found[items] = rows
    return np.asarray(found)
