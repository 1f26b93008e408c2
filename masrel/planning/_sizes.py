"""How many items or raters a study needs, and what a study of a given size shows."""

from collections.abc import Sequence
from typing import Literal

import numpy as np

from masrel.agreement import Label, WeightsLike
from masrel.errors import ParameterError
from masrel.estimates import Target
from masrel.planning._aims import Aim
from masrel.planning._cheapest import cheapest_plan
from masrel.planning._item_models import LatentModel
from masrel.planning._plan_question import RATER_SHARE, pose_question
from masrel.planning._precision import Plan, plan_of
from masrel.planning._smallest_size import Search
from masrel.planning._tasks import Progress

Method = Literal["auto", "wald", "goodness-of-fit", "exact", "simulation"]
Model = str | LatentModel | None
Prices = tuple[float, float, float]  # of an item, a rater, a rating
_RATINGS: Prices = (0.0, 0.0, 1.0)


def sample_size(
    coefficient: str,
    *,
    value: float | None,
    n_raters: int | None = None,
    n_items: int | None = None,
    weights: WeightsLike = "identity",
    categories: int | Sequence[Label] | None = None,
    prevalences: object = None,
    model: Model = None,
    target: Target,
    p_missing: float = 0.0,
    level: float = 0.95,
    sides: int = 2,
    half_width: float | None = None,
    lower: float | None = None,
    upper: float | None = None,
    null: float | None = None,
    power: float | None = None,
    assurance: float | None = None,
    max_cost: float | None = None,
    prices: Prices | None = None,
    interval: str = "auto",
    rater_share: float = RATER_SHARE,
    rng: np.random.Generator | int | None = None,
    method: Method = "auto",
    progress: Progress | None = None,
) -> Plan:
    """Solve for the number of items or of raters that a study needs.

    Parameters
    ----------
    coefficient : str
        Its name in the register; any that is a function of sums over items, and the
        intraclass correlations icc_1, icc_c1 and icc_a1.
    value : float or None
        The coefficient that is taken to be true; None where the model has it: a table,
        or a `LatentModel`.
    n_raters, n_items : int, optional
        Exactly one of them: the other is solved for. With `prices` neither: the
        cheapest study is.
    weights : str or array_like, optional
        How much two categories agree.
    categories : int or sequence, optional
        How many there are, or the scale in order, by which weights of numbers go.
    prevalences : sequence of float, optional
        Of the categories, with sum 1; equal when not given. With model "table" the
        joint probabilities of two raters, shape (n_categories, n_categories).
    model : {"mixture", "dirichlet-multinomial", "latent", "table"} or LatentModel
        How the ratings of an item come about. An intraclass correlation takes none:
        its ratings are normal.
    target : {"items", "raters", "both"}
        What a new study would draw anew.
    p_missing : float, optional
        Chance of every rating to be missing.
    level : float, optional
        Nominal level of the interval.
    sides : {1, 2}, optional
        How many tails share 1 - level.
    half_width : float, optional
        Aim: half the width of the interval, expected or with `assurance`.
    lower, upper : float, optional
        Aim: ends of the interval no lower, no higher; expected, or with `assurance`, or
        with `power` (non-inferiority by one, equivalence by both).
    null : float, optional
        Aim, with `power`: the interval excludes this value.
    power, assurance : float, optional
        Chances to be reached.
    max_cost : float, optional
        What the study may cost; without an aim, the study is the most that this buys.
    prices : tuple of float, optional
        Of an item, a rater, and a rating; (0, 0, 1) when not given.
    interval : str, optional
        The interval that is planned: a method of `masrel.intervals.estimate`, such as
        "auto" or "jackknife", or estimate ± quantile times standard error, not cut at
        the ends of the scale: "t" or "normal".
    rater_share : float, optional
        Of the error of icc_a1, how much the levels of the raters make.
    rng : numpy.random.Generator or int, optional
        Seed of simulated studies; drawn and kept in the plan when not given.
    method : {"auto", "exact", "simulation", "wald", "goodness-of-fit"}, optional
        "auto" sums over all studies where there are few, and else draws them.
    progress : callable, optional
        Called as studies are drawn, with how many there are and how many there will be.

    Returns
    -------
    Plan
        The smallest study that reaches the aim, or the cheapest, and what it shows.

    Raises
    ------
    ParameterError
        If an argument is out of range, or nothing reaches the aim; the message then
        says what is the best that can be had.

    Notes
    -----
    A chance is not monotone in the number of items: an exact plan with `assurance` or
    `power` gives the size from which on it holds, and notes the first.

    Examples
    --------
    How many items have an expected half-width of 0.15?

    >>> plan = sample_size(
    ...     "scott_pi",
    ...     value=0.5,
    ...     prevalences=[0.7, 0.3],
    ...     model="mixture",
    ...     target="items",
    ...     n_raters=2,
    ...     half_width=0.15,
    ...     interval="normal",
    ... )
    >>> plan.n_items, plan.method
    (154, 'exact')
    """
    is_cheapest = n_items is None and n_raters is None and prices is not None
    if not is_cheapest:
        _check_one_size(n_items, n_raters)
    aim = Aim(
        half_width=half_width,
        lower=lower,
        upper=upper,
        null=null,
        power=power,
        assurance=assurance,
    ).checked()
    question = pose_question(
        coefficient=coefficient,
        value=value,
        weights=weights,
        categories=categories,
        prevalences=prevalences,
        model=model,
        target=target,
        p_missing=p_missing,
        level=level,
        sides=sides,
        interval=interval,
        method=method,
        aim=aim,
        prices=_RATINGS if prices is None else prices,
        max_cost=max_cost,
        rng=rng,
        rater_share=rater_share,
        progress=progress,
    )
    if aim.kind is None and max_cost is None:
        raise ParameterError(
            "half_width: needs an aim: a half-width, a lower or upper limit, or a null "
            "value with power; got none"
        )
    if is_cheapest:
        return cheapest_plan(question)
    return Search(question, n_items=n_items, n_raters=n_raters).plan()


