"""Tests of Dawid and Skene's model and of the effective number of judges."""

import csv
import itertools
import json
import math
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from numpy.typing import NDArray

from docs.make import judge_truth
from docs.make.evidence import EVIDENCE
from masrel.errors import SmallSampleWarning, UndefinedStatisticWarning
from masrel.judges import dawid_skene, dawid_skene_intervals, effective_number

ORACLE = json.loads((Path(__file__).parent / "latent_classes.json").read_text("utf-8"))
PATIENTS = ORACLE["dawid_skene"]  # 45 patients, 5 anaesthetists

Rows = list[tuple[object, object, object]]


def study(seed: int, n_items: int, accuracies: list[float], k: int = 3) -> Rows:
    """Ratings by raters who err evenly, and the truth of items in their names."""
    rng = np.random.default_rng(seed)
    truth = rng.integers(k, size=n_items)
    wrong = rng.integers(1, k, size=(n_items, len(accuracies)))
    errs = rng.random((n_items, len(accuracies))) > accuracies
    grades = (truth[:, None] + errs * wrong) % k
    return [
        ((item, int(truth[item])), f"rater {j}", int(grades[item, j]))
        for item in range(n_items)
        for j in range(len(accuracies))
    ]


def test_the_anaesthetists_are_as_published() -> None:
    fit = dawid_skene(PATIENTS["ratings"])
    assert fit.log_likelihood == pytest.approx(PATIENTS["log_likelihood"], abs=1e-8)
    assert fit.shares == pytest.approx(PATIENTS["class_shares"], abs=1e-8)
    assert fit.confusion == pytest.approx(np.array(PATIENTS["theta"]), abs=1e-8)
    for item, posterior in PATIENTS["posterior_below_99"]:
        place = fit.items.index(item)
        assert fit.posterior[place] == pytest.approx(posterior, abs=1e-8)
    assert (fit.posterior.max(axis=1) < 0.99).sum() == 2
    assert fit.is_converged


def test_a_higher_maximum_of_the_anaesthetists_is_said() -> None:
    fit = dawid_skene(PATIENTS["ratings"])
    known, higher = PATIENTS["higher_maximum"], fit.higher
    assert higher is not None
    assert higher.log_likelihood == pytest.approx(known["log_likelihood"], abs=1e-8)
    assert higher.shares == pytest.approx(known["class_shares"], abs=1e-8)
    theta = np.array(known["theta_rater_1"])
    assert higher.confusion[0] == pytest.approx(theta, abs=1e-8)
    assert "not the highest maximum" in fit.notes[0]


def test_by_hand_two_items_of_which_three_raters_agree_on_one() -> None:
    # item x: a a a, item y: a b b. T = (1, 0), (1/3, 2/3) by votes; the maximum has x
    # in a and y in b: π = 1/2, θ of rater 1 is (1, 0) twice and of the others right:
    # each item has the likelihood 1/2
    rows = [("x", j, "a") for j in range(3)] + [("y", 0, "a"), ("y", 1, "b")]
    fit = dawid_skene([*rows, ("y", 2, "b")])
    assert fit.log_likelihood == pytest.approx(2 * math.log(1 / 2))
    assert fit.shares == pytest.approx([0.5, 0.5])
    assert fit.confusion[0] == pytest.approx(np.array([[1.0, 0.0], [1.0, 0.0]]))
    assert fit.confusion[1] == pytest.approx(np.eye(2), abs=1e-9)
    assert fit.accuracy == pytest.approx([0.5, 1.0, 1.0])


def test_the_log_likelihood_is_that_of_a_plain_loop() -> None:
    rows = study(1, 60, [0.9, 0.7, 0.6])
    fit = dawid_skene(rows)
    graded = dict.fromkeys(fit.items, fit.shares)
    for item, rater, grade in rows:
        column = fit.confusion[fit.raters.index(rater), :, int(str(grade))]
        graded[item] = graded[item] * column
    total = sum(math.log(joint.sum()) for joint in graded.values())
    assert fit.log_likelihood == pytest.approx(total)
    for place, joint in enumerate(graded.values()):
        assert fit.posterior[place] == pytest.approx(joint / joint.sum(), abs=1e-8)


