"""Which model comes next, and what a presentation counts."""

from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from masrel.lab.protocol import StudyPaths, copy_template, read_protocol
from masrel.lab.run import read_log
from masrel.lab.training import Lesson, SimulatedTrainee, train_rater
from masrel.lab.training._lessons import record_of
from masrel.lab.training._trainees import (
    adaptive_weights,
    draw_blocks,
    draw_training,
)
from masrel.lab.training._trainer import next_model

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


def test_every_block_has_each_model() -> None:
    for seed in range(50):
        models = taught("blocked", 18, seed=seed)
        assert set(models[:9]) == set(models[9:]) == {"A", "B", "C"}


def test_the_blocks_of_trainees_have_each_model_and_are_otherwise_free() -> None:
    blocks = draw_blocks(3, (4_000, 18), np.random.default_rng(3))
    blocks = blocks.reshape(-1, 9)
    assert all(len(set(block)) == 3 for block in blocks.tolist())
    # Of 3^9 sequences 3^9 - 3 * 2^9 + 3 = 18 150 have all three, 9!/(3!)^3 = 1680 of
    # them each three times; four standard errors of a share of 8 000
    even = np.mean([Counter(b) == {0: 3, 1: 3, 2: 3} for b in blocks.tolist()])
    share = 1680 / 18150
    assert even == pytest.approx(share, abs=4.0 * (share * (1 - share) / 8_000) ** 0.5)


def test_the_order_is_of_its_seed_and_the_same_each_time() -> None:
    assert taught("blocked", 36) == taught("blocked", 36)
    assert taught("blocked", 36) != taught("blocked", 36, seed=5)
    # what was graded moves nothing
    assert taught("blocked", 36) == taught("blocked", 36, frozenset("AB"))


def test_adaptive_presents_what_is_misgraded_twice_as_often() -> None:
    models = Counter(
        model
        for seed in range(100)
        for model in taught("adaptive", 60, frozenset("C"), seed=seed)
    )
    # 1/2 once C has come for the first time; four standard errors of a share of 6 000
    # and the first few presentations
    assert models["C"] / 6_000 == pytest.approx(0.5, abs=0.026 + 0.01)
    assert models["A"] / 6_000 == pytest.approx(0.25, abs=0.023)


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


RULES = """
[training]
order = "adaptive"
kappa_insufficient = 0.3
kappa_sufficient = 0.95
false_pass = 0.2
window = 24
max_presentations = 32
"""


def test_a_training_begun_without_weights_ends_without(tmp_path: Path) -> None:
    copy_template("small", tmp_path / "study")
    paths = StudyPaths(tmp_path / "study")
    with paths.protocol.open("a", encoding="utf-8") as file:
        file.write(RULES)
    protocol = read_protocol(paths.protocol)
    trainee = SimulatedTrainee(protocol)
    now = train_rater(paths, protocol, "R1", grades=trainee, clock="simulated")
    log = paths.training_log_file("R1")
    first, *others = read_log(log)
    fields = {k: v for k, v in first.fields.items() if k != "is_weighted"}
    old = record_of(log, [replace(first, fields=fields), *others], protocol)
    code = {grade: at for at, grade in enumerate(old.criterion.grades)}
    intended = np.array([code[one.intended] for one in old.lessons])
    given = np.array([code[one.grade] for one in old.lessons])
    alike = old.criterion.evidence(intended, given)
    assert old.evidence() == pytest.approx(alike, abs=0.0)
    assert now.evidence() != pytest.approx(alike)
