"""Distinct items and rows, counted in whichever way, are those of a plain count."""

from collections import Counter
from typing import Literal

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from masrel.agreement import (
    COEFFICIENTS,
    CodedRatings,
    _counts,
    code_ratings,
    count_ratings,
    declared_weights,
    fleiss_kappa,
    fleiss_kappa_from_counts,
    krippendorff_alpha_from_counts,
    percent_agreement_from_counts,
)
from masrel.agreement._count_tables import (
    check_counts,
    check_table,
    column_categories,
    count_items,
)
from masrel.agreement._counts import DistinctItems, bilinear, distinct_rows, item_counts
from masrel.errors import CountsError, ParameterError

Codes = NDArray[np.int8]


def coded(codes: Codes, n_categories: int) -> CodedRatings:
    return CodedRatings(codes=codes, categories=tuple(range(n_categories)))


def random_codes(
    n_items: int, n_raters: int, n_categories: int, seed: int = 1
) -> Codes:
    rng = np.random.Generator(np.random.PCG64(seed))
    return rng.integers(-1, n_categories, (n_items, n_raters)).astype(np.int8)


def plain_count(codes: Codes, n_categories: int) -> Counter[tuple[int, ...]]:
    """Count items with a rating by what the word means: rating after rating."""
    counted = Counter(
        tuple(row.count(k) for k in range(n_categories)) for row in codes.tolist()
    )
    del counted[(0,) * n_categories]
    return counted


def frequencies(items: DistinctItems) -> Counter[tuple[int, ...]]:
    counted: Counter[tuple[int, ...]] = Counter()
    for row, n in zip(items.rows, items.freq, strict=True):
        counted[tuple(map(int, row))] += int(n)
    return counted


SHAPES = [
    # items, raters, categories; n_raters + 1 to the power n_categories keys
    (1, 1, 1),
    (30, 3, 4),  # few: counted in Python
    (2_001, 1, 3),  # just more than few
    (5_000, 3, 4),  # 4⁴ keys: a table of keys
    (70_000, 2, 3),  # more than one block
    (40_000, 5, 4),  # 5⁵ rows: keys of rows before keys of items
    (1_000, 8, 4),  # 9⁴ keys of at most 16 000
    (1_000, 5, 9),  # 6⁹ keys: too many, counted category by category
    (1_000, 3, 30),  # more categories than raters
    (900, 40, 12),  # 41¹² keys are more than 64 bits hold
]


@pytest.mark.parametrize("shape", SHAPES)
def test_distinct_items_are_those_of_a_plain_count(
    shape: tuple[int, int, int],
) -> None:
    codes = random_codes(*shape)
    table = DistinctItems.of_codes(coded(codes, shape[2]))
    assert table.n_categories == shape[2]
    assert frequencies(table) == plain_count(codes, shape[2])


@given(
    st.lists(st.lists(st.integers(-1, 2), min_size=3, max_size=3), min_size=1),
)
def test_counts_of_items_are_those_of_a_plain_count(rows: list[list[int]]) -> None:
    codes = np.array(rows, dtype=np.int8)
    counts = item_counts(coded(codes, 3))
    assert [tuple(row) for row in counts.tolist()] == [
        tuple(row.count(k) for k in range(3)) for row in rows
    ]
    assert frequencies(count_items(counts).items) == plain_count(codes, 3)


@pytest.mark.parametrize("largest", [1, 9, 40, 10_000])
def test_equal_rows_of_a_table_of_counts_are_put_together(largest: int) -> None:
    # bases 2, 10 (10⁴ keys), and 41 and 10 001, beyond the table of keys in 5 columns
    rng = np.random.Generator(np.random.PCG64(2))
    counts = rng.integers(0, largest + 1, (1_500, 5))
    counts[0, 0] = largest
    expected = Counter(map(tuple, counts.tolist()))
    del expected[(0,) * 5]
    assert frequencies(count_items(counts).items) == expected


@pytest.mark.parametrize("shape", [*SHAPES[:7], (300, 40, 4), (300, 70, 126)])
def test_distinct_rows_are_those_of_a_plain_count(
    shape: tuple[int, int, int],
) -> None:
    codes = random_codes(*shape)
    rows, freq = distinct_rows(codes, shape[2])
    assert rows.dtype == freq.dtype == np.int64
    pairs = zip(map(tuple, rows.tolist()), freq.tolist(), strict=True)
    assert dict(pairs) == Counter(map(tuple, codes.tolist()))