def test_names_and_the_order_of_rows_change_nothing() -> None:
    rows = study(2, 80, [0.9, 0.8, 0.7, 0.6])
    fit = dawid_skene(rows)
    # the order of classes is turned round, and that of raters
    other = dawid_skene([(i, j, -int(str(g))) for i, j, g in reversed(rows)])
    assert other.log_likelihood == pytest.approx(fit.log_likelihood)
    assert other.shares == pytest.approx(fit.shares[::-1], abs=1e-8)
    assert other.confusion == pytest.approx(fit.confusion[::-1, ::-1, ::-1], abs=1e-8)
    assert other.raters == fit.raters[::-1]


def test_every_item_twice_gives_the_same_and_twice_the_log_likelihood() -> None:
    rows = study(3, 50, [0.9, 0.8, 0.6])
    twice = dawid_skene([((copy, i), j, g) for copy in (0, 1) for i, j, g in rows])
    fit = dawid_skene(rows)
    assert twice.log_likelihood == pytest.approx(2 * fit.log_likelihood)
    assert twice.confusion == pytest.approx(fit.confusion, abs=1e-8)


def test_a_frame_by_its_names_and_rows_without_a_grade() -> None:
    rows = study(4, 30, [0.9, 0.8, 0.7])
    frame = pd.DataFrame([*rows, ("x", "rater 0", None)])
    frame.columns = pd.Index(["Document", "annotator", "label"])
    fit = dawid_skene(frame[["label", "Document", "annotator"]])
    assert fit.log_likelihood == dawid_skene(rows).log_likelihood
    assert "x" not in fit.items


@pytest.mark.parametrize("seed", range(5))
def test_who_is_right_is_recovered(seed: int) -> None:
    # θ_kk is a mean over some 330 items: 5 standard errors of .022 are passed by one of
    # 75 cells in 4e-5 of such tests; the classes of items by raters of these accuracies
    # are told with an error of .06, 5 standard errors are .04
    accuracies = [0.9, 0.9, 0.8, 0.7, 0.6]
    fit = dawid_skene(study(10 + seed, 1000, accuracies))
    truth = [item[1] for item in fit.items]  # type: ignore[index]
    assert (fit.posterior.argmax(axis=1) == truth).mean() > 0.9
    right = np.diagonal(fit.confusion, axis1=1, axis2=2)
    assert np.abs(right - np.array(accuracies)[:, None]).max() < 0.15
    assert np.abs(fit.accuracy - accuracies).max() < 0.1


def test_more_patterns_than_are_searched_are_said() -> None:
    fit = dawid_skene(study(5, 3000, [0.6] * 12))
    assert "2000 of" in fit.notes[0]
    assert fit.higher is None


def test_what_is_not_identified_is_said() -> None:
    rows = study(6, 30, [0.9, 0.8, 0.7])
    two = [row for row in rows if row[1] != "rater 2"]
    assert "three ratings" in str(dawid_skene(two).reason)
    again = dawid_skene([*two, *two])
    assert again.reason == "the model is not identified with two raters"
    # rater 2 met no item of class 0
    unmet = [row for row in rows if row[1] != "rater 2" or row[0][1]]  # type: ignore[index]
    perfect = [(i, j, i[1]) for i, j, _ in unmet]  # type: ignore[index]
    fit = dawid_skene(perfect)
    assert np.isnan(fit.confusion[2, 0]).all()
    assert np.isnan(fit.accuracy).tolist() == [False, False, True]
    assert "'rater 2' of class 0" in fit.notes[-1]


def test_intervals_hold_the_estimate_and_repeat() -> None:
    rows = study(7, 100, [0.9, 0.8, 0.8, 0.7])
    first, again = (dawid_skene_intervals(rows, rng=1) for _ in range(2))
    fit = first.fit
    assert (first.shares_low < fit.shares).all()
    assert (fit.shares < first.shares_high).all()
    assert (first.confusion_low <= fit.confusion).all()
    assert (fit.confusion <= first.confusion_high).all()
    assert np.array_equal(first.confusion_low, again.confusion_low)
    assert first.seed == 1
    assert dawid_skene_intervals(rows).seed != dawid_skene_intervals(rows).seed


def test_intervals_of_raters_without_error_are_those_of_beta() -> None:
    # 30 items of two classes by four perfect raters: classes are known, π | data is
    # Beta(1 + 15, 1 + 15), an error Beta(.5, 1.5 + 15); of 16000 draws the ends are
    # within .004 (5 standard errors of a quantile)
    from scipy.stats import beta

    rows = [(i, j, i % 2) for i in range(30) for j in range(4)]
    intervals = dawid_skene_intervals(rows, n_resamples=16_000, rng=2)
    expected = beta.ppf([0.025, 0.975], 16, 16)
    assert intervals.shares_low == pytest.approx([expected[0]] * 2, abs=0.004)
    assert intervals.shares_high == pytest.approx([expected[1]] * 2, abs=0.004)
    upper = beta.ppf(0.975, 0.5, 16.5)
    assert intervals.confusion_high[:, 0, 1] == pytest.approx([upper] * 4, abs=0.008)
    assert intervals.confusion_low[:, 0, 1].tolist() == [0.0] * 4
    assert intervals.confusion_high[:, 0, 0].tolist() == [1.0] * 4
    assert intervals.n_switched == 0


