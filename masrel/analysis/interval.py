"""The interval a line of the plan asks for; the others are never loaded."""

import hashlib
from collections.abc import Sequence
from typing import TypedDict

from masrel.agreement import Label, WeightName
from masrel.errors import ParameterError
from masrel.estimates import Interval, Target

__all__ = ["planned_interval", "stream_seed"]

_KINDS = ("auto", "analytic", "jackknife", "bootstrap", "posterior")


def planned_interval(
    kind: str,
    coefficient: str,
    ratings: object,
    *,
    target: Target,
    categories: Sequence[Label],
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

    asked = _Asked(target=target, categories=categories, weights=weights, level=level)
    if kind == "auto":
        return intervals.estimate(coefficient, ratings, **asked).interval
    if kind == "analytic":
        return intervals.analytic(coefficient, ratings, **asked)
    if kind == "jackknife":
        return intervals.jackknife(coefficient, ratings, **asked)
    if kind == "bootstrap":
        return intervals.bootstrap(
            coefficient, ratings, **asked, n_resamples=n_resamples, rng=seed
        )
    return intervals.posterior(coefficient, ratings, **asked, rng=seed)


class _Asked(TypedDict):
    # what every method takes
    target: Target
    categories: Sequence[Label]
    weights: WeightName
    level: float


def stream_seed(root: int, purpose: str) -> int:
    """Derive the seed of one purpose from a study's root seed."""
    # Adding a line to a plan then moves no other line's numbers.
    digest = hashlib.sha256(f"{root}/{purpose}".encode()).digest()
    return int.from_bytes(digest[:8], "big") >> 1
