"""The alternative annotator test: by hand, published, by a plain loop, properties."""

import json
import math
import os
from collections.abc import Hashable
from fractions import Fraction
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.special import expit, logit, stdtr
from scipy.stats import t
from statsmodels.stats.multitest import multipletests

from masrel.agreement import benjamini_yekutieli
from masrel.errors import SmallSampleWarning, UndefinedStatisticWarning
from masrel.judges import (
    EPSILONS,
    advantage,
    advantage_differences,
    alternative_annotator_test,
    reference_difference,
    score_test,
)
from masrel.judges._paired import tango

ORACLE = json.loads((Path(__file__).parent / "annotators.json").read_text("utf-8"))
DATA = os.environ.get("MASREL_ALTTEST")  # the folder `data` of nitaytech/AltTest

Graded = dict[Hashable, Any]


def by_item(grades: str) -> Graded:
    """Grades as text, of items 0, 1, …; a space is missing."""
    return {i: grade for i, grade in enumerate(grades) if grade != " "}


SMALL = ORACLE["alt_test"]
HUMANS = {name: by_item(grades) for name, grades in SMALL["humans"].items()}
JUDGE = by_item(SMALL["judge"])


def noisy(
    rng: np.random.Generator, n: int, n_humans: int, grades: Any, share: float = 1.0
) -> tuple[dict[str, Graded], Graded]:
    """Grades of humans, who may leave items out, and of a judge."""
    truth = rng.integers(0, len(grades), n)

    def one(share: float) -> Graded:
        errs, is_there = rng.random(n) < 0.3, rng.random(n) < share
        drawn = np.where(errs, rng.integers(0, len(grades), n), truth)
        return {i: grades[drawn[i]] for i in range(n) if is_there[i]}

    return {f"H{j}": one(share) for j in range(n_humans)}, one(1.0)


# -- the test --------------------------------------------------------------------------


@pytest.mark.parametrize("test", ["t", "score"])
def test_the_small_set_is_that_of_another_implementation(test: Any) -> None:
    expected = SMALL["result"]
    result = alternative_annotator_test(
        HUMANS, JUDGE, epsilon=SMALL["epsilon"], test=test
    )
    assert result.winning_rate == expected[f"omega_{test}"]
    assert result.advantage == pytest.approx(expected["rho"], rel=1e-12)
    assert result.thresholds == pytest.approx(expected["thresholds"])
    for human, row in zip(result.humans, expected["humans"], strict=True):
        assert (human.name, human.n_items) == (row["human"], row["n"])
        assert (human.b, human.c) == (row["human_better"], row["judge_better"])
        assert human.judge_share == pytest.approx(row["rho_judge"])
        assert human.human_share == pytest.approx(row["rho_human"])
        assert human.p_value == pytest.approx(row[f"p_{test}"], rel=1e-9)
        assert human.is_rejected == (human.name in expected[f"rejected_{test}"])


@pytest.mark.skipif(DATA is None, reason="MASREL_ALTTEST names no folder of the data")
@pytest.mark.parametrize("row", ORACLE["published"], ids=lambda row: row["set"])
def test_published_winning_rates_and_advantages(row: Any) -> None:
    folder = Path(str(DATA)) / row["set"]
    humans, judges = (
        json.loads((folder / f"{who}_annotations.json").read_text("utf-8"))
        for who in ("human", "llm")
    )
    for test in ("t", "score"):
        result = alternative_annotator_test(
            humans,
            judges["gpt-4o"],
            epsilon=row["epsilon"],
            score=row["score"],
            test=test,
        )
        n_rejected = row[f"rejected_{test}"]
        assert result.winning_rate == n_rejected / row["humans"]
        assert float(Fraction(row["omega"])) == result.winning_rate
        assert result.advantage == pytest.approx(row["rho"], abs=5.1e-9)
        assert [human.n_items for human in result.humans] == row["n_items"]
        p_values = [float(f"{human.p_value:.4g}") for human in result.humans]
        assert p_values == row[f"p_{test}_4_digits"]


