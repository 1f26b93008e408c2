"""The interval a line of the plan asks for; the others are never loaded."""

from collections.abc import Sequence
from typing import TypedDict

from masrel.agreement import Label, WeightName
from masrel.errors import ParameterError
from masrel.estimates import Interval, Target

_KINDS = ("auto", "analytic", "jackknife", "bootstrap", "posterior")


class _Options(TypedDict):
    # what every method takes
    target: Target
    categories: Sequence[Label] | None
    weights: WeightName
    level: float


def planned_interval(
    kind: str,
    coefficient: str,
    ratings: object,
    *,
    target: Target,
    categories: Sequence[Label] | None = None,
    weights: WeightName = "identity",
    level: float,
    n_resamples: int,
    seed: int,
) -> Interval | None:
    """Compute the interval of one kind."""
    if kind == "none":
        return None
    if kind not in _KINDS:
        raise ParameterError(
            f"interval: needs one of none, {', '.join(_KINDS)}, got {kind!r}"
        )
    # Imported here: asking for a kappa alone loads no interval.
    from masrel import intervals

    options = _Options(
        target=target, categories=categories, weights=weights, level=level
    )
    if kind == "auto":
        return intervals.estimate(coefficient, ratings, **options).interval
    if kind == "analytic":
        return intervals.analytic(coefficient, ratings, **options)
    if kind == "jackknife":
        return intervals.jackknife(coefficient, ratings, **options)
    if kind == "bootstrap":
        return intervals.bootstrap(
            coefficient, ratings, **options, n_resamples=n_resamples, rng=seed
        )
    return intervals.posterior(coefficient, ratings, **options, rng=seed)
