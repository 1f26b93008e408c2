"""Stretching speeds: what is known is summarized, what is not is counted."""

import math

from masrel.lab.analysis import Speeds, analyze
from masrel.lab.ratings import Ratings, ratings_from_rows
from masrel.scales import MODIFIED_ASHWORTH
from tests.lab.analysis.studies import protocol_with, ratings


def stretching_speeds(rows: Ratings) -> Speeds:
    """What an analysis says of speeds."""
    result = analyze(protocol_with(sections=("speeds",)), rows).speeds
    assert result is not None
    return result


def test_ratings_without_speeds_say_so() -> None:
    found = stretching_speeds(ratings(("test", "R1", "HM1", "1")))
    assert (found.values, found.by_model, found.by_rater) == ((), (), ())
    assert found.n_missing == 1
    assert found.reason == "no rating comes with a stretching speed"


def test_one_speed_has_no_deviation_and_sessions_stay_apart() -> None:
    rows = [
        ("retest", "R2", 70.0),
        ("test", "R1", 80.0),
        ("test", "R2", 90.0),
        ("test", "R3", math.nan),
    ]
    made = ratings_from_rows(
        [
            {"session": s, "rater": r, "model": "HM1", "mean_speed_deg_s": speed}
            for s, r, speed in rows
        ],
        MODIFIED_ASHWORTH,
    )
    found = stretching_speeds(made)
    test, retest = found.by_model  # in the protocol's order, not the file's
    # mean 85, deviations 5 and -5: sd sqrt(50 / 1)
    assert (test.session, test.n, test.mean, test.sd) == ("test", 2, 85.0, 50**0.5)
    assert (retest.session, retest.n, retest.mean) == ("retest", 1, 70.0)
    assert math.isnan(retest.sd)
    assert [(s.session, s.name) for s in found.by_rater] == [
        ("test", "R1"),
        ("test", "R2"),
        ("retest", "R2"),
    ]
    assert found.n_missing == 1
