"""What the latent-trait model says, in types."""

from dataclasses import dataclass, field

from masrel.agreement._kernel import Floats
from masrel.estimates import Estimate
from masrel.intervals.latent.predictive import PredictiveCheck
from masrel.intervals.latent.prior import LatentPrior
from masrel.intervals.quantity import Quantity

__all__ = ["LatentChains", "LatentTrait"]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LatentChains:
    """The draws themselves."""

    # (n_chains, n_kept): kappa; fewer a chain than of the others when items are random
    kappa: Floats = field(repr=False)
    # severity, bias, noise, thresholds: (n_chains, n_kept, n): items' severities,
    # raters' biases and noises, and the thresholds, severities and thresholds from the
    # mean severity of these items
    severity: Floats = field(repr=False)
    bias: Floats = field(repr=False)
    noise: Floats = field(repr=False)
    thresholds: Floats = field(repr=False)
    # (n_chains, n_kept, 3): shares of the variance: of the items, of the biases, of the
    # noises
    shares: Floats = field(repr=False)
    # (n_chains, n_kept, 1): η, the standard deviation of the logarithms of raters'
    # noises
    noise_spread: Floats = field(repr=False)


@dataclass(frozen=True, slots=True, kw_only=True)
class LatentTrait:
    """Items, raters and thresholds on one scale, and the agreement they imply."""

    # The scale has its 0 at the mean severity of these items, and its unit is the
    # standard deviation of a rating of a random item by a random rater.

    # fleiss' kappa of two raters drawn anew: posterior median, its standard deviation
    # as `standard_error`, and interval; `observed` and `chance` are the posterior
    # medians of both agreements
    kappa: Estimate
    items: tuple[Quantity, ...]  # severity of every item with a rating
    # bias of every rater with a rating, against the population of raters: positive for
    # one who grades high
    raters: tuple[Quantity, ...]
    # standard deviation of the same rater's perception of the same item
    noises: tuple[Quantity, ...]
    thresholds: tuple[Quantity, ...]  # where one grade ends and the next begins
    # shares of the variance: items, raters' biases, raters' noise
    shares: tuple[Quantity, ...]
    noise_spread: Quantity  # standard deviation of the logarithms of raters' noises
    # per item, the probability of each grade by a rater drawn anew (posterior mean)
    grades: tuple[tuple[float, ...], ...]
    checks: tuple[PredictiveCheck, ...]  # whether the model makes ratings such as these
    prior: LatentPrior  # what was believed before the data
    # the same under another prior, or None if there was no other
    other: "LatentTrait | None"
    # r_hat, ess: the largest R-hat and the smallest effective size of all reported
    # quantities
    r_hat: float
    ess: float
    # n_chains, n_steps: chains, and steps of each after warm-up
    n_chains: int
    n_steps: int
    seed: int | None  # seed that repeats it; None when a generator was passed
    # the draws, when they were asked for
    chains: LatentChains | None = field(default=None, compare=False, repr=False)
