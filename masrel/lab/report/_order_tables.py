"""Orders: whether grades depend on them, and how even drawn schedules are.

A grade counts by its step in the scale, from 0. Each effect of order is one difference
of two means for each rater, and its interval is that of a mean difference of pairs.
"""

import math
import statistics
from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict
from itertools import pairwise
from operator import attrgetter

import numpy as np

from masrel.agreement._engine import student_t
from masrel.lab.protocol import Protocol
from masrel.lab.ratings import Rating, Ratings
from masrel.lab.report._material import Material, lacking, sentence
from masrel.lab.schedule.sheets import _OrderBalance
from masrel.pages._sections import Content, Paragraph
from masrel.tables._tables import Column, Table, Value, percent

# By rating, the step of its grade, or how far that is from others'
_Steps = Mapping[Rating, float]

# By rater, the values whose means are compared: the first less the second
_Pairs = Mapping[str, tuple[list[float], list[float]]]


def place_rows(protocol: Protocol, ratings: Ratings) -> list[tuple[Value, ...]]:
    """Return the grades of every quarter of each session, or half of a short one.

    A row has the places, the session, the number of grades, the mean of what they
    differ from those of their model, and how many of standard models there are and are
    the intended ones.
    """
    steps = _steps(protocol, ratings)
    deviations = _deviations(steps)
    intended = {m.id: m.intended_grade for m in protocol.models if m.role == "standard"}
    rows: list[tuple[Value, ...]] = []
    for session in dict.fromkeys(row.session for row in steps):
        of_session = [r for r in deviations if r.session == session and r.position]
        n_places = max((r.position or 0 for r in of_session), default=0)
        n_parts = 4 if n_places >= 8 else 2
        ends = [part * n_places // n_parts for part in range(n_parts + 1)]
        for first, last in pairwise(ends if n_places > 1 else ()):
            inside = [r for r in of_session if first < (r.position or 0) <= last]
            aims = [(r.grade, aim) for r in inside if (aim := intended.get(r.model))]
            mean = (
                statistics.fmean(deviations[r] for r in inside) if inside else math.nan
            )
            n_intended = sum(grade == aim for grade, aim in aims)
            part = _part(first, last)
            rows.append((part, session, len(inside), mean, len(aims), n_intended))
    return rows


def effect_rows(
    protocol: Protocol, ratings: Ratings, level: float
) -> list[tuple[tuple[Value, ...], str | None]]:
    """Return the effects that the ratings can show, and why one has no interval.

    A row has the question, the numbers of raters and of pairs of grades, how many of
    these are equal, and the mean difference with the ends of its interval, in steps.
    """
    steps = _steps(protocol, ratings)
    deviations = _deviations(steps)
    by_session: dict[str, list[Rating]] = defaultdict(list)
    for row in steps:
        by_session[row.session].append(row)
    sessions = list(by_session)
    first, second = ([r for r in steps if r.repeat == n] for n in (1, 2))
    again = _paired(steps, first, second, ("session", "rater", "model"))
    shared = "rater", "model", "repeat"
    compared = [  # the kind of effect, its sessions and its values
        ("place", sessions, _halves(deviations)),
        ("neighbour", sessions, _neighbours(steps, deviations)),
        ("again", sessions, again),
        *(
            ("session", [a, b], _paired(steps, by_session[a], by_session[b], shared))
            for a, b in pairwise(sessions)
        ),
    ]
    return [
        _effect_row(kind, of_sessions, pairs, level)
        for kind, of_sessions, pairs in compared
        if pairs
    ]


def _steps(protocol: Protocol, ratings: Ratings) -> dict[Rating, float]:
    # of every grade, sessions in the protocol's order
    steps = {grade: step for step, grade in enumerate(ratings.scale.grades)}
    order = {session.id: place for place, session in enumerate(protocol.sessions)}
    rows = sorted(ratings.rows, key=lambda row: order[row.session])
    return {row: steps[row.grade] for row in rows if row.grade is not None}


def _deviations(steps: _Steps) -> dict[Rating, float]:
    # of every grade from the mean of its model in its session, where raters share it
    groups: dict[tuple[str, str], list[Rating]] = defaultdict(list)
    for row in steps:
        groups[row.session, row.model].append(row)
    deviations: dict[Rating, float] = {}
    for group in groups.values():
        if len({row.rater for row in group}) > 1:
            mean = statistics.fmean(steps[row] for row in group)
            deviations |= {row: steps[row] - mean for row in group}
    return deviations


def _halves(deviations: _Steps) -> _Pairs:
    # deviations in the second half of a session, and in the first
    last: dict[str, int] = {}
    for row in deviations:
        last[row.session] = max(last.get(row.session, 0), row.position or 0)
    return _complete(
        (row.rater, 2 * row.position > last[row.session], deviation)
        for row, deviation in deviations.items()
        if row.position is not None
    )


def _neighbours(steps: _Steps, deviations: _Steps) -> _Pairs:
    # deviations after a model that was graded higher by all, and after a lower one
    places = {(r.session, r.rater, r.position): r for r in deviations}

    def after_another() -> Iterator[tuple[str, bool, float]]:
        for row, deviation in deviations.items():
            if row.position is None:
                continue
            before = places.get((row.session, row.rater, row.position - 1))
            if before is None:
                continue
            # the mean of a model is a grade of it less that grade's deviation
            change = steps[before] - deviations[before] - (steps[row] - deviation)
            if abs(change) > 1e-9:
                yield row.rater, change > 0.0, deviation

    return _complete(after_another())


def _complete(values: Iterable[tuple[str, bool, float]]) -> _Pairs:
    # rater, whether it is of the first kind, value: of raters who have both kinds
    by_rater: dict[str, tuple[list[float], list[float]]] = {}
    for rater, is_first, value in values:
        by_rater.setdefault(rater, ([], []))[not is_first].append(value)
    return {rater: both for rater, both in by_rater.items() if all(both)}


def _paired(
    steps: _Steps, first: list[Rating], again: list[Rating], shared: tuple[str, ...]
) -> _Pairs:
    # grades given again, and the first ones, of what has these columns in common
    columns = attrgetter(*shared)
    before = {columns(row): steps[row] for row in first}
    return _complete(
        (row.rater, is_later, step)
        for row in again
        if columns(row) in before
        for is_later, step in ((True, steps[row]), (False, before[columns(row)]))
    )


def _effect_row(
    kind: str, sessions: Sequence[str], pairs: _Pairs, level: float
) -> tuple[tuple[Value, ...], str | None]:
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
        half = student_t(level, n - 1) / math.sqrt(n) * sd
        low, high = mean - half, mean + half
    n_pairs = n_equal = None  # where means of many are compared
    if kind in ("again", "session"):
        both = [zip(*of_rater, strict=True) for of_rater in pairs.values()]
        equal = [one == other for of_rater in both for one, other in of_rater]
        n_pairs, n_equal = len(equal), sum(equal)
    question = sentence("order", kind, first=sessions[0], last=sessions[-1])
    return (question, n, n_pairs, n_equal, mean, low, high), reason


def order_section(material: Material) -> Iterator[Content]:
    """Show grades by place, after other models, and when a model came again."""
    protocol, level = material.protocol, material.analysis.level
    ratings = material.ratings.without(material.analysis.excluded)
    effects = effect_rows(protocol, ratings, level)
    if not effects:
        yield lacking(sentence("order", "nothing"))
        return
    yield Paragraph(text=sentence("order", "steps"))
    if places := place_rows(protocol, ratings):
        yield Table(
            name="grades_by_place",
            caption="Grades by the position of the presentation in its session",
            columns=(
                Column(key="places", heading="Positions", align="left"),
                Column(key="session", heading="Session", align="left"),
                Column(key="n_ratings", heading="Ratings"),
                Column(key="deviation_steps", heading="Mean difference", digits=2),
                Column(key="n_standard", heading="Of standard models"),
                Column(key="n_intended", heading="As intended"),
            ),
            rows=tuple(places),
            data=material.data,
        )
    else:
        yield Paragraph(text=sentence("order", "no_places"), absent=True)
    yield Table(
        name="order_effects",
        caption="Differences between grades by order",
        columns=(
            Column(key="effect", heading="Difference", align="left"),
            Column(key="n_raters", heading="Raters"),
            Column(key="n_pairs", heading="Pairs"),
            Column(key="n_equal", heading="Equal pairs"),
            Column(key="mean_steps", heading="Mean", digits=2),
            Column(key="low", heading="Low", digits=2),
            Column(key="high", heading="High", digits=2),
        ),
        rows=tuple(row for row, _ in effects),
        notes=(
            sentence("order", "intervals", level=percent(level)),
            *(
                f"{question}: no interval, as {reason}."
                for (question, *_), reason in effects
                if reason is not None
            ),
        ),
        data=material.data,
    )


_CONCEALED = (
    "Not for raters: this names the models, and counts of few schedules reveal orders."
)
_MAX_COLUMNS = 16  # of places or models
_N_PARTS = 8  # of a session with more places


def summary_table(balances: Sequence[_OrderBalance]) -> Table:
    """Return the fewest and most of each count, a row each session (and site)."""
    has_sites = any(balance.site is not None for balance in balances)
    site = (Column(key="site", heading="Site", align="left"),) if has_sites else ()
    return Table(
        name="orders",
        caption="Orders of the drawn schedules",
        columns=(
            Column(key="session", heading="Session", align="left"),
            *site,
            Column(key="n_schedules", heading="Schedules"),
            Column(key="n_places", heading="Positions"),
            Column(key="in_a_place", heading="Model in a position"),
            Column(key="ordered_pair", heading="Ordered pair"),
            Column(key="twice_in_a_row", heading="Model twice in a row"),
            Column(key="model_run", heading="Run of a model"),
            Column(key="grade_run", heading="of a grade"),
            Column(key="standard_run", heading="of standards"),
        ),
        rows=tuple(
            (
                balance.session,
                *((balance.site,) if has_sites else ()),
                balance.n_schedules,
                balance.n_places,
                _range([freq for row in balance.places for freq in row]),
                _range(balance.of_others),
                sum(run > 1 for run in balance.model_runs),
                max(balance.model_runs),
                max(balance.grade_runs),
                max(balance.standard_runs),
            )
            for balance in balances
        ),
        read=(_CONCEALED,),
        notes=(
            "How often a model has one position in the session, and how often one "
            "model follows another: fewest to most. Twice in a row: number of "
            "schedules in which a model follows itself. Runs: the longest in any "
            "schedule.",
        ),
        data="recorded",
    )


def _range(counts: Sequence[int]) -> str:
    if not counts:
        return "–"
    low, high = min(counts), max(counts)
    return str(low) if low == high else f"{low} to {high}"


def count_tables(balance: _OrderBalance) -> Iterator[Table]:
    """Yield a table of places, and one of ordered pairs unless there are too many."""
    of_session = f"session {balance.session}" + (
        "" if balance.site is None else f", site {balance.site}"
    )
    # every place, or parts of a session as even as can be: first, and after the last
    n_places = balance.n_places
    n_parts = n_places if n_places <= _MAX_COLUMNS else _N_PARTS
    parts = list(pairwise(n_places * part // n_parts for part in range(n_parts + 1)))
    yield Table(
        name="places",
        caption=f"How often each model is in each position, {of_session}",
        columns=(
            Column(key="model", heading="Model", align="left"),
            *(Column(key=f"p{a}", heading=_part(a, b)) for a, b in parts),
        ),
        rows=tuple(
            (model, *(sum(row[a:b]) for a, b in parts))
            for model, row in zip(balance.models, balance.places, strict=True)
        ),
        data="recorded",
    )
    if len(balance.models) <= _MAX_COLUMNS:
        yield Table(
            name="pairs",
            caption=f"How often each model directly follows another, {of_session}",
            columns=(
                Column(key="first", heading="First", align="left"),
                *(Column(key=model, heading=model) for model in balance.models),
            ),
            rows=tuple(
                (model, *row)
                for model, row in zip(balance.models, balance.pairs, strict=True)
            ),
            data="recorded",
        )


def _part(first: int, end: int) -> str:
    return str(end) if end == first + 1 else f"{first + 1}–{end}"


def order_document(balances: Sequence[_OrderBalance]) -> dict[str, object]:
    """Return every count as plain values."""
    return {"note": _CONCEALED, "sessions": [asdict(balance) for balance in balances]}
