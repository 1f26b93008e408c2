"""Which model comes next in a training."""

from collections.abc import Mapping, Sequence

from masrel.schedule.presentation import _Stream
from masrel.training._lessons import Lesson
from masrel.training._trainees import BLOCK_REPEATS


def next_model(
    intended: Mapping[str, str],
    lessons: Sequence[Lesson],
    *,
    order: str,
    seed: int,
    rater: str,
) -> tuple[str, bool]:
    """Return the id of the next model, and whether the criterion counts it."""
    # intended: grade by model. Blocks have every model `BLOCK_REPEATS` times; each is
    # drawn by its number alone, so that a training goes on as if nothing had stopped
    # it.
    block_size = BLOCK_REPEATS * len(intended)
    n_counted = sum(lesson.counts for lesson in lessons)
    block, place = divmod(n_counted, block_size)
    if order == "adaptive" and place == 0 and block > 0:
        again = _misgraded(intended, lessons, block_size)
        _Stream(seed, "practice", rater, str(block)).shuffle(again)
        practised = 0
        while not lessons[-1 - practised].counts:
            practised += 1
        if practised < len(again):
            return again[practised], False
    models = [model for model in intended for _ in range(BLOCK_REPEATS)]
    _Stream(seed, "training", rater, str(block)).shuffle(models)
    return models[place], True


def _misgraded(
    intended: Mapping[str, str], lessons: Sequence[Lesson], block_size: int
) -> list[str]:
    # models of the last block to which the rater gave another grade, each once
    counted = [lesson for lesson in lessons if lesson.counts][-block_size:]
    missed = {lesson.model for lesson in counted if lesson.grade != lesson.intended}
    return [model for model in intended if model in missed]
