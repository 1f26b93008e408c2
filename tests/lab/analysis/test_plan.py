"""A plan asks, the ratings give or not: the answer is an estimate or a sentence."""

import itertools
import math
import random
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
    UndefinedStatisticWarning,
)
from masrel.estimates import Estimate
from masrel.intervals import estimate
from masrel.judges import alternative_annotator_test
from masrel.lab.analysis import PlannedEstimate, analyze, check_gates
from masrel.lab.protocol import (
    EstimatePlan,
    JudgeKeys,
    ScaleDefinition,
    parse_gate,
    scale_of,
)
from masrel.lab.ratings import Ratings, ratings_from_rows
from tests.architecture.test_imports import loaded_after
from tests.lab.analysis.studies import (
    hess2012,
    of_session,
    plan,
    protocol_with,
    ratings,
    table_v,
)

TWO = ratings(
    *of_session("test", R1=("1", "1+", "2", "3"), R2=("1", "1", "2", "3")),
    *of_session("retest", R1=("1", "1+", "2", "2"), R2=("1", "1", "3", "3")),
)


ALONE = ratings(*of_session("test", R1=("1", "2")))


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


def test_a_judge_is_held_against_the_others_of_its_session() -> None:
    draw = random.Random(4).choice
    rows = [
        ("test", rater, model.id, draw(("1", "1", "2", None)))
        for model in hess2012().models
        for rater in ("R1", "R2", "R3", "R4")
    ]
    graded = {
        rater: {model: grade for _, of, model, grade in rows if of == rater}
        for rater in ("R1", "R2", "R3", "R4")
    }
    judge = JudgeKeys(id="m", judge="R4", session="test", epsilon=0.2, min_items=5)
    lines = (
        judge,
        msgspec.structs.replace(judge, id="two", humans=("R1", "R3")),
        msgspec.structs.replace(judge, id="late", session="retest"),
    )
    protocol = protocol_with()
    plan = msgspec.structs.replace(protocol.analysis, judges=lines)
    protocol = msgspec.structs.replace(protocol, analysis=plan)
    analysis = analyze(protocol, ratings(*rows))
    humans = (("R1", "R2", "R3"), ("R1", "R3"), ())
    for found, names in zip(analysis.judges, humans, strict=True):
        expected = names and alternative_annotator_test(
            {name: graded[name] for name in names},
            graded["R4"],
            epsilon=0.2,
            min_items=5,
        )
        assert found.result == (expected or None)
    gates = [
        parse_gate(f"{of}.advantage >= 0", (), judges=("m", "late"), where="plan")
        for of in ("m", "late")
    ]
    holds = check_gates(analysis, gates)
    assert [result.holds for result in holds] == [True, False]
    assert holds[1].reason is not None


def test_what_is_not_there_is_a_reason() -> None:
    no_dummy = "no dummy model has ratings in session test"
    for line, rows, said in (
        (
            plan(sessions=["retest"]),
            table_v(),
            "there are no ratings of session retest",
        ),
        (plan(models="dummy"), table_v(), no_dummy),
        # Of "all" the dummies are lost: the rest is not what was asked.
        (plan(models="all"), table_v(), no_dummy),
        (plan(), ALONE, "session test has one rater; agreement needs two"),
    ):
        assert reason_of(line, rows) == said


def test_missing_ratings_are_counted_and_pass_into_no_pair() -> None:
    # HM2 has one grade, so no pair; HM1 and HM3 agree in 1 of 2 models.
    gaps = ratings(*of_session("test", R1=("1", None, "2"), R2=("1", "2", "3")))
    line = plan(coefficient="percent_agreement")
    (found,) = analyze(protocol_with(line), gaps).estimates
    assert found.estimate is not None
    assert (found.n_missing, found.estimate.value) == (1, 0.5)


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


def test_a_line_more_moves_no_other_lines_seed(monkeypatch: pytest.MonkeyPatch) -> None:
    seeds = []

    def record(*arguments: Any, rng: int, **options: Any) -> Estimate:
        seeds.append(rng)
        return estimate(*arguments, rng=rng, **options)

    monkeypatch.setattr(intervals, "estimate", record)
    first, second = (plan(id=name, interval="jackknife") for name in "ab")
    analyze(protocol_with(first, second), table_v())
    analyze(protocol_with(second), table_v())
    assert seeds[0] != seeds[1] == seeds[2]
    # fits a signed integer of 64 bits, as other readers of the JSON have them
    assert all(0 <= seed < 2**63 for seed in seeds)


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


