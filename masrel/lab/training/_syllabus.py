"""Which model comes next in a training."""

from collections.abc import Mapping, Sequence

from masrel.lab.schedule._secret import Stream
from masrel.lab.training._lessons import Lesson
from masrel.lab.training._trainees import BLOCK_SETS


def next_model(
    intended: Mapping[str, str],
    lessons: Sequence[Lesson],
    *,
    order: str,
    seed: int,
    rater: str,
) -> str:
    """Return the id of the next model."""
    # intended: grade by model. Each draw is of its number alone, or of that and the
    # grades before, so that a training goes on as if nothing had stopped it.
    models = list(intended)
    if order == "blocked":
        block, place = divmod(len(lessons), BLOCK_SETS * len(models))
        return _block(models, Stream(seed, "training", rater, str(block)))[place]
    last = {one.model: one.grade for one in lessons}
    wrong = [
        model for model in models if last.get(model, intended[model]) != intended[model]
    ]
    tickets = [*models, *wrong]  # what was misgraded the last time, twice
    stream = Stream(seed, "training", rater, str(len(lessons)))
    return tickets[stream.below(len(tickets))]


def _block(models: Sequence[str], stream: Stream) -> list[str]:
    # Only that each comes at all is certain: who counts knows next to nothing.
    while True:
        block = [
            models[stream.below(len(models))] for _ in range(BLOCK_SETS * len(models))
        ]
        if set(block) == set(models):
            return block
