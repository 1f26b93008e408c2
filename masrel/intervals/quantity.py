"""One unknown of a model, with its interval."""

from dataclasses import dataclass

from masrel.estimates import Interval

__all__ = ["Quantity"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Quantity:
    """One unknown of a model after the data."""

    name: str  # what it is, or whose
    value: float  # posterior median; ``nan`` when undefined
    interval: Interval  # central credible interval
    # r_hat, ess: rank-normalized split R-hat, and the smaller effective size of bulk
    # and tails; None when nothing was drawn
    r_hat: float | None = None
    ess: float | None = None
