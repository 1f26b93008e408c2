"""Long tables: one row a rating, arranged item by rater."""

import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from masrel.agreement import code_long, code_ratings
from masrel.agreement._codes import Repeated
from masrel.errors import RatingsError

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


TWICE = long(("x", "A", "1"), ("x", "B", "2"), ("x", "A", "3"), ("y", "A", "2"))


def test_a_repeated_rating_is_refused_by_name() -> None:
    with pytest.raises(RatingsError, match="'x' by 'A'; repeated=\"first\" or"):
        code_long(TWICE)


@pytest.mark.parametrize(("policy", "kept"), [("first", 0), ("last", 3)])
def test_a_named_policy_keeps_one_of_them(policy: Repeated, kept: int) -> None:
    coded = code_long(TWICE, categories=SCALE, repeated=policy)
    assert coded.codes.tolist() == [[kept, 2], [2, -1]]


def test_sets_of_labels_are_categories_as_of_a_wide_table() -> None:
    frame = long(("x", "A", {"b", "a"}), ("x", "B", {"a"}), ("y", "A", set()))
    wide = code_ratings([[{"a", "b"}, {"a"}], [set(), None]])
    coded = code_long(frame)
    assert coded == wide
    assert coded.codes.tolist() == wide.codes.tolist()
    with pytest.raises(RatingsError, match="row 1, column 'grade'"):
        code_long(long(("x", "A", {"a"}), ("x", "B", ["a"])))
