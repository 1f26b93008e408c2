"""Classes of items and errors of raters, without a gold standard.

In: grades of several raters, without a gold standard. Out: how common each class is,
each rater's confusion matrix, the class of each item; and how many independent judges
several judges are worth who err together.
"""

import math
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Any, Literal

import numpy as np
from scipy import sparse
from scipy.optimize import linear_sum_assignment

from masrel._input import check_option, listed, refuse, shown, warn_caller
from masrel.agreement import Label
from masrel.agreement._codes import read_only
from masrel.agreement._engine import (
    Floats,
    Integers,
    check_level,
    divide,
    recorded_generator,
    student_t,
    undefined,
)
from masrel.agreement._labels import coded, columns_of, is_missing, label_codes
from masrel.errors import RatingsError, SmallSampleWarning
from masrel.intervals._question import warn_small
from masrel.intervals.jackknife import _variance_of
from masrel.judges._paired import check_count

_SETTLED = 1e-10  # largest move of a posterior at which EM ends
_MAX_STEPS = 5000
_N_STARTS = 20  # others, drawn around the shares of votes
_SEARCH = 2000, 300, 1e-6  # patterns, steps and largest move of the other starts
_HIGHER = 1e-4  # difference of log-likelihoods that is no rounding
_NO_ITEM = 1e-6  # ratings of a class below which a rater has met none of it
_SMALLEST = 1e-300  # probability, so that the logarithm of 0 is a number
_PRIOR, _PRIOR_RIGHT = 0.5, 1.0  # of each cell, and so much more of the right one
_MANY_SWITCHED = 0.01  # share of draws
_CERTAIN = 0.87  # mean probability of an item's class; see docs/evidence/judges.md
_N_CHAINS, _BURN_IN = 16, 100


@dataclass(frozen=True, slots=True, kw_only=True)
class DawidSkene:
    """Classes of items and errors of raters, estimated without a gold standard.

    Attributes
    ----------
    categories : tuple
        The grades in order, which are the classes as well.
    raters, items : tuple
        Their names, in the order in which they are first met.
    shares : ndarray, shape (n_categories,)
        Share of each class among the items, π.
    confusion : ndarray, shape (n_raters, n_categories, n_categories)
        How probable it is that a rater gives a grade (last axis) to an item of a class
        (middle axis), θ; ``nan`` for a class in which the rater has graded no item.
    accuracy : ndarray, shape (n_raters,)
        How probable it is that a rater gives an item its class, Σ π_k θ_kk.
    posterior : ndarray, shape (n_items, n_categories)
        How probable each class of each item is, as if π and θ were known.
    log_likelihood : float
        Σ_i log Σ_k π_k Π θ^n, one factor a rating, without multinomial constants.
    start : {"majority", "highest"}
        Which maximum it is.
    is_converged : bool
        Whether no posterior moved any more.
    higher : DawidSkene or None
        The highest maximum that another start led to, if it is above this one.
    notes : tuple of str
        What the reader must know before relying on it.
    reason : str or None
        Why the ratings do not identify the model, or None.
    """

    categories: tuple[Label, ...]
    raters: tuple[object, ...]
    items: tuple[object, ...] = field(repr=False)
    shares: Floats = field(compare=False)
    confusion: Floats = field(compare=False, repr=False)
    accuracy: Floats = field(compare=False, repr=False)
    posterior: Floats = field(compare=False, repr=False)
    log_likelihood: float
    start: Literal["majority", "highest"]
    is_converged: bool
    higher: "DawidSkene | None" = field(default=None, repr=False)
    notes: tuple[str, ...] = ()
    reason: str | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class DawidSkeneIntervals:
    """Intervals of classes and errors, for other items by the same raters.

    Attributes
    ----------
    fit : DawidSkene
        The estimates, from the majority start.
    shares_low, shares_high : ndarray, shape (n_categories,)
        Ends for the share of each class.
    confusion_low, confusion_high : ndarray, shape (n_raters, n_classes, n_grades)
        Ends for each cell of each rater's confusion matrix; ``nan`` where the cell is.
    level : float
        Nominal level.
    method : str
        How they were computed, in words.
    n_resamples : int
        Draws of the posterior.
    n_switched : int
        Draws in which classes had exchanged their places.
    seed : int or None
        Seed that repeats them.
    notes : tuple of str
        What the reader must know before relying on them.
    reason : str or None
        Why they are undefined, or None.
    """

    fit: DawidSkene = field(repr=False)
    shares_low: Floats = field(compare=False)
    shares_high: Floats = field(compare=False)
    confusion_low: Floats = field(compare=False, repr=False)
    confusion_high: Floats = field(compare=False, repr=False)
    level: float
    method: str
    n_resamples: int
    n_switched: int
    seed: int | None
    notes: tuple[str, ...] = ()
    reason: str | None = None


