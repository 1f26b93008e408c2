"""masrel's estimate and the exact one of a case, side by side."""

import warnings
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from masrel import agreement as offered
from masrel.agreement import count_items, count_ratings, count_table
from masrel.errors import UndefinedStatisticWarning
from masrel.estimates import Estimate
from tests.accuracy import reference
from tests.accuracy.cases import METRICS, Case


@dataclass(frozen=True)
class Exact:
    """A coefficient in fractions; None where it is 0/0, and the error of one item."""

    value: Fraction | None
    standard_error: Any  # mpmath.mpf or None


def exact(case: Case, name: str, weights: str, *, error: bool = True) -> Exact:
    """Compute a coefficient by its textbook formula."""
    if weights in METRICS:
        w: Any = reference.agreement_of_metric(METRICS[weights], case.scale, case.items)
    else:
        w = reference.agreement(weights, case.scale)
    q = len(case.scale)
    value = reference.value(name, case.items, w, q)
    if value is None or not error:
        return Exact(value, None)
    return Exact(value, reference.standard_error(name, case.items, w, q))


def prepared(case: Case) -> Any:
    """Ratings as masrel takes them, coded once for all coefficients."""
    if case.table:
        return count_table(case.table, categories=case.scale)
    if case.counts:
        return count_items(case.counts, categories=case.scale)
    return count_ratings(case.labels(), categories=case.scale)


def estimate(name: str, weights: str, ratings: Any) -> Estimate:
    """Ask masrel for a coefficient of prepared ratings."""
    how = {"metric": METRICS[weights]} if weights in METRICS else {"weights": weights}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UndefinedStatisticWarning)
        return getattr(offered, name)(ratings, **how)