def test_intervals_of_two_raters_are_undefined() -> None:
    rows = study(8, 30, [0.9, 0.8])
    with pytest.warns(UndefinedStatisticWarning, match="three ratings"):
        intervals = dawid_skene_intervals(rows, rng=1)
    assert np.isnan(intervals.shares_low).all()
    assert np.isnan(intervals.confusion_high).all()
    assert intervals.reason == intervals.fit.reason


def test_classes_that_raters_hardly_tell_apart_are_warned_of() -> None:
    with pytest.warns(SmallSampleWarning, match="classes were exchanged"):
        intervals = dawid_skene_intervals(study(9, 40, [0.4, 0.4, 0.4]), rng=1)
    assert intervals.n_switched > 20


# -- how many judges they are worth ----------------------------------------------------


@pytest.mark.filterwarnings("ignore::masrel.errors.SmallSampleWarning")
def test_the_effective_number_is_that_of_the_formula() -> None:
    (case,) = ORACLE["k_eff"]["data"]
    result = effective_number(case["errors"])
    assert result.value == pytest.approx(case["k_eff"], rel=1e-9)
    assert result.mean_correlation == pytest.approx(case["rho"], rel=1e-9)
    named = dict(zip("abcd", case["errors"], strict=True))
    assert effective_number(named).value == result.value
    assert effective_number(pd.DataFrame(named)).value == result.value


@pytest.mark.filterwarnings("ignore::masrel.errors.SmallSampleWarning")
def test_its_interval_is_that_of_leaving_out_each_item() -> None:
    errors = np.random.default_rng(1).random((4, 40)) < 0.3

    def logarithm(part: NDArray[np.bool_]) -> float:
        return math.log(effective_number(part.astype(int)).value)

    left_out = [logarithm(np.delete(errors, item, axis=1)) for item in range(40)]
    error = math.sqrt(39 * np.var(left_out))
    result = effective_number(errors.astype(int))
    half = 2.022690920036762 * error  # t(39)
    assert result.low == pytest.approx(max(result.value * math.exp(-half), 1))
    assert result.high == pytest.approx(result.value * math.exp(half))


def test_judges_who_make_the_same_errors_are_worth_one() -> None:
    same = [[1, 0, 1, 0] * 10] * 3
    with pytest.warns(UndefinedStatisticWarning, match="stays the same"):
        result = effective_number(same)
    assert result.value == pytest.approx(1.0)
    assert math.isnan(result.low)
    assert math.isnan(result.high)


def test_independent_judges_are_worth_as_many_as_they_are() -> None:
    # errors in all combinations alike often
    errors = np.array(list(itertools.product((0, 1), repeat=4)) * 3).T
    result = effective_number(errors)
    assert result.value == pytest.approx(4.0)
    assert result.low < 4.0 < result.high


def test_a_judge_without_error_is_in_no_pair_and_that_is_said() -> None:
    errors = {"a": [1, 0, 1, 0] * 10, "b": [0, 0, 1, 1] * 10, "c": [0] * 40}
    with pytest.warns(SmallSampleWarning, match="0 errors"):
        result = effective_number(errors)
    assert result.left_out == (("a", "c"), ("b", "c"))
    assert result.mean_correlation == pytest.approx(0.0)
    assert result.n_judges == 3
    with (
        pytest.warns(UndefinedStatisticWarning, match="0/0"),
        pytest.warns(SmallSampleWarning),
    ):
        alone = effective_number({"a": errors["a"], "c": errors["c"]})
    assert math.isnan(alone.value)
    assert alone.reason is not None


# -- what the pages show ---------------------------------------------------------------


@pytest.mark.slow
def test_a_row_of_the_study_of_coverage_repeats() -> None:
    """If it does not: ``python -m docs.make.judge_truth``."""
    path = EVIDENCE / "judges_truth.csv"
    rows = list(csv.DictReader(path.read_text("utf-8").splitlines()))
    assert len(rows) == len(judge_truth.CELLS)
    assert judge_truth.row(2) == rows[2]
