"""Bayesian intervals of Fleiss' kappa from the Dirichlet-multinomial model."""

import dataclasses
from collections.abc import Sequence
from typing import TYPE_CHECKING, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from masrel.agreement.coding import Label
from masrel.agreement.counting import item_counts
from masrel.errors import ParameterError
from masrel.estimates import Interval, Target
from masrel.intervals.bootstrap import recorded_generator
from masrel.intervals.case import Case, Statistic, open_case
from masrel.intervals.prior import Prior, PriorName

if TYPE_CHECKING:
    from masrel.agreement.weights import WeightName

__all__ = ["SPOKEN_OF", "posterior"]

SPOKEN_OF = ("fleiss_kappa", "scott_pi", "krippendorff_alpha")
"""Coefficients whose value in the population is the model's ρ."""

Method = Literal["exact", "emcee"]


def posterior(
    coefficient: Statistic,
    ratings: object,
    *,
    target: Target,
    categories: Sequence[Label] | None = None,
    weights: "WeightName | ArrayLike" = "identity",
    level: float = 0.95,
    prior: PriorName = "uniform",
    concentration: float = 1.0,
    method: Method = "exact",
    n_steps: int = 3_000,
    most_steps: int = 48_000,
    rng: np.random.Generator | int | None = None,
) -> Interval:
    """Compute the posterior of the population's Fleiss' kappa.

    Parameters
    ----------
    coefficient : {"fleiss_kappa", "scott_pi", "krippendorff_alpha"} or callable
        The model has one parameter of agreement, ρ, whose value in the population
        all three share.
    ratings : nested sequence, array_like or DataFrame, shape (n_items, n_raters)
        Labels or numbers; None and ``nan`` are missing. An item of one rating
        informs the shares of the categories only.
    target : {"items"}
        Items are the sample; raters are exchangeable in the model.
    categories : sequence, optional
        The declared scale in order. Categories nobody used count: the prior spreads
        over all that are declared.
    weights : {"identity"}, optional
        The model is of agreement on one category.
    level : float, optional
        Level of the central credible interval.
    prior : {"uniform", "jeffreys"}, optional
        ρ ~ U(0, 1), or ρ ~ Beta(1/2, 1/2), the prior of Jeffreys for a probability.
    concentration : float, optional
        The shares of the categories are Dirichlet(concentration, ...).
    method : {"exact", "emcee"}, optional
        Quadrature, which draws nothing; or a sampler, to check it.
    n_steps, most_steps : int, optional
        Steps of every walker at first, and where the sampler gives up; for "emcee".
    rng : Generator or int, optional
        Where randomness comes from; an integer is recorded as the seed. Without
        it a fresh seed is drawn and recorded; for "emcee".

    Returns
    -------
    Interval
        A central credible interval. With "exact" its `distribution` is the density
        of ρ; with "emcee" there is the Monte Carlo error of each endpoint, and
        `n_resamples` counts the draws.

    Raises
    ------
    ParameterError
        If an option is none, or this model does not answer it.
    RatingsError
        If the ratings do not fit.
    ConvergenceError
        If the sampler has not converged after `most_steps`.

    Warns
    -----
    UndefinedStatisticWarning
        If no item has ratings of two raters: the prior alone would speak.

    Notes
    -----
    An item's category probabilities are Dirichlet(A π) and its ratings multinomial;
    ρ = 1 / (1 + A). π is integrated out in closed form, and ρ by quadrature, to
    about 1e-12 [1]_. Where the prior weighs, a note gives the interval under
    another.

    References
    ----------
    .. [1] Mosimann, J. E. (1962). On the compound multinomial distribution.
       Biometrika, 49(1/2), 65-82. https://doi.org/10.2307/2333468

    Examples
    --------
    >>> ratings = [["a", "a", "a"], ["b", "b", "a"], ["b", "b", "b"]] * 4
    >>> found = posterior("fleiss_kappa", ratings, target="items")
    >>> found.kind, round(found.low, 3), round(found.high, 3)
    ('credible', 0.188, 0.815)
    """
    case = open_case(
        coefficient,
        ratings,
        target=target,
        categories=categories,
        weights=weights,
        level=level,
    )
    _check_model(case, weights)
    believed = Prior.of(prior, concentration)
    if method not in get_args(Method):
        raise ParameterError(
            f"method: needs one of {', '.join(get_args(Method))}, got {method!r}"
        )
    words = f"Dirichlet-multinomial posterior, {method}"
    counts = item_counts(case.coded)
    reason = _nothing_to_learn(counts)
    if reason is not None:
        undefined = case.undefined(reason, method=words, unit=None)
        return dataclasses.replace(undefined, kind="credible")
    # Imported here: the other intervals load neither scipy nor emcee.
    from masrel.intervals.rho import prior_notes

    if method == "exact":
        found = _integrated(case, counts, believed, words)
    else:
        found = _sampled(case, counts, believed, words, n_steps, most_steps, rng)
    notes = prior_notes(counts, believed, level, found.low, found.high)
    return dataclasses.replace(found, notes=notes)


def _check_model(case: Case, weights: "WeightName | ArrayLike") -> None:
    if case.entry.name not in SPOKEN_OF:
        raise ParameterError(
            "coefficient: the Dirichlet-multinomial model speaks of fleiss_kappa and "
            "of scott_pi and krippendorff_alpha, whose value in the population is the "
            f"same; got {case.entry.name}"
        )
    if not (isinstance(weights, str) and weights == "identity"):
        raise ParameterError(
            "weights: the Dirichlet-multinomial model is of unweighted agreement, so "
            f'"identity"; got {weights!r}'
        )
    if case.target != "items":
        raise ParameterError(
            "target: the Dirichlet-multinomial model speaks of other items, so "
            f'"items"; for other raters use the jackknife; got "{case.target}"'
        )


def _nothing_to_learn(counts: NDArray[np.int64]) -> str | None:
    # shape of counts: (n_items, n_categories)
    if not (counts.sum(axis=1) >= 2).any():
        return "no item has ratings of two raters"
    if counts.shape[1] < 2:
        return "one category is declared"
    return None


def _integrated(
    case: Case, counts: NDArray[np.int64], prior: Prior, words: str
) -> Interval:
    from masrel.intervals.rho import ExactPosterior

    found = ExactPosterior.of(counts, prior, case.level)
    return Interval(
        low=found.low,
        high=found.high,
        level=case.level,
        kind="credible",
        method=words,
        target=case.target,
        distribution=found.distribution(f"posterior of ρ, prior {prior.words}"),
    )


def _sampled(
    case: Case,
    counts: NDArray[np.int64],
    prior: Prior,
    words: str,
    n_steps: int,
    most_steps: int,
    rng: np.random.Generator | int | None,
) -> Interval:
    from masrel.intervals.dirichlet import DirichletMultinomial
    from masrel.intervals.mcmc import sample

    generator, seed = recorded_generator(rng)
    model = DirichletMultinomial.of_counts(
        counts, concentration=prior.concentration, shape=prior.shape
    )
    draws = sample(
        model.log_density,
        model.n_dimensions,
        lambda position: model.parts(position)[0],
        generator=generator,
        n_steps=n_steps,
        most_steps=most_steps,
    )
    tail = 0.5 * (1.0 - case.level)
    errors = (draws.quantile_error(tail), draws.quantile_error(1.0 - tail))
    return Interval(
        low=draws.quantile(tail),
        high=draws.quantile(1.0 - tail),
        level=case.level,
        kind="credible",
        method=words,
        target=case.target,
        n_resamples=int(draws.values.size),
        monte_carlo_error=errors,
        seed=seed,
    )
