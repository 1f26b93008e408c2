"""Bootstrap intervals by Monte Carlo, over items or raters."""

from collections.abc import Sequence
from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from masrel.agreement.coding import Label
from masrel.agreement.kernel import Floats
from masrel.agreement.weights import WeightName
from masrel.errors import ParameterError
from masrel.estimates import Interval, Target, Unit
from masrel.intervals.case import (
    Case,
    Statistic,
    open_case,
    warn_small,
)

__all__ = ["Kind", "bootstrap", "recorded_generator"]

Kind = Literal["percentile", "basic", "bca"]

_CHUNK = 2_000_000  # numbers held at once while resampling


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
        Resamples, at least 100.
    kind : {"percentile", "basic", "bca"}, optional
        How endpoints come from the resamples.
    rng : Generator or int, optional
        Where randomness comes from; an integer is recorded as the seed. Without
        it a fresh seed is drawn and recorded.

    Returns
    -------
    Interval
        A confidence interval with the Monte Carlo error of each endpoint; ``nan``
        with a reason when undefined.

    Raises
    ------
    ParameterError
        If an option is none, or raters of this coefficient cannot be resampled.
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
    are left out and counted in `n_undefined`. When raters are resampled, a rater is
    never paired with a copy of itself: such pairs agree always and say nothing.

    References
    ----------
    .. [1] Efron, B., Tibshirani, R. J. (1993). An Introduction to the Bootstrap,
       ch. 13 and 14.

    Examples
    --------
    >>> ratings = [["a", "a"], ["a", "b"], ["b", "b"], ["b", "b"]] * 5
    >>> found = bootstrap("cohen_kappa", ratings, target="items", rng=1)
    >>> found.seed, found.n_resamples, found.low < 0.5 < found.high
    (1, 10000, True)
    """
    if kind not in get_args(Kind):
        raise ParameterError(
            f"kind: needs one of {', '.join(get_args(Kind))}, got {kind!r}"
        )
    if n_resamples < 100:
        raise ParameterError(f"n_resamples: needs at least 100, got {n_resamples}")
    case = open_case(
        coefficient,
        ratings,
        target=target,
        categories=categories,
        weights=weights,
        level=level,
    )
    unit = _unit(case)
    generator, seed = recorded_generator(rng)
    method = f"{kind} bootstrap"
    if np.isnan(case.value):
        return case.undefined(
            "the estimate itself is undefined", method=method, unit=unit
        )
    if unit == "items":
        notes = warn_small(case.n_items, 16, "items")
        drawn = _resample_items(case, n_resamples, generator)
    else:
        notes = warn_small(case.coded.codes.shape[1], 5, "raters")
        drawn = _resample_raters(case, n_resamples, generator)
    values = np.sort(drawn[~np.isnan(drawn)])
    if values.size == 0 or values[0] == values[-1]:
        reason = "every resample gives the same value or none, so there is no spread"
        return case.undefined(reason, method=method, unit=unit)
    low_at, high_at = _positions(case, values, kind)
    low, high = np.quantile(values, [low_at, high_at]).tolist()
    errors = (_quantile_error(values, low_at), _quantile_error(values, high_at))
    if kind == "basic":
        low, high = 2 * case.value - high, 2 * case.value - low
        errors = errors[::-1]
    closed = case.closed(low, high, method=method, unit=unit, notes=notes)
    return Interval(
        low=closed.low,
        high=closed.high,
        level=level,
        kind="confidence",
        method=method,
        target=target,
        unit=unit,
        n_resamples=n_resamples,
        n_undefined=n_resamples - values.size,
        monte_carlo_error=errors,
        seed=seed,
        notes=closed.notes,
    )


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
    if isinstance(rng, np.random.Generator):
        return rng, None  # its owner knows where it began
    if rng is None:
        rng = int(np.random.SeedSequence().generate_state(1, np.uint64)[0] >> 1)
    if isinstance(rng, bool) or not isinstance(rng, int | np.integer) or rng < 0:
        raise ParameterError(
            f"rng: needs a numpy Generator or an integer of at least 0, got {rng!r}"
        )
    return np.random.default_rng(int(rng)), int(rng)


def _resample_items(
    case: Case, n_resamples: int, generator: np.random.Generator
) -> Floats:
    # Items with equal features are alike: draw how often each kind occurs.
    rows, times = np.unique(case.features, axis=0, return_counts=True)
    shares = times / times.sum()
    drawn = np.empty(n_resamples)
    step = max(1, _CHUNK // rows.shape[0])
    for start in range(0, n_resamples, step):
        stop = min(start + step, n_resamples)
        taken = generator.multinomial(case.n_items, shares, size=stop - start)
        drawn[start:stop] = case.values(taken @ rows)
    return drawn


def _resample_raters(
    case: Case, n_resamples: int, generator: np.random.Generator
) -> Floats:
    kernel = case.kernel
    n_items, n_raters = case.coded.codes.shape
    drawn = np.empty(n_resamples)
    step = max(1, _CHUNK // (n_items * n_raters * case.coded.n_categories))
    for start in range(0, n_resamples, step):
        stop = min(start + step, n_resamples)
        taken = generator.multinomial(
            n_raters, np.full(n_raters, 1.0 / n_raters), size=stop - start
        )
        sums = kernel.rater_sums(  # type: ignore[misc]
            case.coded, taken.astype(np.float64), case.v
        )
        drawn[start:stop] = case.values(sums)
    return drawn


def _positions(case: Case, values: Floats, kind: Kind) -> tuple[float, float]:
    # which quantiles of the resamples are the endpoints
    tail = 0.5 * (1.0 - case.level)
    if kind != "bca":
        return tail, 1.0 - tail
    from scipy.special import ndtr, ndtri

    below = np.searchsorted(values, case.value, side="left")
    equal = np.searchsorted(values, case.value, side="right") - below
    share = (below + 0.5 * equal) / values.size  # ties count half
    if not 0.0 < share < 1.0:
        return tail, 1.0 - tail
    bias = float(ndtri(share))  # z0, (14.14) of [1]
    skew = _acceleration(case)
    ends = []
    for z in (float(ndtri(tail)), float(ndtri(1.0 - tail))):
        moved = bias + (bias + z) / (1.0 - skew * (bias + z))  # (14.10)
        ends.append(float(ndtr(moved)))
    return ends[0], ends[1]


def _acceleration(case: Case) -> float:
    # (14.15): a third of the skewness of the leave-one-out values
    if case.target == "raters":
        return 0.0
    left = case.values(case.features.sum(axis=0) - case.features)
    left = left[~np.isnan(left)]
    deviation = left.mean() - left
    spread = float((deviation**2).sum())
    return float((deviation**3).sum() / (6.0 * spread**1.5)) if spread > 0.0 else 0.0


def _quantile_error(values: Floats, position: float) -> float:
    # half the distance between the quantiles one binomial error to either side
    error = float(np.sqrt(position * (1.0 - position) / values.size))
    ends = np.clip([position - error, position + error], 0.0, 1.0)
    low, high = np.quantile(values, ends)
    return float(0.5 * (high - low))
