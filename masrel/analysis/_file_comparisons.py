"""How much the groups of a file differ in agreement: pair by pair, and all at once.

In: a `RatingsFile` whose parts are the groups. Out: differences of coefficients with
their tests, and tests that all groups agree as well.
"""

import itertools
import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Literal

import numpy as np

from masrel.agreement import CodedRatings, Coefficient, Significance, holm
from masrel.analysis._file_estimates import EstimateOptions, on_grades
from masrel.analysis._file_parts import coded_part, label, part_names
from masrel.errors import MasrelError, MasrelWarning, ParameterError, RatingsError
from masrel.estimates import Estimate
from masrel.ratings import RatingsFile, RatingsPart
from masrel.scales import Scale

# Tests that all groups agree as well.
FLEISS = "Fleiss' weighted χ²"
DONNER = "Donner's goodness of fit"
HOTELLING = "Hotelling's T² as F"

_INTRACLASS = ("fleiss_kappa", "scott_pi")
"""Coefficients that are the intraclass kappa of two raters and two categories."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Pair:
    """Two groups, and whether they are of the same items, or clusters."""

    first: str
    second: str
    ratings: tuple[CodedRatings, CodedRatings]  # row by row the same items, if they are
    design: Literal["dependent", "independent"]
    same_items: bool
    clusters: object  # of the items, as `difference` takes them
    n_shared: int  # names of items that both have


@dataclass(frozen=True, slots=True, kw_only=True)
class Difference:
    """One coefficient of two groups."""

    pair: Pair
    title: str
    estimate: Estimate
    test: Significance
    adjusted: float  # p after Holm, over the pairs of the coefficient


@dataclass(frozen=True, slots=True, kw_only=True)
class Comparison:
    """Every two groups in every coefficient."""

    pairs: tuple[Pair, ...]
    differences: tuple[Difference, ...]
    without: tuple[str, ...]  # titles of coefficients that have no such interval


@dataclass(frozen=True, slots=True, kw_only=True)
class EqualityTest:
    """A test of one coefficient of all groups."""

    entry: Coefficient
    title: str
    weights: str
    name: str
    result: Significance


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


def compare_pairs(
    file: RatingsFile, entries: Sequence[Coefficient], options: EstimateOptions
) -> Comparison:
    """Return the difference of every two groups in every coefficient."""
    if len(file.parts) < 2:
        raise ParameterError(
            "--compare: needs two groups or more, so --by with the column that tells "
            "them apart"
        )
    pairs = _pairs(file)
    # one that was named is refused rather than left out
    can = [of for of in entries if of.formula is not None or not options.takes_all]
    return Comparison(
        pairs=tuple(pairs),
        differences=tuple(
            difference
            for entry in can
            for difference in _differences(entry, pairs, options, file.scale)
        ),
        without=tuple(entry.title for entry in entries if entry not in can),
    )


def _pairs(file: RatingsFile) -> list[Pair]:
    names = [label(part_names(file, part).values()) for part in file.parts]
    pairs = []
    for one, other in itertools.combinations(range(len(file.parts)), 2):
        groups = _groups_of((file.parts[one], file.parts[other]))
        first, second = groups.sets
        pairs.append(
            Pair(
                first=names[one],
                second=names[other],
                ratings=(first, second),
                design="dependent" if groups.is_dependent else "independent",
                same_items=groups.same_items,
                clusters=groups.clusters,
                n_shared=groups.n_shared,
            )
        )
    return pairs


def _differences(
    entry: Coefficient, pairs: Sequence[Pair], options: EstimateOptions, scale: Scale
) -> list[Difference]:
    from masrel.intervals import difference, difference_test

    weights = options.weights_of(entry)
    results = []
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", MasrelWarning)  # the results say it
        for pair in pairs:
            ratings = [on_grades(of, entry, scale) for of in pair.ratings]
            try:
                estimate = difference(
                    entry,
                    *ratings,
                    design=pair.design,
                    weights=weights,
                    level=options.level,
                    clusters=pair.clusters,
                )
                test = difference_test(
                    entry,
                    *ratings,
                    design=pair.design,
                    weights=weights,
                    clusters=pair.clusters,
                )
            except MasrelError as error:
                raise type(error)(
                    f"--compare: {pair.first} and {pair.second}: {error}"
                ) from error
            results.append((pair, estimate, test))
    adjusted = holm([test.p_value for _, _, test in results])
    title = options.title(entry)
    return [
        Difference(pair=pair, title=title, estimate=estimate, test=test, adjusted=p)
        for (pair, estimate, test), p in zip(results, adjusted, strict=True)
    ]


def compare_all(
    file: RatingsFile, entries: Sequence[Coefficient], options: EstimateOptions
) -> list[EqualityTest]:
    """Return the tests that all groups have the same coefficient, for each of them."""
    groups = _groups_of(file.parts)
    tests: list[EqualityTest] = []
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", MasrelWarning)  # the results say it
        for entry in entries:
            if entry.formula is not None:  # else the differences say it
                of_entry = tuple(on_grades(s, entry, file.scale) for s in groups.sets)
                tests += _equality_tests(entry, replace(groups, sets=of_entry), options)
    return tests


def _equality_tests(
    entry: Coefficient, groups: _Groups, options: EstimateOptions
) -> Iterator[EqualityTest]:
    from masrel.intervals import differences, donner_test, equality_test, estimate

    weights, clusters = options.weights_of(entry), groups.clusters
    test = partial(
        EqualityTest, entry=entry, title=options.title(entry), weights=weights
    )
    if groups.is_dependent:
        result = differences(entry, groups.sets, weights=weights, clusters=clusters)
        yield test(name=HOTELLING, result=result.equality)
        return
    if clusters is None:
        estimates = [entry(ratings, weights=weights) for ratings in groups.sets]
    else:
        estimates = [
            estimate(entry, ratings, target="items", weights=weights, clusters=of)
            for ratings, of in zip(groups.sets, clusters, strict=True)
        ]
    yield test(name=FLEISS, result=equality_test(estimates))
    of_two = all(
        ratings.codes.shape[1] == 2 and len(ratings.categories) == 2
        for ratings in groups.sets
    )
    if of_two and clusters is None and entry.name in _INTRACLASS:
        yield test(name=DONNER, result=donner_test(groups.sets))
