"""Ratings as statistics take them: item by rater, and pairs of two sessions."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from masrel.errors import RatingsError
from masrel.ratings.table import Ratings

__all__ = ["RatingMatrix", "RetestPairs", "rating_matrix", "retest_pairs"]


@dataclass(frozen=True, slots=True, kw_only=True)
class RatingMatrix:
    """Grades of one session, item by rater.

    Attributes
    ----------
    items : tuple of str
        The haptic models; a second presentation of one is an item ``"HM1#2"``.
    raters : tuple of str
        The raters.
    grades : list of list of (str or None), shape (n_items, n_raters)
        None is missing.
    n_missing : int
        How many are None.
    """

    items: tuple[str, ...]
    raters: tuple[str, ...]
    grades: list[list[str | None]] = field(hash=False)
    n_missing: int


@dataclass(frozen=True, slots=True, kw_only=True)
class RetestPairs:
    """Grades the same raters gave the same items in two sessions.

    Attributes
    ----------
    raters : tuple of str
        Raters with rows in both sessions.
    items : tuple of str
        The haptic models; a second presentation of one is an item ``"HM1#2"``.
    pairs : list, shape (n_raters, n_items, 2)
        First and second grade; None is missing.
    n_missing : int
        Pairs of which a side is missing.
    """

    raters: tuple[str, ...]
    items: tuple[str, ...]
    pairs: list[list[list[str | None]]] = field(hash=False)
    n_missing: int


_Key = tuple[str, str, int]  # rater, model, repeat


def rating_matrix(
    ratings: Ratings, *, session: str, models: Sequence[str] | None = None
) -> RatingMatrix:
    """Arrange the grades of one session item by rater.

    Parameters
    ----------
    ratings : Ratings
        The table.
    session : str
        The session.
    models : sequence of str, optional
        The models, in this order; one that nobody rated is a row of None. Every
        model of the session, as they come, unless given.

    Returns
    -------
    RatingMatrix
        Raters as they come in the session, all of them.

    Raises
    ------
    RatingsError
        If the session has no ratings.

    Examples
    --------
    >>> from masrel.ratings import ratings_from_rows
    >>> from masrel.scales import MODIFIED_ASHWORTH
    >>> rows = [
    ...     {"rater": "R1", "model": "HM1", "grade": "1"},
    ...     {"rater": "R2", "model": "HM1", "grade": "1+"},
    ... ]
    >>> ratings = ratings_from_rows(rows, MODIFIED_ASHWORTH)
    >>> rating_matrix(ratings, session="test").grades
    [['1', '1+']]
    """
    grades = _of_session(ratings, session)
    raters = tuple(dict.fromkeys(rater for rater, _, _ in grades))
    keys = _item_keys([grades], models)
    matrix = [
        [grades.get((rater, model, repeat)) for rater in raters]
        for model, repeat in keys
    ]
    return RatingMatrix(
        items=_item_names(keys),
        raters=raters,
        grades=matrix,
        n_missing=sum(row.count(None) for row in matrix),
    )


def retest_pairs(
    ratings: Ratings,
    *,
    first: str,
    second: str,
    models: Sequence[str] | None = None,
) -> RetestPairs:
    """Pair the grades raters gave in two sessions.

    Parameters
    ----------
    ratings : Ratings
        The table.
    first, second : str
        The sessions.
    models : sequence of str, optional
        The models, in this order. Every model of either session unless given.

    Returns
    -------
    RetestPairs
        Raters of both sessions, as they come in the first; none is no error.

    Raises
    ------
    RatingsError
        If a session has no ratings, or both are the same.
    """
    if first == second:
        raise RatingsError(f"needed two different sessions, got {first!r} twice")
    before, after = _of_session(ratings, first), _of_session(ratings, second)
    again = {rater for rater, _, _ in after}
    raters = tuple(dict.fromkeys(r for r, _, _ in before if r in again))
    keys = _item_keys([before, after], models)
    pairs = [
        [[before.get((r, *key)), after.get((r, *key))] for key in keys] for r in raters
    ]
    return RetestPairs(
        raters=raters,
        items=_item_names(keys),
        pairs=pairs,
        n_missing=sum(None in pair for of_rater in pairs for pair in of_rater),
    )


def _of_session(ratings: Ratings, session: str) -> dict[_Key, str | None]:
    table = ratings.table[ratings.table["session"] == session]
    if table.empty:
        known = ", ".join(dict.fromkeys(ratings.table["session"])) or "none"
        raise RatingsError(f"needed ratings of session {session!r}, there are {known}")
    return {
        (rater, model, repeat): grade if isinstance(grade, str) else None
        for rater, model, repeat, grade in zip(
            table["rater"],
            table["model"],
            table["repeat"].tolist(),
            table["grade"],
            strict=True,
        )
    }


def _item_keys(
    sessions: Sequence[Mapping[_Key, str | None]], models: Sequence[str] | None
) -> list[tuple[str, int]]:
    # -> (model, repeat) in the order of models; a model without ratings once
    n_repeats: dict[str, int] = {}
    for grades in sessions:
        for _, model, repeat in grades:
            n_repeats[model] = max(n_repeats.get(model, 1), repeat)
    wanted = list(n_repeats) if models is None else list(models)
    return [
        (model, repeat)
        for model in wanted
        for repeat in range(1, n_repeats.get(model, 1) + 1)
    ]


def _item_names(keys: Sequence[tuple[str, int]]) -> tuple[str, ...]:
    return tuple(
        model if repeat == 1 else f"{model}#{repeat}" for model, repeat in keys
    )