@dataclass(frozen=True, kw_only=True, eq=False)
class _Votes:
    """Ratings as counts in the distinct patterns of items."""

    categories: tuple[Label, ...]
    raters: tuple[object, ...]
    items: tuple[object, ...]
    counts: sparse.csr_array  # n_ijl, (n_patterns, n_raters n_grades)
    freq: Floats  # items of each pattern, (n_patterns,)
    pattern: Integers  # that of each item, (n_items,)

    @property
    def shape(self) -> tuple[int, int]:
        """Raters and grades."""
        return len(self.raters), len(self.categories)

    def votes(self) -> Floats:
        """Return the share of each grade in each pattern, (n_patterns, n_grades)."""
        of_grade = self.counts @ np.tile(np.eye(self.shape[1]), (self.shape[0], 1))
        return np.asarray(of_grade / of_grade.sum(axis=1, keepdims=True))


@dataclass(frozen=True, kw_only=True, eq=False)
class _Fits:
    """Where EM has led from several starts, side by side."""

    posterior: Floats  # (n_patterns, n_starts, n_classes)
    shares: Floats  # (n_starts, n_classes)
    expected: Floats  # ratings, (n_raters, n_grades, n_starts, n_classes)
    log_likelihood: Floats  # (n_starts,)
    move: float  # the largest of a posterior at the last step


def dawid_skene(
    ratings: object, *, start: Literal["majority"] = "majority"
) -> DawidSkene:
    """Estimate classes of items and errors of raters from the ratings alone.

    Parameters
    ----------
    ratings : iterable of (item, rater, grade), or long DataFrame
        One row a rating; a rater may grade an item several times. A frame has columns
        named item, rater and grade, or as is usual. Rows without a grade are left out.
    start : {"majority"}, optional
        Answer with the maximum to which the shares of votes of each item lead. A note
        says whether another start ends higher, and `higher` has the best.

    Returns
    -------
    DawidSkene
        Shares of classes, confusion matrix of each rater, posterior of each item.

    Raises
    ------
    RatingsError
        If the ratings are not such rows, or of fewer than two raters.
    ParameterError
        If an option is invalid.

    Notes
    -----
    Raters are independent given the class. If they err together, the model takes
    their common error for the truth: nothing in the ratings shows it.

    Classes are named after grades by the majority start. Each item needs three ratings,
    or at least some do: two raters fit equally well with many values of π and θ.
    Of more than 2000 distinct patterns of ratings, 2000 are searched for other maxima.

    References
    ----------
    .. [1] Dawid, A. P., Skene, A. M. (1979). Maximum likelihood estimation of observer
       error-rates using the EM algorithm. Applied Statistics, 28(1), 20-28, eq. (2.3)
       to (2.5). https://doi.org/10.2307/2346806

    Examples
    --------
    Two raters agree with the class of nine items in ten, the third is guessing:

    >>> rows = [(i, "A", i % 2) for i in range(40)]
    >>> rows += [(i, "B", (i + (i % 10 == 3)) % 2) for i in range(40)]
    >>> rows += [(i, "C", i // 2 % 2) for i in range(40)]
    >>> fit = dawid_skene(rows)
    >>> fit.accuracy.round(1).tolist()
    [1.0, 0.9, 0.5]
    """
    check_option("start", start, ("majority",))
    votes = _read(ratings)
    fits = _climb(votes, votes.votes()[:, None], _MAX_STEPS, _SETTLED)
    other, notes = _other_starts(votes, fits, np.random.default_rng(0))
    higher = None if other is None else _result(votes, other, start="highest")
    return _result(votes, fits, notes=notes, higher=higher)


