"""How much the groups of a file differ in agreement: pair by pair, and all at once.

In: a `RatingsFile` whose parts are the groups. Out: rows of the differences of
coefficients with their tests, and of tests that all groups agree as well.
"""

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from masrel.agreement import CodedRatings, Coefficient, Significance, holm
from masrel.analysis._file_estimates import (
    Answer,
    EstimateOptions,
    Note,
    Row,
    on_grades,
)
from masrel.analysis._file_questions import coded_part, label, part_names
from masrel.errors import MasrelError, ParameterError, RatingsError
from masrel.estimates import Estimate, as_document
from masrel.ratings import RatingsFile, RatingsPart
from masrel.scales import Scale

# Tests that all groups agree as well.
FLEISS = "Fleiss' weighted χ²"
DONNER = "Donner's goodness of fit"
HOTELLING = "Hotelling's T² as F"

_INTRACLASS = ("fleiss_kappa", "scott_pi")
"""Coefficients that are the intraclass kappa of two raters and two categories."""


@dataclass(frozen=True, slots=True, kw_only=True)
class _Groups:
    """The ratings of several groups."""

    # row by row the same items, if they are dependent; then with gaps for items of
    # other groups
    sets: tuple[CodedRatings, ...]
    is_dependent: bool  # whether groups have items, or clusters, in common
    same_items: bool  # whether all are of the same items
    n_shared: int  # names of items that all have
    # of every row if they are dependent, else of the rows of each; None without any
    clusters: tuple[str, ...] | tuple[tuple[str, ...], ...] | None


def _groups_of(parts: Sequence[RatingsPart]) -> _Groups:
    """Return groups with the same items in the same rows; others have their own."""
    coded = [coded_part(part, "--compare") for part in parts]
    rated = [_rated_rows(*both) for both in zip(parts, coded, strict=True)]
    items = [frozenset(rows) for rows in rated]
    has_clusters = any(part.clusters for part in parts)
    n_shared = len(frozenset.intersection(*items))
    if len(set(items)) == len(parts) and not _share_clusters(parts):
        return _Groups(
            sets=tuple(coded),
            is_dependent=False,
            n_shared=n_shared,
            same_items=False,
            clusters=tuple(part.clusters for part in parts) if has_clusters else None,
        )
    starts: dict[frozenset[str], tuple[int, list[str]]] = {}
    n_rows = 0
    for names, rows in zip(items, rated, strict=True):
        if names not in starts:
            starts[names] = n_rows, list(rows)
            n_rows += len(rows)
    placed = []  # first row of each group, and which of its own rows come there
    for names, rows in zip(items, rated, strict=True):
        start, order = starts[names]
        placed.append((start, [rows[item] for item in order]))
    return _Groups(
        sets=tuple(
            _in_rows(ratings, *rows, n_rows)
            for ratings, rows in zip(coded, placed, strict=True)
        ),
        is_dependent=True,
        n_shared=n_shared,
        same_items=len(starts) == 1,
        clusters=_row_clusters(parts, placed, n_rows) if has_clusters else None,
    )


def _in_rows(
    ratings: CodedRatings, start: int, places: Sequence[int], n_rows: int
) -> CodedRatings:
    # with gaps for items of other groups
    codes = np.full((n_rows, ratings.codes.shape[1]), -1, ratings.codes.dtype)
    codes[start : start + len(places)] = ratings.codes[places]
    return replace(ratings, codes=codes)


def _row_clusters(
    parts: Sequence[RatingsPart], placed: Sequence[tuple[int, list[int]]], n_rows: int
) -> tuple[str, ...]:
    clusters = [""] * n_rows
    for part, (start, places) in zip(parts, placed, strict=True):
        for row, place in enumerate(places, start):
            if clusters[row] not in ("", part.clusters[place]):
                raise RatingsError(
                    f"--compare: item {part.items[place]!r} needs one cluster in all "
                    f"groups, got {clusters[row]!r} and {part.clusters[place]!r}"
                )
            clusters[row] = part.clusters[place]
    return tuple(clusters)


def _rated_rows(part: RatingsPart, coded: CodedRatings) -> dict[str, int]:
    # item to its row; an item that nobody rated is none
    rated = np.max(coded.codes, axis=1) >= 0
    return {item: row for row, item in enumerate(part.items) if rated[row]}


def _share_clusters(parts: Sequence[RatingsPart]) -> bool:
    of_parts = [set(part.clusters) for part in parts]
    return len(set().union(*of_parts)) < sum(map(len, of_parts))


def difference_rows(
    file: RatingsFile, entries: Sequence[Coefficient], options: EstimateOptions
) -> Answer:
    """Return the difference of every two groups in every coefficient."""
    if len(file.parts) < 2:
        raise ParameterError(
            "--compare: needs two groups or more, so --by with the column that tells "
            "them apart"
        )
    names = [label(part_names(file, part).values()) for part in file.parts]
    pairs = {
        (names[one], names[other]): _groups_of((file.parts[one], file.parts[other]))
        for one, other in itertools.combinations(range(len(file.parts)), 2)
    }
    # one that was named is refused rather than left out
    can = [of for of in entries if of.formula is not None or not options.takes_all]
    without = ", ".join(entry.title for entry in entries if entry not in can)
    every = [
        row for entry in can for row in _differences(entry, pairs, options, file.scale)
    ]
    notes = _difference_notes(pairs, options.level)
    return Answer(
        name="differences",
        rows=[row for row, _ in every],
        shown=[shown for _, shown in every],
        notes=(*notes, *([Note("without", {"titles": without})] if without else [])),
        is_single=len(pairs) == 1,
    )


