"""Grades against intended ones and those in person, and speeds, beyond Table V."""

import dataclasses
import math
from typing import Any

import pytest

from masrel.errors import RatingsError
from masrel.lab.analysis import Analysis, analyze
from masrel.lab.ratings import InPerson, Ratings, ratings_from_rows
from masrel.scales import MODIFIED_ASHWORTH
from tests.lab.analysis.studies import in_person, of_session, protocol_with, ratings


def of_section(name: str, rows: Ratings, **more: Any) -> Any:
    """What an analysis says of a section."""
    found: Analysis = analyze(protocol_with(sections=(name,)), rows, **more)
    return getattr(found, name.replace("-", "_"))


def without_haptic_grades() -> InPerson:
    """Table IV as if the grades of the models were not printed beside."""
    table = in_person()
    rows = [row for row in table.rows if row.source_table == "IV"]
    bare = (dataclasses.replace(row, haptic_grade=None) for row in rows)
    return dataclasses.replace(table, rows=tuple(bare))


def test_a_model_without_ratings_has_no_percentage() -> None:
    rows = ratings(*of_session("test", R1=("1", "1"), R2=(None,)))
    found = of_section("intended", rows)
    hm1, hm2, hm3, _ = found.models
    assert (hm1.percent, hm1.n_ratings, hm2.percent) == (100.0, 1, 0.0)
    assert (math.isnan(hm3.percent), hm3.n_ratings) == (True, 0)
    # over HM1 and HM2: mean 50, deviations 50 and -50, sd sqrt(5000 / 1)
    assert found.mean == 50.0
    assert found.sd == pytest.approx(math.sqrt(5000.0), abs=1e-12)


def test_what_was_too_slow_to_be_felt_is_not_as_intended() -> None:
    first, *others = ratings(*of_session("test", R1=("1",), R2=("1",), R3=("2",))).rows
    slow = first._replace(felt="below-threshold")
    rows = dataclasses.replace(ratings(), rows=(slow, *others))
    hm1 = of_section("intended", rows).models[0]
    assert (hm1.n_ratings, hm1.n_agree) == (3, 1)


def test_of_the_first_session_one_model_has_a_mean_and_no_deviation() -> None:
    found = of_section("intended", ratings(("retest", "R1", "HM1", "1")))
    assert (found.session, found.mean, math.isnan(found.sd)) == ("retest", 100.0, True)
    assert found.reason == "one model has no standard deviation over models"


def test_in_person_grades_alone_are_paired_with_the_first_of_the_ratings() -> None:
    first = ratings(*of_session("test", R1=("1", "1+", "2", "2"), R4=("1",)))
    again = ratings(("test", "R1", "HM1", "2"), repeat=2)
    both = dataclasses.replace(first, rows=(*again.rows, *first.rows))
    found = of_section("in-person", both, in_person=without_haptic_grades())
    # R1 in person: 1, 1+, 2, 3. The other eight entries meet no rating.
    assert [(p.model, p.in_person, p.haptic) for p in found.pairs] == [
        ("HM1", "1", "1"),
        ("HM2", "1+", "1+"),
        ("HM3", "2", "2"),
        ("HM4", "3", "2"),
    ]
    assert (found.n_pairs, found.n_equal, found.n_unpaired) == (4, 3, 8)
    without = of_section("in-person", first)
    assert without.pairs == ()
    assert without.reason == "no grades given in person belong to these ratings"


def test_a_haptic_grade_that_contradicts_the_ratings_is_refused_with_its_line() -> None:
    rated = ratings(("test", "R1", "HM1", "3"))
    with pytest.raises(RatingsError, match=r"in_person\.csv: line \d+.*'3'.*got '1'"):
        of_section("in-person", rated, in_person=in_person())


def test_what_is_known_of_speeds_is_summarized_and_what_is_not_is_counted() -> None:
    rows = [("retest", "R2", 70.0), ("test", "R1", 80.0), ("test", "R2", 90.0)]
    names = ("session", "rater", "mean_speed_deg_s")
    made = ratings_from_rows(
        [
            {"model": "HM1", **dict(zip(names, row, strict=True))}
            for row in (*rows, ("test", "R3", math.nan))
        ],
        MODIFIED_ASHWORTH,
    )
    found = of_section("speeds", made)
    test, retest = found.by_model  # in the protocol's order, not the file's
    # mean 85, deviations 5 and -5: sd sqrt(50 / 1)
    assert (test.session, test.n, test.mean, test.sd) == ("test", 2, 85.0, 50**0.5)
    assert (test.least, test.most) == (80.0, 90.0)
    assert (retest.session, retest.n, retest.mean) == ("retest", 1, 70.0)
    assert math.isnan(retest.sd)
    of_raters = [(s.session, s.name) for s in found.by_rater]
    assert of_raters == [("test", "R1"), ("test", "R2"), ("retest", "R2")]
    assert found.n_missing == 1
    none = of_section("speeds", ratings(("test", "R1", "HM1", "1")))
    assert (none.values, none.n_missing) == ((), 1)
    assert none.reason == "no rating comes with a stretching speed"
