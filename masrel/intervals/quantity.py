"""One unknown of a model, with its interval."""

from dataclasses import dataclass

from masrel.estimates import Interval


@dataclass(frozen=True, slots=True, kw_only=True)
class Quantity:
    """One unknown of a model after the data.

    Attributes
    ----------
    name : str
        What it is, or whose.
    value : float
        Posterior median; ``nan`` when undefined.
    interval : Interval
        Central credible interval.
    r_hat, ess : float or None
        Rank-normalized split R-hat, and the effective size of the tails; None when
        nothing was drawn.
    """

    name: str
    value: float
    interval: Interval
    r_hat: float | None = None
    ess: float | None = None
