"""The one rule for undefined statistics: nan, a warning, and a reason."""

import warnings

from masrel.errors import UndefinedStatisticWarning

__all__ = ["NO_CHANCE", "NO_PAIR", "undefined"]

NO_PAIR = "no item has ratings of two raters"
NO_CHANCE = "0/0: chance agreement is 1, all ratings are in one category"


def undefined(title: str, reason: str) -> str:
    """Warn that a statistic is undefined, and return why."""
    warnings.warn(
        f"{title} is undefined: {reason}", UndefinedStatisticWarning, stacklevel=4
    )
    return reason