def test_by_hand() -> None:
    # 40 items aa, judge a: all tie. Then of (human 1, human 2; judge) ab;a twice: to
    # human 2 the judge is nearer than nobody: human 1 and he are as far from b, a tie;
    # to human 1 the judge is nearer than human 2, c = 1 of human 2. Once aa;b: b = 1 of
    # both. An item of one human counts for nobody.
    humans = {
        "Ann": by_item("a" * 40 + "aaa" + "a"),
        "Ben": by_item("a" * 40 + "bba" + " "),
    }
    judge = by_item("a" * 40 + "aab" + "a")
    result = alternative_annotator_test(humans, judge, epsilon=0.1)
    ann, ben = result.humans
    assert (ann.n_items, ann.b, ann.c) == (43, 1, 0)
    assert (ben.n_items, ben.b, ben.c) == (43, 1, 2)
    assert result.advantage == pytest.approx(42 / 43)
    assert result.n_items == 43
    assert ann.test == "exact"


def plain_signs(
    humans: dict[str, Graded], judge: Graded, name: str, kind: str
) -> list[int]:
    """How a human and the judge compare on each item, by a loop over fractions."""

    def score(grade: Any, others: list[Any]) -> Fraction:
        if kind == "accuracy":
            return Fraction(others.count(grade), len(others))
        squares = [(Fraction(str(grade)) - Fraction(str(y))) ** 2 for y in others]
        return -sum(squares, Fraction(0)) / len(others)

    signs = []
    for item, grade in humans[name].items():
        others = [of[item] for h, of in humans.items() if h != name and item in of]
        if others and item in judge:
            gap = score(grade, others) - score(judge[item], others)
            signs.append((gap > 0) - (gap < 0))
    return signs


@given(
    st.integers(0, 10**6),
    st.sampled_from([("a", "b", "c"), (1, 2, 4), (0.1, 0.2, 0.3, 1 / 3), (1, 10**12)]),
    st.booleans(),
)
def test_counts_are_those_of_a_plain_loop(
    seed: int, grades: Any, of_rmse: bool
) -> None:
    rng = np.random.default_rng(seed)
    humans, judge = noisy(rng, 40, 4, grades, 0.6)
    kind: Any = "neg_rmse" if of_rmse and grades[0] != "a" else "accuracy"
    result = alternative_annotator_test(
        humans, judge, epsilon=0.2, score=kind, min_items=5, test="score"
    )
    assert len(result.humans) == 4
    for human in result.humans:
        signs = plain_signs(humans, judge, human.name, kind)
        assert human.n_items == len(signs)
        assert (human.b, human.c) == (signs.count(1), signs.count(-1))


def test_decimals_tie_where_floats_would_not() -> None:
    # .1 and .3 are as far from .2; as floats they are not
    humans = {"Ann": {0: 0.1}, "Ben": {0: 0.2}}
    result = alternative_annotator_test(
        humans, {0: 0.3}, epsilon=0.5, score="neg_rmse", min_items=1
    )
    assert (result.humans[0].b, result.humans[0].c) == (0, 0)


@pytest.mark.parametrize(
    ("weights", "name"), [("identity", "accuracy"), ("quadratic", "neg_rmse")]
)
def test_weights_are_those_scores_where_they_say_the_same(
    weights: Any, name: Any
) -> None:
    humans, judge = noisy(np.random.default_rng(1), 80, 4, (1, 2, 4, 7), 0.7)
    by_weights, by_name = (
        alternative_annotator_test(humans, judge, epsilon=0.2, score=score)
        for score in ((weights, (1, 2, 4, 7)), name)
    )
    assert by_weights.humans == by_name.humans
    assert by_weights.score == weights


def test_a_frame_and_a_series_are_as_dicts_are() -> None:
    humans, judge = noisy(np.random.default_rng(2), 80, 3, (1, 2, 3), 0.8)
    frame, series = pd.DataFrame(humans), pd.Series(judge)
    assert frame.isna().any(axis=None)
    assert alternative_annotator_test(
        frame, series, epsilon=0.1
    ) == alternative_annotator_test(humans, judge, epsilon=0.1)


