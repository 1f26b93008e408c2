"""Bootstrap intervals over items or raters: exact, or by Monte Carlo."""

import dataclasses
from collections.abc import Sequence
from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from masrel.agreement.coding import Label
from masrel.agreement.weights import WeightName
from masrel.errors import ParameterError
from masrel.estimates import Interval, Target, Unit
from masrel.intervals.case import Case, Statistic, open_case, warn_small
from masrel.intervals.compositions import n_compositions
from masrel.intervals.endpoints import Kind, Replicates, bca_levels
from masrel.intervals.pool import Pool, acceleration, item_pool, rater_pool
from masrel.intervals.resamples import draw_resamples, enumerate_resamples

__all__ = ["Exact", "Kind", "bootstrap", "recorded_generator"]

Exact = Literal["auto"] | bool

_MOST_EXACT = 300_000  # distinct resamples that are enumerated rather than drawn


def bootstrap(
    coefficient: Statistic,
    ratings: object,
    *,
    target: Target,
    categories: Sequence[Label] | None = None,
    weights: "WeightName | ArrayLike" = "identity",
    level: float = 0.95,
    n_resamples: int = 10_000,
    kind: Kind = "percentile",
    exact: Exact = "auto",
    rng: np.random.Generator | int | None = None,
) -> Interval:
    """Compute a bootstrap interval.

    Parameters
    ----------
    coefficient : str or callable
        Name of a coefficient, or its public function.
    ratings : nested sequence, array_like or DataFrame
        What the coefficient takes.
    target : {"items", "raters"}
        What a new study would draw anew, and so what is resampled.
    categories : sequence, optional
        The declared scale in order.
    weights : str or array_like, optional
        How much two categories agree; see `declared_weights`.
    level : float, optional
        Nominal level.
    n_resamples : int, optional
        Resamples where they are drawn, at least 100.
    kind : {"percentile", "basic", "bca"}, optional
        How endpoints come from the resamples.
    exact : {"auto", True, False}, optional
        Whether every distinct resample is taken with its probability, instead of
        drawing some. "auto" does so up to 300 000 of them; then nothing is random.
    rng : Generator or int, optional
        Where randomness comes from; an integer is recorded as the seed. Without
        it a fresh seed is drawn and recorded. An exact interval needs none.

    Returns
    -------
    Interval
        A confidence interval with the distribution of the resamples, and the Monte
        Carlo error of each endpoint if they were drawn; ``nan`` with a reason when
        undefined.

    Raises
    ------
    ParameterError
        If an option is none, raters of this coefficient cannot be resampled, or there
        are too many resamples for `exact` to be True.
    RatingsError
        If the ratings do not fit the coefficient.

    Warns
    -----
    SmallSampleWarning
        Below 16 items, or 5 raters.
    UndefinedStatisticWarning
        If the estimate is undefined or all resamples are alike.

    Notes
    -----
    Resamples on which the coefficient is undefined, such as one item drawn n times,
    are left out and counted in `n_undefined`; the probabilities of the others are
    scaled up to 1. An exact interval counts distinct resamples there, and a note says
    how probable they are. When raters are resampled, a rater is
    never paired with a copy of itself: such pairs agree always and say nothing.

    References
    ----------
    .. [1] Efron, B., Tibshirani, R. J. (1993). An Introduction to the Bootstrap,
       ch. 13 and 14.

    Examples
    --------
    Of 20 items of three kinds there are 231 different resamples:

    >>> ratings = [["a", "a"], ["a", "b"], ["b", "b"], ["b", "b"]] * 5
    >>> found = bootstrap("cohen_kappa", ratings, target="items")
    >>> found.method, found.distribution.words
    ('percentile bootstrap, exact', 'exact bootstrap distribution, 231 resamples')
    >>> found.n_resamples, round(found.low, 3), round(found.high, 3)
    (None, 0.174, 0.802)

    Drawing some of them instead:

    >>> found = bootstrap("cohen_kappa", ratings, target="items", exact=False, rng=1)
    >>> found.seed, found.n_resamples, found.low < 0.5 < found.high
    (1, 10000, True)
    """
    _check(kind, n_resamples, exact)
    _check_rng(rng)
    case = open_case(
        coefficient,
        ratings,
        target=target,
        categories=categories,
        weights=weights,
        level=level,
    )
    unit = _unit(case)
    method = f"{kind} bootstrap"
    if np.isnan(case.value):
        return case.undefined(
            "the estimate itself is undefined", method=method, unit=unit
        )
    if unit == "items":
        pool, notes = item_pool(case), warn_small(case.n_items, 16, "items")
    else:
        pool = rater_pool(case)
        notes = warn_small(pool.n, 5, "raters")
    if _is_exact(exact, pool):
        method, found, seed = f"{method}, exact", enumerate_resamples(pool), None
    else:
        generator, seed = recorded_generator(rng)
        found = draw_resamples(pool, n_resamples, generator)
    if not found.replicates.has_spread:
        reason = "every resample gives the same value or none, so there is no spread"
        return case.undefined(reason, method=method, unit=unit)
    low_at, high_at = _levels(case, pool, found.replicates, kind)
    ends = [found.replicates.quantile(at) for at in (low_at, high_at)]
    errors = found.errors(low_at, high_at)
    if kind == "basic":
        ends = [2 * case.value - end for end in reversed(ends)]
        errors = None if errors is None else errors[::-1]
    return dataclasses.replace(
        case.closed(*ends, method=method, unit=unit, notes=(*notes, *found.notes)),
        n_resamples=found.n_resamples,
        n_undefined=found.n_undefined,
        monte_carlo_error=errors,
        seed=seed,
        distribution=found.distribution,
    )


