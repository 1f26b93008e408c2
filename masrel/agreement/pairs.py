"""Pairs of ratings, rater by rater: the same items, rated in two sessions."""

from collections.abc import Iterable, Sequence

from masrel.agreement.coding import (
    CodedRatings,
    Codes,
    Label,
    check_scale,
    code_ratings,
)
from masrel.errors import RatingsError

__all__ = ["code_strata", "strata_of"]


def code_strata(
    pairs: object, categories: Sequence[Label] | None = None
) -> CodedRatings:
    """Check pairs of ratings per rater and lay them side by side as codes."""
    # Takes pairs (n_raters, n_items, 2)
    if isinstance(pairs, CodedRatings):
        if categories is not None:
            check_scale(pairs.categories, categories)
        return pairs
    if isinstance(pairs, str) or not isinstance(pairs, Iterable):
        raise RatingsError(
            f"pairs: needs one table (items, 2) per rater, got {type(pairs).__name__}"
        )
    tables = [_plain(table, rater) for rater, table in enumerate(pairs)]
    if not tables:
        raise RatingsError("pairs: needs the pairs of at least one rater, got none")
    if len({len(table) for table in tables}) > 1:
        raise RatingsError(
            "pairs: every rater needs the same items, got "
            f"{', '.join(str(len(table)) for table in tables)} items"
        )
    rows = [
        [grade for pair in of_item for grade in pair]
        for of_item in zip(*tables, strict=True)
    ]
    return code_ratings(rows, categories)


def _plain(table: object, rater: int) -> list[list[object]]:
    # one rater's table -> n_items lists of 2 labels
    if not isinstance(table, Iterable) or isinstance(table, str):
        raise RatingsError(f"pairs: rater {rater} needs a table, got {table!r}")
    rows = []
    for item, pair in enumerate(table):
        if isinstance(pair, str) or not isinstance(pair, Iterable):
            raise RatingsError(
                f"pairs: rater {rater}, item {item}: needs two grades, got {pair!r}"
            )
        rows.append(list(pair))
        if len(rows[-1]) != 2:
            raise RatingsError(
                f"pairs: rater {rater}, item {item}: needs two grades, got "
                f"{len(rows[-1])}"
            )
    return rows


def strata_of(coded: CodedRatings) -> list[Codes]:
    """Take pairs that lie side by side apart, rater by rater."""
    # -> (n_items, 2)
    width = coded.codes.shape[1]
    return [coded.codes[:, start : start + 2] for start in range(0, width, 2)]