def test_names_and_order_change_nothing() -> None:
    names = {"H1": "H3", "H2": "Zoe", "H3": "A"}
    renamed = {names[name]: HUMANS[name] for name in reversed(HUMANS)}
    items = {i: f"item {i}" for i in reversed(JUDGE)}
    moved = {
        name: {items[i]: grade for i, grade in grades.items()}
        for name, grades in renamed.items()
    }
    judge = {items[i]: JUDGE[i] for i in items}
    one = alternative_annotator_test(HUMANS, JUDGE, epsilon=0.1)
    other = alternative_annotator_test(moved, judge, epsilon=0.1)
    p_values = {human.name: human.p_value for human in other.humans}
    assert [p_values[names[h.name]] for h in one.humans] == [
        h.p_value for h in one.humans
    ]
    assert other.winning_rate == one.winning_rate
    assert other.advantage == pytest.approx(one.advantage)


def test_items_twice_double_counts_and_leave_the_advantage() -> None:
    twice = {
        name: grades | {-1 - i: grade for i, grade in grades.items()}
        for name, grades in HUMANS.items()
    }
    judge = JUDGE | {-1 - i: grade for i, grade in JUDGE.items()}
    one = alternative_annotator_test(HUMANS, JUDGE, epsilon=0.1)
    two = alternative_annotator_test(twice, judge, epsilon=0.1)
    assert two.advantage == pytest.approx(one.advantage)
    for human, doubled in zip(one.humans, two.humans, strict=True):
        assert (doubled.n_items, doubled.b) == (2 * human.n_items, 2 * human.b)
        assert doubled.p_value < human.p_value


def test_a_human_of_few_items_is_left_out_but_others_are_held_against_him() -> None:
    humans = HUMANS | {"Few": dict.fromkeys(range(12), "a")}
    result = alternative_annotator_test(humans, JUDGE, epsilon=0.1)
    assert result.left_out == (("Few", 12),)
    assert len(result.humans) == len(result.thresholds) == 3
    signs = plain_signs(humans, JUDGE, "H1", "accuracy")
    assert (result.humans[0].b, result.humans[0].c) == (
        signs.count(1),
        signs.count(-1),
    )


def test_a_human_of_more_items_than_an_exact_test_is_for_has_the_score_test() -> None:
    humans, judge = noisy(np.random.default_rng(3), 2501, 2, (1, 2))
    human, _ = alternative_annotator_test(humans, judge, epsilon=0.02).humans
    expected = score_test(human.b, human.c, human.n_items, delta=0.02).p_less
    assert human.test == "score"
    assert human.p_value == pytest.approx(expected, rel=1e-12)


def test_what_is_undefined_is_no_rejection() -> None:
    same = dict.fromkeys("AB", JUDGE)
    with pytest.warns(UndefinedStatisticWarning, match="0/0"):
        result = alternative_annotator_test(same, JUDGE, epsilon=0.0, test="score")
    assert result.winning_rate == 0.0
    assert math.isnan(result.humans[0].p_value)
    assert result.humans[0].reason is not None


def test_half_of_the_humans_is_enough_to_pass() -> None:
    # the judge repeats human 2, so it is never worse than human 1, who differs on 20
    # items of 40, and always ties with human 2, which does not show 1 in 100
    one, two = ({i: "ab"[i % of] for i in range(40)} for of in (2, 1))
    result = alternative_annotator_test({"1": one, "2": two}, two, epsilon=0.01)
    assert [(human.b, human.c) for human in result.humans] == [(0, 20), (0, 0)]
    assert (result.winning_rate, result.is_passed) == (0.5, True)


def test_advised_bounds_are_those_of_the_paper() -> None:
    assert EPSILONS == {"expert": 0.2, "skilled": 0.15, "crowd": 0.1}


# -- several p-values ------------------------------------------------------------------


@pytest.mark.parametrize("row", ORACLE["by"], ids=str)
def test_benjamini_yekutieli_is_that_of_another_implementation(row: Any) -> None:
    adjusted = benjamini_yekutieli(row["p"])
    assert adjusted == pytest.approx(row["adjusted"], rel=1e-12)
    rejected = [i for i, p in enumerate(adjusted) if p <= row["q"]]
    assert rejected == sorted(row["rejected"])


