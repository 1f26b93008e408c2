"""Agreement of raters with themselves over two sessions."""

import dataclasses

from masrel.agreement import coefficient, cohen_kappa
from masrel.analysis.planned import with_interval
from masrel.analysis.results import PlannedEstimate, RaterEstimate
from masrel.analysis.selection import absence, rated_models
from masrel.protocol import EstimatePlan, Protocol, scale_of
from masrel.ratings import Ratings, RetestPairs, retest_pairs

__all__ = ["retest_agreement"]


def retest_agreement(
    line: EstimatePlan, protocol: Protocol, ratings: Ratings
) -> PlannedEstimate:
    """Estimate agreement of every rater with him- or herself."""
    # ``stratified_kappa`` gives one estimate over all raters, each a stratum, and
    # ``pooled_kappa`` one of all their pairs in one table, both with every rater's
    # Cohen's kappa beside it; any other coefficient is computed for every rater alone.
    missing = absence(line, protocol, ratings)
    if missing is not None:
        return PlannedEstimate(line=line, reason=missing)
    first, second = line.sessions
    pairs = retest_pairs(
        ratings,
        first=first,
        second=second,
        models=rated_models(line, protocol, ratings),
    )
    if not pairs.raters:
        reason = f"no rater has ratings in both {first} and {second}"
        return PlannedEstimate(line=line, reason=reason)
    over_raters = coefficient(line.coefficient).shape == "pairs"
    found = _over_raters if over_raters else _each_rater
    return dataclasses.replace(
        found(line, protocol, pairs),
        items=pairs.items,
        raters=pairs.raters,
        n_missing=pairs.n_missing,
    )


def _over_raters(
    line: EstimatePlan, protocol: Protocol, pairs: RetestPairs
) -> PlannedEstimate:
    categories = scale_of(protocol).values
    weighed = [scale_of(protocol).weigh(of_rater) for of_rater in pairs.pairs]
    over_raters = coefficient(line.coefficient)
    estimate = over_raters(weighed, categories=categories, weights=line.weights)
    return PlannedEstimate(
        line=line,
        estimate=with_interval(estimate, line, protocol, weighed, line.id),
        by_rater=tuple(
            RaterEstimate(
                rater=rater,
                estimate=cohen_kappa(
                    of_rater, categories=categories, weights=line.weights
                ),
            )
            for rater, of_rater in zip(pairs.raters, weighed, strict=True)
        ),
    )


def _each_rater(
    line: EstimatePlan, protocol: Protocol, pairs: RetestPairs
) -> PlannedEstimate:
    own = coefficient(line.coefficient)
    categories = scale_of(protocol).values
    weighed = [scale_of(protocol).weigh(of_rater) for of_rater in pairs.pairs]
    return PlannedEstimate(
        line=line,
        by_rater=tuple(
            RaterEstimate(
                rater=rater,
                estimate=with_interval(
                    own(
                        of_rater,
                        categories=categories,
                        weights=line.weights,
                        level=protocol.analysis.level,
                    ),
                    line,
                    protocol,
                    of_rater,
                    f"{line.id}/{rater}",
                ),
            )
            for rater, of_rater in zip(pairs.raters, weighed, strict=True)
        ),
    )