def _read(ratings: object) -> _Votes:
    """Return ratings as counts in distinct patterns."""
    rows = zip(*columns_of(ratings, ("item", "rater", "grade")), strict=True)
    rated = [row for row in rows if not is_missing(row[2])]
    item, rater, grade = zip(*rated, strict=True) if rated else ((), (), ())
    items, item_names = coded(item, "item")
    raters, rater_names = coded(rater, "rater")
    refuse(
        (
            len(rater_names) < 2,
            f"ratings: needs grades of at least two raters, got {len(rater_names)}",
        ),
        error=RatingsError,
    )
    grades, categories = label_codes([list(grade)], None, lambda *_: "ratings: grade")
    shape = len(item_names), len(rater_names) * len(categories)
    places = items, raters * len(categories) + grades[0]
    counts = sparse.csr_array((np.ones(len(rated)), places), shape=shape)
    counts.sum_duplicates()
    # equal items have the same places and counts
    rows_of = [
        counts.indices[a:b].tobytes() + counts.data[a:b].tobytes()
        for a, b in pairwise(counts.indptr.tolist())
    ]
    pattern, _ = coded(rows_of, "item")
    _, first, freq = np.unique(pattern, return_index=True, return_counts=True)
    return _Votes(
        categories=categories,
        raters=tuple(rater_names),
        items=tuple(item_names),
        counts=counts[first],
        freq=freq.astype(np.float64),
        pattern=pattern,
    )


# -- EM --------------------------------------------------------------------------------


def _climb(votes: _Votes, posterior: Floats, max_steps: int, settled: float) -> _Fits:
    """Run EM from posteriors (n_patterns, n_starts, n_classes) until they settle."""
    freq, n_items = votes.freq[:, None, None], votes.freq.sum()
    n_steps, move = 0, math.inf
    while move > settled and n_steps < max_steps:
        shares = (freq * posterior).sum(axis=0) / n_items  # π = mean T
        expected = _expected(votes, freq * posterior)
        new, of_pattern = _posterior(votes, shares, _confusion(expected))
        move, posterior = float(np.abs(new - posterior).max()), new
        n_steps += 1
    return _Fits(
        posterior=posterior,
        shares=shares,
        expected=expected,
        log_likelihood=votes.freq @ of_pattern,
        move=move,
    )


def _expected(votes: _Votes, weights: Floats) -> Floats:
    """Return ratings of each rater and grade in each class, Σ_i T_ik n_ijl."""
    flat = votes.counts.T @ weights.reshape(len(weights), -1)
    return np.asarray(flat).reshape(*votes.shape, *weights.shape[1:])


def _confusion(expected: Floats) -> Floats:
    """Return θ_jkl = Σ_i T_ik n_ijl / Σ_il T_ik n_ijl, and even chances for 0/0."""
    total = expected.sum(axis=1, keepdims=True)
    return divide(expected, total, 1.0 / expected.shape[1])


def _posterior(
    votes: _Votes, shares: Floats, confusion: Floats
) -> tuple[Floats, Floats]:
    """Return T_ik ∝ π_k Π_jl θ_jkl^n_ijl, and the log-likelihood of each pattern."""
    logs = np.log(np.maximum(confusion, _SMALLEST))
    flat = votes.counts @ logs.reshape(-1, shares.size)
    joint = np.asarray(flat).reshape(-1, *shares.shape)
    joint += np.log(np.maximum(shares, _SMALLEST))
    highest = joint.max(axis=-1, keepdims=True)
    joint = np.exp(joint - highest)
    total = joint.sum(axis=-1, keepdims=True)
    return joint / total, (highest + np.log(total))[..., 0]


