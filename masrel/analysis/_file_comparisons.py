"""How much the groups of a file differ in agreement: pair by pair, and all at once.

In: a `RatingsFile` whose parts are the groups. Out: rows of the differences of
coefficients with their tests, and of tests that all groups agree equally well.
"""

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from masrel._input import refuse
from masrel.agreement import CodedRatings, Coefficient, Significance, code_ratings, holm
from masrel.analysis._file_estimates import (
    Answer,
    Questions,
    Row,
    entries,
    note,
    on_grades,
    parts_of,
    placed,
)
from masrel.errors import RatingsError
from masrel.estimates import as_document
from masrel.ratings import RatingsFile, RatingsPart

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


def _groups_of(name: str, parts: Sequence[RatingsPart]) -> _Groups:
    """Return groups with the same items in the same rows; others have their own."""
    # name: the file's
    with placed(name):
        coded = [code_ratings(part.ratings) for part in parts]
    rated = list(map(_rated_rows, parts, coded))
    items = list(map(frozenset, rated))
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
    # a row for each item of each set of items that groups have, and its cluster
    clusters: dict[tuple[frozenset[str], str], str] = {}
    for part, names, rows in zip(parts, items, rated, strict=True):
        for item, row in rows.items():
            cluster = part.clusters[row] if part.clusters else ""
            if (known := clusters.setdefault((names, item), cluster)) != cluster:
                raise RatingsError(
                    f"{name}: item {item!r} needs one cluster in all groups, got "
                    f"{known!r} and {cluster!r}"
                )
    row_of = {item: row for row, item in enumerate(clusters)}
    sets = []
    for ratings, names, rows in zip(coded, items, rated, strict=True):
        codes = np.full((len(row_of), ratings.codes.shape[1]), -1, ratings.codes.dtype)
        codes[[row_of[names, of] for of in rows]] = ratings.codes[list(rows.values())]
        sets.append(replace(ratings, codes=codes))
    return _Groups(
        sets=tuple(sets),
        is_dependent=True,
        n_shared=n_shared,
        same_items=len(set(items)) == 1,
        clusters=tuple(clusters.values()) if has_clusters else None,
    )


def _rated_rows(part: RatingsPart, coded: CodedRatings) -> dict[str, int]:
    # item to its row; an item that nobody rated is none, one without a name the group's
    rated = np.max(coded.codes, axis=1) >= 0
    items = part.items or [f"{part.group} {row}" for row in range(len(rated))]
    return {item: row for row, item in enumerate(items) if rated[row]}


def comparisons(file: RatingsFile, questions: Questions) -> Iterator[Answer]:
    """Return the differences of every two groups, and whether all groups are equal."""
    of_all = entries(questions, file, file.parts)
    yield _difference_rows(file, of_all, questions)
    if len(file.parts) > 2:  # of two the difference says it
        yield _equality_rows(file, of_all, questions)


def _difference_rows(
    file: RatingsFile, coefficients: Sequence[Coefficient], questions: Questions
) -> Answer:
    name, by = file.read["file"], file.read["by"]
    refuse(
        (
            len(file.parts) < 2,
            "--by: needs a column with two groups or more, "
            + ("or --by-criterion" if by is None else f"{by!r} has one"),
        )
    )
    pairs = {
        (first, second): _groups_of(name, (one, other))
        for (one, first, _), (other, second, _) in itertools.combinations(
            parts_of(file), 2
        )
    }
    # one that was named is refused rather than left out
    can = [
        of
        for of in coefficients
        if (of.formula is not None and not of.has_interval) or not questions.takes_all
    ]
    rows = [row for of in can for row in _differences(of, file, pairs, questions)]
    has_clusters = any(of.clusters is not None for of in pairs.values())
    unit = "clusters" if has_clusters else "items"
    notes = [note(f"difference_of_{unit}", level=questions.level)]
    if len(pairs) > 1:
        notes.append(note("holm", n=len(pairs)))
    if any(of.is_dependent for of in pairs.values()):
        notes.append(note(f"shared_{unit}"))
    notes += [
        note("same_names", first=first, second=second, n=of.n_shared)
        for (first, second), of in pairs.items()
        if not of.same_items and of.n_shared
    ]
    if without := ", ".join(entry.title for entry in coefficients if entry not in can):
        notes.append(note("without", titles=without))
    return Answer(
        name="differences",
        rows=[row for row, _ in rows],
        shown=[{**row, **cells} for row, cells in rows],
        notes=tuple(notes),
    )


