"""How much the groups of a file of ratings differ in agreement, pair by pair.

In: a `RatingsFile` whose parts are the groups. Out: a table, and the same for JSON.
"""

import itertools
import math
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from masrel.agreement import CodedRatings, Coefficient, Significance, holm
from masrel.analysis._file_estimates import EstimateOptions, on_grades
from masrel.errors import MasrelError, MasrelWarning, ParameterError
from masrel.estimates import Estimate, as_document
from masrel.ratings import RatingsFile
from masrel.report._further_tables import (
    FurtherTable,
    data_of,
    finite,
    label,
    part_names,
)
from masrel.report._group_rows import groups_of, n_shared_items
from masrel.report._tables import Column, Table, Value, p_text, percent
from masrel.scales import Scale


@dataclass(frozen=True, slots=True, kw_only=True)
class _Pair:
    """Two groups, and whether they are of the same items, or clusters."""

    first: str
    second: str
    ratings: tuple[CodedRatings, CodedRatings]  # row by row the same items, if they are
    design: Literal["dependent", "independent"]
    same_items: bool
    clusters: object  # of the items, as `difference` takes them
    n_shared: int  # names of items that both have


@dataclass(frozen=True, slots=True, kw_only=True)
class _Difference:
    """One coefficient of two groups."""

    pair: _Pair
    title: str
    estimate: Estimate
    test: Significance
    adjusted: float  # p after Holm, over the pairs of the coefficient


def difference_table(
    file: RatingsFile,
    entries: Sequence[Coefficient],
    options: EstimateOptions,
    *,
    skip: bool = False,
) -> FurtherTable:
    """Return the difference of every two groups in every coefficient."""
    # skip: whether a coefficient without such an interval is left out, and not refused
    if len(file.parts) < 2:
        raise ParameterError(
            "--compare: needs two groups or more, so --by with the column that tells "
            "them apart"
        )
    pairs = _pairs(file)
    differences: list[_Difference] = []
    without = []
    for entry in entries:
        if skip and entry.kernel is None:
            without.append(entry.title)
        else:
            differences += _differences(entry, pairs, options, file.scale)
    return FurtherTable(
        key="differences",
        table=Table(
            name="differences",
            caption="Differences of agreement between groups",
            columns=_COLUMNS,
            rows=tuple(map(_cells, differences)),
            notes=_notes(differences, pairs, options, without),
            data=data_of(file),
        ),
        documents=list(map(_document, differences)),
    )


def _pairs(file: RatingsFile) -> list[_Pair]:
    names = [label(part_names(file, part).values()) for part in file.parts]
    pairs = []
    for one, other in itertools.combinations(range(len(file.parts)), 2):
        both = file.parts[one], file.parts[other]
        groups = groups_of(both)
        first, second = groups.sets
        pairs.append(
            _Pair(
                first=names[one],
                second=names[other],
                ratings=(first, second),
                design="dependent" if groups.is_dependent else "independent",
                same_items=groups.same_items,
                clusters=groups.clusters,
                n_shared=n_shared_items(*both),
            )
        )
    return pairs


def _differences(
    entry: Coefficient, pairs: Sequence[_Pair], options: EstimateOptions, scale: Scale
) -> list[_Difference]:
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
        _Difference(pair=pair, title=title, estimate=estimate, test=test, adjusted=p)
        for (pair, estimate, test), p in zip(results, adjusted, strict=True)
    ]


