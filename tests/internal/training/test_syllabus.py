"""Which model comes next: blocks, and practice of what was misgraded."""

from collections import Counter

import pytest

from masrel.training import Lesson
from masrel.training._syllabus import next_model

INTENDED = {"A": "1", "B": "2", "C": "3"}


def taught(order: str, wrong: set[int], n_lessons: int, seed: int = 4) -> list[Lesson]:
    """Lessons of a rater who is wrong at some positions."""
    lessons: list[Lesson] = []
    while len(lessons) < n_lessons:
        model, counts = next_model(
            INTENDED, lessons, order=order, seed=seed, rater="R1"
        )
        position = len(lessons) + 1
        lessons.append(
            Lesson(
                position=position,
                model=model,
                intended=INTENDED[model],
                grade="4" if position in wrong else INTENDED[model],
                counts=counts,
            )
        )
    return lessons


@pytest.mark.parametrize("order", ["blocked", "adaptive"])
def test_every_block_has_each_model_twice(order: str) -> None:
    lessons = taught(order, set(), 24)
    assert all(lesson.counts for lesson in lessons)
    for start in range(0, 24, 6):
        models = Counter(lesson.model for lesson in lessons[start : start + 6])
        assert models == {"A": 2, "B": 2, "C": 2}


def test_the_order_is_of_its_seed_and_block() -> None:
    one, two = (
        [lesson.model for lesson in taught("blocked", set(), 36, seed=s)]
        for s in (4, 5)
    )
    assert one != two
    assert one[:6] != one[6:12] or one[6:12] != one[12:18]


def test_what_was_misgraded_is_practised_once_after_its_block() -> None:
    first = taught("blocked", set(), 6)
    missed = {first[1].model, first[3].model}
    lessons = taught("adaptive", {2, 4}, 6 + len(missed) + 6)
    practice = lessons[6 : 6 + len(missed)]
    assert {lesson.model for lesson in practice} == missed
    assert not any(lesson.counts for lesson in practice)
    # the next block is the one that it would have been, wrong in practice or not
    assert [lesson.model for lesson in lessons[6 + len(missed) :]] == [
        lesson.model for lesson in taught("blocked", set(), 12)[6:]
    ]
    assert all(lesson.counts for lesson in lessons[6 + len(missed) :])


def test_what_is_misgraded_in_practice_is_not_practised_again_at_once() -> None:
    lessons = taught("adaptive", {2, 7}, 8)
    assert [lesson.counts for lesson in lessons] == [True] * 6 + [False, True]
