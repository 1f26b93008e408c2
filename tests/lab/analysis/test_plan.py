"""A plan asks, the ratings give or not: the answer is an estimate or a sentence."""

import itertools
import warnings
from fractions import Fraction
from typing import Any

import msgspec
import pytest

from masrel import intervals
from masrel.agreement import COEFFICIENTS
from masrel.errors import (
    MasrelError,
    MasrelWarning,
    RatingsError,
    UndefinedStatisticWarning,
)
from masrel.estimates import Estimate
from masrel.intervals import estimate
from masrel.lab.analysis import analyze
from masrel.lab.protocol import EstimatePlan, ScaleDefinition, scale_of
from masrel.lab.ratings import Ratings, ratings_from_rows
from tests.lab.analysis.studies import of_session, plan, protocol_with, ratings, table_v

TWO = ratings(
    *of_session("test", R1=("1", "1+", "2", "3"), R2=("1", "1", "2", "3")),
    *of_session("retest", R1=("1", "1+", "2", "2"), R2=("1", "1", "3", "3")),
)


def reason_of(line: EstimatePlan, rows: Ratings) -> str | None:
    (found,) = analyze(protocol_with(line), rows).estimates
    assert (found.estimate is None) == (found.reason is not None)
    return found.reason


def refusal(line: EstimatePlan, rows: Ratings) -> str | None:
    """What `analyze` says against a line; None when there are numbers."""
    try:
        (found,) = analyze(protocol_with(line), rows).estimates
    except MasrelError as error:
        return str(error)
    return None if found.estimate is not None or found.by_rater else found.reason


def test_a_session_without_ratings_is_a_reason() -> None:
    said = reason_of(plan(sessions=["retest"]), table_v())
    assert said == "there are no ratings of session retest"


def test_models_without_ratings_are_a_reason() -> None:
    said = reason_of(plan(models="dummy"), table_v())
    assert said == "no dummy model has ratings in session test"
    # Of "all" the dummies are lost: an estimate over the rest is not what was asked.
    assert reason_of(plan(models="all"), table_v()) == said


def test_one_rater_is_a_reason() -> None:
    alone = ratings(*of_session("test", R1=("1", "2")))
    said = reason_of(plan(), alone)
    assert said == "session test has one rater; agreement needs two"


def test_missing_ratings_are_counted_and_pass_into_no_pair() -> None:
    # HM2 has one grade, so no pair; HM1 and HM3 agree in 1 of 2 models.
    gaps = ratings(*of_session("test", R1=("1", None, "2"), R2=("1", "2", "3")))
    line = plan(coefficient="percent_agreement")
    (found,) = analyze(protocol_with(line), gaps).estimates
    assert found.n_missing == 1
    assert found.estimate is not None
    assert found.estimate.value == 0.5


def test_an_undefined_estimate_says_why() -> None:
    same = ratings(*of_session("test", R1=("1", "1"), R2=("1", "1")))
    with pytest.warns(UndefinedStatisticWarning):
        (found,) = analyze(protocol_with(plan()), same).estimates
    assert found.estimate is not None
    assert found.estimate.value != found.estimate.value
    assert found.estimate.reason
    assert found.reason is None


@pytest.mark.parametrize(
    ("row", "said"),
    [
        (("test", "R9", "HM1", "1"), "column 'rater'.*R1, .*got 'R9'"),
        (("test", "R1", "HM9", "1"), "column 'model'.*HM1, .*got 'HM9'"),
        (("third", "R1", "HM1", "1"), "column 'session'.*test, retest, got 'third'"),
    ],
)
def test_ratings_the_protocol_does_not_know_are_refused(
    row: tuple[str, str, str, str], said: str
) -> None:
    with pytest.raises(RatingsError, match=said):
        analyze(protocol_with(), ratings(row))


def test_every_stranger_is_named_once() -> None:
    strangers = [("test", f"X{i % 2}", f"HM{i}", "1") for i in (1, 2, 3, 4)]
    with pytest.raises(RatingsError) as caught:
        analyze(protocol_with(), ratings(*strangers))
    assert len(str(caught.value).splitlines()) == 2


@pytest.mark.parametrize("kind", ["inter-rater", "test-retest"])
@pytest.mark.parametrize("coefficient", COEFFICIENTS)
def test_a_plan_that_does_not_fit_is_said_with_its_line(
    kind: str, coefficient: str
) -> None:
    sessions = ["test"] if kind == "inter-rater" else ["test", "retest"]
    for interval, target in itertools.product(
        ("none", "analytic", "jackknife"), ("items", "raters", "both")
    ):
        line = plan(
            id="mine",
            kind=kind,
            coefficient=coefficient,
            sessions=sessions,
            interval=interval,
            target=target,
        )
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", MasrelWarning)
            said = refusal(line, TWO)
        needs_more = "not with the ratings that are there: target:"
        assert (
            said is None
            or "analysis.estimates 'mine'" in said
            or said.startswith(needs_more)
        )


