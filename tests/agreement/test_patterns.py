"""Equal rows of codes put together, however many there are."""

from collections import Counter

import numpy as np
import pytest

from masrel.agreement._counts import distinct_rows


@pytest.mark.parametrize(
    ("n_items", "n_raters", "n_categories"),
    [
        (0, 3, 4),
        (1, 1, 1),
        (40, 5, 4),  # sorted with their keys
        (1024, 3, 2),
        (1025, 3, 2),  # counted in a table of keys
        (1025, 8, 12),  # more keys than that
        (50, 40, 4),  # a key is no integer of 64 bits
    ],
)
def test_every_row_is_counted(n_items: int, n_raters: int, n_categories: int) -> None:
    rng = np.random.default_rng(n_items + n_raters)
    codes = rng.integers(-1, n_categories, (n_items, n_raters), dtype=np.int8)
    codes[: n_items // 3] = codes[:1]
    codes[n_items // 2 : n_items // 2 + 2] = -1
    rows, times = distinct_rows(codes, n_categories)
    assert (rows.dtype, times.dtype) == (np.int64, np.int64)
    found = dict(zip(map(tuple, rows.tolist()), times.tolist(), strict=True))
    assert found == Counter(map(tuple, codes.tolist()))
    if n_items > 1:
        assert (rows[0] == -1).all()  # an item without ratings comes first
