"""What only a report shows: grades by intended ones, each grade, and effects of order.

Of effects of order a grade counts by its step in the scale, from 0. Each is one
difference of two means for each rater, and its interval is that of a mean difference of
pairs.
"""

import math
import statistics
import warnings
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from masrel.agreement import category_kappa, code_ratings
from masrel.errors import MasrelWarning
from masrel.intervals.diagnosis import _category_arrays, _share_interval
from masrel.lab.analysis._results import PlannedEstimate
from masrel.lab.protocol import Protocol
from masrel.lab.ratings import Ratings, rating_matrix

_Pairs = Mapping[str, tuple[list[float], list[float]]]
"""By rater, the values whose means are compared: the first less the second."""


@dataclass(frozen=True, slots=True, kw_only=True)
class GivenGrades:
    """Grades of the models of one intended grade."""

    intended: str
    counts: tuple[int, ...]  # of each grade of the scale
    n_raters: int
    # part of the grades that are the intended one, and its interval, raters random
    share: float
    low: float
    high: float

    @property
    def n(self) -> int:
        """How many grades there are."""
        return sum(self.counts)


def given_grades(
    protocol: Protocol, ratings: Ratings, level: float
) -> tuple[str | None, tuple[GivenGrades, ...]]:
    """Return the first session that has ratings, and its grades by intended ones."""
    intended = {model.id: model.intended_grade for model in protocol.models}
    graded = [row for row in ratings.rows if row.grade is not None]
    present = {row.session for row in graded}
    session = next((s.id for s in protocol.sessions if s.id in present), None)
    # how often each rater met each intended grade with each grade
    met: dict[str, Counter[tuple[str, str]]] = {}
    for row in graded:
        aim = intended[row.model]
        if row.session == session and row.grade is not None and aim is not None:
            met.setdefault(aim, Counter())[row.rater, row.grade] += 1
    grades = ratings.scale.grades
    return session, tuple(
        _of_aim(aim, met[aim], grades, level) for aim in grades if aim in met
    )


