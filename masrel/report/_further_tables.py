"""What a file of ratings says beyond its agreement: test and retest, each category.

In: a `RatingsFile` and how every estimate is made. Out: a table, and the same as
plain values for JSON.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from masrel.agreement import (
    CodedRatings,
    Coefficient,
    category_kappa,
    code_ratings,
    coefficient,
)
from masrel.analysis._file_estimates import (
    AgreementRow,
    EstimateOptions,
    estimate_row,
)
from masrel.errors import ParameterError, RatingsError
from masrel.estimates import Estimate
from masrel.ratings import RatingsFile, RatingsPart
from masrel.report._agreement_table import (
    agreement_table,
    estimate_documents,
    group_key,
)
from masrel.report._figure_data import Content
from masrel.report._tables import Table

_SHOWN = 6  # names that a note lists


@dataclass(frozen=True, slots=True, kw_only=True)
class FurtherTable:
    """A table below that of agreement, and the same for JSON."""

    key: str  # what it is called in the JSON
    table: Table
    documents: list[dict[str, object]]
    rows: tuple[AgreementRow, ...] = ()  # the estimates in it, for a figure
    figure: Content | None = None  # what takes the place of that figure


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


def retest_table(
    file: RatingsFile, options: EstimateOptions, *, explain: bool
) -> FurtherTable:
    """Return how well raters agree with themselves, each and all together."""
    if file.read["session"] is None:
        raise ParameterError(
            "--retest: needs --session with the column of the two sessions"
        )
    by = None if file.read["by"] is None else str(file.read["by"])
    entries = [coefficient("stratified_kappa")]
    if options.takes_all or "pooled_kappa" in options.names:
        entries.append(coefficient("pooled_kappa"))
    rows: list[AgreementRow] = []
    documents: list[dict[str, object]] = []
    notes: list[str] = []
    for group in dict.fromkeys(part.group for part in file.parts):
        pairs = _retest_pairs(file, [p for p in file.parts if p.group == group])
        of_group = _retest_rows(group, pairs, options, entries)
        rows += of_group
        notes += pairs.notes
        keys = {} if by is None else {group_key(by): group}
        raters: list[str | None] = [*pairs.raters, *[None] * len(entries)]
        documents += [
            {**keys, "rater": rater, **document}
            for rater, document in zip(
                raters, estimate_documents(of_group, bands=options.words), strict=True
            )
        ]
    table = agreement_table(
        rows,
        caption="Agreement of raters with themselves",
        by=heading(filter(None, (by, "rater"))),
        notes=tuple(notes),
        explain=explain,
        bands=options.words,
        data=data_of(file),
    )
    return FurtherTable(
        key="retest",
        table=replace(table, name="retest"),
        documents=documents,
        rows=tuple(rows),
    )


def _changed(estimate: Estimate, **fields: object) -> Estimate:
    # `vars` has the standard error as it is: still to be computed when it is read
    return Estimate(**{**vars(estimate), **fields})


@dataclass(frozen=True, slots=True, kw_only=True)
class _RetestPairs:
    """The ratings of two sessions, side by side."""

    raters: tuple[str, ...]
    ratings: CodedRatings  # (n_items, 2 n_raters): both sessions of each rater
    notes: tuple[str, ...]  # which sessions, and what was left out


def _retest_rows(
    group: str | None,
    pairs: _RetestPairs,
    options: EstimateOptions,
    entries: Sequence[Coefficient],
) -> list[AgreementRow]:
    head = [] if group is None else [group]
    every, codes = replace(options, coefficients=None), pairs.ratings.codes
    # a single rater says nothing of other raters
    alone = replace(every, target=None if options.target != "items" else "items")
    rows = []
    for place, rater in enumerate(pairs.raters):
        of_rater = codes[:, 2 * place : 2 * place + 2]
        ratings = replace(pairs.ratings, codes=of_rater)
        name = label([*head, rater])
        row, _ = estimate_row(coefficient("cohen_kappa"), ratings, name, alone)
        estimate = _changed(row.estimate, n_raters=min(row.estimate.n_raters, 1))
        rows.append(replace(row, estimate=estimate))
    everybody = label([*head, "all"])
    return rows + [
        estimate_row(entry, pairs.ratings, everybody, every)[0] for entry in entries
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


def category_table(
    file: RatingsFile, options: EstimateOptions, *, explain: bool
) -> FurtherTable:
    """Return how well raters tell each category from all others."""
    rows: list[AgreementRow] = []
    documents: list[dict[str, object]] = []
    for part in file.parts:
        of_part = [
            _category_row(file, part, place, options)
            for place in range(len(file.scale.grades))
        ]
        rows += of_part
        of_grades = estimate_documents(of_part, bands=options.words)
        documents += [
            {**part_keys(file, part), "category": grade, **document}
            for grade, document in zip(file.scale.grades, of_grades, strict=True)
        ]
    table = agreement_table(
        rows,
        caption="Agreement on each category against all others",
        by=heading([*part_names(file, file.parts[0]), "category"]),
        explain=explain,
        bands=options.words,
        data=data_of(file),
    )
    return FurtherTable(
        key="categories",
        table=replace(table, name="categories"),
        documents=documents,
        rows=tuple(rows),
    )


def _category_row(
    file: RatingsFile, part: RatingsPart, place: int, options: EstimateOptions
) -> AgreementRow:
    grade = file.scale.grades[place]
    group = label([*part_names(file, part).values(), grade])
    estimate = category_kappa(part.counted, file.scale.values[place])
    row = AgreementRow(group=group, title="Fleiss' κ, category", estimate=estimate)
    if options.target is not None and estimate.reason is None:
        # that of Fleiss' kappa of the two categories that the scale is folded to
        folded = _folded(part, place)
        if folded is None:
            none = "no interval: counts do not say who rated what"
            row = replace(row, notes=(none,))
        else:
            plain = replace(options, coefficients=None, weights="identity")
            of, _ = estimate_row(coefficient("fleiss_kappa"), folded, group, plain)
            row = replace(of, title=row.title)
            estimate = _changed(estimate, interval=of.estimate.interval)
    return replace(row, estimate=_changed(estimate, weights=grade))


def _folded(part: RatingsPart, place: int) -> CodedRatings | None:
    """Return the ratings on a scale of one category and the rest."""
    coded = part.counted.coded
    if coded is None:
        return None
    codes = np.where(coded.codes < 0, -1, coded.codes != place)
    return CodedRatings(codes=codes, categories=("this", "other"))
