"""What raters answered, summed up question by question."""

import math
import statistics
from collections.abc import Sequence
from itertools import pairwise

from masrel.lab.analysis._results import AnswerCount, QuestionSummary
from masrel.lab.protocol import Protocol, Question
from masrel.lab.ratings import RECONSTRUCTED, GivenAnswer

_MOST_BARS = 21  # a range of more whole numbers is counted in tenths
_N_BINS = 10

FEWEST_RATERS = 5
"""With fewer, a summary could show what one of them answered."""


def question_summaries(
    protocol: Protocol, answers: Sequence[GivenAnswer]
) -> tuple[QuestionSummary, ...]:
    """Return a summary of each question in each session, and of each model in it."""
    questions = {
        (questionnaire.id, question.id): question
        for questionnaire in protocol.questionnaires
        for question in questionnaire.questions
    }
    groups: dict[tuple[str, str, str | None, str | None], list[GivenAnswer]] = {}
    for each in answers:
        key = (each.questionnaire, each.question, each.session, each.model)
        groups.setdefault(key, []).append(each)
    # As the protocol has them: the order in which models came says who met which when.
    order = {key: place for place, key in enumerate(questions)}
    sessions = {each.id: place for place, each in enumerate(protocol.sessions)}
    models = {each.id: place for place, each in enumerate(protocol.models)}
    keys = sorted(
        groups,
        key=lambda key: (
            order[key[:2]],
            sessions.get(str(key[2]), len(sessions)),
            models.get(str(key[3]), len(models)),
        ),
    )
    return tuple(_summary(questions[key[:2]], *key, groups[key]) for key in keys)


def _summary(
    question: Question,
    questionnaire: str,
    name: str,
    session: str | None,
    model: str | None,
    group: Sequence[GivenAnswer],
) -> QuestionSummary:
    answered = [each for each in group if each.answer is not None]
    shown = [each.answer for each in answered if question.public or _are_many(answered)]
    numbers = [float(x) for x in shown if isinstance(x, int | float)]
    return QuestionSummary(
        questionnaire=questionnaire,
        question=name,
        session=session,
        model=model,
        n=len(answered),
        n_missing=len(group) - len(answered),
        mean=statistics.fmean(numbers) if numbers else math.nan,
        sd=statistics.stdev(numbers) if len(numbers) > 1 else math.nan,
        median=statistics.median(numbers) if numbers else math.nan,
        least=min(numbers, default=math.nan),
        most=max(numbers, default=math.nan),
        counts=_counts(question, shown) if shown else (),
        is_reconstructed=any(each.grades_from == RECONSTRUCTED for each in group),
    )


def _are_many(answered: Sequence[GivenAnswer]) -> bool:
    # an answer of which nobody knows whose it is stands for a rater
    raters = [each.rater for each in answered]
    return len({*raters} - {None}) + raters.count(None) >= FEWEST_RATERS


def _counts(question: Question, shown: Sequence[object]) -> tuple[AnswerCount, ...]:
    # of each choice or whole number, or of each tenth of a range; none of texts
    if question.range is None:
        return tuple(AnswerCount(label=x, n=shown.count(x)) for x in question.choices)
    low, high = question.range
    if question.type == "whole" and high - low < _MOST_BARS:
        return tuple(
            AnswerCount(label=str(x), n=shown.count(x)) for x in range(low, high + 1)
        )
    width = (high - low) / _N_BINS
    places = [min(int((x - low) / width), _N_BINS - 1) for x in shown]  # type: ignore[operator]
    ends = pairwise(low + width * i for i in range(_N_BINS + 1))
    return tuple(
        AnswerCount(label=f"{left:g}–{right:g}", n=places.count(place))
        for place, (left, right) in enumerate(ends)
    )