def _of_aim(
    aim: str, met: Counter[tuple[str, str]], grades: tuple[str, ...], level: float
) -> GivenGrades:
    raters = sorted({rater for rater, _ in met})
    every = np.array([[met[rater, grade] for grade in grades] for rater in raters])
    # of each rater how many grades, and how many of them the intended one
    wholes = every.sum(axis=1).astype(np.float64)
    parts = every[:, grades.index(aim)].astype(np.float64)
    low, high = _share_interval(
        level,
        parts=parts.sum(keepdims=True),
        wholes=wholes.sum(keepdims=True),
        squares=np.array([parts @ parts]),
        products=np.array([parts @ wholes]),
        whole_squares=np.array([wholes @ wholes]),
        n_items=np.array([float(len(raters))]),
    )
    return GivenGrades(
        intended=aim,
        counts=tuple(every.sum(axis=0).tolist()),
        n_raters=len(raters),
        share=float(parts.sum() / wholes.sum()),
        low=float(low[0]),
        high=float(high[0]),
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class CategoryAgreement:
    """Agreement of raters on one grade."""

    grade: str
    n_ratings: int  # in the grade
    # specific agreement and its interval, models random; ``nan`` where undefined
    agreement: float
    low: float
    high: float
    kappa: float  # Fleiss' of the grade against all others; ``nan`` where undefined


def category_agreement(
    entry: PlannedEstimate, ratings: Ratings, level: float
) -> tuple[CategoryAgreement, ...]:
    """Return how well raters agree on each grade, by the ratings of a planned line."""
    matrix = rating_matrix(ratings, session=entry.line.sessions[0], models=entry.models)
    grades = ratings.scale.grades
    codes = code_ratings(matrix.grades, grades).codes
    freq = np.ones(len(codes), dtype=np.int64)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", MasrelWarning)  # a grade that nobody gave
        arrays = _category_arrays(codes, freq, len(grades), level)
        kappas = [
            category_kappa(matrix.grades, grade, categories=grades).value
            for grade in grades
        ]
    keys = ("counts", "values", "low", "high")
    columns = [arrays[f"category_{key}"].tolist() for key in keys]
    return tuple(
        CategoryAgreement(
            grade=grade, n_ratings=n, agreement=value, low=low, high=high, kappa=kappa
        )
        for grade, n, value, low, high, kappa in zip(
            grades, *columns, kappas, strict=True
        )
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class _Rated:
    """One grade, and when it was given."""

    session: str
    rater: str
    model: str
    repeat: int
    position: int | None
    step: int  # of the grade in the scale, from 0


@dataclass(frozen=True, slots=True, kw_only=True)
class PlaceSummary:
    """Grades of one part of a session."""

    session: str
    # the first and the last place of the part
    first: int
    last: int
    n: int
    deviation: float  # mean of grades less those of the model's in the session, steps
    # of the standard models
    n_standard: int
    n_intended: int


@dataclass(frozen=True, slots=True, kw_only=True)
class OrderEffect:
    """One difference of means, over raters."""

    kind: str  # "place", "neighbour", "again" or "session"
    sessions: tuple[str, ...]
    n_raters: int
    n_pairs: int | None  # pairs of grades; None where means of many are compared
    n_equal: int | None  # of these
    # steps of the scale; ends are ``nan`` where undefined
    mean: float
    low: float
    high: float
    reason: str | None


def place_summaries(protocol: Protocol, ratings: Ratings) -> tuple[PlaceSummary, ...]:
    """Return the grades of every quarter of each session, or half of a short one."""
    rated = _rated(protocol, ratings)
    deviations = _deviations(rated)
    intended = {m.id: m.intended_grade for m in protocol.models if m.role == "standard"}
    made = []
    for session in dict.fromkeys(each.session for each in rated):
        of_session = [r for r in deviations if r.session == session and r.position]
        n_places = max((r.position or 0 for r in of_session), default=0)
        n_parts = 4 if n_places >= 8 else 2
        for part in range(n_parts if n_places > 1 else 0):
            first = part * n_places // n_parts + 1
            last = (part + 1) * n_places // n_parts
            inside = [r for r in of_session if first <= (r.position or 0) <= last]
            aims = [(r, intended.get(r.model)) for r in inside]
            aimed = [(r, aim) for r, aim in aims if aim is not None]
            values = [deviations[r] for r in inside]
            made.append(
                PlaceSummary(
                    session=session,
                    first=first,
                    last=last,
                    n=len(inside),
                    deviation=statistics.fmean(values) if values else math.nan,
                    n_standard=len(aimed),
                    n_intended=sum(
                        ratings.scale.grades[r.step] == aim for r, aim in aimed
                    ),
                )
            )
    return tuple(made)


def order_effects(
    protocol: Protocol, ratings: Ratings, level: float
) -> tuple[OrderEffect, ...]:
    """Return the effects that the ratings can show."""
    return tuple(_effect(*each, level) for each in compared(protocol, ratings))


def compared(
    protocol: Protocol, ratings: Ratings
) -> list[tuple[str, list[str], _Pairs]]:
    """Return what can be compared: the kind of effect, its sessions and its values."""
    rated = _rated(protocol, ratings)
    deviations = _deviations(rated)
    sessions = list(dict.fromkeys(each.session for each in rated))
    every = [
        ("place", sessions, _halves(deviations)),
        ("neighbour", sessions, _neighbours(deviations)),
        ("again", sessions, _presented_again(rated)),
        *(
            ("session", [one, other], _two_sessions(rated, one, other))
            for one, other in pairwise(sessions)
        ),
    ]
    return [each for each in every if each[2]]


def _rated(protocol: Protocol, ratings: Ratings) -> list[_Rated]:
    # every grade, sessions in the protocol's order
    steps = {grade: step for step, grade in enumerate(ratings.scale.grades)}
    order = {session.id: place for place, session in enumerate(protocol.sessions)}
    rated = [
        _Rated(
            session=row.session,
            rater=row.rater,
            model=row.model,
            repeat=row.repeat,
            position=row.position,
            step=steps[row.grade],
        )
        for row in ratings.rows
        if row.grade is not None
    ]
    return sorted(rated, key=lambda each: order[each.session])


def _deviations(rated: Sequence[_Rated]) -> dict[_Rated, float]:
    # of every grade from the mean of its model in its session, where raters share it
    groups: dict[tuple[str, str], list[_Rated]] = {}
    for each in rated:
        groups.setdefault((each.session, each.model), []).append(each)
    deviations: dict[_Rated, float] = {}
    for group in groups.values():
        if len({each.rater for each in group}) > 1:
            mean = statistics.fmean(each.step for each in group)
            deviations |= {each: each.step - mean for each in group}
    return deviations


def _halves(deviations: Mapping[_Rated, float]) -> _Pairs:
    # deviations in the second half of a session, and in the first
    last: dict[str, int] = {}
    for each in deviations:
        last[each.session] = max(last.get(each.session, 0), each.position or 0)
    return _complete(
        (each.rater, 2 * each.position > last[each.session], deviation)
        for each, deviation in deviations.items()
        if each.position is not None
    )


def _neighbours(deviations: Mapping[_Rated, float]) -> _Pairs:
    # deviations after a model that was graded higher by all, and after a lower one
    places = {(r.session, r.rater, r.position): r for r in deviations}

    def after_another() -> Iterator[tuple[str, bool, float]]:
        for each, deviation in deviations.items():
            if each.position is None:
                continue
            before = places.get((each.session, each.rater, each.position - 1))
            if before is None:
                continue
            # the mean of a model is a grade of it less that grade's deviation
            change = before.step - deviations[before] - (each.step - deviation)
            if abs(change) > 1e-9:
                yield each.rater, change > 0.0, deviation

    return _complete(after_another())


def _presented_again(rated: Sequence[_Rated]) -> _Pairs:
    # grades of the second presentation in a session, and of the first
    first = {(r.session, r.rater, r.model): r for r in rated if r.repeat == 1}
    again = (r for r in rated if r.repeat == 2)
    return _both((first.get((r.session, r.rater, r.model)), r) for r in again)


def _two_sessions(rated: Sequence[_Rated], one: str, other: str) -> _Pairs:
    # grades in the later of two sessions, and in the earlier
    first = {(r.rater, r.model, r.repeat): r for r in rated if r.session == one}
    again = (r for r in rated if r.session == other)
    return _both((first.get((r.rater, r.model, r.repeat)), r) for r in again)


def _both(pairs: Iterator[tuple[_Rated | None, _Rated]]) -> _Pairs:
    by_rater: dict[str, tuple[list[float], list[float]]] = {}
    for before, after in pairs:
        if before is not None:
            later, earlier = by_rater.setdefault(after.rater, ([], []))
            later.append(after.step)
            earlier.append(before.step)
    return by_rater


def _complete(values: Iterator[tuple[str, bool, float]]) -> _Pairs:
    # rater, whether it is of the first kind, value: of raters who have both kinds
    by_rater: dict[str, tuple[list[float], list[float]]] = {}
    for rater, is_first, value in values:
        by_rater.setdefault(rater, ([], []))[not is_first].append(value)
    return {rater: both for rater, both in by_rater.items() if all(both)}


def _effect(
    kind: str, sessions: Sequence[str], pairs: _Pairs, level: float
) -> OrderEffect:
    means = [
        [statistics.fmean(values) for values in of_rater] for of_rater in pairs.values()
    ]
    differences = np.array([first - second for first, second in means])
    n, mean, reason = len(means), float(differences.mean()), None
    low = high = math.nan
    if n == 1:
        reason = "one rater has no spread"
    elif (sd := float(differences.std(ddof=1))) <= 1e-12:
        reason = "it is the same for every rater"
    else:
        from scipy.special import stdtrit  # loaded only when an interval needs it

        half = float(stdtrit(n - 1, 0.5 + 0.5 * level)) / math.sqrt(n) * sd
        low, high = mean - half, mean + half
    n_pairs = n_equal = None
    if kind in ("again", "session"):
        both = [zip(*of_rater, strict=True) for of_rater in pairs.values()]
        equal = [one == other for of_rater in both for one, other in of_rater]
        n_pairs, n_equal = len(equal), sum(equal)
    return OrderEffect(
        kind=kind,
        sessions=tuple(sessions),
        n_raters=len(pairs),
        n_pairs=n_pairs,
        n_equal=n_equal,
        mean=mean,
        low=low,
        high=high,
        reason=reason,
    )