def test_cohens_kappa_of_three_raters_names_the_line_of_the_plan() -> None:
    three = ratings(*of_session("test", R1=("1", "2"), R2=("1", "2"), R3=("1", "3")))
    line = plan(id="pairwise", coefficient="cohen_kappa")
    with pytest.raises(MasrelError, match=r"analysis\.estimates 'pairwise'.*3"):
        analyze(protocol_with(line), three)


@pytest.mark.parametrize("target", ["items", "raters", "both"])
@pytest.mark.parametrize("kind", ["inter-rater", "test-retest"])
def test_a_plan_that_fits_the_whole_study_waits_for_its_ratings(
    kind: str, target: str
) -> None:
    # one rater back, two raters, one item: every part of a study that is under way
    retest = kind == "test-retest"
    line = plan(
        kind=kind,
        coefficient="stratified_kappa" if retest else "fleiss_kappa",
        sessions=["test", "retest"] if retest else ["test"],
        interval="auto",
        target=target,
    )
    one, all_four = ("1",), ("1", "1+", "2", "3")
    for test in ({"R1": one}, {"R1": all_four}, {"R1": all_four, "R2": all_four}):
        for back in ({}, {"R1": one}, {"R1": all_four}):
            rows = [*of_session("test", **test), *of_session("retest", **back)]
            with warnings.catch_warnings():
                warnings.simplefilter("ignore", MasrelWarning)
                (found,) = analyze(protocol_with(line), ratings(*rows)).estimates
            assert (found.estimate is None) == (found.reason is not None)


def test_a_line_more_moves_no_other_lines_numbers() -> None:
    drawn = plan(id="a", interval="bootstrap")
    (alone,) = analyze(protocol_with(drawn), table_v()).estimates
    other = plan(id="b", interval="bootstrap")
    _, beside = analyze(protocol_with(other, drawn), table_v()).estimates
    assert beside == alone
    assert alone.estimate is not None
    assert alone.estimate.interval is not None


@pytest.mark.parametrize("kind", ["inter-rater", "test-retest"])
def test_a_scale_of_numbers_weighs_by_value(kind: str) -> None:
    # as `masrel agree` does: 0 and 1 nearly agree on a scale that goes to 10
    line = plan(
        kind=kind,
        coefficient="cohen_kappa",
        weights="linear",
        sessions=["test"] if kind == "inter-rater" else ["test", "retest"],
    )
    grades = ("0", "1", "10")
    protocol = msgspec.structs.replace(
        protocol_with(line), scale=ScaleDefinition(name="pain", grades=grades)
    )
    first, second = ("0", "1", "10", "0"), ("1", "1", "10", "10")
    if kind == "inter-rater":
        rows = of_session("test", R1=first, R2=second)
    else:
        rows = [*of_session("test", R1=first), *of_session("retest", R1=second)]
    names = ("session", "rater", "model", "grade")
    given = ratings_from_rows(
        [dict(zip(names, row, strict=True)) for row in rows],
        scale=scale_of(protocol),
    )
    (found,) = analyze(protocol, given).estimates
    estimate = found.estimate or found.by_rater[0].estimate
    # D_o = (1 + 0 + 0 + 10)/40; D_e = [2 (2·1 + 2·10) + (2·0 + 2·9) + (2·9 + 2·0)]/160
    kappa = float(1 - Fraction(11, 40) / Fraction(80, 160))
    assert estimate.value == pytest.approx(kappa, abs=1e-14)


def test_every_line_has_a_seed_of_its_own(monkeypatch: pytest.MonkeyPatch) -> None:
    seeds = []

    def record(*arguments: Any, rng: int, **options: Any) -> Estimate:
        seeds.append(rng)
        return estimate(*arguments, rng=rng, **options)

    monkeypatch.setattr(intervals, "estimate", record)
    first, second = (plan(id=name, interval="jackknife") for name in "ab")
    analyze(protocol_with(first, second), table_v())
    analyze(protocol_with(second), table_v())
    assert seeds[0] != seeds[1]
    assert seeds[1] == seeds[2]
    # fits a signed integer of 64 bits, as other readers of the JSON have them
    assert all(0 <= seed < 2**63 for seed in seeds)
