"""Matrices and pairs hold each rating where its item and rater say."""

import pytest

from masrel.errors import RatingsError
from masrel.lab.ratings import Ratings, rating_matrix, ratings_from_rows, retest_pairs
from masrel.scales import MODIFIED_ASHWORTH


def made(*rows: tuple[str, str, str, str | None]) -> Ratings:
    names = ("session", "rater", "model", "grade")
    return ratings_from_rows(
        [dict(zip(names, row, strict=True)) for row in rows], MODIFIED_ASHWORTH
    )


STUDY = made(
    ("test", "B", "HM2", "1+"),
    ("test", "B", "HM1", "1"),
    ("test", "A", "HM1", "2"),
    ("test", "A", "HM2", None),
    ("test", "C", "HM1", "0"),
    ("retest", "A", "HM1", "3"),
    ("retest", "B", "HM2", "1"),
    ("retest", "B", "HM1", "1"),
    ("retest", "D", "HM1", "1"),
)


def test_a_matrix_is_item_by_rater_of_one_session() -> None:
    models = ["HM1", "HM2", "HM3"]
    matrix = rating_matrix(STUDY, session="test", models=models)
    assert (matrix.items, matrix.raters) == (tuple(models), ("B", "A", "C"))
    rows = {"HM1": ["1", "2", "0"], "HM2": ["1+", None, None], "HM3": [None] * 3}
    assert (matrix.grades, matrix.n_missing) == ([*rows.values()], 5)
    as_they_come = rating_matrix(STUDY, session="test")  # without models
    assert as_they_come.items == ("HM2", "HM1")
    assert as_they_come.grades == [rows["HM2"], rows["HM1"]]


def test_pairs_are_of_raters_of_both_sessions() -> None:
    pairs = retest_pairs(STUDY, first="test", second="retest", models=["HM1", "HM2"])
    assert (pairs.raters, pairs.n_missing) == (("B", "A"), 1)
    assert pairs.pairs == [[["1", "1"], ["1+", "1"]], [["2", "3"], [None, None]]]
    apart = made(("a", "R1", "HM1", "1"), ("b", "R2", "HM1", "1"))
    none = retest_pairs(apart, first="a", second="b")  # which is no error
    assert (none.raters, none.items, none.pairs) == ((), ("HM1",), [])


def test_repeats_are_items_of_their_own() -> None:
    rows = [
        {"rater": r, "model": "HM1", "repeat": n, "grade": g}
        for r, n, g in [("A", 1, "1"), ("A", 2, "2"), ("B", 2, "3")]
    ]
    matrix = rating_matrix(ratings_from_rows(rows, MODIFIED_ASHWORTH), session="test")
    assert matrix.items == ("HM1", "HM1#2")
    assert matrix.grades == [["1", None], ["2", "3"]]


def test_an_unknown_session_names_those_there_are() -> None:
    with pytest.raises(RatingsError, match="'third', there are test, retest"):
        rating_matrix(STUDY, session="third")
    with pytest.raises(RatingsError, match="'third'"):
        retest_pairs(STUDY, first="test", second="third")
    with pytest.raises(RatingsError, match="'test' twice"):
        retest_pairs(STUDY, first="test", second="test")
