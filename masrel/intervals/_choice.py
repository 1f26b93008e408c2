"""Which interval answers a question at its size, by the study of coverage in the docs.

Other items. A posterior covers best where there are

- few: less than 10 items, and less than 10 raters;
- rare categories: less than 30 items, and less than half of all, have a rating outside
  the commonest category;
- no spread: leaving out any item changes nothing, or next to nothing.

It is that of the Dirichlet-multinomial model for Fleiss' kappa, Scott's pi and
Krippendorff's alpha, and for every unweighted coefficient where categories are rare,
since chance agreement then hardly depends on who the raters are, or where few items are
graded by more than two, which say more of raters alike than of each pattern. For others
it is that of the table of two raters or of the patterns of any number, as it is for all
above 2000 items. Elsewhere the item jackknife on a logit, its upper end lifted below 30
items.

Other raters. The rater jackknife; without spread the posterior, for those of the model.

Both. What the two of them say, joined.

Other clusters of items. The cluster jackknife on a logit; that it may cover less where
categories are rare is noted.

Items and raters are counted that have a pair of ratings.
"""

import math
from dataclasses import replace
from functools import partial

import numpy as np

from masrel.estimates import Interval
from masrel.intervals._drawn_posterior import (
    DEFAULT_DRAWS,
    SEED,
    alike_interval,
    nothing_to_learn,
    patterns_interval,
)
from masrel.intervals._problem import Integers, IntervalProblem, singular, warn_small
from masrel.intervals._rho import (
    DEFAULT_PRIOR,
    RhoPosterior,
    default_rho_interval,
    extended,
)
from masrel.intervals._table_quadrature import CHANCE_AGREEMENT
from masrel.intervals._two_raters import applies_to, default_table_interval
from masrel.intervals.jackknife import (
    _interval_around_estimate,
    _jackknife_variance,
    _logit_interval,
    _variance_of_cells,
)
from masrel.intervals.posterior import _RHO_COEFFICIENTS

_FEW = 10  # items, and raters, below which a posterior covers best
_SEVERAL = 30  # items, below which a jackknife alone ends too low
_ACCIDENT = 0.003  # of (1 - κ) / ratings: a variance below it is no information
_OUTSIDE = "items with a rating outside the commonest category"
_MANY = 2_000  # items, above which the model's polynomials take long


def choose_interval(
    problem: IntervalProblem, *, unweighted: bool
) -> tuple[Interval, str]:
    """Compute the interval that covers best, and say what it is and why."""
    if problem.entry.shape == "pairs":
        why = "items leave with the pairs of all their raters"
        return _interval_around_estimate(problem, _jackknife_variance(problem)), why
    if problem.n_paired_items == 0:
        why = "no item has ratings of two raters"
        return _interval_around_estimate(problem, _jackknife_variance(problem)), why
    if problem.target == "both":
        return _other_items_and_raters(problem, unweighted)
    few = problem.n_paired_items < _FEW and problem.n_paired_raters < _FEW
    outside = _outside_commonest(problem)
    rare = not few and _is_rare(problem, outside)
    if not (few or rare) or problem.target == "raters" or nothing_to_learn(problem):
        return _jackknife_with_spread(problem, unweighted)
    # of more than two raters; two have a table of their own
    alike = rare or problem.n_paired_raters > 2
    interval = _posterior(problem, unweighted, alike)
    if few:
        return interval, f"few items ({problem.n_paired_items}), where it covers best"
    # below so many no method covers everywhere
    notes = warn_small(outside, 5 if unweighted else _SEVERAL, _OUTSIDE)
    what = singular(_OUTSIDE) if outside == 1 else _OUTSIDE
    why = f"categories are rare ({outside} {what}), where it covers best"
    return replace(interval, notes=(*notes, *interval.notes)), why


def choose_of_clusters(problem: IntervalProblem, codes: Integers) -> Interval:
    """Compute the interval of other clusters of items, which no posterior knows of."""
    interval = _logit_interval(problem, codes)
    if interval.reason is not None:
        return interval
    outside = _outside_commonest(problem)
    if not _is_rare(problem, outside):
        return interval
    notes = warn_small(outside, _SEVERAL, _OUTSIDE)
    return replace(interval, notes=(*notes, *interval.notes))


def _jackknife_with_spread(
    problem: IntervalProblem, unweighted: bool
) -> tuple[Interval, str]:
    # leave items out, or raters, unless that says nothing
    n_items, target = problem.n_paired_items, problem.target
    modelled = unweighted and problem.entry.name in _RHO_COEFFICIENTS
    jackknifed, n_ratings = _jackknife_variance(problem), _paired_ratings(problem)
    # an accident of few disagreements gives as much
    accident = _ACCIDENT * (1.0 - problem.value) / n_ratings if modelled else 0.0
    if not jackknifed.variance > accident:
        if (modelled or target == "items") and not nothing_to_learn(problem):
            why = "leaving any out says next to nothing, so that a model must"
            return _posterior(problem, unweighted, False), why
        why = "the spread of the units left out"
        return _interval_around_estimate(problem, jackknifed), why
    if target == "raters":
        why = "raters left out, one at a time"
        return _interval_around_estimate(problem, jackknifed), why
    lowest, per_item = problem.entry.lowest, n_ratings / n_items
    if modelled and per_item > 1.0:
        # An intraclass correlation of r raters is at least -1/(r - 1): its logit is
        # Fisher's transformation, ln[(1 + (r - 1) κ) / (1 - κ)].
        lowest = -1.0 / (per_item - 1.0)
    interval = problem.around(
        problem.value,
        problem.student_t(jackknifed.df) * math.sqrt(jackknifed.variance),
        lowest=lowest,
        method=f"item jackknife, t({jackknifed.df:g}) on the logit",
        unit="items",
        notes=jackknifed.notes,
    )
    if modelled and n_items < _SEVERAL:
        interval = _lift(problem, interval)
    return interval, "items left out, on a scale without ends"


