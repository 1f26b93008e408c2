"""Whether all groups of a file of ratings agree as well: one test a coefficient.

In: a `RatingsFile` whose parts are the groups. Out: a table, and the same for JSON.
"""

import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial

from masrel.agreement import Coefficient, Significance
from masrel.analysis._file_estimates import EstimateOptions, on_grades
from masrel.errors import MasrelWarning
from masrel.ratings import RatingsFile
from masrel.report._further_tables import (
    FurtherTable,
    data_of,
    finite,
)
from masrel.report._group_rows import Groups, groups_of
from masrel.report._tables import Column, Table, Value, p_text, significant

_FLEISS = "Fleiss' weighted χ²"
_DONNER = "Donner's goodness of fit"
_HOTELLING = "Hotelling's T² as F"

_NOTES = {
    _FLEISS: f"{_FLEISS}: groups of other items, by their delta-method errors.",
    _DONNER: f"{_DONNER}: two raters and two categories, of one κ of all groups; it "
    "holds its level in smaller groups.",
    _HOTELLING: f"{_HOTELLING}: groups of the same items, by their names, or "
    "of the same clusters, by the delta method.",
}
_INTRACLASS = ("fleiss_kappa", "scott_pi")
"""Coefficients that are the intraclass kappa of two raters and two categories."""


@dataclass(frozen=True, slots=True, kw_only=True)
class _Test:
    """A test of one coefficient of all groups."""

    entry: Coefficient
    title: str
    weights: str
    name: str
    result: Significance


def equality_table(
    file: RatingsFile,
    entries: Sequence[Coefficient],
    options: EstimateOptions,
) -> FurtherTable:
    """Return the test that all groups have the same coefficient, for each of them."""
    groups = groups_of(file.parts)
    tests: list[_Test] = []
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", MasrelWarning)  # the results say it
        for entry in entries:
            if entry.kernel is not None:  # else the table of differences says it
                of_entry = tuple(on_grades(s, entry, file.scale) for s in groups.sets)
                tests += _tests(entry, replace(groups, sets=of_entry), options)
    names = dict.fromkeys(test.name for test in tests)
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
            columns=_COLUMNS,
            rows=tuple(map(_cells, tests)),
            notes=(*(_NOTES[name] for name in names), *undefined),
            data=data_of(file),
        ),
        documents=list(map(_document, tests)),
    )


def _tests(
    entry: Coefficient, groups: Groups, options: EstimateOptions
) -> Iterator[_Test]:
    from masrel.intervals import differences, donner_test, equality_test, estimate

    weights, clusters = options.weights_of(entry), groups.clusters
    test = partial(_Test, entry=entry, title=options.title(entry), weights=weights)
    if groups.is_dependent:
        result = differences(entry, groups.sets, weights=weights, clusters=clusters)
        yield test(name=_HOTELLING, result=result.equality)
        return
    if clusters is None:
        estimates = [entry(ratings, weights=weights) for ratings in groups.sets]
    else:
        estimates = [
            estimate(entry, ratings, target="items", weights=weights, clusters=of)
            for ratings, of in zip(groups.sets, clusters, strict=True)
        ]
    yield test(name=_FLEISS, result=equality_test(estimates))
    of_two = all(
        ratings.codes.shape[1] == 2 and len(ratings.categories) == 2
        for ratings in groups.sets
    )
    if of_two and clusters is None and entry.name in _INTRACLASS:
        yield test(name=_DONNER, result=donner_test(groups.sets))


_COLUMNS = (
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


def _cells(test: _Test) -> tuple[Value, ...]:
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


def _document(test: _Test) -> dict[str, object]:
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