_COLUMNS = (
    Column(key="coefficient", heading="Coefficient", where="csv"),
    Column(key="title", heading="Coefficient", align="left"),
    Column(key="weights", heading="Weights", where="csv"),
    Column(key="first", heading="First", align="left"),
    Column(key="second", heading="Second", align="left"),
    Column(key="items", heading="Items", align="left"),
    Column(key="difference", heading="Difference", digits=3),
    Column(key="standard_error", heading="SE", digits=3),
    Column(key="low", heading="Low", digits=3),
    Column(key="high", heading="High", digits=3),
    Column(key="level", heading="Level", where="csv"),
    Column(key="t", heading="t", digits=2, where="csv"),
    Column(key="df", heading="df", digits=1, where="csv"),
    Column(key="p", heading="p", where="page"),
    Column(key="p_value", heading="p", where="csv"),
    Column(key="p_shown_holm", heading="p (Holm)", where="page"),
    Column(key="p_holm", heading="p (Holm)", where="csv"),
)


def _name(difference: _Difference) -> str:
    return difference.estimate.coefficient.removeprefix("difference of ")


def _cells(difference: _Difference) -> tuple[Value, ...]:
    estimate, test, pair = difference.estimate, difference.test, difference.pair
    interval = estimate.interval
    return (
        _name(difference),
        difference.title,
        estimate.weights,
        pair.first,
        pair.second,
        "the same" if pair.same_items else "others",
        estimate.value,
        estimate.standard_error,
        math.nan if interval is None else interval.low,
        math.nan if interval is None else interval.high,
        None if interval is None else interval.level,
        test.statistic,
        test.df[0],
        p_text(test.p_value),
        test.p_value,
        p_text(difference.adjusted),
        difference.adjusted,
    )


def _document(difference: _Difference) -> dict[str, object]:
    test, pair = difference.test, difference.pair
    return {
        "first": pair.first,
        "second": pair.second,
        "design": pair.design,
        **as_document(difference.estimate),
        "coefficient": _name(difference),
        "t": finite(test.statistic),
        "df": finite(test.df[0]),
        "p_value": finite(test.p_value),
        "p_holm": finite(difference.adjusted),
        "test_reason": test.reason,
    }


def _notes(
    differences: Sequence[_Difference],
    pairs: Sequence[_Pair],
    options: EstimateOptions,
    without: Sequence[str],
) -> tuple[str, ...]:
    is_clustered = any(pair.clusters is not None for pair in pairs)
    unit, population = ("item", "items")
    if is_clustered:
        unit, population = ("cluster", "clusters of items")
    notes = [
        "Difference: the first less the second. SE, "
        f"{percent(options.level)} % CI and p: {unit} jackknife, t; they generalise "
        f"to other {population} like these, graded by the same raters; raters are "
        "taken as they are, whether groups share them or not.",
        f"p (Holm): adjusted for {len(pairs)} pairs, each coefficient by itself."
        if len(pairs) > 1
        else "p (Holm): there is one pair, so nothing to adjust.",
    ]
    if any(pair.design == "dependent" for pair in pairs) and is_clustered:
        notes.append(
            "Groups have clusters in common, which are left out of both at once."
        )
    elif any(pair.design == "dependent" for pair in pairs):
        notes.append(
            "Items the same: both groups have items of the same names, taken for the "
            "same items, and an item is left out of both at once."
        )
    notes += [
        f"{pair.first} and {pair.second}: {pair.n_shared} items have the same name, "
        "taken for different items."
        for pair in pairs
        if not pair.same_items and pair.n_shared
    ]
    if without:
        notes.append(f"Left out: {', '.join(without)}: there is no such interval.")
    return (*notes, *_remarks(differences))


def _remarks(differences: Sequence[_Difference]) -> list[str]:
    # what to know of single differences, or of all alike
    rows_with: dict[str, list[str]] = {}
    for difference in differences:
        pair, interval = difference.pair, difference.estimate.interval
        texts = [] if interval is None else list(interval.notes)
        if difference.test.reason is not None:
            texts.append(f"undefined: {difference.test.reason}")
        for text in texts:
            name = f"{difference.title} ({pair.first} and {pair.second})"
            rows_with.setdefault(text, []).append(name)
    return [
        f"{text}." if len(names) == len(differences) else f"{'; '.join(names)}: {text}."
        for text, names in rows_with.items()
    ]
