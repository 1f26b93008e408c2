"""Candidate intervals of Fleiss' kappa, by the population they are meant for."""

from collections.abc import Callable, Mapping
from functools import partial

import numpy as np

from docs.make.coverage import peers
from docs.make.coverage.bounds import Bounds, Scale, around, joined, student
from docs.make.coverage.case import Case
from docs.make.coverage.studies import Floats, Target, Truths

Method = Callable[[Case], Bounds]
DEFAULT = "default"
FEW = 10
"""Items, and raters, below which the posterior is more than a stopgap."""
SEVERAL = 30
"""Items, below which a jackknife alone ends too low."""


def is_small(case: Case) -> bool:
    """Whether items and raters are both few."""
    return case.n < FEW and case.r < FEW


def delta(case: Case, scale: Scale = "plain", quantile: float | None = None) -> Bounds:
    """The delta method, items random."""
    t = case.t_items if quantile is None else quantile
    ends = around(case.value, t * case.spread.error, scale, case.r)
    return ends.where(case.spread.error > 0.0, _none(case))


def one_way(
    case: Case, variance: Floats, t: float, scale: Scale, *, stopgap: bool = True
) -> Bounds:
    """A jackknife; where it has no spread, the one-sided posterior or nothing."""
    ends = around(case.value, t * np.sqrt(variance), scale, case.r)
    if stopgap:
        return ends.where(case.spreads(variance), case.posterior.one_sided)
    return ends.where(variance > 0.0, _none(case))


def of_items(case: Case, scale: Scale, *, stopgap: bool = True) -> Bounds:
    """The jackknife over items."""
    variance = case.spread.of_items
    return one_way(case, variance, case.t_items, scale, stopgap=stopgap)


def of_raters(case: Case, scale: Scale, *, stopgap: bool = True) -> Bounds:
    """The jackknife over raters."""
    variance = case.spread.of_raters
    return one_way(case, variance, case.t_raters, scale, stopgap=stopgap)


def at_least_cells(case: Case) -> Bounds:
    """The jackknife over raters, its variance not below that of single ratings."""
    variance = np.fmax(case.spread.of_raters, case.spread.of_cells)
    return one_way(case, variance, case.t_raters, "plain")


def cells_and_excess(case: Case) -> Bounds:
    """Single ratings with their own degrees of freedom, and what raters add."""
    single = (case.spread.of_cells, (case.n - 1) * (case.r - 1))
    variance, df = joined(single, (case.excess, case.r - 1))
    ends = around(case.value, student(df) * np.sqrt(variance), "plain", case.r)
    return ends.where(case.spreads(variance), case.posterior.one_sided)


def two_way(
    case: Case, scale: Scale, *, corrected: bool = False, stopgap: bool = True
) -> Bounds:
    """Jackknife variances of both, added, perhaps less what both hold."""
    spread = case.spread
    items, raters = spread.of_items, spread.of_raters
    variance = items + raters
    if corrected:
        variance = np.maximum(variance - spread.of_cells, np.maximum(items, raters))
    ends = around(case.value, case.t_fewest * np.sqrt(variance), scale, case.r)
    if stopgap:
        return ends.where(case.spreads(variance), case.posterior.one_sided)
    return ends.where(variance > 0.0, _none(case))


def items_and_excess(case: Case, scale: Scale = "intraclass") -> Bounds:
    """Items and what raters add beyond single ratings, each with its quantile."""
    items, raters = case.spread.of_items, case.spread.of_raters
    squared = case.t_items**2 * items + case.t_raters**2 * case.excess
    ends = around(case.value, np.sqrt(squared), scale, case.r)
    return ends.where(case.spreads(items + raters), case.posterior.one_sided)


def posterior(case: Case) -> Bounds:
    """The central posterior interval."""
    return case.posterior.central


def posterior_holding(case: Case) -> Bounds:
    """The posterior, widened to the estimate, one-sided at 1."""
    return case.posterior.holding(case.value, case.posterior.central)


def posterior_and_excess(case: Case) -> Bounds:
    """The posterior, and what raters add, as the recovery of variances does it."""
    middle, ends = case.posterior.p50, case.posterior.central
    added = case.t_raters**2 * case.excess
    low = middle - np.sqrt((middle - ends.low) ** 2 + added)
    high = middle + np.sqrt((ends.high - middle) ** 2 + added)
    wide = Bounds(low=np.maximum(low, -1.0), high=np.minimum(high, 1.0))
    return case.posterior.holding(case.value, wide)


def lifted(case: Case, t: float | None = None) -> Bounds:
    """The jackknife on the intraclass scale, its upper end halfway to a higher one."""
    t = case.t_items if t is None else t
    ends = one_way(case, case.spread.of_items, t, "intraclass")
    above = case.posterior.central.high
    high = np.maximum(ends.high, 0.5 * (ends.high + above))
    higher = Bounds(low=ends.low, high=high)
    return higher.where(case.spreads(case.spread.of_items), ends)


