"""The standard error of an estimate whose items are a sample."""

import math
from typing import Literal, get_args

import numpy as np

from masrel.errors import ParameterError

__all__ = ["Variance", "check_population", "check_variance", "standard_error"]

Variance = Literal["delta", "irrcac"]
"""Which standard error: the delta method's, or the one irrCAC prints."""

_VARIANCES = get_args(Variance)


def standard_error(
    squares: float, over: float, n_items: int, population: int | None
) -> float:
    """Return the standard error of an estimate from how much each item moves it."""
    # squares, over: Σ_i u_i² is `squares` / `over`, u_i being n times what the estimate
    # changes by when item i counts a little more.
    # √[(1 - n/N) Σ_i u_i² / (n (n - 1))]; ``nan`` of a single item.
    if n_items < 2:
        return math.nan
    variance = squares / (over * n_items * (n_items - 1))
    if population is not None:
        variance *= (population - n_items) / population
    return math.sqrt(variance)


def check_variance(variance: str) -> None:
    """Check the name of a standard error."""
    if variance not in _VARIANCES:
        raise ParameterError(
            f"variance: needs one of {', '.join(_VARIANCES)}, got {variance!r}"
        )


def check_population(population: int | None, n_items: int) -> None:
    """Check the size of a finite population."""
    if population is None:
        return
    if not isinstance(population, int | np.integer) or population < max(n_items, 1):
        raise ParameterError(
            f"population: needs a whole number of at least the {n_items} items rated, "
            f"got {population!r}"
        )
