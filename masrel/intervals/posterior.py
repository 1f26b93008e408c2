"""Bayesian intervals of Fleiss' kappa from the Dirichlet-multinomial model."""

from collections.abc import Sequence

import numpy as np

from masrel.agreement.coding import Label
from masrel.agreement.counting import item_counts
from masrel.errors import ParameterError
from masrel.estimates import Interval, Target
from masrel.intervals.bootstrap import recorded_generator
from masrel.intervals.case import Statistic, open_case

__all__ = ["posterior"]


def posterior(
    coefficient: Statistic,
    ratings: object,
    *,
    target: Target,
    categories: Sequence[Label] | None = None,
    level: float = 0.95,
    n_steps: int = 3_000,
    most_steps: int = 48_000,
    rng: np.random.Generator | int | None = None,
) -> Interval:
    """Sample the posterior of the population's Fleiss' kappa.

    Parameters
    ----------
    coefficient : {"fleiss_kappa"} or callable
        The model has one parameter of agreement, whose value in the population is
        Fleiss' kappa.
    ratings : nested sequence, array_like or DataFrame, shape (n_items, n_raters)
        Labels or numbers; None and ``nan`` are missing.
    target : {"items"}
        Items are the sample; raters are exchangeable in the model.
    categories : sequence, optional
        The declared scale in order. Categories nobody used count: the prior spreads
        over all that are declared.
    level : float, optional
        Level of the central credible interval.
    n_steps, most_steps : int, optional
        Steps of every walker at first, and where the sampler gives up.
    rng : Generator or int, optional
        Where randomness comes from; an integer is recorded as the seed. Without
        it a fresh seed is drawn and recorded.

    Returns
    -------
    Interval
        A central credible interval with the Monte Carlo error of each endpoint;
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
    Prior: ρ ~ U(0, 1), π ~ Dirichlet(1, ..., 1) over the declared categories.

    Examples
    --------
    >>> ratings = [["a", "a", "a"], ["b", "b", "a"], ["b", "b", "b"]]
    >>> found = posterior("fleiss_kappa", ratings, target="items", rng=1)
    >>> found.kind, 0.0 < found.low < found.high < 1.0
    ('credible', True)
    """
    case = open_case(
        coefficient,
        ratings,
        target=target,
        categories=categories,
        weights="identity",
        level=level,
    )
    if case.entry.name != "fleiss_kappa":
        raise ParameterError(
            "coefficient: the Dirichlet-multinomial model speaks of fleiss_kappa, "
            f"got {case.entry.name}"
        )
    if target != "items":
        raise ParameterError(
            "target: the Dirichlet-multinomial model speaks of other items, so "
            f'"items"; for other raters use the jackknife; got "{target}"'
        )
    method = "Dirichlet-multinomial posterior, emcee"
    counts = item_counts(case.coded)
    if not (counts.sum(axis=1) >= 2).any():
        return case.undefined(
            "no item has ratings of two raters", method=method, unit=None
        )
    if case.coded.n_categories < 2:
        return case.undefined("one category is declared", method=method, unit=None)
    # Imported here: the other intervals load neither scipy nor emcee.
    from masrel.intervals.dirichlet import DirichletMultinomial
    from masrel.intervals.mcmc import sample

    generator, seed = recorded_generator(rng)
    model = DirichletMultinomial.of_counts(counts)
    draws = sample(
        model.log_density,
        model.n_dimensions,
        lambda position: model.parts(position)[0],
        generator=generator,
        n_steps=n_steps,
        most_steps=most_steps,
    )
    tail = 0.5 * (1.0 - level)
    return Interval(
        low=draws.quantile(tail),
        high=draws.quantile(1.0 - tail),
        level=level,
        kind="credible",
        method=method,
        target=target,
        n_resamples=int(draws.values.size),
        monte_carlo_error=(
            draws.quantile_error(tail),
            draws.quantile_error(1.0 - tail),
        ),
        seed=seed,
        notes=_notes(counts),
    )


def _notes(counts: np.ndarray[tuple[int, ...], np.dtype[np.int64]]) -> tuple[str, ...]:
    if (counts.sum(axis=0) > 0).sum() == 1:
        return (
            "all ratings are in one category: the lower end comes from the prior "
            "more than from the data",
        )
    if ((counts > 0).sum(axis=1) <= 1).all():
        return ("agreement is perfect in these data",)
    return ()