def _other_starts(
    votes: _Votes, fits: _Fits, rng: np.random.Generator
) -> tuple[_Fits | None, tuple[str, ...]]:
    """Return the highest maximum of other starts, if it is higher, and what to know."""
    n_patterns, max_steps, settled = _SEARCH
    part, notes = votes, tuple[str, ...]()
    chosen = np.arange(len(votes.freq))
    if len(chosen) > n_patterns:
        notes = (
            f"other starts were tried on {n_patterns} of {len(chosen)} distinct "
            "patterns of ratings",
        )
        chosen = np.sort(rng.choice(chosen, n_patterns, replace=False))
        part = replace(votes, counts=votes.counts[chosen], freq=votes.freq[chosen])
    around = np.repeat(part.votes()[:, None] + 0.1, _N_STARTS, axis=1)
    starts = [fits.posterior[chosen], _dirichlet(around, -1, rng)]
    tried = _climb(part, np.concatenate(starts, axis=1), max_steps, settled)
    gains = tried.log_likelihood - tried.log_likelihood[0]
    best, n_higher = int(gains.argmax()), int((gains > _HIGHER).sum())
    if not n_higher:
        return None, notes
    posterior, _ = _posterior(
        votes, tried.shares[[best]], _confusion(tried.expected[:, :, [best]])
    )
    # the classes that hold the same items have the same names
    overlap = (votes.freq[:, None] * fits.posterior[:, 0]).T @ posterior[:, 0]
    order = linear_sum_assignment(-overlap)[1]
    other = _climb(votes, posterior[:, :, order], _MAX_STEPS, _SETTLED)
    gain = float(other.log_likelihood[0] - fits.log_likelihood[0])
    if gain <= _HIGHER:
        return None, notes
    note = (
        f"this is not the highest maximum: {n_higher} of {_N_STARTS} other "
        f"starts end higher, the best by {gain:.3g} in log-likelihood"
    )
    return other, (note, *notes)


def _result(
    votes: _Votes,
    fits: _Fits,
    *,
    start: Literal["majority", "highest"] = "majority",
    notes: tuple[str, ...] = (),
    higher: DawidSkene | None = None,
) -> DawidSkene:
    """Return the first of the fits, with what it does not tell."""
    expected = fits.expected[:, :, 0].transpose(0, 2, 1)  # (n_raters, classes, grades)
    has_none = expected.sum(axis=2) < _NO_ITEM
    confusion = _confusion(fits.expected)[:, :, 0].transpose(0, 2, 1)
    confusion[has_none] = math.nan
    shares, posterior = fits.shares[0], fits.posterior[votes.pattern, 0]
    notes += _doubts(votes, posterior, has_none)
    if fits.move > _SETTLED:
        notes = (f"EM did not converge in {_MAX_STEPS} steps", *notes)
    correct = np.diagonal(confusion, axis1=1, axis2=2)
    correct = np.where(shares * len(posterior) < _NO_ITEM, 0.0, correct)
    reason = None
    if votes.counts.sum(axis=1).max() < 3:
        reason = "no item has three ratings, and with fewer the model is not identified"
    elif len(votes.raters) < 3:
        reason = "the model is not identified with two raters"
    return DawidSkene(
        categories=votes.categories,
        raters=votes.raters,
        items=votes.items,
        shares=read_only(shares),
        confusion=read_only(confusion),
        accuracy=read_only(correct @ shares),
        posterior=read_only(posterior),
        log_likelihood=float(fits.log_likelihood[0]),
        start=start,
        is_converged=fits.move <= _SETTLED,
        higher=higher,
        notes=notes if reason is None else (reason, *notes),
        reason=reason,
    )


def _doubts(votes: _Votes, posterior: Floats, has_none: Any) -> tuple[str, ...]:
    """Return which classes no item has, and which a rater has never graded."""
    best, names = posterior.argmax(axis=1), votes.categories
    pairs = listed(
        f"{votes.raters[j]!r} of class {names[k]!r}" for j, k in np.argwhere(has_none)
    )
    return (
        *(
            f"class {name!r} is not the most probable class of any item"
            for k, name in enumerate(names)
            if k not in best
        ),
        *(
            [f"errors are unknown, because no item was graded: {pairs}"]
            if pairs
            else []
        ),
    )


# -- intervals -------------------------------------------------------------------------


