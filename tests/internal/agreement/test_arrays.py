"""Arrays and DataFrames become the codes that the plain nested list becomes."""

from typing import Any

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays
from numpy.typing import NDArray

from masrel.agreement import code_ratings
from masrel.agreement._labels import code_type, is_missing
from masrel.errors import RatingsError

INTEGERS = ["i1", "i2", "i4", "i8", "u1", "u2", "u4", "u8"]


def same_as_list(labels: NDArray[Any], categories: list[Any] | None = None) -> bool:
    """Code an array and its nested list; both must have the same labels in place."""
    array = code_ratings(labels, categories)
    plain = code_ratings(labels.tolist(), categories)
    assert array.categories == plain.categories
    assert [type(label) for label in array.categories] == [
        type(label) for label in plain.categories
    ]
    return array.codes.tolist() == plain.codes.tolist()


@given(
    st.data(),
    st.sampled_from(INTEGERS),
    st.sampled_from(["<", ">"]),
    st.sampled_from(["C", "F"]),
)
def test_integers_of_every_width_are_coded_as_their_list(
    data: st.DataObject, kind: str, byte_order: str, layout: str
) -> None:
    # the whole range of the type, so narrow spans, wide ones and both ends occur
    dtype = np.dtype(byte_order + kind)
    shape = arrays.array_shapes(min_dims=2, max_dims=2, max_side=5)
    labels = data.draw(arrays.arrays(dtype, shape))
    assert same_as_list(np.asarray(labels, order=layout))


@pytest.mark.parametrize("kind", INTEGERS)
def test_both_ends_of_an_integer_type(kind: str) -> None:
    ends = np.iinfo(kind)
    labels = np.array([[ends.min, ends.max], [ends.max - 1, ends.min + 1]], dtype=kind)
    assert code_ratings(labels).codes.tolist() == [[0, 3], [2, 1]]
    assert code_ratings(labels).categories == tuple(sorted(labels.ravel().tolist()))


def test_a_span_beyond_the_type_of_the_array_is_not_cut() -> None:
    # -128 and 100 are 228 apart, more than an int8 can say
    labels = np.array([[-128, 100], [5, 100]], dtype=np.int8)
    assert code_ratings(labels).codes.tolist() == [[0, 2], [1, 2]]
    assert code_ratings(labels, [100, -128, 5]).codes.tolist() == [[1, 0], [2, 0]]


def test_every_value_of_a_byte_is_a_category() -> None:
    labels = np.arange(-128, 128).astype(np.int8).reshape(-1, 2)
    assert code_ratings(labels).codes.ravel().tolist() == list(range(256))


@pytest.mark.parametrize("kind", ["i8", "u8"])
def test_integers_that_no_float_tells_apart_stay_apart(kind: str) -> None:
    near = 2**60 + 1
    labels = np.array([[near, near + 2], [near + 1, near]], dtype=kind)
    assert code_ratings(labels).codes.tolist() == [[0, 2], [1, 0]]
    wide = np.array([[0, near], [near + 1, 0]], dtype=kind)
    assert code_ratings(wide).codes.tolist() == [[0, 1], [2, 0]]
    assert code_ratings(wide, [near + 1, near, 0]).codes.tolist() == [[2, 1], [0, 2]]


def test_categories_the_type_cannot_hold_are_never_met() -> None:
    labels = np.array([[200, 255], [201, 0]], dtype=np.uint8)
    scale = [-1, 0, 0.5, 200, 201, 255, 256, 2**70, float("inf")]
    assert code_ratings(labels, scale).codes.tolist() == [[3, 5], [4, 1]]
    wide = np.array([[0, 2**40]])
    assert code_ratings(wide, [2**40, 0.5, 2**70, 0]).codes.tolist() == [[3, 0]]


@given(
    arrays.arrays(
        st.sampled_from(["f2", "<f4", ">f4", "<f8", ">f8"]),
        arrays.array_shapes(min_dims=2, max_dims=2, max_side=5),
        elements=st.one_of(
            st.sampled_from([0.0, 1.0, 2.0, -3.0, 0.5, float("inf"), -float("inf")]),
            st.just(float("nan")),
            st.floats(width=16),
        ),
    )
)
def test_floats_are_coded_as_their_list(labels: NDArray[Any]) -> None:
    assert same_as_list(labels)


