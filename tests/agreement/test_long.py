"""Long tables: one row a rating, arranged item by rater."""

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from masrel.agreement import code_long, fleiss_kappa
from masrel.agreement._codes import Repeated
from masrel.errors import ParameterError, RatingsError

SCALE = ["1", "1+", "2", "3"]


def long(*rows: tuple[object, object, object]) -> pd.DataFrame:
    return pd.DataFrame(list(rows), columns=["item", "rater", "grade"])


def test_items_and_raters_are_in_the_order_in_which_they_are_met() -> None:
    frame = long(("y", "B", "2"), ("x", "A", "1"), ("y", "A", "1+"), ("x", "B", "3"))
    coded = code_long(frame, categories=SCALE)
    # rows y, x; columns B, A
    assert coded.codes.tolist() == [[2, 1], [3, 0]]
    assert coded.categories == tuple(SCALE)


def test_a_rating_that_is_not_there_or_empty_is_missing() -> None:
    frame = long(("x", "A", "1"), ("x", "B", None), ("y", "B", "2"), ("z", "A", None))
    coded = code_long(frame, categories=SCALE)
    assert coded.codes.tolist() == [[0, -1], [-1, 2], [-1, -1]]
    assert (coded.n_items, coded.n_raters) == (2, 2)


@given(st.data())
def test_a_long_table_gives_what_the_wide_one_gives(data: st.DataObject) -> None:
    grade = st.sampled_from([*SCALE, None])
    wide = data.draw(
        st.lists(st.lists(grade, min_size=3, max_size=3), min_size=2, max_size=6)
    )
    cells = [(i, j, g) for i, row in enumerate(wide) for j, g in enumerate(row)]
    shuffled = data.draw(st.permutations(cells[3:]))
    # the first item's rows stay first, so that raters keep their order
    coded = code_long(long(*cells[:3], *shuffled), categories=SCALE)
    position = {g: k for k, g in enumerate(SCALE)} | {None: -1}
    expected = sorted([position[g] for g in row] for row in wide[1:])
    assert coded.codes[0].tolist() == [position[g] for g in wide[0]]
    assert sorted(coded.codes[1:].tolist()) == expected


@pytest.mark.parametrize("dtype", ["object", "string", "category"])
def test_grades_of_every_type_of_column(dtype: str) -> None:
    frame = long(("x", "A", "1+"), ("x", "B", "2"), ("y", "A", None), ("y", "B", "1"))
    coded = code_long(frame.astype({"grade": dtype}))
    assert coded.categories == ("1", "1+", "2")
    assert coded.codes.tolist() == [[1, 2], [-1, 0]]


def test_numbers_are_graded_by_value() -> None:
    frame = long(("x", 1, 10), ("x", 2, 9), ("y", 1, 2), ("y", 2, np.nan))
    assert code_long(frame).categories == (2, 9, 10)
    assert code_long(frame).codes.tolist() == [[2, 1], [0, -1]]


def test_columns_of_other_names() -> None:
    frame = long(("x", "A", "1"), ("x", "B", "2")).rename(
        columns={"item": "patient", "rater": "who", "grade": "MAS"}
    )
    coded = code_long(frame, item="patient", rater="who", grade="MAS")
    assert coded.codes.tolist() == [[0, 1]]


def test_every_coefficient_takes_the_codes() -> None:
    frame = long(("x", "A", "a"), ("x", "B", "a"), ("y", "A", "b"), ("y", "B", "b"))
    assert fleiss_kappa(code_long(frame)).value == 1.0


TWICE = long(("x", "A", "1"), ("x", "B", "2"), ("x", "A", "3"), ("y", "A", "2"))


def test_a_repeated_rating_is_refused_by_name() -> None:
    with pytest.raises(RatingsError, match="'x' by 'A'; repeated=\"first\" or"):
        code_long(TWICE)


def test_many_repeated_ratings_are_counted() -> None:
    rows = [(i, "A", "1") for i in range(7)] * 2
    with pytest.raises(RatingsError, match=r"once: 0 by 'A'; .*4 by 'A' and 2 more; "):
        code_long(long(*rows))


@pytest.mark.parametrize(("policy", "kept"), [("first", 0), ("last", 3)])
def test_a_named_policy_keeps_one_of_them(policy: Repeated, kept: int) -> None:
    coded = code_long(TWICE, categories=SCALE, repeated=policy)
    assert coded.codes.tolist() == [[kept, 2], [2, -1]]


def test_a_mistyped_policy_gets_one_sentence() -> None:
    with pytest.raises(ParameterError, match="one of error, first, last, got 'mean'"):
        code_long(TWICE, repeated="mean")  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("frame", "said"),
    [
        (long(("x", "A", "1")).drop(columns="rater"), "needs a column 'rater', got"),
        (long((None, "A", "1")), "row 0, column 'item': needs a name, got none"),
        (long(("x", "A", "1"), ("x", None, "1")), "row 1, column 'rater'"),
        (long(("x", "A", "1"), ("x", "B", "4")), "row 1, column 'grade': .*got '4'"),
        (long(), "at least one item and one rater"),
    ],
)
def test_what_is_no_long_table_is_refused(frame: pd.DataFrame, said: str) -> None:
    with pytest.raises(RatingsError, match=said):
        code_long(frame, categories=SCALE)


def test_text_and_numbers_are_not_mixed() -> None:
    with pytest.raises(RatingsError, match="text and numbers cannot be mixed"):
        code_long(long(("x", "A", "1"), ("x", "B", 1)))


def test_codes_cannot_be_written_to() -> None:
    coded = code_long(long(("x", "A", "1")))
    with pytest.raises(ValueError, match="read-only"):
        coded.codes[0, 0] = 1
