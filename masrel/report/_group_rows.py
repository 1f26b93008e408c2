"""Groups of ratings side by side: the same items, and the same clusters, in one row.

In: parts of a file. Out: their ratings as comparisons of dependent coefficients take
them, or as they are where the groups have nothing in common.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from masrel.agreement import CodedRatings
from masrel.errors import RatingsError
from masrel.ratings import RatingsPart
from masrel.report._further_tables import coded_part


@dataclass(frozen=True, slots=True, kw_only=True)
class Groups:
    """The ratings of several groups."""

    # row by row the same items, if they are dependent; then with gaps for items of
    # other groups
    sets: tuple[CodedRatings, ...]
    is_dependent: bool  # whether groups have items, or clusters, in common
    same_items: bool  # whether all are of the same items
    # of every row if they are dependent, else of the rows of each; None without any
    clusters: tuple[str, ...] | tuple[tuple[str, ...], ...] | None


def groups_of(parts: Sequence[RatingsPart]) -> Groups:
    """Return groups with the same items in the same rows; others have their own."""
    coded = [coded_part(part, "--compare") for part in parts]
    rated = [_rated_rows(*both) for both in zip(parts, coded, strict=True)]
    starts: dict[frozenset[str], tuple[int, list[str]]] = {}
    n_rows = 0
    for rows in rated:
        if frozenset(rows) not in starts:
            starts[frozenset(rows)] = n_rows, list(rows)
            n_rows += len(rows)
    has_clusters = any(part.clusters for part in parts)
    if len(starts) == len(parts) and not _share_clusters(parts):
        return Groups(
            sets=tuple(coded),
            is_dependent=False,
            same_items=False,
            clusters=tuple(part.clusters for part in parts) if has_clusters else None,
        )
    sets, clusters = [], [""] * n_rows
    for part, ratings, rows in zip(parts, coded, rated, strict=True):
        start, items = starts[frozenset(rows)]
        codes = np.full((n_rows, ratings.codes.shape[1]), -1, ratings.codes.dtype)
        places = [rows[item] for item in items]
        codes[start : start + len(items)] = ratings.codes[places]
        sets.append(replace(ratings, codes=codes))
        for row, place in enumerate(places if has_clusters else (), start):
            if clusters[row] not in ("", part.clusters[place]):
                raise RatingsError(
                    f"--compare: item {part.items[place]!r} needs one cluster in all "
                    f"groups, got {clusters[row]!r} and {part.clusters[place]!r}"
                )
            clusters[row] = part.clusters[place]
    return Groups(
        sets=tuple(sets),
        is_dependent=True,
        same_items=len(starts) == 1,
        clusters=tuple(clusters) if has_clusters else None,
    )


def n_shared_items(one: RatingsPart, other: RatingsPart) -> int:
    """Return how many items of two groups that somebody rated have the same name."""
    rows = [_rated_rows(part, coded_part(part, "--compare")) for part in (one, other)]
    return len(rows[0].keys() & rows[1].keys())


def _rated_rows(part: RatingsPart, coded: CodedRatings) -> dict[str, int]:
    # item to its row; an item that nobody rated is none
    rated = np.max(coded.codes, axis=1) >= 0
    return {item: row for row, item in enumerate(part.items) if rated[row]}


def _share_clusters(parts: Sequence[RatingsPart]) -> bool:
    of_parts = [set(part.clusters) for part in parts]
    return len(set().union(*of_parts)) < sum(map(len, of_parts))