@pytest.mark.parametrize(
    ("labels", "codes"),
    [
        ([[np.inf, np.inf]], [[0, 0]]),
        ([[np.inf, -np.inf], [np.nan, 0.0]], [[2, 0], [-1, 1]]),
        ([[1e308, -1e308]], [[1, 0]]),
        ([[np.nan, np.nan]], [[-1, -1]]),
        ([[0.0, -0.0], [1.0, 0.0]], [[0, 0], [1, 0]]),
        ([[-2.0, -1.0], [-3.0, -2.0]], [[1, 2], [0, 1]]),
    ],
)
def test_infinite_huge_missing_and_negative_floats(
    labels: list[list[float]], codes: list[list[int]]
) -> None:
    assert code_ratings(np.array(labels)).codes.tolist() == codes
    assert code_ratings(labels).codes.tolist() == codes


@pytest.mark.parametrize("stranger", [np.inf, -np.inf, 1e300, 1.5, 0.0, 4.0])
def test_a_number_of_no_category_is_refused_without_noise(stranger: float) -> None:
    labels = np.array([[1.0, 2.0], [3.0, np.nan], [2.0, stranger]])
    with pytest.raises(RatingsError, match="row 2, column 1: needs one of 1, 2, 3"):
        code_ratings(labels, [1, 2, 3])


@st.composite
def text_arrays(draw: st.DrawFn) -> NDArray[Any]:
    width = draw(st.sampled_from([1, 2, 3, 10]))
    shape = draw(arrays.array_shapes(min_dims=2, max_dims=2, max_side=5))
    letters = st.text("01+23aé\U0001d538", min_size=1, max_size=min(width, 3))
    dtype = draw(st.sampled_from("<>")) + f"U{width}"
    return draw(arrays.arrays(dtype, shape, elements=letters))


@given(text_arrays())
def test_text_of_every_width_is_coded_as_its_list(labels: NDArray[Any]) -> None:
    assert same_as_list(labels)


@pytest.mark.parametrize("dtype", ["<U1", "<U2", ">U2", "<U10", "O"])
def test_categories_wider_than_the_array_are_not_cut_to_it(dtype: str) -> None:
    # cut to one letter, "1+" would be "1"
    labels = np.array([["1", "2"], ["2", "1"]], dtype=dtype)
    scale = ["1+", "1", "20", "2"]
    assert code_ratings(labels, scale).codes.tolist() == [[1, 3], [3, 1]]
    with pytest.raises(RatingsError, match="row 0, column 0: needs one of '1\\+'"):
        code_ratings(labels, ["1+", "20"])


def test_objects_and_truth_values_are_coded_as_their_list() -> None:
    mixed = np.array([["1+", None], ["2", "1"]], dtype=object)
    assert same_as_list(mixed)
    assert same_as_list(mixed, ["1", "1+", "2"])
    truths = np.array([[True, False], [False, False]])
    assert code_ratings(truths).codes.tolist() == [[1, 0], [0, 0]]
    assert same_as_list(truths)
    assert same_as_list(np.array([[3, None], [10, float("nan")]], dtype=object))


def test_numbers_on_a_scale_of_text_are_refused_and_not_converted() -> None:
    for labels in (np.array([[1, 2]]), np.array([[1.0, 2.0]])):
        with pytest.raises(RatingsError, match="row 0, column 0: needs one of '1'"):
            code_ratings(labels, ["1", "2"])
    with pytest.raises(RatingsError, match="row 0, column 0: needs one of 1, 2"):
        code_ratings(np.array([["1", "2"]]), [1, 2])


@pytest.mark.parametrize("dtype", ["i1", "i8", "f8", "<U1", "<U3", "O"])
def test_views_that_are_reversed_stepped_or_read_only(dtype: str) -> None:
    whole = np.array([[3, 1, 2, 1], [1, 2, 3, 3], [2, 2, 1, 3]]).astype(dtype)
    for labels in (whole[::-1, ::2], whole.T, whole[:, ::-1], np.asfortranarray(whole)):
        labels.setflags(write=False)
        assert same_as_list(labels)
        assert not labels.flags.writeable


@pytest.mark.parametrize("dtype", ["i2", "i8", "f8", "<U1", "<U4"])
def test_a_label_first_met_in_the_last_row_of_many(dtype: str) -> None:
    # more labels than one block holds; the middle category is the last one met
    labels = np.full((70_000, 2), 1).astype(dtype)
    labels[1::2] = np.array(3).astype(dtype)
    labels[-1, 1] = np.array(2).astype(dtype)
    coded = code_ratings(labels)
    assert len(coded.categories) == 3
    assert coded.codes[:2].tolist() == [[0, 0], [2, 2]]
    assert coded.codes[-1].tolist() == [2, 1]
    assert np.bincount(coded.codes.ravel()).tolist() == [70_000, 1, 69_999]


