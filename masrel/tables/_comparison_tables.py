"""How much the groups of a file of ratings differ in agreement, and whether at all.

In: a `RatingsFile` whose parts are the groups. Out: tables, and the same for JSON.
"""

import math
from collections.abc import Sequence
from dataclasses import replace

from masrel.agreement import Coefficient
from masrel.analysis._file_comparisons import (
    DONNER,
    FLEISS,
    HOTELLING,
    Comparison,
    Difference,
    EqualityTest,
    compare_all,
    compare_pairs,
)
from masrel.analysis._file_estimates import EstimateOptions
from masrel.estimates import as_document
from masrel.ratings import RatingsFile
from masrel.tables._further_tables import FurtherTable, data_of, finite
from masrel.tables._row_notes import NotedRow, row_notes
from masrel.tables._tables import Column, Table, Value, p_text, percent, significant

_TESTS = {
    FLEISS: f"{FLEISS}: groups of other items, by their delta-method errors.",
    DONNER: f"{DONNER}: two raters and two categories, of one κ of all groups; it "
    "holds its level in smaller groups.",
    HOTELLING: f"{HOTELLING}: groups of the same items, by their names, or "
    "of the same clusters, by the delta method.",
}


def difference_table(
    file: RatingsFile, entries: Sequence[Coefficient], options: EstimateOptions
) -> FurtherTable:
    """Return the difference of every two groups in every coefficient."""
    comparison = compare_pairs(file, entries, options)
    differences = comparison.differences
    return FurtherTable(
        key="differences",
        table=Table(
            name="differences",
            caption="Differences of agreement between groups",
            columns=_difference_columns(len(comparison.pairs)),
            rows=tuple(map(_difference_cells, differences)),
            notes=_difference_notes(comparison, options),
            data=data_of(file),
        ),
        documents=list(map(_difference_document, differences)),
    )


_DIFFERENCE_COLUMNS = (
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


def _difference_columns(n_pairs: int) -> tuple[Column, ...]:
    # of one pair there is nothing to adjust
    return tuple(
        replace(column, where="csv")
        if n_pairs == 1 and column.key == "p_shown_holm"
        else column
        for column in _DIFFERENCE_COLUMNS
    )


def _name(difference: Difference) -> str:
    return difference.estimate.coefficient.removeprefix("difference of ")


def _difference_cells(difference: Difference) -> tuple[Value, ...]:
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


def _difference_document(difference: Difference) -> dict[str, object]:
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


def _difference_notes(
    comparison: Comparison, options: EstimateOptions
) -> tuple[str, ...]:
    pairs = comparison.pairs
    is_clustered = any(pair.clusters is not None for pair in pairs)
    unit, population = ("item", "items")
    if is_clustered:
        unit, population = ("cluster", "clusters of items")
    notes = [
        "Difference: the first less the second. SE, "
        f"{percent(options.level)} % CI and p: {unit} jackknife, t; they generalise "
        f"to other {population} like these, graded by the same raters; raters are "
        "taken as they are, whether groups share them or not.",
    ]
    if len(pairs) > 1:
        notes.append(
            f"p (Holm): adjusted for {len(pairs)} pairs, each coefficient by itself."
        )
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
    if comparison.without:
        titles = ", ".join(comparison.without)
        notes.append(f"Left out: {titles}: there is no such interval.")
    return (*notes, *row_notes(list(map(_noted, comparison.differences)), "groups"))


def _noted(difference: Difference) -> NotedRow:
    pair, interval = difference.pair, difference.estimate.interval
    texts = () if interval is None else interval.notes
    if difference.test.reason is not None:
        texts = (*texts, f"undefined: {difference.test.reason}")
    group = f"{pair.first} and {pair.second}"
    return NotedRow(title=difference.title, group=group, texts=texts)


def equality_table(
    file: RatingsFile, entries: Sequence[Coefficient], options: EstimateOptions
) -> FurtherTable:
    """Return the test that all groups have the same coefficient, for each of them."""
    tests = compare_all(file, entries, options)
    undefined = [
        f"{test.entry.title}: undefined: {test.result.reason}."
        for test in tests
        if test.result.reason is not None
    ]
    return FurtherTable(
        key="equality",
        table=Table(
            name="equality",
            caption="Equality of agreement in all groups",
            columns=_EQUALITY_COLUMNS,
            rows=tuple(map(_equality_cells, tests)),
            notes=(*dict.fromkeys(_TESTS[test.name] for test in tests), *undefined),
            data=data_of(file),
        ),
        documents=list(map(_equality_document, tests)),
    )


_EQUALITY_COLUMNS = (
    Column(key="coefficient", heading="Coefficient", where="csv"),
    Column(key="title", heading="Coefficient", align="left"),
    Column(key="weights", heading="Weights", where="csv"),
    Column(key="test", heading="Test", align="left"),
    Column(key="statistic", heading="Statistic", digits=2),
    Column(key="distribution", heading="Distribution", align="left", where="csv"),
    Column(key="df", heading="df", align="left"),
    Column(key="p", heading="p", where="page"),
    Column(key="p_value", heading="p", where="csv"),
)


def _equality_cells(test: EqualityTest) -> tuple[Value, ...]:
    result = test.result
    return (
        test.entry.name,
        test.title,
        test.weights,
        test.name,
        result.statistic,
        result.distribution,
        ", ".join(map(significant, result.df)) or None,
        p_text(result.p_value),
        result.p_value,
    )


def _equality_document(test: EqualityTest) -> dict[str, object]:
    result = test.result
    return {
        "coefficient": test.entry.name,
        "weights": test.weights,
        "test": result.name,
        "statistic": finite(result.statistic),
        "distribution": result.distribution,
        "df": list(result.df),
        "p_value": finite(result.p_value),
        "n_items": result.n_items,
        "reason": result.reason,
    }
