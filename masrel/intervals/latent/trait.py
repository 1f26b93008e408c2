"""Ratings on an ordered scale as severities, biases, noises and thresholds."""

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np

from masrel.agreement import Label
from masrel.errors import ParameterError
from masrel.estimates import Target
from masrel.intervals._seeds import recorded_generator
from masrel.intervals.latent.prior import LatentPrior
from masrel.intervals.latent.ratings import Items, LatentRatings

if TYPE_CHECKING:
    from masrel.intervals.latent.result import LatentTrait

__all__ = ["latent_trait"]

_TARGETS: dict[str, Target] = {"fixed": "raters", "random": "both"}


def latent_trait(
    ratings: object,
    *,
    items: Items,
    categories: Sequence[Label] | None = None,
    level: float = 0.95,
    prior: LatentPrior | None = None,
    other_prior: LatentPrior | None = None,
    compare: bool = True,
    n_steps: int = 1_000,
    most_steps: int = 32_000,
    keep_chains: bool = False,
    progress: Callable[[int], object] | None = None,
    rng: np.random.Generator | int | None = None,
) -> "LatentTrait":
    """Place items, raters and thresholds on one scale, and read kappa off it.

    Parameters
    ----------
    ratings : nested sequence, array_like or DataFrame, shape (n_items, n_raters)
        Labels or numbers; None and ``nan`` are missing.
    items : {"fixed", "random"}
        Whether kappa speaks of new raters on these items, or of new raters on new
        items of the same population.
    categories : sequence of str, int or float, optional
        The declared scale in order; numbers need none. Categories nobody used count.
    level : float, optional
        Level of the central credible intervals.
    prior : LatentPrior, optional
        What is believed before the data.
    other_prior : LatentPrior, optional
        The prior under which everything is computed once more, to show how much the
        prior matters.
    compare : bool, optional
        Whether it is; False halves the time.
    n_steps, most_steps : int, optional
        Steps of each of 64 chains at first, and where the sampler gives up.
    keep_chains : bool, optional
        Whether the result holds the draws.
    progress : callable, optional
        Called with the number of steps just made, such as the ``update`` of a
        progress bar.
    rng : Generator or int, optional
        Where randomness comes from; an integer is recorded as the seed. Without it a
        fresh seed is drawn and recorded.

    Returns
    -------
    LatentTrait
        Kappa; severities, biases, noises and thresholds; the predictive check.

    Raises
    ------
    ParameterError
        If an option is none, or the order of the scale is not known.
    RatingsError
        If the ratings do not fit, have fewer than two items, no item rated by two
        raters, or no disagreement.
    ConvergenceError
        If the sampler has not converged after `most_steps`; says how many it needs.

    Notes
    -----
    Rater r perceives item i at θ_i + b_r + σ_r ε and gives the grade between whose
    thresholds that lies; θ_i ~ N(0, ρ), b_r ~ N(0, (1 - ρ)(1 - f)), and the
    logarithm of σ_r² is normal around that of (1 - ρ) f. Missing ratings are taken
    as missing at random. Kappa follows by quadrature from every draw. The posterior
    is sampled by Hamiltonian proposals within emcee, whose own moves need far more
    steps in that many dimensions.

    References
    ----------
    .. [1] Johnson, V. E., Albert, J. H. (1999). Ordinal Data Modeling, ch. 5.
       Springer. https://doi.org/10.1007/b98832
    .. [2] Uebersax, J. S., Grove, W. M. (1993). A latent trait finite mixture model
       for the analysis of rating agreement. Biometrics, 49(3), 823-835.
       https://doi.org/10.2307/2532202

    Examples
    --------
    >>> ratings = [[1, 1, 2], [2, 2, 2], [3, 4, 3]]
    >>> found = latent_trait(  # doctest: +SKIP
    ...     ratings, items="fixed", categories=[1, 2, 3, 4], rng=1
    ... )
    """
    if items not in _TARGETS:
        raise ParameterError(f'items: needs "fixed" or "random", got {items!r}')
    if not 0.0 < level < 1.0:
        raise ParameterError(f"level: needs (0, 1), got {level}")
    if min(n_steps, most_steps) < 20:
        raise ParameterError("n_steps, most_steps: need at least 20")
    known = LatentRatings.of(ratings, categories)
    # Imported here: it loads scipy and emcee.
    from masrel.intervals.latent.summary import Question, summarize

    generator, seed = recorded_generator(rng)
    seeds = generator.integers(2**63, size=2).tolist()
    question = Question(
        ratings=known,
        items=items,
        target=_TARGETS[items],
        level=level,
        n_steps=n_steps,
        most_steps=most_steps,
        keep_chains=keep_chains,
        progress=progress,
        seed=seed,
    )
    other = None
    if compare:
        other = summarize(question, other_prior or LatentPrior.other(), seeds[1], None)
    return summarize(question, prior or LatentPrior(), seeds[0], other)
