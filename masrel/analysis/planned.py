"""The interval that a line of a protocol's plan asks for, given to its estimate."""

import dataclasses

from masrel.analysis.interval import planned_interval, stream_seed
from masrel.estimates import Estimate
from masrel.protocol import EstimatePlan, Protocol, scale_of

__all__ = ["with_interval"]


def with_interval(
    estimate: Estimate,
    line: EstimatePlan,
    protocol: Protocol,
    ratings: object,
    purpose: str,
) -> Estimate:
    """Give an estimate the interval that its line of the plan asks for."""
    interval = planned_interval(
        line.interval,
        line.coefficient,
        ratings,
        target=line.target,
        categories=scale_of(protocol).values,
        weights=line.weights,
        level=protocol.analysis.level,
        n_resamples=protocol.analysis.n_resamples,
        seed=stream_seed(protocol.analysis.seed, purpose),
    )
    return dataclasses.replace(estimate, interval=interval or estimate.interval)
