"""From labels to codes: what is accepted, what is missing, what is refused where."""

import numpy as np
import pandas as pd
import pytest

from masrel.agreement import code_ratings, fleiss_kappa

GRADES = ["0", "1", "1+", "2", "3", "4"]


def test_codes_are_positions_in_the_declared_scale() -> None:
    coded = code_ratings([["1+", "4"], ["0", None]], GRADES)
    assert coded.codes.tolist() == [[2, 5], [0, -1]]
    assert (coded.n_items, coded.n_raters, coded.n_categories) == (2, 2, 6)


def test_numbers_are_ordered_by_value_and_not_as_text() -> None:
    assert code_ratings([[10, 9], [2, 10]]).categories == (2, 9, 10)


def test_every_kind_of_missing_value_is_missing() -> None:
    frame = pd.DataFrame({"a": ["x", None], "b": [pd.NA, "y"], "c": [np.nan, "x"]})
    assert code_ratings(frame).codes.tolist() == [[0, -1, -1], [-1, 1, 0]]
    nothing = code_ratings(np.full((2, 2), np.nan), [1, 2])
    assert nothing.codes.tolist() == [[-1, -1], [-1, -1]]
    assert code_ratings(np.array([[1.0, np.nan], [2.0, 1.0]])).codes.tolist() == [
        [0, -1],
        [1, 0],
    ]
    assert code_ratings([[1, pd.NaT], [1, 2]]).codes.tolist() == [[0, -1], [0, 1]]


def test_list_array_and_frame_are_the_same_ratings() -> None:
    rows = [["1", "1+", "1"], ["2", "2", "1+"], ["3", "3", "2"]]
    expected = fleiss_kappa(rows)
    assert fleiss_kappa(np.array(rows)) == expected
    assert fleiss_kappa(pd.DataFrame(rows, columns=["R1", "R2", "R3"])) == expected
    assert fleiss_kappa(pd.DataFrame(rows, dtype="category")) == expected
    assert fleiss_kappa(tuple(map(tuple, rows))) == expected


def test_items_and_raters_without_any_rating_do_not_count() -> None:
    coded = code_ratings([["a", None, "b"], [None, None, None], ["a", None, "a"]])
    assert (coded.n_items, coded.n_raters) == (2, 2)


def test_codes_cannot_be_written_to() -> None:
    coded = code_ratings([["a", "b"]])
    with pytest.raises(ValueError, match="read-only"):
        coded.codes[0, 0] = 1
