"""Test-retest agreement on a table worked by hand."""

import pytest

from masrel.errors import UndefinedStatisticWarning
from masrel.lab.analysis import PlannedEstimate, analyze
from masrel.lab.ratings import Ratings
from tests.lab.analysis.studies import of_session, plan, protocol_with, ratings

# Rater by rater, HM1 to HM4. R1 repeats 3 of 4 grades, R2 all, R3 two of four.
TEST = of_session(
    "test",
    R1=("1", "1", "2", "2"),
    R2=("1", "1+", "2", "3"),
    R3=("1", "1", "2", "2"),
)
RETEST = of_session(
    "retest",
    R1=("1", "1", "2", "1"),
    R2=("1", "1+", "2", "3"),
    R3=("1", "2", "1", "2"),
)


def again(
    rows: Ratings, coefficient: str = "stratified_kappa", interval: str = "none"
) -> PlannedEstimate:
    line = plan(
        kind="test-retest",
        coefficient=coefficient,
        sessions=["test", "retest"],
        target="items",
        interval=interval,
    )
    (found,) = analyze(protocol_with(line), rows).estimates
    return found


def test_each_raters_kappa_and_the_stratified_one_are_as_by_hand() -> None:
    # R1: p_o 3/4; shares of 1 and 2: 2/4, 2/4 and 3/4, 1/4, so p_e = 3/8 + 1/8 = 1/2
    #     and kappa = (3/4 - 1/2) / (1 - 1/2) = 1/2.
    # R2: p_o 1; four grades once each, p_e = 4/16 = 1/4: kappa 1.
    # R3: p_o 1/2; half and half twice, p_e = 1/2: kappa 0.
    # Stratified: sum of p_o - p_e over sum of 1 - p_e
    #     = (1/4 + 3/4 + 0) / (1/2 + 3/4 + 1/2) = 1 / (7/4) = 4/7.
    found = again(ratings(*TEST, *RETEST))
    own = {part.rater: part.estimate.value for part in found.by_rater}
    assert own == {"R1": 0.5, "R2": 1.0, "R3": 0.0}
    assert found.estimate is not None
    assert found.estimate.value == pytest.approx(4 / 7, abs=1e-15)
    assert found.raters == ("R1", "R2", "R3")
    assert found.items == ("HM1", "HM2", "HM3", "HM4")


def test_pairs_of_different_raters_are_not_pooled() -> None:
    # Pooled, the 12 pairs give p_o 3/4, and the margins (5, 1, 5, 1) and
    # (5, 1, 4, 2) / 12 give p_e = 48/144 = 1/3: kappa 5/8, which is not 4/7.
    found = again(ratings(*TEST, *RETEST))
    assert found.estimate is not None
    assert found.estimate.value != pytest.approx(5 / 8, abs=1e-3)


def test_another_coefficient_is_each_raters_own() -> None:
    found = again(ratings(*TEST, *RETEST), "percent_agreement")
    assert found.estimate is None
    assert found.reason is None
    own = {part.rater: part.estimate.value for part in found.by_rater}
    assert own == {"R1": 0.75, "R2": 1.0, "R3": 0.5}


def test_only_raters_of_both_sessions_are_used() -> None:
    once = [row for row in RETEST if row[1] != "R3"]
    found = again(ratings(*TEST, *once))
    assert found.raters == ("R1", "R2")
    # (1/4 + 3/4) / (1/2 + 3/4) = 4/5
    assert found.estimate is not None
    assert found.estimate.value == pytest.approx(4 / 5, abs=1e-15)


def test_a_missing_grade_is_counted_and_its_pair_left_out() -> None:
    # R3 without HM2: pairs (1, 1), (2, 1), (2, 2). p_o 2/3; p_e = 1/3 * 2/3 + 2/3 *
    # 1/3 = 4/9; kappa = (2/9) / (5/9) = 2/5.
    gap = [
        (s, rater, model, None if (rater, model) == ("R3", "HM2") else grade)
        for s, rater, model, grade in RETEST
    ]
    found = again(ratings(*TEST, *gap))
    assert found.n_missing == 1
    own = {part.rater: part.estimate.value for part in found.by_rater}
    assert own["R3"] == pytest.approx(2 / 5, abs=1e-15)
    assert own["R1"] == 0.5


def test_no_rater_of_both_sessions_is_a_reason() -> None:
    first = [row for row in TEST if row[1] == "R1"]
    second = [row for row in RETEST if row[1] == "R2"]
    found = again(ratings(*first, *second))
    assert found.estimate is None
    assert found.by_rater == ()
    assert found.reason == "no rater has ratings in both test and retest"


def test_an_undefined_rater_leaves_the_stratified_kappa_defined() -> None:
    # R4 said 2 throughout: 0/0 alone; p_o = p_e = 1 adds nothing to either sum.
    same = ("2", "2", "2", "2")
    rows = [*TEST, *of_session("test", R4=same)]
    rows += [*RETEST, *of_session("retest", R4=same)]
    with pytest.warns(UndefinedStatisticWarning):
        found = again(ratings(*rows))
    assert found.estimate is not None
    assert found.estimate.value == pytest.approx(4 / 7, abs=1e-15)
    r4 = found.by_rater[-1].estimate
    assert r4.value != r4.value
    assert r4.reason