def _outside_commonest(problem: IntervalProblem) -> int:
    """Count items of two ratings or more, not all of the commonest category."""
    codes = problem.patterns.codes  # (n_patterns, n_raters)
    rated = codes >= 0
    freq = np.broadcast_to(problem.freq[:, None], codes.shape)
    commonest = np.bincount(codes[rated], weights=freq[rated]).argmax()
    outside = (rated & (codes != commonest)).any(axis=1)
    return int(problem.freq @ (outside & (rated.sum(axis=1) >= 2)))


def _is_rare(problem: IntervalProblem, outside: int) -> bool:
    return outside < _SEVERAL and 2 * outside < problem.n_paired_items


def _paired_ratings(problem: IntervalProblem) -> int:
    sizes = (problem.patterns.codes >= 0).sum(axis=1)
    return int(problem.freq @ np.where(sizes > 1, sizes, 0))


def _posterior(problem: IntervalProblem, unweighted: bool, alike: bool) -> Interval:
    """Compute the posterior, one-sided where the estimate is perfect or undefined."""
    name = problem.entry.name
    chance, small = CHANCE_AGREEMENT.get(name), problem.n_paired_items <= _MANY
    alike = alike and unweighted and chance is not None and small
    is_rho = alike and chance in ("pooled", "margins")
    if is_rho or (small and unweighted and name in _RHO_COEFFICIENTS):
        return default_rho_interval(problem)
    if not alike and small and applies_to(problem):
        return default_table_interval(problem)
    one_sided = not problem.value < 1.0
    drawn = partial(alike_interval, prior=DEFAULT_PRIOR) if alike else patterns_interval
    interval = drawn(problem, n_draws=DEFAULT_DRAWS, rng=SEED, one_sided=one_sided)
    return interval if one_sided else extended(problem, interval)


def _lift(problem: IntervalProblem, interval: Interval) -> Interval:
    # An estimate of few items is skewed: low where its error is low, too. The posterior
    # knows, but trusts many raters too much where κ is low; halfway covers with either.
    counts = problem.item_counts()
    high = RhoPosterior.of(counts, DEFAULT_PRIOR, problem.level).high
    if not high > interval.high:
        return interval
    note = (
        f"the upper end, {interval.high:.3f}, is lifted halfway to that of the "
        f"Dirichlet-multinomial posterior, {high:.3f}: with few items an estimate "
        "that is low by chance has a low error, too"
    )
    halfway = 0.5 * (interval.high + high)
    return replace(interval, high=halfway, notes=(*interval.notes, note))


def _other_items_and_raters(
    problem: IntervalProblem, unweighted: bool
) -> tuple[Interval, str]:
    # Either end is as far from the estimate as other items alone, and as other raters
    # alone, would put it: these distances squared and added, less what both hold of the
    # disagreement of a rater on an item, which is never taken as more than either has.
    # So the variance is below neither; nor is an end inside either interval. With the
    # fewer degrees of freedom of the two, in both, the answer is no surer than either.
    df = min(problem.n_paired_items, problem.n_paired_raters) - 1
    if df < 1:
        reason = "one item with two ratings does not say how items differ"
        method = "items and raters left out"
        return problem.undefined(reason, method=method, unit="both"), "one item"
    common = problem.student_t(df) ** 2 * _variance_of_cells(problem)
    parts = (replace(problem, target=of, max_df=df) for of in ("items", "raters"))
    items, raters = (choose_interval(of, unweighted=unweighted)[0] for of in parts)
    why = "what items left out and raters left out move"
    for part in (items, raters):
        if part.reason is not None:
            return part, why
    if (items.low, items.high) == (raters.low, raters.high):
        return items, why  # nothing moves, and the same model must say what that hides
    ends = np.array([[items.low, items.high], [raters.low, raters.high]])
    of_items, of_raters = np.maximum((ends - problem.value) * (-1.0, 1.0), 0.0) ** 2
    both = np.minimum(of_items, of_raters)
    low, high = np.sqrt(of_items + of_raters - np.minimum(common, both)).tolist()
    interval = problem.confidence(
        problem.value - low,
        problem.value + high,
        method=f"{items.method}, and {raters.method}",
        unit="both",
        notes=[
            note if f" {of}: below" in note else f"{of}: {note}"
            for of, part in (("items", items), ("raters", raters))
            for note in part.notes
        ],
    )
    return interval, why
