"""What a file of ratings says beyond its agreement: test and retest, each category.

In: a `RatingsFile` and how every estimate is made. Out: a table, and the same as
plain values for JSON.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from masrel.agreement import (
    BandScale,
    CodedRatings,
    Coefficient,
    WeightName,
    category_kappa,
    code_ratings,
    coefficient,
)
from masrel.errors import MasrelError, ParameterError, RatingsError
from masrel.estimates import Estimate, Interval, Target
from masrel.ratings import RatingsFile, RatingsPart
from masrel.report._agreement_table import (
    AgreementRow,
    agreement_table,
    estimate_documents,
    group_key,
)
from masrel.report._estimate_words import surely_reached
from masrel.report._figure_data import Content
from masrel.report._tables import Table
from masrel.scales import Scale

_SHOWN = 6  # names that a note lists


@dataclass(frozen=True, slots=True, kw_only=True)
class FurtherTable:
    """A table below that of agreement, and the same for JSON."""

    key: str  # what it is called in the JSON
    table: Table
    documents: list[dict[str, object]]
    rows: tuple[AgreementRow, ...] = ()  # the estimates in it, for a figure
    figure: Content | None = None  # what takes the place of that figure


@dataclass(frozen=True, slots=True, kw_only=True)
class Question:
    """How every estimate of a table is made."""

    weights: WeightName = "identity"
    target: Target | None = None  # no interval when None
    interval: Literal["auto", "analytic", "jackknife", "bootstrap", "posterior"] = (
        "auto"
    )
    level: float = 0.95
    # n_resamples, seed: for intervals that draw
    n_resamples: int = 10_000
    seed: int = 0
    explain: bool = False  # whether notes say what an interval promises
    bands: BandScale | None = None  # whose words for values


def data_of(file: RatingsFile) -> str:
    """Return where the ratings of a file come from, as tables have it."""
    return "simulated" if file.simulated else "foreign"


def part_names(file: RatingsFile, part: RatingsPart) -> dict[str, str]:
    """Return what tells a part from the others: names of columns, and what they say."""
    names = {}
    if part.group is not None:
        names[str(file.read["by"])] = part.group
    if part.session is not None and len({other.session for other in file.parts}) > 1:
        names[str(file.read["session"])] = part.session
    return names


def finite(value: object) -> object:
    """Return a value as JSON has it: ``nan`` and infinities as None."""
    is_lost = isinstance(value, float) and not math.isfinite(value)
    return None if is_lost else value


def part_keys(file: RatingsFile, part: RatingsPart) -> dict[str, object]:
    """Return the same for JSON."""
    return {group_key(name): text for name, text in part_names(file, part).items()}


def label(names: Iterable[str]) -> str:
    """Return what something is called, from the group down."""
    return ": ".join(names)


def heading(columns: Iterable[str]) -> str:
    """Return the heading of such names."""
    return ", ".join(columns)


def named(names: Sequence[str]) -> str:
    """Return names as a note lists them."""
    listed = ", ".join(names[:_SHOWN])
    more = len(names) - _SHOWN
    return f"{listed} and {more} more" if more > 0 else listed


def coded_part(part: RatingsPart, option: str) -> CodedRatings:
    """Return the ratings of a part, of which it must be known who rated what."""
    try:
        return code_ratings(part.ratings)
    except RatingsError as error:
        raise RatingsError(f"{option}: {error}") from error


def on_grades(ratings: CodedRatings, entry: Coefficient, scale: Scale) -> CodedRatings:
    """Return ratings with the text of their grades if a metric takes sets of labels."""
    if entry.metric in ("jaccard", "masi"):
        return replace(ratings, categories=scale.grades)
    return ratings


def _estimate_row(
    name: str, ratings: CodedRatings, group: str, question: Question, n_raters: int
) -> AgreementRow:
    # one coefficient, with the interval if there is such a one
    entry, weights = coefficient(name), question.weights
    notes: tuple[str, ...] = ()
    bound = None
    estimate = entry(ratings, weights=weights)
    if question.target is not None:
        interval, notes = _interval(name, ratings, question, weights)
        estimate = _changed(estimate, interval=interval)
        bound = _lower_bound(name, ratings, question, weights, interval)
    return AgreementRow(
        group=group,
        title=entry.title if weights == "identity" else f"{entry.title}, {weights}",
        estimate=_changed(estimate, n_raters=min(estimate.n_raters, n_raters)),
        notes=notes,
        lower_bound=bound,
    )


def _lower_bound(
    name: str,
    ratings: CodedRatings,
    question: Question,
    weights: WeightName,
    interval: Interval | None,
) -> float | None:
    # what the true value reaches, where a word is to be named for it
    if question.bands is None:
        return None

    def at_level(level: float) -> Interval | None:
        return _interval(name, ratings, replace(question, level=level), weights)[0]

    return surely_reached(interval, at_level)


def _interval(
    name: str, ratings: CodedRatings, question: Question, weights: WeightName
) -> tuple[Interval | None, tuple[str, ...]]:
    # the interval of a coefficient, or None and a note that says why there is none
    from masrel import intervals  # a coefficient alone loads no interval

    if question.target is None:
        return None, ()
    try:
        estimate = intervals.estimate(
            name,
            ratings,
            target=question.target,
            method=question.interval,
            weights=weights,
            level=question.level,
            n_resamples=question.n_resamples,
            rng=question.seed,
        )
    except MasrelError as error:
        return None, (f"no interval: {error}",)
    return estimate.interval, ()


def _changed(estimate: Estimate, **fields: object) -> Estimate:
    # `vars` has the standard error as it is: still to be computed when it is read
    return Estimate(**{**vars(estimate), **fields})


def retest_table(
    file: RatingsFile, question: Question, names: Sequence[str] = ("stratified_kappa",)
) -> FurtherTable:
    """Return how well raters agree with themselves, each and all together."""
    if file.read["session"] is None:
        raise ParameterError(
            "--retest: needs --session with the column of the two sessions"
        )
    by = None if file.read["by"] is None else str(file.read["by"])
    rows: list[AgreementRow] = []
    documents: list[dict[str, object]] = []
    notes: list[str] = []
    for group in dict.fromkeys(part.group for part in file.parts):
        pairs = _retest_pairs(file, [p for p in file.parts if p.group == group])
        of_group = _retest_rows(group, pairs, question, names)
        rows += of_group
        notes += pairs.notes
        keys = {} if by is None else {group_key(by): group}
        raters: list[str | None] = [*pairs.raters, *[None] * len(names)]
        documents += [
            {**keys, "rater": rater, **document}
            for rater, document in zip(
                raters, estimate_documents(of_group, bands=question.bands), strict=True
            )
        ]
    table = agreement_table(
        rows,
        caption="Agreement of raters with themselves",
        by=heading(filter(None, (by, "rater"))),
        notes=tuple(notes),
        explain=question.explain,
        bands=question.bands,
        data=data_of(file),
    )
    return FurtherTable(
        key="retest",
        table=replace(table, name="retest"),
        documents=documents,
        rows=tuple(rows),
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class _RetestPairs:
    """The ratings of two sessions, side by side."""

    raters: tuple[str, ...]
    ratings: CodedRatings  # (n_items, 2 n_raters): both sessions of each rater
    notes: tuple[str, ...]  # which sessions, and what was left out


def _retest_rows(
    group: str | None, pairs: _RetestPairs, question: Question, names: Sequence[str]
) -> list[AgreementRow]:
    head = [] if group is None else [group]
    # a single rater says nothing of other raters
    alone = question
    if question.target in ("raters", "both"):
        alone = replace(question, target=None)
    codes = pairs.ratings.codes
    rows = [
        _estimate_row(
            "cohen_kappa",
            replace(pairs.ratings, codes=codes[:, 2 * place : 2 * place + 2]),
            label([*head, rater]),
            alone,
            1,
        )
        for place, rater in enumerate(pairs.raters)
    ]
    everybody = label([*head, "all"])
    return rows + [
        _estimate_row(name, pairs.ratings, everybody, question, len(pairs.raters))
        for name in names
    ]


def _retest_pairs(file: RatingsFile, parts: Sequence[RatingsPart]) -> _RetestPairs:
    # by the names of raters and of items, those of both sessions alone
    of_group = "" if parts[0].group is None else f"{parts[0].group}: "
    _check_sessions(file, parts, of_group)
    raters = _of_both(parts, "a rater", [part.raters for part in parts], of_group)
    items = _of_both(parts, "an item", [part.items for part in parts], of_group)
    codes = np.stack([_aligned(part, items, raters) for part in parts], axis=2)
    return _RetestPairs(
        raters=raters,
        ratings=CodedRatings(
            codes=codes.reshape(len(items), 2 * len(raters)),
            categories=file.scale.values,
        ),
        notes=_left_out(of_group, parts, raters, items),
    )


def _check_sessions(
    file: RatingsFile, parts: Sequence[RatingsPart], of_group: str
) -> None:
    column = file.read["session"]
    if parts[0].session is None:
        raise ParameterError(
            f"--retest: compares the sessions of column {column!r}, so that --by must "
            "not take them apart"
        )
    if len(parts) != 2:
        sessions = [str(part.session) for part in parts]
        raise RatingsError(
            f"--retest: {of_group}needs two sessions in column {column!r}, got "
            f"{len(sessions)} ({named(sessions)})"
        )


def _of_both(
    parts: Sequence[RatingsPart],
    noun: str,
    names: Sequence[tuple[str, ...]],
    of_group: str,
) -> tuple[str, ...]:
    # the names that both sessions have, as they come in the first
    first, second = names
    again = set(second)
    both = tuple(name for name in first if name in again)
    if not both:
        each = (
            f"{named(of)} in {part.session!r}"
            for of, part in zip(names, parts, strict=True)
        )
        raise RatingsError(
            f"--retest: {of_group}needs {noun} of both sessions, got "
            f"{' and '.join(each)}"
        )
    return both


def _aligned(
    part: RatingsPart, items: Sequence[str], raters: Sequence[str]
) -> NDArray[np.signedinteger[Any]]:
    # (n_items, n_raters): the codes of a part in this order
    rows = {item: row for row, item in enumerate(part.items)}
    columns = {rater: column for column, rater in enumerate(part.raters)}
    return coded_part(part, "--retest").codes[
        np.ix_([rows[item] for item in items], [columns[rater] for rater in raters])
    ]


def _left_out(
    of_group: str,
    parts: Sequence[RatingsPart],
    raters: Sequence[str],
    items: Sequence[str],
) -> tuple[str, ...]:
    # which sessions these are, and who and what is of one of them only
    first, second = parts
    notes = [
        f"{of_group}Each rater's grades of {first.session} and of {second.session}."
    ]
    texts, of_both = [], {"rater": set(raters), "item": set(items)}
    for part in parts:
        for noun, names in (("rater", part.raters), ("item", part.items)):
            lone = [name for name in names if name not in of_both[noun]]
            texts += [f"{noun} {named(lone)} ({part.session} only)"] if lone else []
    if texts:
        notes.append(f"{of_group}Left out: {'; '.join(texts)}.")
    return tuple(notes)


def category_table(file: RatingsFile, question: Question) -> FurtherTable:
    """Return how well raters tell each category from all others."""
    rows: list[AgreementRow] = []
    documents: list[dict[str, object]] = []
    for part in file.parts:
        of_part = [
            _category_row(file, part, place, question)
            for place in range(len(file.scale.grades))
        ]
        rows += of_part
        of_grades = estimate_documents(of_part, bands=question.bands)
        documents += [
            {**part_keys(file, part), "category": grade, **document}
            for grade, document in zip(file.scale.grades, of_grades, strict=True)
        ]
    table = agreement_table(
        rows,
        caption="Agreement on each category against all others",
        by=heading([*part_names(file, file.parts[0]), "category"]),
        explain=question.explain,
        bands=question.bands,
        data=data_of(file),
    )
    return FurtherTable(
        key="categories",
        table=replace(table, name="categories"),
        documents=documents,
        rows=tuple(rows),
    )


def _category_row(
    file: RatingsFile, part: RatingsPart, place: int, question: Question
) -> AgreementRow:
    grade = file.scale.grades[place]
    notes: tuple[str, ...] = ()
    bound = None
    estimate = category_kappa(part.counted, file.scale.values[place])
    if question.target is not None and estimate.reason is None:
        # that of Fleiss' kappa of the two categories that the scale is folded to
        folded = _folded(part, place)
        interval = None
        if folded is None:
            notes = ("no interval: counts do not say who rated what",)
        else:
            interval, notes = _interval("fleiss_kappa", folded, question, "identity")
            bound = _lower_bound("fleiss_kappa", folded, question, "identity", interval)
        estimate = _changed(estimate, interval=interval)
    return AgreementRow(
        group=label([*part_names(file, part).values(), grade]),
        title="Fleiss' κ, category",
        estimate=_changed(estimate, weights=grade),
        notes=notes,
        lower_bound=bound,
    )


def _folded(part: RatingsPart, place: int) -> CodedRatings | None:
    """Return the ratings on a scale of one category and the rest."""
    coded = part.counted.coded
    if coded is None:
        return None
    codes = np.where(coded.codes < 0, -1, coded.codes != place)
    return CodedRatings(codes=codes, categories=("this", "other"))
