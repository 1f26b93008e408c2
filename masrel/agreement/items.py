"""Distinct items, each with how often it occurs.

An item is a row of counts: how many raters put it into each category. Few of them are
summed in Python integers, many in numpy; both give the same sums.
"""

import numpy as np
from numpy.typing import NDArray

from masrel.agreement.few_items import FewItems
from masrel.agreement.many_items import ManyItems

__all__ = ["FewItems", "ItemTable", "ManyItems", "item_table"]

Integers = NDArray[np.int64]

_FEW = 4_000  # counts that Python sums about as fast as numpy

ItemTable = FewItems | ManyItems
"""Distinct items with how often each occurs."""


def item_table(counts: Integers, times: Integers | None = None) -> ItemTable:
    """Choose how distinct items are kept."""
    # Takes counts (n_rows, n_categories), times (n_rows,)
    if counts.size <= _FEW:
        how_often = [1] * len(counts) if times is None else times.tolist()
        return FewItems(counts.tolist(), how_often, counts.shape[1])
    if times is None:
        times = np.ones(len(counts), dtype=np.int64)
    return ManyItems(counts, times)