@given(st.lists(st.floats(0.0, 1.0), min_size=1, max_size=30))
def test_benjamini_yekutieli_is_that_of_statsmodels(p_values: list[float]) -> None:
    expected = multipletests(p_values, method="fdr_by")[1]
    assert benjamini_yekutieli(p_values) == pytest.approx(expected, rel=1e-12)


def test_an_undefined_p_value_counts_for_none() -> None:
    adjusted = benjamini_yekutieli([math.nan, 0.01])
    assert math.isnan(adjusted[0])
    assert adjusted[1] == 0.01


# -- intervals -------------------------------------------------------------------------


def plain_advantage(humans: dict[str, Graded], judge: Graded) -> float:
    signs = [plain_signs(humans, judge, name, "accuracy") for name in humans]
    return float(np.mean([1 - of.count(1) / len(of) for of in signs if of]))


def without(graded: Graded, items: set[Hashable]) -> Graded:
    return {item: grade for item, grade in graded.items() if item not in items}


@pytest.mark.parametrize("target", ["items", "raters", "both", "clusters"])
def test_the_error_is_the_jackknifes_by_leaving_out_one_after_the_other(
    target: Any,
) -> None:
    humans, judge = noisy(np.random.default_rng(4), 45, 5, (1, 2, 3), 0.7)
    clusters = {i: i % 15 for i in range(45)} if target == "clusters" else None
    units = [{i for i in range(45) if i % 15 == k} for k in range(15)]
    if clusters is None:
        units = [{i} for i in range(45) if sum(i in of for of in humans.values()) >= 2]
    variance = 0.0
    if target != "raters":
        rest = [
            plain_advantage({h: without(of, unit) for h, of in humans.items()}, judge)
            for unit in units
        ]
        variance += (len(rest) - 1) * np.var(rest)
    if target in {"raters", "both"}:
        rest = [
            plain_advantage({h: of for h, of in humans.items() if h != name}, judge)
            for name in humans
        ]
        variance += (len(rest) - 1) * np.var(rest)
    estimate = advantage(
        humans,
        judge,
        target="items" if target == "clusters" else target,
        min_items=5,
        clusters=clusters,
    )
    assert estimate.value == pytest.approx(plain_advantage(humans, judge))
    assert estimate.standard_error == pytest.approx(math.sqrt(variance), rel=1e-9)
    # symmetric on the logit, by t of the human with the fewest units, or of humans
    counted = set().union(*units)
    fewest = min(
        sum(any(i in of and i in counted for i in unit) for unit in units)
        for of in humans.values()
    )
    df = (4 if target in {"raters", "both"} else fewest - 1) + 0.0
    slope = estimate.value * (1.0 - estimate.value)
    half = t.ppf(0.975, df) * estimate.standard_error / slope
    ends = expit(logit(estimate.value) + np.array([-half, half]))
    interval = estimate.interval
    assert interval is not None
    assert (interval.low, interval.high) == pytest.approx(tuple(ends), rel=1e-9)


def test_an_advantage_of_1_has_the_interval_of_no_event() -> None:
    # .025 = (1 - p)^40
    humans = {name: by_item("ab" * 20) for name in ("Ann", "Ben")}
    interval = advantage(humans, by_item("ab" * 20), target="items").interval
    assert interval is not None
    assert interval.low == pytest.approx(0.025 ** (1 / 40))
    assert interval.high == 1.0


def test_other_humans_need_three() -> None:
    humans = {name: by_item("ab" * 20) for name in ("Ann", "Ben", "Cem")}
    with (
        pytest.warns(UndefinedStatisticWarning, match="end of its scale"),
        pytest.warns(SmallSampleWarning, match="3 humans"),
    ):
        estimate = advantage(humans, by_item("ab" * 20), target="both")
    assert estimate.interval is not None
    assert math.isnan(estimate.interval.low)