def _check(kind: Kind, n_resamples: int, exact: Exact) -> None:
    if kind not in get_args(Kind):
        raise ParameterError(
            f"kind: needs one of {', '.join(get_args(Kind))}, got {kind!r}"
        )
    if n_resamples < 100:
        raise ParameterError(f"n_resamples: needs at least 100, got {n_resamples}")
    if exact not in ("auto", True, False):
        raise ParameterError(f'exact: needs "auto", True or False, got {exact!r}')


def _is_exact(exact: Exact, pool: Pool) -> bool:
    if exact is False:
        return False
    n_distinct = n_compositions(pool.n, pool.times.size)
    if exact is True and n_distinct > _MOST_EXACT:
        raise ParameterError(
            f"exact: there are {n_distinct} distinct resamples, and at most "
            f"{_MOST_EXACT} are enumerated; leave it out to draw some"
        )
    return n_distinct <= _MOST_EXACT


def _levels(
    case: Case, pool: Pool, replicates: Replicates, kind: Kind
) -> tuple[float, float]:
    # which quantiles of the resamples are the endpoints
    tail = 0.5 * (1.0 - case.level)
    if kind != "bca":
        return tail, 1.0 - tail
    share = replicates.share_below(case.value)
    return bca_levels(case.level, share, acceleration(pool))


def _unit(case: Case) -> Unit:
    if case.target == "both":
        raise ParameterError(
            'target: the bootstrap resamples "items" or "raters"; for both use the '
            "jackknife"
        )
    if case.target == "raters":
        fewest, most = case.entry.n_raters
        if case.kernel.rater_sums is None or most == fewest:
            raise ParameterError(
                f"target: raters of {case.entry.title} cannot be resampled without "
                "pairing a rater with a copy of itself"
            )
    return case.target


def recorded_generator(
    rng: np.random.Generator | int | None,
) -> tuple[np.random.Generator, int | None]:
    """Return a generator and the seed that repeats it.

    Parameters
    ----------
    rng : Generator, int or None
        A generator is taken as it is, and its seed is not known here; None draws a
        fresh seed.

    Returns
    -------
    tuple of Generator and int or None
        The generator, and its seed where known.

    Raises
    ------
    ParameterError
        If it is neither.
    """
    _check_rng(rng)
    if isinstance(rng, np.random.Generator):
        return rng, None  # its owner knows where it began
    if rng is None:
        rng = int(np.random.SeedSequence().generate_state(1, np.uint64)[0] >> 1)
    return np.random.default_rng(int(rng)), int(rng)


def _check_rng(rng: object) -> None:
    if rng is None or isinstance(rng, np.random.Generator):
        return
    if isinstance(rng, bool) or not isinstance(rng, int | np.integer) or rng < 0:
        raise ParameterError(
            f"rng: needs a numpy Generator or an integer of at least 0, got {rng!r}"
        )