def _differences(
    entry: Coefficient,
    pairs: Mapping[tuple[str, str], _Groups],
    options: EstimateOptions,
    scale: Scale,
) -> Iterator[tuple[Row, Row]]:
    # the row of every pair, and what a table shows of it
    from masrel.intervals import difference, difference_test

    results = []
    for names, groups in pairs.items():
        design = "dependent" if groups.is_dependent else "independent"
        ratings = [on_grades(of, entry, scale) for of in groups.sets]
        of_pair: Any = {
            "design": design,
            "weights": options.weights_of(entry),
            "clusters": groups.clusters,
        }
        try:
            estimate = difference(entry, *ratings, level=options.level, **of_pair)
            test = difference_test(entry, *ratings, **of_pair)
        except MasrelError as error:
            raise type(error)(f"--compare: {' and '.join(names)}: {error}") from error
        results.append((names, groups, design, estimate, test))
    adjusted = holm([test.p_value for *_, test in results])
    for (names, groups, design, estimate, test), p in zip(
        results, adjusted, strict=True
    ):
        first, second = names
        row = {
            "first": first,
            "second": second,
            "design": design,
            **as_document(estimate),
            "coefficient": estimate.coefficient.removeprefix("difference of "),
            "t": test.statistic,
            "df": test.df[0],
            "p_value": test.p_value,
            "p_holm": p,
            "test_reason": test.reason,
        }
        titles = {"title": options.title(entry), "group": f"{first} and {second}"}
        items = "the same" if groups.same_items else "others"
        yield row, {**row, **titles, "items": items, **_shown(estimate, test)}


def _shown(estimate: Estimate, test: Significance) -> Row:
    # what a table has of a difference: ``nan`` where it is undefined
    interval = estimate.interval
    texts = () if interval is None else interval.notes
    if test.reason is not None:
        texts = (*texts, f"undefined: {test.reason}")
    return {
        "texts": texts,
        "difference": estimate.value,
        "standard_error": estimate.standard_error,
        "low": math.nan if interval is None else interval.low,
        "high": math.nan if interval is None else interval.high,
        "level": None if interval is None else interval.level,
    }


def _difference_notes(
    pairs: Mapping[tuple[str, str], _Groups], level: float
) -> Iterator[Note]:
    groups = pairs.values()
    is_clustered = any(of.clusters is not None for of in groups)
    unit = "clusters" if is_clustered else "items"
    yield Note(f"difference_of_{unit}", {"level": level})
    if len(pairs) > 1:
        yield Note("holm", {"n": len(pairs)})
    if any(of.is_dependent for of in groups):
        yield Note(f"shared_{unit}")
    for (first, second), of in pairs.items():
        if not of.same_items and of.n_shared:
            values = {"first": first, "second": second, "n": of.n_shared}
            yield Note("same_names", values)


def equality_rows(
    file: RatingsFile, entries: Sequence[Coefficient], options: EstimateOptions
) -> Answer:
    """Return the tests that all groups have the same coefficient, for each of them."""
    groups = _groups_of(file.parts)
    rows, shown, kinds, undefined = [], [], [], []
    for entry in entries:
        if entry.formula is None:  # the differences say it
            continue
        of_entry = tuple(on_grades(of, entry, file.scale) for of in groups.sets)
        of_groups = replace(groups, sets=of_entry)
        for test, result in _equality_tests(entry, of_groups, options):
            rows.append(
                {
                    "coefficient": entry.name,
                    "weights": options.weights_of(entry),
                    "test": result.name,
                    "statistic": result.statistic,
                    "distribution": result.distribution,
                    "df": list(result.df),
                    "p_value": result.p_value,
                    "n_items": result.n_items,
                    "reason": result.reason,
                }
            )
            shown.append({**rows[-1], "title": options.title(entry), "test": test})
            kinds.append(test)
            if result.reason is not None:
                values = {"of": entry.title, "reason": result.reason}
                undefined.append(Note("undefined", values))
    return Answer(
        name="equality",
        rows=rows,
        shown=shown,
        notes=(*map(Note, dict.fromkeys(kinds)), *undefined),
    )


def _equality_tests(
    entry: Coefficient, groups: _Groups, options: EstimateOptions
) -> Iterator[tuple[str, Significance]]:
    from masrel.intervals import differences, donner_test, equality_test, estimate

    weights, clusters = options.weights_of(entry), groups.clusters
    if groups.is_dependent:
        result = differences(entry, groups.sets, weights=weights, clusters=clusters)
        yield HOTELLING, result.equality
        return
    if clusters is None:
        estimates = [entry(ratings, weights=weights) for ratings in groups.sets]
    else:
        estimates = [
            estimate(entry, ratings, target="items", weights=weights, clusters=of)
            for ratings, of in zip(groups.sets, clusters, strict=True)
        ]
    yield FLEISS, equality_test(estimates)
    of_two = all(
        ratings.codes.shape[1] == 2 and len(ratings.categories) == 2
        for ratings in groups.sets
    )
    if of_two and clusters is None and entry.name in _INTRACLASS:
        yield DONNER, donner_test(groups.sets)
