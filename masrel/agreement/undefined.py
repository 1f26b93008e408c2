"""The one rule for undefined statistics: nan, a warning, and a reason."""

import math
import warnings
from fractions import Fraction

from masrel.errors import UndefinedStatisticWarning

__all__ = [
    "NO_CHANCE",
    "NO_PAIR",
    "defined",
    "kappa",
    "ratio",
]

NO_PAIR = "no item has ratings of two raters"
NO_CHANCE = "0/0: chance agreement is 1, all ratings are in one category"


def ratio(value: Fraction | None) -> float:
    """Return an exact ratio as the nearest float, ``nan`` for None.

    Parameters
    ----------
    value : Fraction or None
        The exact value.

    Returns
    -------
    float
        The float64 nearest to it.
    """
    return math.nan if value is None else float(value)


def kappa(observed: Fraction | None, chance: Fraction | None) -> Fraction | None:
    """Return (p_o - p_e) / (1 - p_e), or None where it is undefined.

    Parameters
    ----------
    observed, chance : Fraction or None
        Observed and chance agreement; None when undefined.

    Returns
    -------
    Fraction or None
        The coefficient, exact.
    """
    if observed is None or chance is None or chance == 1:
        return None
    return (observed - chance) / (1 - chance)


def defined(
    name: str, observed: Fraction | None, chance: Fraction | None
) -> str | None:
    """Return why a coefficient is undefined, with a warning; None when it is not.

    Parameters
    ----------
    name : str
        The coefficient, for the warning.
    observed, chance : Fraction or None
        Observed and chance agreement; `chance` is 0 for a coefficient without.

    Returns
    -------
    str or None
        The reason.

    Warns
    -----
    UndefinedStatisticWarning
        If there is a reason.
    """
    if observed is None or chance is None:
        reason = NO_PAIR
    elif chance == 1:
        reason = NO_CHANCE
    else:
        return None
    warnings.warn(
        f"{name} is undefined: {reason}", UndefinedStatisticWarning, stacklevel=3
    )
    return reason
