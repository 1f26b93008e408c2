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

from masrel.agreement import CodedRatings, Coefficient, Significance, code_ratings, holm
from masrel.analysis._file_estimates import (
    Answer,
    EstimateOptions,
    Row,
    note,
    on_grades,
    parts_of,
    placed,
)
from masrel.errors import ParameterError, RatingsError
from masrel.estimates import Estimate, as_document
from masrel.ratings import RatingsFile, RatingsPart

# Tests that all groups agree as well.
FLEISS = "Fleiss' weighted χ²"
DONNER = "Donner's goodness of fit"
HOTELLING = "Hotelling's T² as F"

# coefficients that are the intraclass kappa of two raters and two categories
_INTRACLASS = ("fleiss_kappa", "scott_pi")


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
    with placed("--compare"):
        coded = [code_ratings(part.ratings) for part in parts]
    rated = [_rated_rows(*both) for both in zip(parts, coded, strict=True)]
    items = [frozenset(rows) for rows in rated]
    n_shared = len(frozenset.intersection(*items))
    has_clusters = any(part.clusters for part in parts)
    of_parts = [set(part.clusters) for part in parts]
    share_clusters = len(set().union(*of_parts)) < sum(map(len, of_parts))
    if len(set(items)) == len(parts) and not share_clusters:
        return _Groups(
            sets=tuple(coded),
            is_dependent=False,
            n_shared=n_shared,
            same_items=False,
            clusters=tuple(part.clusters for part in parts) if has_clusters else None,
        )
    # a row for each item of each set of items that groups have
    rows_of: dict[tuple[frozenset[str], str], int] = {}
    for names, rows in zip(items, rated, strict=True):
        for item in rows:
            rows_of.setdefault((names, item), len(rows_of))
    sets = []
    clusters: dict[int, str] = {}
    for part, ratings, names, rows in zip(parts, coded, items, rated, strict=True):
        at = [rows_of[names, item] for item in rows]
        codes = np.full((len(rows_of), ratings.codes.shape[1]), -1, ratings.codes.dtype)
        codes[at] = ratings.codes[list(rows.values())]
        sets.append(replace(ratings, codes=codes))
        for row, (item, place) in zip(at, rows.items(), strict=True):
            cluster = part.clusters[place] if part.clusters else ""
            if clusters.setdefault(row, cluster) != cluster:
                raise RatingsError(
                    f"--compare: item {item!r} needs one cluster in all groups, got "
                    f"{clusters[row]!r} and {cluster!r}"
                )
    return _Groups(
        sets=tuple(sets),
        is_dependent=True,
        n_shared=n_shared,
        same_items=len(set(items)) == 1,
        clusters=tuple(map(clusters.__getitem__, range(len(rows_of))))
        if has_clusters
        else None,
    )


def _rated_rows(part: RatingsPart, coded: CodedRatings) -> dict[str, int]:
    # item to its row; an item that nobody rated is none
    rated = np.max(coded.codes, axis=1) >= 0
    return {item: row for row, item in enumerate(part.items) if rated[row]}


def difference_rows(
    file: RatingsFile, entries: Sequence[Coefficient], options: EstimateOptions
) -> Answer:
    """Return the difference of every two groups in every coefficient."""
    if len(file.parts) < 2:
        raise ParameterError(
            "--compare: needs two groups or more, so --by with the column that tells "
            "them apart"
        )
    pairs = {
        (first, second): _groups_of((one, other))
        for (one, first, _), (other, second, _) in itertools.combinations(
            parts_of(file), 2
        )
    }
    # one that was named is refused rather than left out
    can = [of for of in entries if of.formula is not None or not options.takes_all]
    rows = [row for of in can for row in _differences(of, file, pairs, options)]
    notes = list(_difference_notes(pairs, options.level))
    if without := ", ".join(entry.title for entry in entries if entry not in can):
        notes.append(note("without", titles=without))
    return Answer(
        name="differences",
        rows=[row for row, _ in rows],
        shown=[shown for _, shown in rows],
        notes=tuple(notes),
        is_single=len(pairs) == 1,
    )


def _differences(
    entry: Coefficient,
    file: RatingsFile,
    pairs: Mapping[tuple[str, str], _Groups],
    options: EstimateOptions,
) -> Iterator[tuple[Row, Row]]:
    # the row of every pair, and what a table shows of it
    from masrel.intervals.contrasts import difference, difference_test

    rows: list[tuple[Row, Row]] = []
    for (first, second), groups in pairs.items():
        design = "dependent" if groups.is_dependent else "independent"
        ratings = [on_grades(of, entry, file) for of in groups.sets]
        of_pair: Any = {
            "design": design,
            "weights": options.weights_of(entry),
            "clusters": groups.clusters,
        }
        with placed("--compare", f"{first} and {second}"):
            estimate = difference(entry, *ratings, level=options.level, **of_pair)
            test = difference_test(entry, *ratings, **of_pair)
        row: Row = {
            "first": first,
            "second": second,
            "design": design,
            **as_document(estimate),
            "coefficient": entry.name,
            "t": test.statistic,
            "df": test.df[0],
            "p_value": test.p_value,
            "p_holm": math.nan,
            "test_reason": test.reason,
        }
        shown = {
            "title": options.title(entry),
            "group": f"{first} and {second}",
            "items": "the same" if groups.same_items else "others",
            **_shown(estimate, test),
        }
        rows.append((row, shown))
    adjusted = holm([row["p_value"] for row, _ in rows])
    for (row, shown), p in zip(rows, adjusted, strict=True):
        yield row | {"p_holm": p}, row | {"p_holm": p} | shown


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
) -> Iterator[str]:
    groups = pairs.values()
    is_clustered = any(of.clusters is not None for of in groups)
    unit = "clusters" if is_clustered else "items"
    yield note(f"difference_of_{unit}", level=level)
    if len(pairs) > 1:
        yield note("holm", n=len(pairs))
    if any(of.is_dependent for of in groups):
        yield note(f"shared_{unit}")
    for (first, second), of in pairs.items():
        if not of.same_items and of.n_shared:
            yield note("same_names", first=first, second=second, n=of.n_shared)


def equality_rows(
    file: RatingsFile, entries: Sequence[Coefficient], options: EstimateOptions
) -> Answer:
    """Return the tests that all groups have the same coefficient, for each of them."""
    groups = _groups_of(file.parts)
    rows, shown, notes = [], [], []
    for entry in entries:
        if entry.formula is None:  # the differences say it
            continue
        of_entry = tuple(on_grades(of, entry, file) for of in groups.sets)
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
            notes.append(note(test))
    return Answer(
        name="equality",
        rows=rows,
        shown=shown,
        notes=tuple(dict.fromkeys(notes)),
    )


def _equality_tests(
    entry: Coefficient, groups: _Groups, options: EstimateOptions
) -> Iterator[tuple[str, Significance]]:
    from masrel.intervals.choose import estimate
    from masrel.intervals.contrasts import differences, donner_test, equality_test

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