def test_wide_integers_first_met_in_the_last_row_of_many() -> None:
    labels = np.full((70_000, 2), 10**12)
    labels[-1, 0] = -7
    coded = code_ratings(labels)
    assert coded.categories == (-7, 10**12)
    assert coded.codes[[0, -1]].tolist() == [[1, 1], [0, 1]]


@pytest.mark.parametrize("dtype", ["i1", "i8", "f8", "<U1", "<U9", "O"])
def test_an_unknown_label_in_the_last_row_is_named_with_its_place(dtype: str) -> None:
    labels = np.full((40_000, 2), 1).astype(dtype)
    labels[-1, 1] = np.array(7).astype(dtype).item()
    scale = ["1", "2"] if dtype in ("<U1", "<U9") else [1, 2]
    with pytest.raises(RatingsError, match=r"row 39999, column 1.*got '?7"):
        code_ratings(labels, scale)


def test_more_categories_need_wider_codes() -> None:
    assert [code_type(n) for n in (127, 128, 32_767, 32_768)] == [
        np.int8,
        np.int16,
        np.int16,
        np.int32,
    ]
    for n in (127, 128, 200):
        labels = np.arange(2 * n).reshape(n, 2) % n
        assert same_as_list(labels)
        assert same_as_list(labels.astype(str))
        assert same_as_list(labels * 0.5)


def test_categorical_columns_of_different_categories_in_different_order() -> None:
    frame = pd.DataFrame(
        {
            "A": pd.Categorical(["1", "2", None], categories=["2", "1"]),
            "B": pd.Categorical(["1+", "1", "1"], categories=["1+", "1", "4"]),
        }
    )
    coded = code_ratings(frame)
    assert coded.categories == ("1", "1+", "2")  # "4" was given to nothing
    assert coded.codes.tolist() == [[0, 1], [2, 0], [-1, 0]]
    declared = code_ratings(frame, ["2", "4", "1", "1+"])
    assert declared.codes.tolist() == [[2, 3], [0, 2], [-1, 2]]
    with pytest.raises(RatingsError, match="row 1, column 0: needs one of '1', '1\\+'"):
        code_ratings(frame, ["1", "1+"])


@pytest.mark.parametrize("dtype", ["string", "object", "category"])
def test_frames_of_text(dtype: str) -> None:
    rows = [["1", "1+"], ["2", None], ["1+", "1"]]
    frame = pd.DataFrame(rows, dtype=dtype)
    assert code_ratings(frame).codes.tolist() == [[0, 1], [2, -1], [1, 0]]
    scale = ["2", "1+", "1"]
    assert code_ratings(frame, scale).codes.tolist() == [[2, 1], [0, -1], [1, 2]]


@pytest.mark.parametrize("dtype", ["int8", "int64", "float64", "Int64", "category"])
def test_frames_of_numbers(dtype: str) -> None:
    frame = pd.DataFrame({"A": [10, 2, 9], "B": [2, 9, 9]}).astype(dtype)
    assert code_ratings(frame).codes.tolist() == [[2, 0], [0, 1], [1, 1]]
    assert code_ratings(frame).categories == (2, 9, 10)


def test_columns_of_numbers_and_of_text_are_not_mixed() -> None:
    with pytest.raises(RatingsError, match="text and numbers cannot be mixed"):
        code_ratings(pd.DataFrame({"A": [1, 2], "B": ["1", "2"]}))


@pytest.mark.parametrize("shape", [(0, 2), (2, 0)])
def test_frames_and_arrays_without_a_rating_are_refused(shape: tuple[int, int]) -> None:
    with pytest.raises(RatingsError, match="at least one item and one rater"):
        code_ratings(np.zeros(shape))
    with pytest.raises(RatingsError, match="at least one item and one rater"):
        code_ratings(pd.DataFrame(np.zeros(shape)))


def test_labels_that_are_neither_text_nor_numbers_are_refused() -> None:
    for labels in (np.array([[b"a", b"b"]]), np.array([["2020-01-01"]], dtype="M8[D]")):
        with pytest.raises(RatingsError, match="text or numbers"):
            code_ratings(labels)


@pytest.mark.parametrize(
    ("label", "missing"),
    [
        (None, True),
        (float("nan"), True),
        (np.float32("nan"), True),
        (pd.NA, True),
        (pd.NaT, True),
        (0, False),
        ("", False),
        ("nan", False),
        (float("inf"), False),
        (np.bool_(False), False),
    ],
)
def test_what_is_missing_and_what_is_not(label: object, missing: bool) -> None:
    assert is_missing(label) is missing