def dawid_skene_intervals(
    ratings: object,
    *,
    level: float = 0.95,
    n_resamples: int = 2000,
    rng: np.random.Generator | int | None = None,
) -> DawidSkeneIntervals:
    """Give intervals to the shares of classes and the errors of raters.

    Parameters
    ----------
    ratings : iterable of (item, rater, grade), or long DataFrame
        Ratings in the form that `dawid_skene` takes.
    level : float, optional
        Nominal level.
    n_resamples : int, optional
        Number of draws of the posterior, at least 320, in 16 chains.
    rng : Generator or int, optional
        Where randomness comes from; an integer is recorded as the seed. Without it a
        fresh seed is drawn and recorded.

    Returns
    -------
    DawidSkeneIntervals
        Credible intervals, ``nan`` with a reason where the model is not identified.

    Raises
    ------
    RatingsError
        If the ratings are not such rows, or of fewer than two raters.
    ParameterError
        If an option is invalid.

    Warns
    -----
    UndefinedStatisticWarning
        If the ratings do not identify the model.
    SmallSampleWarning
        If the class of an item is uncertain, with a mean probability below .87, or
        classes exchanged places in more than one draw of a hundred.

    Notes
    -----
    They are for other items like these, graded by these raters. By turns the class of
    each item is drawn, then π and each row of each θ from Dirichlet distributions. The
    prior is uniform for π; of each rater, class and grade it has half a rating, and one
    more of the right grade: without it classes of few items change places. All chains
    begin at the majority solution, which names the classes. If an estimate is 0 or
    1, so is that end of its interval. A bootstrap of items covers less: it has no
    spread in an empty cell.

    Raters who err together make them too short; docs/explanation/judges_and_truth.md
    shows by how much.

    References
    ----------
    .. [1] Dawid, A. P., Skene, A. M. (1979); see `dawid_skene`.
    .. [2] Diebolt, J., Robert, C. P. (1994). Estimation of finite mixture
       distributions through Bayesian sampling. Journal of the Royal Statistical
       Society B, 56(2), 363-375. https://doi.org/10.1111/j.2517-6161.1994.tb01985.x
    .. [3] Brown, L. D., Cai, T. T., DasGupta, A. (2001). Interval estimation for a
       binomial proportion. Statistical Science, 16(2), 101-133.
       https://doi.org/10.1214/ss/1009213286

    Examples
    --------
    >>> rows = [(i, rater, (i + (i % 10 == j)) % 2)
    ...         for i in range(40) for j, rater in enumerate("ABC")]
    >>> intervals = dawid_skene_intervals(rows, rng=1)
    >>> bool(intervals.shares_low[0] < 0.5 < intervals.shares_high[0])
    True
    """
    check_level(level)
    check_count("n_resamples", n_resamples, 20 * _N_CHAINS)
    generator, seed = recorded_generator(rng)
    votes = _read(ratings)
    fits = _climb(votes, votes.votes()[:, None], _MAX_STEPS, _SETTLED)
    fit = _result(votes, fits, start="majority")
    drawn = _draw(votes, fits, -(-n_resamples // _N_CHAINS), generator)
    n_draws, n_switched = len(drawn[0]), _count_switches(fit.confusion, drawn[1])
    is_known = fit.reason is None
    if fit.reason is not None:
        undefined("an interval of the Dawid-Skene model", fit.reason)
    cautions = _cautions(fit, n_switched, n_draws) if is_known else ()
    blank = 0.0 if is_known else math.nan
    shares, confusion = (
        _ends(estimate + blank, of, level)
        for estimate, of in zip((fit.shares, fit.confusion), drawn, strict=True)
    )
    return DawidSkeneIntervals(
        fit=fit,
        shares_low=shares[0],
        shares_high=shares[1],
        confusion_low=confusion[0],
        confusion_high=confusion[1],
        level=level,
        method="Dirichlet posterior, Gibbs sampler",
        n_resamples=n_draws,
        n_switched=n_switched,
        seed=seed,
        notes=fit.notes + cautions,
        reason=fit.reason,
    )


def _cautions(fit: DawidSkene, n_switched: int, n_draws: int) -> tuple[str, ...]:
    """Warn where raters tell classes apart so little that intervals may be short."""
    certainty = float(fit.posterior.max(axis=1).mean())
    doubts = {
        f"the class of an item has a probability of {certainty:.2f} on average; if it "
        f"is below {_CERTAIN}, the true coverage may be below the level of the "
        "interval": certainty < _CERTAIN,
        f"classes were exchanged in {n_switched} of {n_draws} draws, because raters "
        "hardly distinguish them": n_switched > _MANY_SWITCHED * n_draws,
    }
    cautions = tuple(text for text, is_so in doubts.items() if is_so)
    for caution in cautions:
        warn_caller(caution, SmallSampleWarning)
    return cautions


def _draw(
    votes: _Votes, fits: _Fits, n_draws: int, rng: np.random.Generator
) -> tuple[Floats, Floats]:
    """Draw π (n_draws, n_classes) and θ (n_draws, n_raters, n_classes, n_grades)."""
    posterior = np.repeat(fits.posterior, _N_CHAINS, axis=1)
    freq = votes.freq.astype(np.int64)[:, None]
    prior = _PRIOR + _PRIOR_RIGHT * np.eye(len(votes.categories))[:, None]  # of θ
    drawn = []
    for step in range(_BURN_IN + n_draws):
        # items of each pattern and class, (n_patterns, n_chains, n_classes)
        items = rng.multinomial(freq, posterior).astype(np.float64)
        shares = _dirichlet(items.sum(axis=0) + 1.0, -1, rng)
        confusion = _dirichlet(_expected(votes, items) + prior, 1, rng)
        posterior, _ = _posterior(votes, shares, confusion)
        if step >= _BURN_IN:
            drawn.append((shares, confusion.transpose(2, 0, 3, 1)))
    of_shares, of_confusion = map(np.concatenate, zip(*drawn, strict=True))
    return of_shares, of_confusion


def _dirichlet(counts: Floats, axis: int, rng: np.random.Generator) -> Floats:
    gamma = rng.standard_gamma(counts)
    return np.asarray(gamma / gamma.sum(axis=axis, keepdims=True))


def _ends(estimate: Floats, drawn: Floats, level: float) -> Floats:
    """Return quantiles of draws, or 0 and 1 where the estimate is there [3]_."""
    tail = 0.5 - 0.5 * level
    low, high = np.quantile(drawn, [tail, 1.0 - tail], axis=0)
    low = np.where(estimate < _NO_ITEM, 0.0, low)
    high = np.where(estimate > 1.0 - _NO_ITEM, 1.0, high)
    return np.where(np.isnan(estimate), math.nan, np.stack([low, high]))


def _count_switches(confusion: Floats, drawn: Floats) -> int:
    """Count draws in which a class is nearer to another of the fit than to its own."""
    # squares of the distances, up to what is the same for all classes of the fit
    fit = np.nan_to_num(confusion)
    near = np.einsum("jkl,djml->dkm", fit, drawn)  # (n_draws, of fit, drawn)
    squares = (fit**2).sum(axis=(0, 2))[:, None] - 2.0 * near
    return int((squares.argmin(axis=1) != np.arange(fit.shape[1])).any(axis=1).sum())


# -- how many judges they are worth ----------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class EffectiveNumber:
    """How many independent judges several judges with related errors are worth.

    Attributes
    ----------
    value : float
        k / (1 + (k - 1) ρ); ``nan`` when undefined.
    low, high : float
        Its interval for other items; ``nan`` when undefined.
    mean_correlation : float
        ρ, the mean correlation of the errors of two judges.
    n_judges, n_items : int
        Number of judges, and of items.
    left_out : tuple of (judge, judge)
        Pairs without a correlation, which the mean leaves out: one of the two judges
        makes no error on their items, or only errors.
    level : float
        Nominal level of the interval.
    method : str
        How the interval was computed.
    notes : tuple of str
        What the reader must know before relying on it.
    reason : str or None
        Why the value or its interval is undefined, or None.
    """

    value: float
    low: float
    high: float
    mean_correlation: float
    n_judges: int
    n_items: int
    left_out: tuple[tuple[object, object], ...]
    level: float
    method: str
    notes: tuple[str, ...] = ()
    reason: str | None = None


def effective_number(errors: object, *, level: float = 0.95) -> EffectiveNumber:
    """Estimate how many independent judges some judges are worth by their errors.

    Parameters
    ----------
    errors : mapping of judge to errors, array_like (n_judges, n_items), or DataFrame
        1 where a judge is wrong and 0 where right, item by item in one order; a
        DataFrame has one column per judge.
    level : float, optional
        Nominal level of the interval.

    Returns
    -------
    EffectiveNumber
        The number with an interval by the item jackknife.

    Raises
    ------
    RatingsError
        If they are not such errors, of at least two judges and of as many items as
        there are judges.
    ParameterError
        If the level is invalid.

    Warns
    -----
    UndefinedStatisticWarning
        If no two judges have a correlation, or leaving items out changes nothing.
    SmallSampleWarning
        If a judge has fewer than 10 errors or right grades.

    Notes
    -----
    Errors are against the truth. How much judges agree does not show it: judges who
    make the same errors agree, and are worth one.

    References
    ----------
    .. [1] Kish, L. (1965). Survey Sampling. Wiley, section 5.4: the effect of a design
       on clusters of k is 1 + (k - 1) ρ.

    Examples
    --------
    >>> errors = {"A": [1, 0, 0, 1, 0] * 10, "B": [1, 0, 0, 0, 0] * 10,
    ...           "C": [0, 0, 0, 1, 0] * 10}
    >>> number = effective_number(errors)
    >>> round(number.mean_correlation, 2), round(number.value, 1)
    (0.32, 1.8)
    """
    check_level(level)
    judges, table = _read_errors(errors)
    k, n_items = table.shape
    patterns, freq = np.unique(table, axis=1, return_counts=True)
    pairs = np.array(np.triu_indices(k, 1))  # (2, n_pairs)
    # Pearson's correlation of 0 and 1, of all items and without one of each pattern
    a, b = patterns[pairs]
    parts = np.stack([np.ones_like(a), a, b, a * b])
    sums = (parts @ freq.astype(np.float64))[..., None]
    n, x, y, xy = np.concatenate([sums, sums - parts], axis=-1)
    every = divide(n * xy - x * y, np.sqrt((n * x - x * x) * (n * y - y * y)))
    is_defined = ~np.isnan(every[:, 0])
    # without an item a pair may have no correlation: the mean is of the others
    there = every[is_defined]
    means = divide(np.nansum(there, axis=0), (~np.isnan(there)).sum(axis=0))
    rho = float(means[0])
    # 1 + (k - 1) ρ, which a mean over some pairs can bring below 0
    effects = 1.0 + (k - 1) * np.where(np.isnan(means), rho, means)
    effects = np.maximum(effects, _SMALLEST)
    error = math.sqrt(_variance_of(np.log(effects[1:]), n_items, freq))
    reason = None
    if math.isnan(rho):
        reason = undefined(
            "the effective number of judges",
            "0/0: in every pair of judges, one makes no errors or only errors",
        )
    elif error == 0.0:
        reason = undefined(
            "the interval of the effective number of judges",
            "the value stays the same whichever item is left out",
        )
    value = k / float(effects[0])
    factor = math.exp(student_t(level, n_items - 1) * error)
    wrong = table.sum(axis=1).astype(np.int64)
    fewest = int(np.minimum(wrong, n_items - wrong).min())
    return EffectiveNumber(
        value=value,
        low=max(value / factor, 1.0) if reason is None else math.nan,
        high=value * factor if reason is None else math.nan,
        mean_correlation=rho,
        n_judges=k,
        n_items=n_items,
        left_out=tuple((judges[i], judges[j]) for i, j in pairs[:, ~is_defined].T),
        level=level,
        method=f"item jackknife of the logarithm, t({n_items - 1})",
        notes=warn_small(fewest, 10, "errors, or right grades, of a judge"),
        reason=reason,
    )


def _read_errors(errors: Any) -> tuple[list[object], Floats]:
    """Return the names of judges, and their errors (n_judges, n_items)."""
    try:
        named = errors.items() if hasattr(errors, "items") else enumerate(errors)
        rows = {judge: list(row) for judge, row in named}
        table = np.array(list(rows.values()), dtype=np.float64)
    except (TypeError, ValueError):  # no rows, words, or of several lengths
        rows, table = {}, np.empty((0, 0))
    refuse(
        (
            not (2 <= len(table) <= table.shape[1] and np.isin(table, (0, 1)).all()),
            "errors: needs one row of 0 and 1 per judge, at least two judges, and at "
            f"least as many items as judges, got {shown(errors)}",
        ),
        error=RatingsError,
    )
    return list(rows), table
