"""Which rater, which pair and which category of a file of ratings: tables and a figure.

In: a `RatingsFile` and how estimates are made. Out: tables, the same for JSON, and what
a figure shows.
"""

import itertools
import math
import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from masrel.agreement import Coefficient
from masrel.analysis._file_estimates import EstimateOptions, on_grades
from masrel.analysis._file_parts import coded_part, label, part_names
from masrel.errors import MasrelError, MasrelWarning
from masrel.intervals import Diagnosis, diagnose
from masrel.plots._drawn_values import PairMaps, RaterPairs
from masrel.ratings import RatingsFile, RatingsPart
from masrel.tables._further_tables import (
    FurtherTable,
    data_of,
    finite,
    part_keys,
)
from masrel.tables._tables import Column, Table, Value, capital, percent

_MANY = 8  # raters beyond which only the pairs that agree least are shown
_SHOWN = 20  # of these pairs


@dataclass(frozen=True, slots=True, kw_only=True)
class _Diagnosed:
    """One part of the ratings."""

    part: RatingsPart
    group: str  # what tells it from the others
    keys: dict[str, object]  # the same for JSON
    result: Diagnosis


def diagnosis_tables(
    file: RatingsFile,
    entry: Coefficient,
    options: EstimateOptions,
    reference: str | None,
) -> list[FurtherTable]:
    """Return raters, pairs, categories and confusions of every part of the ratings."""
    parts = [_diagnosed(file, part, entry, options, reference) for part in file.parts]
    title = options.title(entry)
    by = ", ".join(part_names(file, file.parts[0]))
    return [
        _table(file, by, parts, "raters", f"What each rater adds to {title}", title),
        _table(file, by, parts, "pairs", f"{title} of every two raters", title),
        _table(file, by, parts, "categories", "Agreement on each category", title),
        _confusion_table(file, by, parts),
    ]


def _diagnosed(
    file: RatingsFile,
    part: RatingsPart,
    entry: Coefficient,
    options: EstimateOptions,
    reference: str | None,
) -> _Diagnosed:
    group = label(part_names(file, part).values())
    ratings = on_grades(coded_part(part, "--diagnose"), entry, file.scale)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", MasrelWarning)  # the result says it
            result = diagnose(
                ratings,
                coefficient=entry,
                target=None if options.target is None else "items",
                raters=part.raters,
                reference=reference,
                weights=options.weights_of(entry),
                level=options.level,
            )
    except MasrelError as error:
        where = f"{group}: " if group else ""
        raise type(error)(f"--diagnose: {where}{error}") from error
    return _Diagnosed(part=part, group=group, keys=part_keys(file, part), result=result)


_ENDS = (
    Column(key="low", heading="Low", digits=3),
    Column(key="high", heading="High", digits=3),
)
_COLUMNS: dict[str, tuple[Column, ...]] = {
    "raters": (
        Column(key="rater", heading="Rater", align="left"),
        Column(key="mean_of_pairs", heading="Mean of pairs", digits=3),
        Column(key="with_reference", heading="With reference", digits=3),
        Column(key="reference_low", heading="Low", digits=3, where="csv"),
        Column(key="reference_high", heading="High", digits=3, where="csv"),
        Column(key="without", heading="All without", digits=3),
        Column(key="change", heading="Change", digits=3),
        Column(key="standard_error", heading="SE", digits=3),
        *_ENDS,
    ),
    "pairs": (
        Column(key="first", heading="First", align="left"),
        Column(key="second", heading="Second", align="left"),
        Column(key="value", heading="Value", digits=3),
        *_ENDS,
        Column(key="n_items", heading="Items"),
    ),
    "categories": (
        Column(key="category", heading="Category", align="left"),
        Column(key="n_ratings", heading="Ratings"),
        Column(key="agreement", heading="Agreement", digits=3),
        *_ENDS,
    ),
}

# the column that each is of
_NOTES = {
    "change": "Change: of all without the rater, less that of all: above 0 the others "
    "agree better without.",
    "standard_error": "SE: item jackknife.",
    "agreement": "Agreement: of the ratings in the category, the part that meets the "
    "same of another rater.",
}


