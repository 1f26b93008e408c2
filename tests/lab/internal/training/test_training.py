"""The test that ends a training, which model comes next, and what it counts."""

import itertools
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from masrel.agreement import cohen_kappa
from masrel.lab._event_log import Event
from masrel.lab.protocol import copy_template, presented_hash, read_protocol
from masrel.lab.training._criterion import Calibration, Criterion, calibrate
from masrel.lab.training._lessons import SETTINGS, Lesson, record_of
from masrel.lab.training._trainees import (
    adaptive_weights,
    confusion,
    draw_blocks,
    draw_training,
)
from masrel.lab.training._trainer import next_model


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
    codes, grades = np.array([0, 1, 0, 1, 1, 0]), np.array([0, 0, 0, 1, 1, 0])
    assert two.evidence(codes, grades) == pytest.approx([-1.0, 1.0, 2.0], abs=1e-12)
    # what was before the window says nothing
    rule, right = criterion(window=8), np.tile([1, 2, 3, 4], 5)
    wrong_once = np.where(np.arange(20) < 12, 0, right)
    after_both = rule.evidence(right, wrong_once)[-1]
    assert after_both == pytest.approx(8 * 0.3, abs=1e-12)
    assert after_both == pytest.approx(rule.evidence(right, right)[-1], abs=1e-12)


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
    result = calibrate(rule, false_pass=0.1, rng=5, n_simulated=4_000)
    orders = itertools.product([0, 1], repeat=6)
    courses = np.array([order for order in orders if len(set(order)) == 2])
    passing = {kind: 1.0 - fails for kind, fails in result.false_fails.items()}
    assert {"noise", "pair"} <= {*passing} & {*result.false_passes}
    for kappa, shares in ((0.2, result.false_passes), (0.7, passing)):
        exact, chance = 0.0, 0.5 * (1.0 - kappa)
        for wrong in itertools.product([0, 1], repeat=6):
            evidence = rule.evidence(courses, courses ^ np.array(wrong))
            passes = (evidence >= result.boundary).any(axis=1)
            n_wrong = sum(wrong)
            exact += chance**n_wrong * (1.0 - chance) ** (6 - n_wrong) * passes.mean()
        # four standard errors of a share of 4 000
        error = (exact * (1.0 - exact) / 4_000) ** 0.5
        for kind, share in shares.items():
            # κ = 1 - 2 e with errors alike, which "shift" has not
            assert kind == "shift" or share == pytest.approx(exact, abs=4.0 * error)


def test_no_kind_of_trainee_passes_too_often_and_one_nearly_as_often_as_may_be() -> (
    None
):
    def calibrated_at(false_pass: float, longest: int) -> Calibration:
        rule = criterion(max_presentations=longest)
        return calibrate(rule, false_pass=false_pass, rng=3, n_simulated=300)

    result = calibrated_at(0.1, 48)
    # two standard errors of a share of 300 below, and a trainee at most
    share = max(result.false_passes.values())
    assert share == pytest.approx(0.1 - 2.0 * (0.09 / 300) ** 0.5, abs=1 / 300)
    assert result.false_fail == max(result.false_fails.values())
    # the boundary rises with fewer errors and with more looks
    assert result.boundary < calibrated_at(0.02, 48).boundary
    assert calibrated_at(0.02, 48).boundary < calibrated_at(0.02, 120).boundary


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


INTENDED = {"A": "1", "B": "2", "C": "3"}


def taught(
    order: str, n_lessons: int, wrong: frozenset[str] = frozenset(), seed: int = 4
) -> list[str]:
    """Models of the lessons of a rater who misgrades some of them."""
    lessons: list[Lesson] = []
    for position in range(1, n_lessons + 1):
        model = next_model(INTENDED, lessons, order=order, seed=seed, rater="R1")
        lessons.append(
            Lesson(
                position=position,
                model=model,
                intended=INTENDED[model],
                grade="4" if model in wrong else INTENDED[model],
            )
        )
    return [lesson.model for lesson in lessons]