def again(rows: Ratings, coefficient: str = "stratified_kappa") -> PlannedEstimate:
    line = plan(
        kind="test-retest",
        coefficient=coefficient,
        sessions=["test", "retest"],
        target="items",
    )
    (found,) = analyze(protocol_with(line), rows).estimates
    return found


def test_each_raters_kappa_and_the_stratified_one_are_as_by_hand() -> None:
    # R1: p_o 3/4; shares of 1 and 2: 2/4, 2/4 and 3/4, 1/4, so p_e = 3/8 + 1/8 = 1/2
    #     and kappa = (3/4 - 1/2) / (1 - 1/2) = 1/2.
    # R2: p_o 1; four grades once each, p_e = 4/16 = 1/4: kappa 1.
    # R3: p_o 1/2; half and half twice, p_e = 1/2: kappa 0.
    # R4 said 2 throughout: 0/0 alone; p_o = p_e = 1 adds nothing to either sum.
    # Stratified: sum of p_o - p_e over sum of 1 - p_e
    #     = (1/4 + 3/4 + 0) / (1/2 + 3/4 + 1/2) = 1 / (7/4) = 4/7. Pooled, the 12 pairs
    #     of R1 to R3 would have 5/8.
    same = ("2", "2", "2", "2")
    both = [*of_session("test", R4=same), *of_session("retest", R4=same)]
    with pytest.warns(UndefinedStatisticWarning):
        found = again(ratings(*TEST, *RETEST, *both))
    *own, r4 = (part.estimate for part in found.by_rater)
    assert [estimate.value for estimate in own] == [0.5, 1.0, 0.0]
    assert (math.isnan(r4.value), bool(r4.reason)) == (True, True)
    assert found.estimate is not None
    assert found.estimate.value == pytest.approx(4 / 7, abs=1e-15)
    assert found.raters == ("R1", "R2", "R3", "R4")
    assert found.items == ("HM1", "HM2", "HM3", "HM4")


def test_another_coefficient_is_each_raters_own() -> None:
    found = again(ratings(*TEST, *RETEST), "percent_agreement")
    assert (found.estimate, found.reason) == (None, None)
    own = {part.rater: part.estimate.value for part in found.by_rater}
    assert own == {"R1": 0.75, "R2": 1.0, "R3": 0.5}


def test_only_raters_of_both_sessions_are_used() -> None:
    once = [row for row in RETEST if row[1] != "R3"]
    found = again(ratings(*TEST, *once))
    assert found.raters == ("R1", "R2")
    assert found.estimate is not None  # (1/4 + 3/4) / (1/2 + 3/4) = 4/5
    assert found.estimate.value == pytest.approx(4 / 5, abs=1e-15)
    nobody = again(ratings(*TEST[:4], *RETEST[4:]))
    assert (nobody.estimate, nobody.by_rater) == (None, ())
    assert nobody.reason == "no rater has ratings in both test and retest"


def test_a_missing_grade_is_counted_and_its_pair_left_out() -> None:
    # R3 without HM2: pairs (1, 1), (2, 1), (2, 2). p_o 2/3; p_e = 1/3 * 2/3 + 2/3 *
    # 1/3 = 4/9; kappa = (2/9) / (5/9) = 2/5.
    gap = [(*row[:3], None) if row[1:3] == ("R3", "HM2") else row for row in RETEST]
    found = again(ratings(*TEST, *gap))
    assert found.n_missing == 1
    own = {part.rater: part.estimate.value for part in found.by_rater}
    assert (own["R1"], own["R3"]) == (0.5, pytest.approx(2 / 5, abs=1e-15))


ANALYZE = """
from tests.lab.analysis.studies import plan, protocol_with, table_v
from masrel.lab.analysis import analyze
analyze(protocol_with(plan(interval={interval!r})), table_v())
import sys
assert ('masrel.intervals' in sys.modules) == ({interval!r} != 'none')
"""


def test_an_analysis_loads_what_its_plan_asks_for() -> None:
    loaded = loaded_after(ANALYZE.format(interval="jackknife").strip())
    assert loaded & {"matplotlib", "jinja2", "emcee", "arviz_stats"} == set()
    assert "scipy" not in loaded_after(ANALYZE.format(interval="none").strip())
