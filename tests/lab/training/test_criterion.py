"""The test that ends a training: its evidence, its kappa, its errors."""

import itertools

import numpy as np
import pytest

from masrel.agreement import cohen_kappa
from masrel.lab.training import Criterion, calibrate, confusion


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(20121)


MAS = ("0", "1", "1+", "2", "3", "4")


def criterion(**changes: object) -> Criterion:
    settings = {
        "grades": MAS,
        "weights": "linear",
        "intended": (1, 2, 3, 4),
        "insufficient": 0.6,
        "sufficient": 0.8,
        "window": 60,
        "max_presentations": 120,
    }
    return Criterion(**{**settings, **changes})  # type: ignore[arg-type]


def test_the_evidence_of_two_models_by_hand() -> None:
    # Grades a and b, reference 0.5; intended and given:   a b | a b | b a
    #                                                      a a | a b | b a
    # After 2: κ = 0 (p_o = 1/2, p_e = 1/2), evidence 2 (0 - 0.5) = -1.
    # After 4: the last 2 are right, 2 (1 - 0.5) = 1; all 4 have p_o = 3/4, p_e = 1/2,
    # κ = 1/2, evidence 0. After 6: the last 4 are right, 4 · 0.5 = 2; all 6 have
    # p_o = 5/6, p_e = 1/2, κ = 2/3, evidence 6 (2/3 - 1/2) = 1.
    two = criterion(
        grades=("a", "b"),
        weights="identity",
        intended=(0, 1),
        insufficient=0.25,
        sufficient=0.75,
        window=6,
    )
    intended, given = np.array([0, 1, 0, 1, 1, 0]), np.array([0, 0, 0, 1, 1, 0])
    assert two.evidence(intended, given) == pytest.approx([-1.0, 1.0, 2.0], abs=1e-12)


@pytest.mark.parametrize("weights", ["identity", "linear", "quadratic"])
def test_the_evidence_is_that_of_the_best_run_looked_at_one_by_one(
    weights: str, rng: np.random.Generator
) -> None:
    rule = criterion(weights=weights, window=20)
    intended = rng.integers(1, 5, size=30)
    codes = np.clip(intended + rng.integers(-1, 2, size=30), 0, 5)
    pairs = [(MAS[i], MAS[j]) for i, j in zip(intended, codes, strict=True)]
    expected = []
    for end in range(4, 29, 4):
        runs = [
            n * (value - rule.reference)
            for n in range(4, min(end, 20) + 1, 4)
            if np.isfinite(
                value := cohen_kappa(
                    pairs[end - n : end], categories=MAS, weights=weights
                ).value
            )
        ]
        expected.append(max(runs))
    assert rule.evidence(intended, codes) == pytest.approx(expected, abs=1e-11)


def test_what_was_before_the_window_says_nothing() -> None:
    rule = criterion(window=8)
    right = np.tile([1, 2, 3, 4], 5)
    wrong_once = right.copy()
    wrong_once[:12] = 0
    after_both = rule.evidence(right, wrong_once)[-1]
    assert after_both == pytest.approx(rule.evidence(right, right)[-1], abs=1e-12)
    assert after_both == pytest.approx(8 * 0.3, abs=1e-12)


def test_kappa_of_probabilities_is_that_of_very_many_grades(
    rng: np.random.Generator,
) -> None:
    rule = criterion()
    table = confusion("shift", 0.6, 6, rule.intended)
    intended = np.repeat([1, 2, 3, 4], 20_000)
    codes = (rng.random(80_000)[:, None] > table.cumsum(axis=1)[intended]).sum(axis=1)
    pairs = np.column_stack([intended, codes])
    many = cohen_kappa(pairs, categories=range(6), weights="linear")
    # four standard errors: a false alarm in 16 000
    assert rule.kappa(table) == pytest.approx(many.value, abs=4.0 * many.standard_error)


def test_the_errors_are_those_of_all_courses_a_training_can_take() -> None:
    # Two models and six presentations, which are one block: 2^6 orders but the two with
    # one model alone, and 2^6 ways to err, each with its probability.
    rule = criterion(
        grades=("a", "b"),
        weights="identity",
        intended=(0, 1),
        insufficient=0.2,
        sufficient=0.7,
        window=6,
        max_presentations=6,
    )
    result = calibrate(rule, false_pass=0.1, rng=5, n_simulated=20_000)
    orders = itertools.product([0, 1], repeat=6)
    courses = np.array([order for order in orders if len(set(order)) == 2])
    for errors in result.errors:
        for kappa, share in (
            (0.2, errors.false_pass),
            (0.7, None if errors.false_fail is None else 1.0 - errors.false_fail),
        ):
            exact = 0.0
            # κ = 1 - 2 e with errors alike, which "shift" has not
            if errors.skill == "shift" or share is None:
                continue
            chance = 0.5 * (1.0 - kappa)
            for wrong in itertools.product([0, 1], repeat=6):
                passes = (
                    rule.evidence(courses, courses ^ np.array(wrong)) >= result.boundary
                ).any(axis=1)
                n_wrong = sum(wrong)
                exact += (
                    chance**n_wrong * (1.0 - chance) ** (6 - n_wrong) * passes.mean()
                )
            # four standard errors of a share of 20 000
            assert share == pytest.approx(
                exact, abs=4.0 * (exact * (1.0 - exact) / 20_000) ** 0.5
            )


def test_no_kind_of_trainee_passes_too_often_and_one_nearly_as_often_as_may_be() -> (
    None
):
    result = calibrate(criterion(), false_pass=0.1, rng=2, n_simulated=1_000)
    shares = [errors.false_pass for errors in result.errors]
    known = [share for share in shares if share is not None]
    # two standard errors of a share of 1000 below, and a trainee at most
    assert max(known) == pytest.approx(0.1 - 2.0 * (0.09 / 1_000) ** 0.5, abs=1e-3)
    assert result.false_fail == max(e.false_fail or 0.0 for e in result.errors)


def test_the_boundary_rises_with_fewer_errors_and_with_more_looks() -> None:
    def boundary(false_pass: float, longest: int) -> float:
        rule = criterion(max_presentations=longest)
        return calibrate(rule, false_pass=false_pass, rng=3, n_simulated=500).boundary

    assert boundary(0.2, 48) < boundary(0.02, 48) < boundary(0.02, 160)


def test_noise_is_a_normal_variable_rounded(rng: np.random.Generator) -> None:
    table = confusion("noise", 0.7, 5, (0, 1, 2, 3, 4))
    felt = np.rint(2.0 + 0.7 * rng.standard_normal(100_000)).clip(0, 4)
    freq = np.bincount(felt.astype(int), minlength=5) / 100_000
    expected = 0.98 * freq + 0.02 / 5  # lapses give any grade
    assert table[2] == pytest.approx(expected, abs=4.0 * (0.25 / 100_000) ** 0.5)
    assert table.sum(axis=1) == pytest.approx(1.0)


def test_a_range_is_of_the_grades_that_models_have() -> None:
    # the same as noise of those grades that are left: 0 and 4 of six are not
    noise, table = (
        confusion("noise", 0.9, 6, (1, 2, 3, 4)),
        confusion("range", 0.9, 6, (1, 2, 3, 4)),
    )
    assert table[1:5, [0, 5]].max() == 0.0
    left = noise[1:5, 1:5] / noise[1:5, 1:5].sum(axis=1, keepdims=True)
    assert table[1:5, 1:5] == pytest.approx(left)
