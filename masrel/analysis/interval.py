"""The interval a line of the plan asks for; the others are never loaded."""

import hashlib
from collections.abc import Sequence
from typing import TypedDict

from masrel.agreement.coding import Label
from masrel.agreement.weights import WeightName
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
    """Compute the interval of one kind.

    Parameters
    ----------
    kind : {"none", "auto", "analytic", "jackknife", "bootstrap", "posterior"}
        Which one; "auto" chooses by target and size.
    coefficient : str
        Name of the coefficient.
    ratings : nested sequence
        What the coefficient takes; None is missing.
    target : {"items", "raters", "both"}
        What a new study would draw anew.
    categories : sequence of str, int or float
        The declared scale in order.
    weights : str, optional
        How much two categories agree.
    level : float
        Nominal level.
    n_resamples : int
        Resamples where a method draws them.
    seed : int
        Seed where a method draws.

    Returns
    -------
    Interval or None
        The interval; None for "none".

    Raises
    ------
    ParameterError
        If there is no such kind, or it does not exist for this coefficient or
        target.
    """
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
    """Derive the seed of one purpose from a study's root seed.

    Adding a line to a plan then moves no other line's numbers.

    Parameters
    ----------
    root : int
        The root seed.
    purpose : str
        What the stream is for.

    Returns
    -------
    int
        A seed of 63 bits.
    """
    digest = hashlib.sha256(f"{root}/{purpose}".encode()).digest()
    return int.from_bytes(digest[:8], "big") >> 1
