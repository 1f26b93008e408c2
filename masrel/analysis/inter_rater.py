"""Agreement between raters in one session."""

from masrel.agreement import coefficient
from masrel.analysis.planned import with_interval
from masrel.analysis.results import PlannedEstimate
from masrel.analysis.selection import absence, rated_models
from masrel.protocol import EstimatePlan, Protocol, scale_of
from masrel.ratings import Ratings, rating_matrix

__all__ = ["inter_rater"]


def inter_rater(
    line: EstimatePlan, protocol: Protocol, ratings: Ratings
) -> PlannedEstimate:
    """Estimate agreement between the raters of one session."""
    missing = absence(line, protocol, ratings)
    if missing is not None:
        return PlannedEstimate(line=line, reason=missing)
    matrix = rating_matrix(
        ratings, session=line.sessions[0], models=rated_models(line, protocol, ratings)
    )
    if len(matrix.raters) < 2:
        reason = f"session {line.sessions[0]} has one rater; agreement needs two"
        return PlannedEstimate(line=line, reason=reason)
    categories = scale_of(protocol).values
    grades = scale_of(protocol).weigh(matrix.grades)
    estimate = coefficient(line.coefficient)(
        grades,
        categories=categories,
        weights=line.weights,
        level=protocol.analysis.level,
    )
    return PlannedEstimate(
        line=line,
        items=matrix.items,
        raters=matrix.raters,
        n_missing=matrix.n_missing,
        estimate=with_interval(estimate, line, protocol, grades, line.id),
    )
