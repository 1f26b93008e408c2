"""What the latent-trait model says, in types."""

from dataclasses import dataclass, field

from masrel.agreement.kernel import Floats
from masrel.estimates import Estimate
from masrel.intervals.latent.predictive import PredictiveCheck
from masrel.intervals.latent.prior import LatentPrior
from masrel.intervals.quantity import Quantity

__all__ = ["LatentChains", "LatentTrait"]


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class LatentChains:
    """The draws themselves.

    Attributes
    ----------
    kappa : ndarray, shape (n_chains, n_kept)
        Kappa; fewer a chain than of the others when items are random.
    severity, bias, noise, thresholds : ndarray, shape (n_chains, n_kept, n)
        Items' severities, raters' biases and noises, and the thresholds, severities
        and thresholds from the mean severity of these items.
    shares : ndarray, shape (n_chains, n_kept, 3)
        Shares of the variance: of the items, of the biases, of the noises.
    noise_spread : ndarray, shape (n_chains, n_kept, 1)
        η, the standard deviation of the logarithms of raters' noises.
    """

    kappa: Floats = field(repr=False)
    severity: Floats = field(repr=False)
    bias: Floats = field(repr=False)
    noise: Floats = field(repr=False)
    thresholds: Floats = field(repr=False)
    shares: Floats = field(repr=False)
    noise_spread: Floats = field(repr=False)


@dataclass(frozen=True, slots=True, kw_only=True)
class LatentTrait:
    """Items, raters and thresholds on one scale, and the agreement they imply.

    The scale has its 0 at the mean severity of these items, and its unit is the
    standard deviation of a rating of a random item by a random rater.

    Attributes
    ----------
    kappa : Estimate
        Fleiss' kappa of two raters drawn anew: posterior median, its standard
        deviation as `standard_error`, and interval; `observed` and `chance` are the
        posterior medians of both agreements.
    items : tuple of Quantity
        Severity of every item with a rating.
    raters : tuple of Quantity
        Bias of every rater with a rating, against the population of raters: positive
        for one who grades high.
    noises : tuple of Quantity
        Standard deviation of the same rater's perception of the same item.
    thresholds : tuple of Quantity
        Where one grade ends and the next begins.
    shares : tuple of Quantity
        Shares of the variance: items, raters' biases, raters' noise.
    noise_spread : Quantity
        Standard deviation of the logarithms of raters' noises.
    grades : tuple of tuple of float
        Per item, the probability of each grade by a rater drawn anew (posterior mean).
    checks : tuple of PredictiveCheck
        Whether the model makes ratings such as these.
    prior : LatentPrior
        What was believed before the data.
    other : LatentTrait or None
        The same under another prior, or None if there was no other.
    r_hat, ess : float
        The largest R-hat and the smallest effective size of all reported quantities.
    n_chains, n_steps : int
        Chains, and steps of each after warm-up.
    seed : int or None
        Seed that repeats it; None when a generator was passed.
    chains : LatentChains or None
        The draws, when they were asked for.
    """

    kappa: Estimate
    items: tuple[Quantity, ...]
    raters: tuple[Quantity, ...]
    noises: tuple[Quantity, ...]
    thresholds: tuple[Quantity, ...]
    shares: tuple[Quantity, ...]
    noise_spread: Quantity
    grades: tuple[tuple[float, ...], ...]
    checks: tuple[PredictiveCheck, ...]
    prior: LatentPrior
    other: "LatentTrait | None"
    r_hat: float
    ess: float
    n_chains: int
    n_steps: int
    seed: int | None
    chains: LatentChains | None = field(default=None, compare=False, repr=False)