def _check_one_size(n_items: int | None, n_raters: int | None) -> None:
    if (n_items is None) != (n_raters is None):
        return
    got = (
        "both"
        if n_items is not None
        else "none, and no prices by which to find the cheapest of both"
    )
    raise ParameterError(
        f"n_items, n_raters: needs exactly one of them, since the other is solved for; "
        f"got {got}"
    )


def precision(
    coefficient: str,
    *,
    n_items: int,
    n_raters: int,
    value: float | None,
    weights: WeightsLike = "identity",
    categories: int | Sequence[Label] | None = None,
    prevalences: object = None,
    model: Model = None,
    target: Target,
    p_missing: float = 0.0,
    level: float = 0.95,
    sides: int = 2,
    half_width: float | None = None,
    lower: float | None = None,
    upper: float | None = None,
    null: float | None = None,
    prices: Prices = _RATINGS,
    interval: str = "auto",
    rater_share: float = RATER_SHARE,
    prior: tuple[float, float] | None = None,
    rng: np.random.Generator | int | None = None,
    method: Method = "auto",
    progress: Progress | None = None,
) -> Plan:
    """Say what a study of a given size can show.

    Parameters
    ----------
    coefficient : str
        Its name.
    n_items, n_raters : int
        The size of the study.
    value, weights, categories, prevalences, model, target, p_missing : optional
        What is taken to be true, as of `sample_size`.
    level, sides : optional
        Of the interval, as of `sample_size`.
    half_width : float, optional
        The plan's assurance is the chance of an interval as narrow as this.
    lower, upper : float, optional
        Its assurance is the chance of an interval inside these.
    null : float, optional
        Its power is the chance of an interval that excludes this.
    prices, interval, rater_share : optional
        As of `sample_size`.
    prior : tuple of float, optional
        Parameters of a Beta distribution of the true value, over which the power of
        method "goodness-of-fit" is averaged.
    rng, method, progress : optional
        How it is computed, as of `sample_size`.

    Returns
    -------
    Plan
        What the study shows.

    Raises
    ------
    ParameterError
        If an argument is out of range.

    Examples
    --------
    >>> plan = precision(
    ...     "icc_1", value=0.6, n_items=100, n_raters=3, target="both", half_width=0.1
    ... )
    >>> round(plan.expected_half_width, 4), round(plan.assurance, 3)
    (0.0995, 0.513)
    """
    aim = Aim(half_width=half_width, lower=lower, upper=upper, null=null)
    question = pose_question(
        coefficient=coefficient,
        value=value,
        weights=weights,
        categories=categories,
        prevalences=prevalences,
        model=model,
        target=target,
        p_missing=p_missing,
        level=level,
        sides=sides,
        interval=interval,
        method=method,
        aim=aim.checked(needs_chance=False),
        prices=prices,
        max_cost=None,
        rng=rng,
        rater_share=rater_share,
        prior=prior,
        progress=progress,
    )
    return plan_of(question, question.design(n_items, n_raters))
