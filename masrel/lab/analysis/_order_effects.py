"""Whether grades depend on when a model came: its place, its neighbour, its return.

A grade counts by its step in the scale, from 0. Every effect is one difference of two
means for each rater, and its interval is that of a mean difference of pairs.
"""

import math
import statistics
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from masrel.lab.protocol import Protocol
from masrel.lab.ratings import Ratings

_Pairs = Mapping[str, tuple[list[float], list[float]]]
"""By rater, the values whose means are compared: the first less the second."""


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
