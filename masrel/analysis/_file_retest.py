"""How well raters agree with themselves: two sessions of a file, side by side.

In: a `RatingsFile` with a column of sessions, and how estimates are made. Out: rows of
each rater and of all.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from masrel.agreement import CodedRatings, coefficient
from masrel.analysis._file_estimates import (
    AgreementRow,
    EstimateOptions,
    estimate_row,
)
from masrel.analysis._file_parts import coded_part, label, named
from masrel.errors import ParameterError, RatingsError
from masrel.ratings import RatingsFile, RatingsPart


@dataclass(frozen=True, slots=True, kw_only=True)
class Retest:
    """Agreement of raters with themselves, of one group of the file."""

    group: str | None
    raters: tuple[str, ...]  # those of the first rows
    rows: list[AgreementRow]  # of each rater, then of all together
    sessions: tuple[str, str]
    left_out: tuple[str, ...]  # raters and items of one session alone, in words


def retests(file: RatingsFile, options: EstimateOptions) -> list[Retest]:
    """Return how well raters agree with themselves, in each group of the file."""
    if file.read["session"] is None:
        raise ParameterError(
            "--retest: needs --session with the column of the two sessions"
        )
    return [
        _retest(file, [part for part in file.parts if part.group == group], options)
        for group in dict.fromkeys(part.group for part in file.parts)
    ]


def _retest(
    file: RatingsFile, parts: Sequence[RatingsPart], options: EstimateOptions
) -> Retest:
    # by the names of raters and of items, those of both sessions alone
    group = parts[0].group
    of_group = "" if group is None else f"{group}: "
    first, second = _check_sessions(file, parts, of_group)
    raters = _of_both(parts, "a rater", [part.raters for part in parts], of_group)
    items = _of_both(parts, "an item", [part.items for part in parts], of_group)
    codes = np.stack([_aligned(part, items, raters) for part in parts], axis=2)
    ratings = CodedRatings(
        codes=codes.reshape(len(items), 2 * len(raters)), categories=file.scale.values
    )
    return Retest(
        group=group,
        raters=raters,
        rows=_rows([] if group is None else [group], raters, ratings, options),
        sessions=(first, second),
        left_out=_left_out(parts, raters, items),
    )


def _rows(
    head: Sequence[str],
    raters: Sequence[str],
    pairs: CodedRatings,
    options: EstimateOptions,
) -> list[AgreementRow]:
    # of both sessions of each rater in pairs, (n_items, 2 n_raters)
    every = replace(options, coefficients=None)
    # a single rater says nothing of other raters
    alone = replace(every, target=None if options.target != "items" else "items")
    rows = []
    for place, rater in enumerate(raters):
        ratings = replace(pairs, codes=pairs.codes[:, 2 * place : 2 * place + 2])
        name = label([*head, rater])
        row, _ = estimate_row(coefficient("cohen_kappa"), ratings, name, alone)
        estimate = replace(row.estimate, n_raters=min(row.estimate.n_raters, 1))
        rows.append(replace(row, estimate=estimate))
    of_all = ["stratified_kappa"]
    if options.takes_all or "pooled_kappa" in options.names:
        of_all.append("pooled_kappa")
    everybody = label([*head, "all"])
    return rows + [
        estimate_row(coefficient(name), pairs, everybody, every)[0] for name in of_all
    ]


def _check_sessions(
    file: RatingsFile, parts: Sequence[RatingsPart], of_group: str
) -> tuple[str, str]:
    column = file.read["session"]
    if parts[0].session is None:
        raise ParameterError(
            f"--retest: compares the sessions of column {column!r}, so that --by must "
            "not take them apart"
        )
    sessions = [str(part.session) for part in parts]
    if len(sessions) != 2:
        raise RatingsError(
            f"--retest: {of_group}needs two sessions in column {column!r}, got "
            f"{len(sessions)} ({named(sessions)})"
        )
    first, second = sessions
    return first, second


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
    parts: Sequence[RatingsPart], raters: Sequence[str], items: Sequence[str]
) -> tuple[str, ...]:
    texts, of_both = [], {"rater": set(raters), "item": set(items)}
    for part in parts:
        for noun, names in (("rater", part.raters), ("item", part.items)):
            lone = [name for name in names if name not in of_both[noun]]
            texts += [f"{noun} {named(lone)} ({part.session} only)"] if lone else []
    return tuple(texts)