def _table(
    file: RatingsFile,
    by: str,
    parts: Sequence[_Diagnosed],
    kind: str,
    caption: str,
    title: str,
) -> FurtherTable:
    rows = [(part, row) for part in parts for row in _rows(file, part.result, kind)]
    reference = parts[0].result.reference
    columns = [
        replace(column, where="csv")
        if all(row[column.key] is None for _, row in rows)
        else column
        for column in _COLUMNS[kind]
        if reference is not None or "reference" not in column.key
    ]
    on_page = [column.key for column in columns if column.where != "csv"]
    shown, notes = rows, [note for key, note in _NOTES.items() if key in on_page]
    if kind == "raters" and reference is not None:
        notes.append(
            f"{reference} is the reference, and in no other estimate between raters."
        )
    elif kind == "pairs" and len(parts[0].result.raters) > _MANY:
        shown = sorted(rows, key=_agreement)[:_SHOWN]
        notes.append(
            f"The {len(shown)} pairs that agree least; --json has {len(rows)}."
        )
    notes += _interval_notes(parts, kind, title)
    cells = [
        (part.group, *(row[column.key] for column in columns)) for part, row in shown
    ]
    return FurtherTable(
        key=f"diagnosis_{kind}",
        table=_with_group(
            file, by, f"diagnosis_{kind}", caption, columns, cells, notes
        ),
        documents=[
            {**part.keys, **{key: finite(value) for key, value in row.items()}}
            for part, row in rows
        ],
        figure=_figure(parts, title) if kind == "pairs" else None,
    )


def _with_group(
    file: RatingsFile,
    by: str,
    name: str,
    caption: str,
    columns: Sequence[Column],
    cells: Sequence[tuple[Value, ...]],
    notes: Sequence[str],
) -> Table:
    # the first of the cells names the group, where there are any
    first = [Column(key="group", heading=capital(by), align="left")]
    return Table(
        name=name,
        caption=caption,
        columns=(*(first if by else ()), *columns),
        rows=tuple(row if by else row[1:] for row in cells),
        notes=tuple(notes),
        data=data_of(file),
    )


def _agreement(row: "tuple[_Diagnosed, dict[str, Value]]") -> float:
    value = row[1]["value"]
    is_known = isinstance(value, float) and not math.isnan(value)
    return value if isinstance(value, float) and is_known else math.inf


def _confusion_table(
    file: RatingsFile, by: str, parts: Sequence[_Diagnosed]
) -> FurtherTable:
    """Return what ratings each rater gave where others, or the reference, gave one."""
    grades, reference = file.scale.grades, parts[0].result.reference
    other = "another rater" if reference is None else reference
    columns = [
        Column(key="rater", heading="Rater", align="left"),
        Column(key="of", heading=f"{other} said".capitalize(), align="left"),
        Column(key="n", heading="Times"),
        *(Column(key=f"said_{g}", heading=g, digits=2) for g in grades),
    ]
    notes = [
        "The columns: which share of these times the rater said so.",
        "Intervals are in --json: exact at the effective number of items.",
    ]
    return FurtherTable(
        key="diagnosis_confusion",
        table=_with_group(
            file,
            by,
            "diagnosis_confusion",
            f"What each rater said where {other} said the first",
            columns,
            [row for part in parts for row in _confusion_rows(part, grades)],
            notes[: 1 if np.isnan(parts[0].result.share_low).all() else 2],
        ),
        documents=[
            document for part in parts for document in _confusions(part, grades)
        ],
    )


def _confusion_rows(
    part: _Diagnosed, grades: Sequence[str]
) -> Iterator[tuple[Value, ...]]:
    result = part.result
    for place, rater in enumerate(result.raters):
        for row, grade in enumerate(grades):
            n_given = int(result.confusion[place, row].sum())
            shares = map(_cell, result.shares[place, row].tolist())
            if n_given:  # else there is nothing to tell; --json has all
                yield (part.group, rater, grade, n_given, *shares)