def default_of_items(case: Case) -> Bounds:
    """What is recommended where other items could have come."""
    return _items(case, case.t_items)


def _items(case: Case, t: float) -> Bounds:
    if is_small(case):
        return posterior_holding(case)
    ends = one_way(case, case.spread.of_items, t, "intraclass")
    if case.n < SEVERAL:
        ends = lifted(case, t)
    by_model = is_rare(case) | ~case.spreads(case.spread.of_items)
    return posterior_holding(case).where(by_model, ends)


def is_rare(case: Case) -> Truths:
    """Whether few items have a rating outside the commonest category."""
    counts = case.studies.counts  # (n_studies, n_items, n_categories)
    commonest = counts.sum(axis=1).argmax(axis=1)[:, None, None]
    there = np.take_along_axis(counts, commonest, axis=2)[..., 0]
    outside = (there < case.r).sum(axis=1)
    return np.asarray((outside < SEVERAL) & (2 * outside < case.n))


def default_of_raters(case: Case) -> Bounds:
    """What is recommended where other raters could have come."""
    return _raters(case, case.t_raters)


def _raters(case: Case, t: float) -> Bounds:
    variance = case.spread.of_raters
    ends = one_way(case, variance, t, "plain")
    return ends.where(case.spreads(variance), posterior_holding(case))


def default_of_both(case: Case) -> Bounds:
    """What is recommended where both could have come."""
    t = case.t_fewest
    items = _items(case, t)
    raters = _raters(case, t)
    common = t**2 * np.nan_to_num(case.spread.of_cells)

    def distance(of_items: Floats, of_raters: Floats) -> Floats:
        one, other = (np.maximum(of, 0.0) ** 2 for of in (of_items, of_raters))
        shared = np.minimum(common, np.minimum(one, other))
        return np.asarray(np.sqrt(one + other - shared))

    low = case.value - distance(case.value - items.low, case.value - raters.low)
    high = case.value + distance(items.high - case.value, raters.high - case.value)
    ends = Bounds(low=np.maximum(low, -1.0), high=np.minimum(high, 1.0))
    alike = (items.low == raters.low) & (items.high == raters.high)
    return items.where(alike, ends)


def _none(case: Case) -> Bounds:
    nowhere = np.full(len(case.value), np.nan)
    return Bounds(low=nowhere, high=nowhere)


PEERS: Mapping[str, Method] = {
    "irrCAC": peers.irrcac,
    "null standard error": peers.null_error,
}
METHODS: Mapping[Target, Mapping[str, Method]] = {
    "items": {
        DEFAULT: default_of_items,
        "delta, normal": partial(delta, quantile=1.959963984540054),
        "delta, t": delta,
        "delta, t, Fisher z": partial(delta, scale="Fisher z"),
        "delta, t, intraclass": partial(delta, scale="intraclass"),
        "jackknife, t": partial(of_items, scale="plain", stopgap=False),
        "jackknife, t, stopgap": partial(of_items, scale="plain"),
        "jackknife, t, Fisher z, stopgap": partial(of_items, scale="Fisher z"),
        "jackknife, t, intraclass, stopgap": partial(of_items, scale="intraclass"),
        "jackknife, t, intraclass, stopgap, lifted": lifted,
        "posterior": posterior,
        "posterior, holding κ̂": posterior_holding,
        **PEERS,
    },
    "raters": {
        DEFAULT: default_of_raters,
        "jackknife, t": partial(of_raters, scale="plain", stopgap=False),
        "jackknife, t, stopgap": partial(of_raters, scale="plain"),
        "jackknife, t, Fisher z, stopgap": partial(of_raters, scale="Fisher z"),
        "jackknife, t, intraclass, stopgap": partial(of_raters, scale="intraclass"),
        "jackknife at least V_C, t, stopgap": at_least_cells,
        "V_C + E, Satterthwaite, stopgap": cells_and_excess,
        "posterior": posterior,
        **PEERS,
    },
    "both": {
        DEFAULT: default_of_both,
        "V_I + V_R, t": partial(two_way, scale="plain", stopgap=False),
        "V_I + V_R, t, stopgap": partial(two_way, scale="plain"),
        "V_I + V_R, t, Fisher z, stopgap": partial(two_way, scale="Fisher z"),
        "V_I + V_R, t, intraclass, stopgap": partial(two_way, scale="intraclass"),
        "V_I + V_R − V_C, t, stopgap": partial(two_way, scale="plain", corrected=True),
        "V_I + V_R − V_C, t, intraclass, stopgap": partial(
            two_way, scale="intraclass", corrected=True
        ),
        "V_I and E, intraclass, stopgap": items_and_excess,
        "posterior and E": posterior_and_excess,
        "posterior": posterior,
        **PEERS,
    },
}
