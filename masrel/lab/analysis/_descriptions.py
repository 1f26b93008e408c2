"""Descriptions: grades as intended and in person, speeds, and what was answered."""

import math
import statistics
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from itertools import pairwise, product
from operator import attrgetter

from masrel.errors import RatingsError
from masrel.lab.analysis._results import (
    AnswerCount,
    InPersonAgreement,
    InPersonPair,
    IntendedAgreement,
    ModelAgreement,
    Presentations,
    QuestionSummary,
    Speed,
    Speeds,
    SpeedSummary,
)
from masrel.lab.protocol import Protocol, Question
from masrel.lab.ratings import (
    RECONSTRUCTED,
    GivenAnswer,
    InPerson,
    InPersonRow,
    Rating,
    Ratings,
)

_SessionUnit = tuple[str, str]  # a session, and a model or a rater


def intended_agreement(
    protocol: Protocol, ratings: Ratings, session: str | None
) -> IntendedAgreement:
    """Return how many raters gave each standard model its intended grade."""
    # [1] Park, H.-S., Kim, J., Damiano, D. L. (2012). Development of a Haptic Elbow
    # Spasticity Simulator (HESS). IEEE TNSRE, 20(3), 361-370, section IV.B.
    # https://doi.org/10.1109/TNSRE.2012.2195330
    # what was too slow to be felt has no grade as intended, whichever it was given
    graded = Counter(
        (row.model, None if row.felt == "below-threshold" else row.grade)
        for row in ratings.rows
        if row.session == session and row.grade is not None
    )
    n_ratings = Counter(model for model, _ in graded.elements())
    models = [
        ModelAgreement(
            model=model.id,
            intended_grade=aim,
            n_ratings=n_ratings[model.id],
            n_agree=graded[model.id, aim],
            percent=100.0 * graded[model.id, aim] / n_ratings[model.id]
            if n_ratings[model.id]
            else math.nan,
        )
        for model in (protocol.models if session is not None else ())
        if model.role == "standard" and (aim := model.intended_grade) is not None
    ]
    percents = [row.percent for row in models if row.n_ratings]
    reasons = (
        (session is None, "no session of the protocol has ratings"),
        (not models, "no standard model has an intended grade"),
        (not percents, "no standard model has a rating"),
        (len(percents) == 1, "one model has no standard deviation over models"),
    )
    return IntendedAgreement(
        session=session if models else None,
        models=tuple(models),
        mean=statistics.fmean(percents) if percents else math.nan,
        sd=statistics.stdev(percents) if len(percents) > 1 else math.nan,
        reason=next((reason for is_so, reason in reasons if is_so), None),
    )


def in_person_agreement(
    ratings: Ratings, in_person: InPerson | None, session: str | None
) -> InPersonAgreement:
    """Return pairs of grades given in person and the same rater's haptic grades."""
    reason = "no grades given in person belong to these ratings"
    entries: list[tuple[InPersonRow, str | None]] = []
    if in_person is not None:
        reason = "no rater has a grade both in person and haptic"
        entries = _entries(in_person, ratings, session)
    pairs = tuple(
        InPersonPair(
            rater=row.rater,
            model=row.model,
            in_person=row.in_person_grade,
            haptic=grade,
        )
        for row, grade in entries
        if row.in_person_grade is not None and grade is not None
    )
    return InPersonAgreement(
        session=session,
        pairs=pairs,
        n_pairs=len(pairs),
        n_equal=sum(pair.in_person == pair.haptic for pair in pairs),
        n_unpaired=len(entries) - len(pairs),
        reason=None if pairs else reason,
    )


def _entries(
    in_person: InPerson, ratings: Ratings, session: str | None
) -> list[tuple[InPersonRow, str | None]]:
    # Every in-person entry with its haptic grade: the one printed beside it in the
    # same file, or, where the file has none, the one in the ratings.
    graded = [
        row for row in ratings.rows if row.session == session and row.grade is not None
    ]
    # Last to first: of repeated presentations the first one counts.
    graded.sort(key=attrgetter("repeat"), reverse=True)
    haptic = {(row.rater, row.model): row.grade for row in graded}
    rows = in_person.rows
    printed = {row.source_table for row in rows if row.haptic_grade is not None}
    if not printed:
        return [(row, haptic.get((row.rater, row.model))) for row in rows]
    for row in rows:
        rated = haptic.get((row.rater, row.model))
        if None not in (row.haptic_grade, rated) and row.haptic_grade != rated:
            raise RatingsError(
                f"{in_person.source_path}: line {row.line}, column 'haptic_grade': "
                f"the ratings hold {rated!r} for rater {row.rater}, model {row.model}, "
                f"got {row.haptic_grade!r}"
            )
    # A table without any haptic grade repeats the in-person grades of another.
    return [(row, row.haptic_grade) for row in rows if row.source_table in printed]