def _confusions(part: _Diagnosed, grades: Sequence[str]) -> Iterator[dict[str, object]]:
    result, places = part.result, range(len(grades))
    for at in itertools.product(range(len(result.raters)), places, places):
        place, row, column = at
        yield {
            **part.keys,
            "rater": result.raters[place],
            "of": grades[row],
            "said": grades[column],
            "n": int(result.confusion[at]),
            "share": _cell(result.shares[at]),
            "low": _cell(result.share_low[at]),
            "high": _cell(result.share_high[at]),
        }


def _interval_notes(
    parts: Sequence[_Diagnosed], kind: str, title: str
) -> Iterator[str]:
    result = parts[0].result
    if np.isnan(result.category_low).all():
        if kind == "raters":
            yield "No intervals: --target items has them."
        return
    of = f"{percent(result.level)} % CI"
    methods = {
        "raters": f"{of}: t, each by itself.",
        "pairs": f"{of}: that of {title} of the two raters alone.",
        "categories": f"{of}: exact at the effective number of items.",
    }
    yield f"{methods[kind]} They generalise to other items, rated by these raters."
    if kind == "raters":
        notes = dict.fromkeys(note for part in parts for note in part.result.notes)
        yield from (f"{note}." for note in notes)


def _rows(
    file: RatingsFile, result: Diagnosis, kind: str
) -> Iterator[dict[str, Value]]:
    if kind == "raters":
        return _rater_rows(result)
    if kind == "pairs":
        return _pair_rows(result)
    return _category_rows(file, result)


def _rater_rows(result: Diagnosis) -> Iterator[dict[str, Value]]:
    columns = {
        "mean_of_pairs": result.mean_values,
        "with_reference": result.reference_values,
        "reference_low": result.reference_low,
        "reference_high": result.reference_high,
        "without": result.without_values,
        "change": result.changes,
        "standard_error": result.change_errors,
        "low": result.change_low,
        "high": result.change_high,
    }
    for place, rater in enumerate(result.raters):
        yield {
            "rater": rater,
            **{key: _cell(values[place]) for key, values in columns.items()},
        }


def _pair_rows(result: Diagnosis) -> Iterator[dict[str, Value]]:
    for one, other in itertools.combinations(range(len(result.raters)), 2):
        yield {
            "first": result.raters[one],
            "second": result.raters[other],
            "value": _cell(result.pair_values[one, other]),
            "low": _cell(result.pair_low[one, other]),
            "high": _cell(result.pair_high[one, other]),
            "n_items": int(result.pair_items[one, other]),
        }


def _category_rows(file: RatingsFile, result: Diagnosis) -> Iterator[dict[str, Value]]:
    for place, grade in enumerate(file.scale.grades):
        yield {
            "category": grade,
            "n_ratings": int(result.category_counts[place]),
            "agreement": _cell(result.category_values[place]),
            "low": _cell(result.category_low[place]),
            "high": _cell(result.category_high[place]),
        }


def _cell(value: float) -> float | None:
    return None if math.isnan(value) else float(value)


def _figure(parts: Sequence[_Diagnosed], title: str) -> PairMaps:
    return PairMaps(groups=tuple(_map(part, title) for part in parts))


def _map(part: _Diagnosed, title: str) -> RaterPairs:
    result = part.result
    # the raters who agree best with the others come first
    means = np.where(np.isnan(result.mean_values), -math.inf, result.mean_values)
    order = np.argsort(-means, kind="stable")
    pairs = result.pair_values[np.ix_(order, order)]
    if result.reference is not None:
        pairs = np.column_stack([pairs, result.reference_values[order]])
    ends = np.column_stack([result.change_low, result.change_high])[order]
    return RaterPairs(
        title=f"{title} ({part.group})" if part.group else title,
        raters=tuple(result.raters[place] for place in order),
        pairs=tuple(map(tuple, pairs.tolist())),
        reference=result.reference,
        changes=tuple(result.changes[order].tolist()),
        change_ends=tuple((low, high) for low, high in ends.tolist()),
        level=result.level,
    )
