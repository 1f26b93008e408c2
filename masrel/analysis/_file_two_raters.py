"""What a file says of two raters: their table of categories, and their differences.

In: a part of a `RatingsFile` with two raters. Out: tests of symmetry, indices of the
table, limits of agreement.
"""

import math
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import TypeVar

from masrel.agreement import (
    LimitsOfAgreement,
    Significance,
    bhapkar,
    bias_index,
    bowker,
    brennan_prediger,
    contingency_table,
    kappa_max,
    limits_of_agreement,
    mcnemar,
    prevalence_index,
    specific_agreement,
    stuart_maxwell,
)
from masrel.analysis._file_parts import named, two_raters
from masrel.errors import ParameterError, RatingsError, UndefinedStatisticWarning
from masrel.ratings import RatingsFile, RatingsPart

_T = TypeVar("_T")

_OF_TABLE = {
    "prevalence_index": ("Prevalence index", prevalence_index),
    "bias_index": ("Bias index", bias_index),
    "kappa_max": ("Largest κ", kappa_max),
}


def symmetry_tests(file: RatingsFile, part: RatingsPart) -> dict[str, Significance]:
    """Return tests of whether changes between categories go both ways alike often."""
    table = contingency_table(two_raters(file, part, "--symmetry"))
    tests: dict[str, Significance] = {}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UndefinedStatisticWarning)  # the results say it
        if len(table) == 2:
            tests["mcnemar, exact"] = mcnemar(table)
            tests["mcnemar, corrected"] = mcnemar(table, kind="corrected")
        tests["bowker"] = bowker(table)
        tests["stuart_maxwell"] = stuart_maxwell(table)
        tests["bhapkar"] = bhapkar(table)
    return tests


@dataclass(frozen=True, slots=True, kw_only=True)
class TableIndex:
    """A number that describes the table of two raters."""

    index: str  # name of it in the JSON
    title: str
    category: str | None = None  # of which, if it is of one
    value: float
    standard_error: float | None = None  # None where it has none
    n_items: int
    reason: str | None  # why it is undefined, or None


def table_indices(file: RatingsFile, part: RatingsPart) -> list[TableIndex]:
    """Return what the margins of two raters and two categories do to kappa."""
    coded, grades = two_raters(file, part, "--indices"), file.scale.grades
    if len(grades) != 2:
        raise RatingsError(
            f"--indices: needs a scale of two categories, got {len(grades)} "
            f"({named(grades)})"
        )
    table = contingency_table(coded)
    made = partial(TableIndex, n_items=int(table.sum()))
    estimate, why = _with_reason(lambda: brennan_prediger(part.counted))
    value, error = estimate.value, estimate.standard_error
    indices = [
        made(
            index="pabak", title="PABAK", value=value, standard_error=error, reason=why
        )
    ]
    for name, (title, function) in _OF_TABLE.items():
        value, why = _with_reason(partial(function, table))
        indices.append(made(index=name, title=title, value=value, reason=why))
    shares, why = _with_reason(lambda: specific_agreement(table))
    indices += [
        made(
            index="specific_agreement",
            title=f"Agreement on {grade}",
            category=grade,
            value=share,
            reason=why if math.isnan(share) else None,
        )
        for grade, share in zip(grades, shares, strict=True)
    ]
    return indices


def _with_reason(call: Callable[[], _T]) -> tuple[_T, str | None]:
    """Return a number, and the warning that says why it is undefined."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always", UndefinedStatisticWarning)
        value = call()
    return value, str(caught[0].message) if caught else None


def difference_limits(
    file: RatingsFile, part: RatingsPart, level: float
) -> LimitsOfAgreement:
    """Return between which bounds the differences of two raters lie."""
    if not file.is_ordered:
        raise ParameterError(
            "--limits-of-agreement: needs grades that are numbers or --categories with "
            "every grade in order, the grades met are text: "
            f"{named(file.scale.grades)}"
        )
    coded = two_raters(file, part, "--limits-of-agreement")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UndefinedStatisticWarning)  # the result says it
        return limits_of_agreement(coded, level=level)