def test_a_pattern_of_missing_ratings_and_of_the_last_category_come_back() -> None:
    codes = np.array([[-1, -1, -1], [3, 3, 3], [-1, 3, -1], [3, 3, 3]], dtype=np.int8)
    rows, freq = distinct_rows(codes, 4)
    assert sorted(zip(rows.tolist(), freq.tolist(), strict=True)) == [
        ([-1, -1, -1], 1),
        ([-1, 3, -1], 1),
        ([3, 3, 3], 2),
    ]


@pytest.mark.parametrize("order", ["C", "F"])
@pytest.mark.parametrize("lowest", [-1, 0])
@pytest.mark.parametrize(
    ("n_items", "n_raters", "n_categories"),
    [(140_000, 16, 2), (9_000, 3, 12), (3_000, 10, 1)],
)
def test_rows_in_products_of_floats_come_in_order_and_complete(
    n_items: int,
    n_raters: int,
    n_categories: int,
    lowest: int,
    order: Literal["C", "F"],
) -> None:
    # 2¹⁶ keys without a missing rating; the largest key of all is among them
    rng = np.random.default_rng(n_items + lowest)
    codes = rng.integers(lowest, n_categories, (n_items, n_raters), dtype=np.int8)
    codes[-1] = n_categories - 1
    rows, freq = distinct_rows(np.asarray(codes, order=order), n_categories)
    keys = (codes + 1) @ (n_categories + 1) ** np.arange(n_raters)
    _, first, often = np.unique(keys, return_index=True, return_counts=True)
    assert np.array_equal(rows, codes[first])
    assert np.array_equal(freq, often)


NAMES = ["identity", "linear", "quadratic", "radical"]


@pytest.mark.parametrize("name", NAMES)
def test_few_and_many_items_have_the_same_sums(name: str) -> None:
    counts = item_counts(coded(random_codes(200, 4, 3), 3))
    counts = counts[counts.any(axis=1)]
    freq = np.arange(len(counts)) % 5 + 1
    few = DistinctItems(list(map(tuple, counts.tolist())), freq.tolist(), 3)
    many = DistinctItems(counts, freq, 3)
    v = declared_weights(name, [1, 2, 4])  # type: ignore[arg-type]
    assert few.sums(v) == many.sums(v)
    assert [group.size for group in few.sums(v).groups] == [1, 2, 3, 4]


@pytest.mark.parametrize("name", NAMES)
def test_bilinear_sums_are_those_of_the_matrix(name: str) -> None:
    v = declared_weights(name, [1, 2, 4, 7])  # type: ignore[arg-type]
    x, y = np.array([3, 0, 2, 5]), np.array([1, 4, 0, 2])
    assert float(bilinear(v, x.tolist(), y.tolist()) / v.denominator) == pytest.approx(
        float(x @ v.floats @ y), rel=1e-15
    )
    assert v.total / v.denominator == pytest.approx(v.floats.sum(), rel=1e-15)