def test_blocks_have_each_model_are_otherwise_free_and_the_same_each_time() -> None:
    for seed in range(50):
        models = taught("blocked", 18, seed=seed)
        assert set(models[:9]) == set(models[9:]) == {"A", "B", "C"}
    # what was graded moves nothing
    order = taught("blocked", 36)
    assert order == taught("blocked", 36, frozenset("AB"))
    assert order != taught("blocked", 36, seed=5)
    blocks = draw_blocks(3, (4_000, 18), np.random.default_rng(3))
    blocks = blocks.reshape(-1, 9)
    assert all(len(set(block)) == 3 for block in blocks.tolist())
    # Of 3^9 sequences 3^9 - 3 * 2^9 + 3 = 18 150 have all three, 9!/(3!)^3 = 1680 of
    # them each three times; four standard errors of a share of 8 000
    even = np.mean([Counter(b) == {0: 3, 1: 3, 2: 3} for b in blocks.tolist()])
    share = 1680 / 18150
    assert even == pytest.approx(share, abs=4.0 * (share * (1 - share) / 8_000) ** 0.5)


def test_the_adaptive_order_of_trainees_is_that_of_raters() -> None:
    # the third grade is always given wrong
    table = np.eye(4)
    table[2] = [1.0, 0.0, 0.0, 0.0]
    intended, codes, weights = draw_training(
        table, (0, 1, 2), "adaptive", (2_000, 60), np.random.default_rng(1)
    )
    # by what it counts, each model is as frequent as any other
    assert weights is not None
    counted = np.bincount(intended.ravel(), weights.ravel()) / intended.size
    assert counted == pytest.approx([1.0 / 3.0] * 3, abs=0.01)
    assert (codes[intended == 2] == 0).all()
    assert (codes[intended < 2] == intended[intended < 2]).all()
    rater = Counter(
        model
        for seed in range(300)
        for model in taught("adaptive", 60, frozenset("C"), seed=seed)
    )
    # 1/2 once C has come for the first time
    assert rater["C"] / 18_000 == pytest.approx(0.5, abs=0.015 + 0.01)
    shares = np.bincount(intended.ravel()) / intended.size
    expected = [rater[model] / 18_000 for model in "ABC"]
    assert shares == pytest.approx(expected, abs=0.02)


def test_what_a_presentation_counts_by_hand() -> None:
    # Of two models, chances 1/2; B misgraded: A 1/3, B 2/3; right again: 1/2
    models, wrong = np.array([1, 1, 0]), np.array([True, False, False])
    expected = [1.0, 0.5 / (2.0 / 3.0), 1.0]
    assert adaptive_weights(models, wrong, 2) == pytest.approx(expected)
    models, wrong = np.array([1, 0, 0]), np.array([True, True, False])
    assert adaptive_weights(models, wrong, 2) == pytest.approx([1.0, 1.5, 1.0])


def test_a_training_begun_without_weights_ends_without(tmp_path: Path) -> None:
    copy_template("small", tmp_path)
    protocol = read_protocol(tmp_path / "protocol.toml")
    rules = {name: getattr(protocol.training, name) for name in SETTINGS}
    header = {
        **rules,
        **{"rater": "R1", "presented_sha256": presented_hash(protocol)},
        **{"order": "adaptive", "boundary": 1.0, "calibrated_false_fail": 0.1},
        **{"order_seed": 1, "simulated": True},
    }
    models = [(m.id, m.intended_grade) for m in protocol.models if m.intended_grade]
    lessons = [
        {"position": at, "model": model, "intended": grade, "grade": "1"}
        for at, (model, grade) in enumerate(models * 3, start=1)
    ]

    def evidence(**more: object) -> list[float]:
        events = [("training", header | more), *(("grade", each) for each in lessons)]
        log = [
            Event(line=line, kind=kind, time_utc="", fields=fields)
            for line, (kind, fields) in enumerate(events, start=1)
        ]
        return list(record_of(tmp_path, log, protocol).evidence())

    assert evidence() == evidence(is_weighted=False)
    assert evidence() != evidence(is_weighted=True)
