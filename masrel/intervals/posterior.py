"""Bayesian intervals of any coefficient, by three models of how raters rate."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal, get_args

import numpy as np

from masrel._input import check_option, refuse
from masrel.agreement import Label, WeightsLike
from masrel.estimates import Interval, Target
from masrel.intervals._question import (
    IntervalProblem,
    PriorName,
    Statistic,
    pose_problem,
)

_MIN_DRAWS = 100

_Model = Literal["auto", "dirichlet-multinomial", "table", "patterns"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Quantity:
    """The posterior of one unknown of a model.

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


def posterior(
    coefficient: Statistic,
    ratings: object,
    *,
    target: Target,
    categories: Sequence[Label] | None = None,
    weights: "WeightsLike" = "identity",
    level: float = 0.95,
    model: _Model = "auto",
    prior: PriorName = "uniform",
    concentration: float | None = None,
    n_draws: int = 10_000,
    rng: np.random.Generator | int | None = None,
) -> Interval:
    """Compute the posterior of a coefficient in the population of items.

    Parameters
    ----------
    coefficient : str or callable
        Any coefficient but stratified ones.
    ratings : nested sequence, array_like or DataFrame, shape (n_items, n_raters)
        Labels or numbers; None and ``nan`` are missing. An item of one rating
        informs the shares of the categories only; the table leaves it out.
    target : {"items"}
        Items are the sample.
    categories : sequence, optional
        The declared scale in order. Categories nobody used count: the prior spreads
        over all that are declared.
    weights : str or array_like, optional
        How much two categories agree; identity for "dirichlet-multinomial".
    level : float, optional
        Level of the central credible interval.
    model : {"auto", "dirichlet-multinomial", "table", "patterns"}, optional
        Raters who are alike; or exactly two, each with margins of their own; or any
        number. By default the first for "fleiss_kappa", "scott_pi" and
        "krippendorff_alpha", unweighted, whose value in the population is the model's
        one parameter of agreement ρ; else the second or the third.
    prior : {"uniform", "jeffreys"}, optional
        ρ ~ U(0, 1), or ρ ~ Beta(1/2, 1/2), the prior of Jeffreys for a probability.
    concentration : float, optional
        Every share of a category is Dirichlet(concentration, ...), 1 unless given;
        with "table" every cell. Unless given, the prior of the table is worth 1.5
        items, half of it on pairs that agree; so is that of the patterns.
    n_draws : int, optional
        Number of draws, where they are needed: by "patterns", by the table of more than
        two categories, and for what is not a function of ρ alone.
    rng : Generator or int, optional
        Where randomness comes from, if any is needed; an integer is recorded as the
        seed. Without it a fresh seed is drawn and recorded.

    Returns
    -------
    Interval
        A central credible interval, with the density as its `distribution`, and with
        the Monte Carlo error of each endpoint if it was drawn.

    Raises
    ------
    ParameterError
        If an option is invalid, or the model does not answer it.
    RatingsError
        If the ratings do not fit.
    ConvergenceError
        If there are more than a million ratings, floats cannot hold their exact
        posterior, or a quadrature does not settle.

    Warns
    -----
    UndefinedStatisticWarning
        If no item has ratings of two raters: the prior alone would speak.

    Notes
    -----
    Dirichlet-multinomial: an item's category probabilities are Dirichlet(A π) and its
    ratings multinomial; ρ = 1 / (1 + A). π is integrated out in closed form, and ρ by
    quadrature, to about 1e-12 [1]_. For raters alike, Cohen's, Conger's and Light's
    kappa are ρ as well; others depend on ρ and π, which are drawn.

    Table: the probabilities of the pairs of categories are Dirichlet. Percent agreement
    and Brennan-Prediger's coefficient, unweighted, are then a Beta; with two categories
    all are integrated by quadrature, to about 1e-10; with more, how often the raters
    agree is integrated and the rest drawn.

    Patterns: what the raters give an item has a Dirichlet, half of its prior on raters
    who all agree, half on one who dissents.

    Where the prior weighs, a note gives the interval under another.

    References
    ----------
    .. [1] Mosimann, J. E. (1962). On the compound multinomial distribution.
       Biometrika, 49(1/2), 65-82. https://doi.org/10.2307/2333468

    Examples
    --------
    >>> ratings = [["a", "a", "a"], ["b", "b", "a"], ["b", "b", "b"]] * 4
    >>> interval = posterior("fleiss_kappa", ratings, target="items")
    >>> interval.kind, round(interval.low, 3), round(interval.high, 3)
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
    # Imported here: the other intervals load no scipy.
    from masrel.intervals._dirichlet import (
        OF_PATTERNS,
        alike_interval,
        no_posterior,
        patterns_interval,
    )
    from masrel.intervals._rho import METHOD, Prior, nothing_to_learn, rho_interval
    from masrel.intervals._two_raters import table_interval

    checked_prior = Prior.of(prior, 1.0 if concentration is None else concentration)
    model = _checked_model(problem, model, weights)
    is_whole = isinstance(n_draws, int | np.integer) and not isinstance(n_draws, bool)
    is_alike = model == "dirichlet-multinomial"
    refuse(
        (
            not is_whole or n_draws < _MIN_DRAWS,
            f"n_draws: needs a whole number of at least {_MIN_DRAWS}, got {n_draws!r}",
        ),
        (
            model == "patterns" and concentration is not None,
            f'model: "patterns" has one prior; got concentration={concentration!r}',
        ),
        (
            prior != "uniform" and not is_alike,
            f'model: "{model}" has one prior; got prior="{prior}"',
        ),
    )
    is_rho = is_alike and problem.entry.rho is not None
    is_exact = is_rho or model == "table"
    reason = nothing_to_learn(problem) if is_exact else no_posterior(problem)
    if reason is not None:
        methods = {"table": "table posterior", "patterns": OF_PATTERNS}
        method = methods.get(model, f"{METHOD}, exact" if is_rho else METHOD)
        nothing = problem.undefined(reason, method=method, unit=None)
        return replace(nothing, kind="credible")
    if is_rho:
        return rho_interval(problem, checked_prior)
    if is_alike:
        return alike_interval(problem, checked_prior, n_draws=n_draws, rng=rng)
    if model == "patterns":
        return patterns_interval(problem, n_draws=n_draws, rng=rng)
    return table_interval(problem, concentration, n_draws=n_draws, rng=rng)


def _checked_model(
    problem: IntervalProblem, model: _Model, weights: "WeightsLike"
) -> _Model:
    """Check what was chosen, and return the model, which may be left to the data."""
    from masrel.intervals._two_raters import table_refusal

    check_option("model", model, get_args(_Model))
    if model == "auto" and problem.is_rho:
        model = "dirichlet-multinomial"
    elif model == "auto":
        model = "table" if problem.n_raters == 2 else "patterns"
    of_table = table_refusal(problem)
    refuse(
        (
            problem.target != "items",
            'target: a posterior generalises to other items: needs "items", got '
            f'"{problem.target}"; for other raters use the jackknife',
        ),
        (
            problem.entry.shape == "pairs" or problem.entry.has_interval,
            f"coefficient: there is no posterior of {problem.entry.title}",
        ),
        (
            model == "dirichlet-multinomial" and not problem.unweighted,
            "model: the Dirichlet-multinomial model applies to unweighted "
            f"coefficients; got {problem.entry.name} with weights={weights!r}",
        ),
        (model == "table" and of_table, of_table),
    )
    return model