def test_sums_by_hand() -> None:
    # (2, 0), (1, 1) twice and (0, 1): pairs that differ: 0, 2, 2
    items = DistinctItems([(2, 0), (1, 1), (0, 1)], [1, 2, 1], 2)
    sums = items.sums(declared_weights("identity", ["a", "b"]))
    one, two = sums.groups
    assert (one.size, one.n_items, one.totals, one.disagreement) == (1, 1, [0, 1], 0)
    assert (two.size, two.n_items, two.totals, two.disagreement) == (2, 3, [4, 2], 4)
    assert (sums.n_rated, sums.n_usable) == (4, 3)
    assert sums.observed * 3 == sums.denominator * 2  # D_o = (0 + 1 + 1)/3
    # shares, each a half: 2/2 + 1/2 + 1/2 of 4 items, and 1/2 + 1/2 + 1/1
    assert sums.marginals == [sums.total // 2, sums.total // 2]


def test_sums_that_pass_64_bits_stay_exact() -> None:
    # sizes of 2³², squared 2⁶⁴: n² Σ t = 3 · 2⁶⁴, of which a² + b² agree
    a, b = 2**32 - 1, 1
    items = DistinctItems.of_arrays(np.array([[a, b]] * 150), np.full(150, 3))
    for name in ("identity", "linear"):
        (group,) = items.sums(declared_weights(name, [0, 1])).groups  # type: ignore[arg-type]
        assert group.disagreement == 150 * 3 * 2 * a * b
        assert group.totals == [450 * a, 450 * b]


def test_coefficients_of_huge_counts_are_exact() -> None:
    # P of (a, a) is 2 (a choose 2)/(2a choose 2) = (a - 1)/(2a - 1)
    a = 2**40
    counts = [[a, a]] * 2_500  # many
    assert percent_agreement_from_counts(counts).value == (a - 1) / (2 * a - 1)
    few = percent_agreement_from_counts(counts[:2])
    assert few.value == (a - 1) / (2 * a - 1)


@pytest.mark.parametrize(
    "name",
    [
        entry.name
        for entry in COEFFICIENTS.values()
        if entry.weighted and entry.shape == "ratings" and entry.n_raters[1] is None
    ],
)
def test_items_in_arrays_and_in_integers_give_the_same(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    rows = coded(random_codes(1_000, 7, 6, seed=3), 6)
    for weights in ("identity", "quadratic"):
        both = []
        for few, kind in ((0, np.ndarray), (10**9, list)):
            with monkeypatch.context() as patched:
                patched.setattr(_counts, "FEW", few)
                assert isinstance(DistinctItems.of_codes(rows).rows, kind)
                both.append(COEFFICIENTS[name](rows, weights=weights))  # type: ignore[arg-type]
        in_arrays, exact = both
        assert in_arrays.value == exact.value
        assert in_arrays.standard_error == pytest.approx(
            exact.standard_error, rel=1e-12
        )


def test_counts_and_ratings_give_the_same() -> None:
    rows = random_codes(25, 3, 3, seed=4)
    counts = item_counts(coded(rows, 3))
    from_counts = fleiss_kappa_from_counts(counts)
    from_ratings = fleiss_kappa(coded(rows, 3))
    assert from_counts == from_ratings


def test_counted_ratings_are_counted_once() -> None:
    counted = count_ratings([["a", "b"], ["b", "b"]])
    assert count_ratings(counted) is counted
    assert code_ratings(counted) is counted.coded
    assert (counted.n_raters, counted.coded.n_items) == (2, 2)


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
    rows, freq = distinct_rows(codes, n_categories)
    assert (rows.dtype, freq.dtype) == (np.int64, np.int64)
    counted = dict(zip(map(tuple, rows.tolist()), freq.tolist(), strict=True))
    assert counted == Counter(map(tuple, codes.tolist()))
    if n_items > 1:
        assert (rows[0] == -1).all()  # an item without ratings comes first


@pytest.mark.parametrize(
    ("counts", "said"),
    [
        ([[1, 2.5]], "row 0, column 1: needs a whole number of at least 0 .* got 2.5"),
        ([[1, 2], [0, -3]], "row 1, column 1.*got -3"),
        ([[1, float("inf")]], "got inf"),
        ([[1, 2.0**53]], r"below 2\^53"),
        ([[True, False]], "needs whole numbers, got bool"),
        (np.zeros((0, 2)), r"at least one of each, got shape \(0, 2\)"),
        ([1, 2, 3], "needs a table"),
    ],
)
def test_what_are_no_counts_is_refused_with_its_place(
    counts: object, said: str
) -> None:
    with pytest.raises(CountsError, match=said):
        check_counts(counts)  # type: ignore[arg-type]


def test_whole_floats_are_counts() -> None:
    assert check_counts([[1.0, 2.0]]).dtype == np.int64
    assert check_table(np.eye(2)).tolist() == [[1, 0], [0, 1]]


def test_as_many_categories_as_columns() -> None:
    assert list(column_categories(None, 3)) == [1, 2, 3]
    with pytest.raises(ParameterError, match=r"needs 2, one per column.*got 3"):
        krippendorff_alpha_from_counts([[1, 1]], categories=["a", "b", "c"])