def stretching_speeds(protocol: Protocol, ratings: Ratings) -> Speeds:
    """Return the mean speeds of the stretches, and summaries of them."""
    known = [row for row in ratings.rows if not math.isnan(row.mean_speed_deg_s)]
    values = tuple(speed for row in known for speed in _speeds_of(row))
    sessions = [session.id for session in protocol.sessions]
    models = [((v.session, v.model), v.mean_speed_deg_s) for v in values]
    raters = [((v.session, v.rater), v.mean_speed_deg_s) for v in values]
    return Speeds(
        values=values,
        by_model=_summaries(models, product(sessions, [m.id for m in protocol.models])),
        by_rater=_summaries(raters, product(sessions, [r.id for r in protocol.raters])),
        n_missing=len(ratings.rows) - len(known),
        reason=None if values else "no rating comes with a stretching speed",
    )


def _speeds_of(row: Rating) -> Iterator[Speed]:
    # of each stretch that has one; of all together where the ratings say no more
    made: dict[int | None, float | None] = {None: row.mean_speed_deg_s}
    if row.speeds_deg_s is not None:
        made = {**dict(enumerate(row.speeds_deg_s, start=1))}
    for stretch, speed in made.items():
        if speed is not None:
            yield Speed(
                session=row.session,
                rater=row.rater,
                model=row.model,
                mean_speed_deg_s=float(speed),
                stretch=stretch,
                is_graded=stretch is not None and stretch == row.graded_stretch,
            )


def presentations(ratings: Ratings) -> Presentations | None:
    """Count stretches, and presentations in which nothing could be felt."""
    known = [row for row in ratings.rows if row.n_stretches is not None]
    if not known:
        return None
    felt = [row.felt for row in known]
    grips = [row.grip_lost for row in known if row.grip_lost is not None]
    return Presentations(
        n_presentations=len(known),
        n_stretches=sum(row.n_stretches or 0 for row in known),
        n_felt=felt.count("felt"),
        n_below_threshold=felt.count("below-threshold"),
        n_no_catch=felt.count("no-catch"),
        n_unknown=felt.count(None),
        n_grip_lost=sum(grips) if grips else None,
    )


def _summaries(
    speeds: Iterable[tuple[_SessionUnit, float]], places: Iterable[_SessionUnit]
) -> tuple[SpeedSummary, ...]:
    # places: sessions with names of models or raters, in the protocol's order
    groups: dict[_SessionUnit, list[float]] = {}
    for place, speed in speeds:
        groups.setdefault(place, []).append(speed)
    return tuple(
        SpeedSummary(
            session=place[0],
            name=place[1],
            n=len(of_place),
            mean=statistics.fmean(of_place),
            sd=statistics.stdev(of_place) if len(of_place) > 1 else math.nan,
            least=min(of_place),
            most=max(of_place),
        )
        for place in places
        if (of_place := groups.get(place))
    )


_MOST_BARS = 21  # a range of more whole numbers is counted in tenths
_N_BINS = 10

FEWEST_RATERS = 5
"""With fewer, a summary could show what one of them answered."""


def question_summaries(
    protocol: Protocol, answers: Sequence[GivenAnswer]
) -> tuple[QuestionSummary, ...]:
    """Return a summary of each question in each session, and of each model in it."""
    groups: dict[tuple[str, str, str | None, str | None], list[GivenAnswer]] = {}
    for each in answers:
        key = (each.questionnaire, each.question, each.session, each.model)
        groups.setdefault(key, []).append(each)
    # As the protocol has them: the order in which models came says who met which when.
    places = product(
        [
            (of.id, question)
            for of in protocol.questionnaires
            for question in of.questions
        ],
        (*(session.id for session in protocol.sessions), None),
        (*(model.id for model in protocol.models), None),
    )
    return tuple(
        _summary(question, *key, group)
        for (of, question), session, model in places
        if (group := groups.get(key := (of, question.id, session, model)))
    )


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