def _differences(
    entry: Coefficient,
    file: RatingsFile,
    pairs: Mapping[tuple[str, str], _Groups],
    questions: Questions,
) -> Iterator[tuple[Row, Row]]:
    # the row of every pair, and what a table shows of it otherwise
    from masrel.intervals.contrasts import difference, difference_test

    rows: list[tuple[Row, Row]] = []
    for (first, second), groups in pairs.items():
        design = "dependent" if groups.is_dependent else "independent"
        ratings = [on_grades(of, entry, file) for of in groups.sets]
        of_pair: Any = {
            "design": design,
            "weights": questions.weights_of(entry),
            "clusters": groups.clusters,
        }
        with placed(file.read["file"], f"{first} and {second}"):
            estimate = difference(entry, *ratings, level=questions.level, **of_pair)
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
        interval = estimate.interval
        cells = {
            "title": questions.title(entry),
            "group": f"{first} and {second}",
            "items": "the same" if groups.same_items else "others",
            "texts": () if test.reason is None else (f"undefined: {test.reason}",),
            "interval_texts": () if interval is None else interval.notes,
            # ``nan`` where they are undefined
            "difference": estimate.value,
            "standard_error": estimate.standard_error,
            "low": getattr(interval, "low", math.nan),
            "high": getattr(interval, "high", math.nan),
            "level": getattr(interval, "level", None),
        }
        rows.append((row, cells))
    adjusted = holm([row["p_value"] for row, _ in rows])
    for (row, cells), p in zip(rows, adjusted, strict=True):
        yield row | {"p_holm": p}, cells


def _equality_rows(
    file: RatingsFile, coefficients: Sequence[Coefficient], questions: Questions
) -> Answer:
    groups = _groups_of(file.read["file"], file.parts)
    results = [
        (entry, test, result)
        for entry in coefficients
        if entry.formula is not None  # else the differences say it
        for test, result in _equality_tests(entry, file, groups, questions)
    ]
    rows: list[Row] = [
        {
            "coefficient": entry.name,
            "weights": str(questions.weights_of(entry)),
            "test": result.name,
            "statistic": result.statistic,
            "distribution": result.distribution,
            "df": list(result.df),
            "p_value": result.p_value,
            "n_items": result.n_items,
            "reason": result.reason,
        }
        for entry, _, result in results
    ]
    shown = [
        {**row, "title": questions.title(entry), "test": test}
        for row, (entry, test, _) in zip(rows, results, strict=True)
    ]
    return Answer(
        name="equality",
        rows=rows,
        shown=shown,
        notes=tuple(dict.fromkeys(note(test) for _, test, _ in results)),
    )


def _equality_tests(
    entry: Coefficient, file: RatingsFile, groups: _Groups, questions: Questions
) -> Iterator[tuple[str, Significance]]:
    from masrel.intervals.choose import estimate
    from masrel.intervals.contrasts import differences, donner_test, equality_test

    weights, clusters = questions.weights_of(entry), groups.clusters
    sets = [on_grades(ratings, entry, file) for ratings in groups.sets]
    if groups.is_dependent:
        of_all = differences(entry, sets, weights=weights, clusters=clusters)
        yield "Hotelling's T² as F", of_all.equality
        return
    if clusters is None:
        estimates = [entry(ratings, weights=weights) for ratings in sets]
    else:
        estimates = [
            estimate(entry, ratings, target="items", weights=weights, clusters=of)
            for ratings, of in zip(sets, clusters, strict=True)
        ]
    yield "Fleiss' weighted χ²", equality_test(estimates)
    of_two = all(
        ratings.codes.shape[1] == 2 and len(ratings.categories) == 2 for ratings in sets
    )
    if of_two and clusters is None and entry.name in _INTRACLASS:
        yield "Donner's goodness of fit", donner_test(sets)
