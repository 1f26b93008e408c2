"""Grades against the intended ones and those given in person, beyond Table V."""

import dataclasses
import math

import pytest

from masrel.errors import RatingsError
from masrel.lab.analysis import InPersonAgreement, IntendedAgreement, analyze
from masrel.lab.ratings import InPerson, Ratings
from tests.lab.analysis.studies import in_person, of_session, protocol_with, ratings


def intended(rows: Ratings) -> IntendedAgreement:
    """What an analysis says of intended grades."""
    result = analyze(protocol_with(sections=("intended",)), rows).intended
    assert result is not None
    return result


def paired(rows: Ratings, grades: InPerson | None) -> InPersonAgreement:
    """What an analysis says of grades in person."""
    protocol = protocol_with(sections=("in-person",))
    result = analyze(protocol, rows, in_person=grades).in_person
    assert result is not None
    return result


def without_haptic_grades() -> InPerson:
    """Table IV as if the grades of the models were not printed beside."""
    table = in_person()
    rows = [row for row in table.rows if row.source_table == "IV"]
    bare = (dataclasses.replace(row, haptic_grade=None) for row in rows)
    return dataclasses.replace(table, rows=tuple(bare))


def test_a_model_without_ratings_has_no_percentage() -> None:
    found = intended(ratings(*of_session("test", R1=("1", "1"))))
    by_model = {row.model: row for row in found.models}
    assert by_model["HM1"].percent == 100.0
    assert by_model["HM2"].percent == 0.0
    assert math.isnan(by_model["HM3"].percent)
    assert by_model["HM3"].n_ratings == 0
    # over HM1 and HM2: mean 50, deviations 50 and -50, sd sqrt(5000 / 1)
    assert found.mean == 50.0
    assert found.sd == pytest.approx(math.sqrt(5000.0), abs=1e-12)


def test_one_model_has_a_mean_and_no_deviation() -> None:
    found = intended(ratings(("test", "R1", "HM1", "1")))
    assert found.mean == 100.0
    assert math.isnan(found.sd)
    assert found.reason == "one model has no standard deviation over models"


def test_a_missing_grade_is_no_rating() -> None:
    gap = ratings(*of_session("test", R1=("1",), R2=(None,)))
    (hm1, *_) = intended(gap).models
    assert (hm1.n_ratings, hm1.n_agree) == (1, 1)


def test_the_first_session_that_has_ratings_is_used() -> None:
    later = ratings(("retest", "R1", "HM1", "1"))
    assert intended(later).session == "retest"


def test_ratings_without_in_person_grades_say_so() -> None:
    found = paired(ratings(("test", "R1", "HM1", "1")), None)
    assert found.pairs == ()
    assert found.reason == "no grades given in person belong to these ratings"


def test_in_person_grades_alone_are_paired_with_the_ratings() -> None:
    rated = ratings(*of_session("test", R1=("1", "1+", "2", "2"), R4=("1",)))
    found = paired(rated, without_haptic_grades())
    # R1 in person: 1, 1+, 2, 3. The other eight entries meet no rating.
    assert [(p.model, p.in_person, p.haptic) for p in found.pairs] == [
        ("HM1", "1", "1"),
        ("HM2", "1+", "1+"),
        ("HM3", "2", "2"),
        ("HM4", "3", "2"),
    ]
    assert (found.n_pairs, found.n_equal, found.n_unpaired) == (4, 3, 8)


def test_of_repeated_presentations_the_first_is_paired() -> None:
    repeated = [("test", "R1", "HM1", "2"), ("test", "R1", "HM1", "1")]
    second, first = (
        ratings(row, repeat=n) for row, n in zip(repeated, (2, 1), strict=True)
    )
    both = dataclasses.replace(first, rows=(*second.rows, *first.rows))
    (pair,) = paired(both, without_haptic_grades()).pairs
    assert pair.haptic == "1"


def test_a_haptic_grade_that_contradicts_the_ratings_is_refused_with_its_line() -> None:
    rated = ratings(("test", "R1", "HM1", "3"))
    with pytest.raises(RatingsError, match=r"in_person\.csv: line \d+.*'3'.*got '1'"):
        paired(rated, in_person())
