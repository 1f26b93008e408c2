"""Bayesian intervals: of Fleiss' kappa by any raters, of any coefficient by two."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from masrel.agreement import Label
from masrel.errors import ParameterError
from masrel.estimates import Interval, Target
from masrel.intervals._problem import IntervalProblem, Statistic, pose_problem
from masrel.intervals.dirichlet.prior import Prior, PriorName

if TYPE_CHECKING:
    from masrel.agreement import WeightName

__all__ = ["SPOKEN_OF", "posterior"]

SPOKEN_OF = ("fleiss_kappa", "scott_pi", "krippendorff_alpha")
"""Coefficients whose value in the population is the model's ρ."""

Model = Literal["auto", "dirichlet-multinomial", "table"]
Method = Literal["exact", "emcee"]


def posterior(
    coefficient: Statistic,
    ratings: object,
    *,
    target: Target,
    categories: Sequence[Label] | None = None,
    weights: "WeightName | ArrayLike" = "identity",
    level: float = 0.95,
    model: Model = "auto",
    prior: PriorName = "uniform",
    concentration: float | None = None,
    method: Method = "exact",
    n_draws: int = 10_000,
    n_steps: int = 3_000,
    most_steps: int = 48_000,
    rng: np.random.Generator | int | None = None,
) -> Interval:
    """Compute the posterior of a coefficient in the population of items.

    Parameters
    ----------
    coefficient : str or callable
        "fleiss_kappa", "scott_pi" or "krippendorff_alpha", whose value in the
        population is the one parameter of agreement ρ of the Dirichlet-multinomial
        model; of two raters any coefficient but stratified ones.
    ratings : nested sequence, array_like or DataFrame, shape (n_items, n_raters)
        Labels or numbers; None and ``nan`` are missing. An item of one rating
        informs the shares of the categories only; it is left out of the table.
    target : {"items"}
        Items are the sample.
    categories : sequence, optional
        The declared scale in order. Categories nobody used count: the prior spreads
        over all that are declared.
    weights : str or array_like, optional
        How much two categories agree; identity but for the table of two raters.
    level : float, optional
        Level of the central credible interval.
    model : {"auto", "dirichlet-multinomial", "table"}, optional
        Any raters who are exchangeable; or exactly two, each with margins of their
        own. By default the first where it speaks of the coefficient.
    prior : {"uniform", "jeffreys"}, optional
        ρ ~ U(0, 1), or ρ ~ Beta(1/2, 1/2), the prior of Jeffreys for a probability.
    concentration : float, optional
        Every share of a category is Dirichlet(concentration, ...), 1 unless given;
        with "table" every cell. Unless given, the prior of the table is worth 1.5
        items, half of it on pairs that agree.
    method : {"exact", "emcee"}, optional
        Quadrature, which draws nothing; or a sampler, to check it.
    n_draws : int, optional
        Draws where the table of more than two categories needs them.
    n_steps, most_steps : int, optional
        Steps of every walker at first, and where the sampler gives up; for "emcee".
    rng : Generator or int, optional
        Where randomness comes from, if any is needed; an integer is recorded as the
        seed. Without it a fresh seed is drawn and recorded.

    Returns
    -------
    Interval
        A central credible interval, its `distribution` the density. Where it was
        drawn, with the Monte Carlo error of each endpoint.

    Raises
    ------
    ParameterError
        If an option is none, or the model does not answer it.
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
    Dirichlet-multinomial: an item's category probabilities are Dirichlet(A π) and its
    ratings multinomial; ρ = 1 / (1 + A). π is integrated out in closed form, and ρ by
    quadrature, to about 1e-12 [1]_.

    Table: the chances of the pairs of categories are Dirichlet. Percent agreement and
    Brennan-Prediger's coefficient, unweighted, are then a Beta; with two categories all
    are integrated by quadrature, to about 1e-10; with more, how often the raters agree
    is integrated and the rest drawn.

    Where the prior weighs, a note gives the interval under another.

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
    problem = pose_problem(
        coefficient,
        ratings,
        target=target,
        categories=categories,
        weights=weights,
        level=level,
    )
    believed = Prior.of(prior, 1.0 if concentration is None else concentration)
    _check_options(problem, model, method)
    identity = isinstance(weights, str) and weights == "identity"
    spoken_of = problem.entry.name in SPOKEN_OF and identity
    asked = problem.entry.name if identity else f"weighted {problem.entry.name}"
    # Imported here: the other intervals load neither scipy nor emcee.
    if model == "table" or (model == "auto" and not spoken_of):
        _check_table(problem, asked, model, method, believed)
        from masrel.intervals.table.interval import table_interval

        return table_interval(problem, concentration, n_draws=n_draws, rng=rng)
    _check_dirichlet(spoken_of, asked)
    from masrel.intervals.dirichlet.interval import rho_interval

    return rho_interval(
        problem,
        believed,
        sampled=method == "emcee",
        n_steps=n_steps,
        most_steps=most_steps,
        rng=rng,
    )


def _check_options(problem: IntervalProblem, model: Model, method: Method) -> None:
    for name, given, options in (("model", model, Model), ("method", method, Method)):
        if given not in get_args(options):
            known = ", ".join(get_args(options))
            raise ParameterError(f"{name}: needs one of {known}, got {given!r}")
    if problem.target != "items":
        raise ParameterError(
            "target: a posterior speaks of other items, so "
            f'"items"; for other raters use the jackknife; got "{problem.target}"'
        )


def _check_dirichlet(spoken_of: bool, asked: str) -> None:
    if not spoken_of:
        raise ParameterError(
            "model: the Dirichlet-multinomial model speaks of unweighted fleiss_kappa, "
            "and of scott_pi and krippendorff_alpha, whose value in the population is "
            f'the same; for two raters "table" speaks of others; got {asked}'
        )


def _check_table(
    problem: IntervalProblem, asked: str, model: Model, method: Method, prior: Prior
) -> None:
    n_raters = problem.coded.codes.shape[1]
    if model == "auto" and n_raters != 2:
        raise ParameterError(
            "coefficient: a posterior speaks of unweighted fleiss_kappa, scott_pi and "
            "krippendorff_alpha, and of others by exactly two raters; got "
            f"{asked} by {n_raters}"
        )
    if method != "exact" or prior.name != "uniform":
        raise ParameterError(
            'model: "table" has one prior, Dirichlet(concentration, ...), and no '
            f'sampler; got prior="{prior.name}", method="{method}"'
        )
