"""Which interval answers a question at its size, by the study of coverage in the docs.

Where few items, or no disagreement, leave nothing to resample, Fleiss' kappa and what
estimates the same fall back on the Dirichlet-multinomial posterior, and other
coefficients of two raters on that of their table.
"""

import dataclasses
import math

from masrel.estimates import Interval
from masrel.intervals.case import Case
from masrel.intervals.choice import FEW, SEVERAL, Choice
from masrel.intervals.jackknife import around_estimate
from masrel.intervals.modelled import lifted, of_any_raters, of_two_raters, one_sided
from masrel.intervals.quantiles import student_t
from masrel.intervals.spread import Spread, excess_of_raters, spread
from masrel.intervals.transforms import around

__all__ = ["Choice", "choose"]


def choose(choice: Choice) -> Interval:
    """Compute the interval that covers best."""
    case = choice.case
    if case.entry.shape == "pairs":
        why = "items leave with the pairs of all their raters"
        return _because(case, around_estimate(case, spread(case)), why)
    if choice.modelled and choice.small and case.target == "items":
        why = f"few items ({case.n_items}) and raters, where it covers best"
        return _because(case, of_any_raters(choice, 0.0), why)
    if choice.tabular and case.n_items < FEW:
        why = f"few items ({case.n_items}), where it covers best"
        return _because(case, of_two_raters(choice), why)
    found = spread(case)
    if not choice.has_spread(found.variance):
        return _spreadless(choice, found)
    if case.target == "raters":
        why = "raters left out, one at a time"
        return _because(case, around_estimate(case, found), why)
    return _items(choice, found) if case.target == "items" else _both(choice, found)


def _spreadless(choice: Choice, found: Spread) -> Interval:
    case = choice.case
    if choice.tabular:
        why = "leaving items out says nothing, so that a model must"
        return _because(case, of_two_raters(choice), why)
    if choice.modelled:
        why = "the ratings hardly disagree, so that a model must say what that can hide"
        return _because(case, one_sided(choice), why)
    why = "the spread of the units left out"
    return _because(case, around_estimate(case, found), why)


def _items(choice: Choice, found: Spread) -> Interval:
    case = choice.case
    half = student_t(case.level, case.n_items - 1) * math.sqrt(found.variance)
    words = f"item jackknife, t({case.n_items - 1}) on the logit"
    interval = _on_logit(choice, found, half, words)
    if choice.modelled and case.n_items < SEVERAL:
        interval = lifted(interval, choice.posterior.high)
    return _because(case, interval, "items left out, on a scale without ends")


def _both(choice: Choice, found: Spread) -> Interval:
    case = choice.case
    excess = student_t(case.level, choice.n_raters - 1) ** 2 * excess_of_raters(case)
    if choice.modelled and choice.small:
        why = "few items and raters; raters add what they differ by"
        return _because(case, of_any_raters(choice, excess), why)
    items = spread(dataclasses.replace(case, target="items")).variance
    half = math.sqrt(student_t(case.level, case.n_items - 1) ** 2 * items + excess)
    words = "two-way jackknife, t on the logit"
    why = "items left out, and what raters differ by beyond single ratings"
    return _because(case, _on_logit(choice, found, half, words), why)


def _on_logit(choice: Choice, found: Spread, half: float, words: str) -> Interval:
    case = choice.case
    low, high = around(case.value, half, "logit", choice.least)
    if math.isnan(low):  # at the least value there is
        low, high = around(case.value, half, "none", choice.least)
    return case.closed(low, high, method=words, unit=case.target, notes=found.notes)


def _because(case: Case, interval: Interval, why: str) -> Interval:
    note = f"chosen for other {_OTHERS[case.target]}: {why}"
    return dataclasses.replace(
        interval, target=case.target, notes=(note, *interval.notes)
    )


_OTHERS = {"items": "items", "raters": "raters", "both": "items and raters"}