def test_the_interval_of_the_advantage_covers() -> None:
    # 200 studies of 40 items; at a true 95 % fewer than 177 hits have p < 1e-4
    humans, judge = noisy(np.random.default_rng(5), 50_000, 3, (0, 1, 2))
    truth = advantage(humans, judge, target="items").value
    rng, hits = np.random.default_rng(6), 0
    for _ in range(200):
        humans, judge = noisy(rng, 40, 3, (0, 1, 2))
        interval = advantage(humans, judge, target="items").interval
        assert interval is not None
        hits += interval.low <= truth <= interval.high
    assert 177 <= hits


def test_differences_of_judges_are_those_of_their_advantages() -> None:
    humans, one = noisy(np.random.default_rng(7), 90, 4, (1, 2, 3))
    _, other = noisy(np.random.default_rng(8), 90, 1, (1, 2, 3))
    judges = {"one": one, "other": other, "again": one}
    with pytest.warns(UndefinedStatisticWarning, match="standard error is 0"):
        pairs = advantage_differences(humans, judges, target="items")
    by_names = {(pair.first, pair.second): pair for pair in pairs}
    values = [advantage(humans, of, target="items").value for of in (one, other)]
    first, back = by_names["one", "other"], by_names["other", "again"]
    assert first.value == pytest.approx(values[0] - values[1])
    ends, mirrored = first.interval, back.interval
    assert (ends.low, ends.high) == pytest.approx((-mirrored.high, -mirrored.low))
    assert first.p_holm == pytest.approx(2.0 * first.p_value)
    assert math.isnan(by_names["one", "again"].p_value)
    # the interval of level 1 - p ends at 0
    (again,) = advantage_differences(
        humans,
        {"one": one, "other": other},
        target="items",
        level=1.0 - first.p_value,
    )
    ends = again.interval
    assert min(abs(ends.low), abs(ends.high)) == pytest.approx(0.0, abs=1e-9)


def test_one_human_is_compared_by_a_reference() -> None:
    truth, human = by_item("ab" * 20), by_item("bb" + "ab" * 19 + "c")
    result = reference_difference(human, truth | {0: None}, truth, epsilon=0.1)
    assert (result.b, result.c, result.n, result.delta) == (0, 0, 39, -0.1)
    assert result.p_greater == score_test(0, 0, 39, delta=0.1).p_less


# -- clusters --------------------------------------------------------------------------


def test_clusters_of_one_item_are_none_where_many_items_differ() -> None:
    humans, judge = noisy(np.random.default_rng(9), 2000, 3, (0, 1, 2, 3))
    alone = {i: i for i in range(2000)}
    plain = alternative_annotator_test(humans, judge, epsilon=0.03, test="score")
    result = alternative_annotator_test(humans, judge, epsilon=0.03, clusters=alone)
    assert result.n_clusters == 2000
    for human, other in zip(plain.humans, result.humans, strict=True):
        assert other.test == "clusters"
        assert other.p_value == pytest.approx(human.p_value, rel=0.02)


def test_clusters_of_the_same_items_are_as_few_as_they_are() -> None:
    copies = {10 * i + k: i for i in range(50) for k in range(10)}
    humans = {
        name: {item: grades[i] for item, i in copies.items()}
        for name, grades in HUMANS.items()
    }
    judge = {item: JUDGE[i] for item, i in copies.items()}
    result = alternative_annotator_test(humans, judge, epsilon=0.1, clusters=copies)
    for human, other in zip(SMALL["result"]["humans"], result.humans, strict=True):
        # the design effect is 10 but for 50/49; two of 10 (b + c) + 2 say 10
        b, c = human["human_better"], human["judge_better"]
        share = 2 / (2 + 10 * (b + c))
        effect = (10 * share + 10 * 50 / 49 * (1 - share)) / 10
        z = tango(b / effect, c / effect, 50 / effect, 0.1)
        assert other.p_value == pytest.approx(float(stdtr(49, z)), rel=1e-9)


def test_few_clusters_are_warned_of() -> None:
    of = {i: i // 5 for i in JUDGE}
    with pytest.warns(SmallSampleWarning, match="10 clusters"):
        result = alternative_annotator_test(HUMANS, JUDGE, epsilon=0.1, clusters=of)
    assert result.n_clusters == 10
