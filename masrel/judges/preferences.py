"""Preferences between two answers: does their order matter, and which model is better.

In: which of two models a judge prefers on an item, and which was shown first. Out: how
far the order decides, and Bradley-Terry strengths.
"""

import math
from dataclasses import dataclass, field

import numpy as np
from scipy.sparse.csgraph import connected_components
from scipy.special import expit

from masrel._input import listed, refuse, shown
from masrel.agreement import mcnemar
from masrel.agreement._engine import (
    NO_SPREAD,
    Floats,
    Integers,
    check_level,
    divide,
    student_t,
    undefined,
)
from masrel.agreement._labels import coded, columns_of
from masrel.errors import RatingsError
from masrel.estimates import Significance
from masrel.intervals._question import warn_small
from masrel.judges._paired import score_test

_FIELDS = ("item", "first", "second", "winner")
_MAX_STEPS, _SETTLED = 500, 1e-12  # of Newton's method


@dataclass(frozen=True, slots=True, kw_only=True)
class PositionBias:
    """How much the order of two answers affects which one is preferred.

    Attributes
    ----------
    table : ndarray, shape (3, 3)
        Pairs of answers by the verdict in one order (rows: the model shown first wins,
        tie, the other wins) and in the swapped order (columns: the same model wins,
        tie, the other wins). Above the diagonal the first position gains.
    value : float
        Share of pairs in which the first position gains, minus that of the second.
    low, high : float
        Its interval, by Tango's score test.
    level : float
        Nominal level.
    agreement : float
        Share of pairs with one verdict in both orders, a tie being one.
    agreement_without_ties : float
        The same of pairs without a tie in either order; ``nan`` without any.
    n_pairs, n_ties, n_unpaired : int
        Pairs in both orders, those of them with a tie, and pairs in one order only,
        which are left out.
    mcnemar : Significance
        Exact test that neither position gains; `masrel.agreement.bowker` takes `table`.
    notes : tuple of str
        What the reader must know before relying on it.
    """

    table: Integers = field(compare=False)
    value: float
    low: float
    high: float
    level: float
    agreement: float
    agreement_without_ties: float
    n_pairs: int
    n_ties: int
    n_unpaired: int
    mcnemar: Significance
    notes: tuple[str, ...] = ()


def position_bias(
    comparisons: object, *, tie: str = "tie", level: float = 0.95
) -> PositionBias:
    """Compare verdicts on the same pairs of answers in both orders.

    Parameters
    ----------
    comparisons : iterable of (item, first, second, winner), or long DataFrame
        One row a verdict of one judge: what was asked, the model whose answer was shown
        first, the other, and which of the two won; a frame has columns of these names.
    tie : str, optional
        Word for a tie in the column of winners.
    level : float, optional
        Nominal level.

    Returns
    -------
    PositionBias
        The bias with its interval, agreement between orders, and tests.

    Raises
    ------
    RatingsError
        If they are not such rows, a pair of answers comes twice in one order, or none
        in both.
    ParameterError
        If the level is invalid.

    References
    ----------
    .. [1] Zheng, L., et al. (2023). Judging LLM-as-a-judge with MT-Bench and Chatbot
       Arena. Advances in Neural Information Processing Systems, 36, section 3.3.
       https://arxiv.org/abs/2306.05685
    .. [2] Tango, T. (1998). Equivalence test and confidence interval for the difference
       in proportions for the paired-sample design. Statistics in Medicine, 17(8),
       891-908; see `score_test`.

    Examples
    --------
    Of 20 pairs, 6 go to whichever answer is shown first, 1 to the second:

    >>> rows = [(i, "a", "b", "a") for i in range(20)]
    >>> rows += [(i, "b", "a", "b" if i < 6 else "a") for i in range(19)]
    >>> rows += [(19, "b", "a", "tie")]
    >>> bias = position_bias(rows)
    >>> bias.value, bias.agreement, round(bias.mcnemar.p_value, 4)
    (0.35, 0.65, 0.0156)
    """
    check_level(level)
    items, first, second, score, _ = _read(comparisons, tie)
    verdicts: dict[tuple[int, int, int], list[int]] = {}
    rows = zip(items.tolist(), first.tolist(), second.tolist(), score, strict=True)
    for place, (item, a, b, of_first) in enumerate(rows):
        pair = verdicts.setdefault((item, min(a, b), max(a, b)), [-1, -1])
        if pair[a > b] >= 0:
            raise RatingsError(
                f"ratings: row {place}: the same pair occurs again in the same order; "
                "give repeated runs different items"
            )
        pair[a > b] = 1 + int(of_first if a > b else -of_first)
    both = [pair for pair in verdicts.values() if min(pair) >= 0]
    refuse(
        (not both, "ratings: needs pairs in both orders, got none"), error=RatingsError
    )
    table = np.zeros((3, 3), dtype=np.int64)
    np.add.at(table, tuple(np.array(both).T), 1)
    n_pairs, corners = len(both), table[::2, ::2]
    gains, losses = int(np.triu(table, 1).sum()), int(np.tril(table, -1).sum())
    interval = score_test(gains, losses, n_pairs, level=level)
    is_several = len({item for item, *_ in verdicts}) < len(verdicts)
    note = "items have several pairs, which are treated as independent"
    stays = n_pairs - gains - losses
    return PositionBias(
        table=table,
        value=(gains - losses) / n_pairs,
        low=interval.low,
        high=interval.high,
        level=level,
        agreement=stays / n_pairs,
        agreement_without_ties=float(divide(corners.trace(), corners.sum())),
        n_pairs=n_pairs,
        n_ties=n_pairs - int(corners.sum()),
        n_unpaired=len(verdicts) - n_pairs,
        mcnemar=mcnemar([[stays, gains], [losses, 0]]),
        notes=(note,) * is_several,
    )


def _read(
    comparisons: object, tie: str
) -> tuple[Integers, Integers, Integers, Floats, list[object]]:
    """Return items, both models, 1, 0 or -1 as the first wins, and names of models."""
    item, first, second, winner = columns_of(comparisons, _FIELDS)
    for place, (a, b, best) in enumerate(zip(first, second, winner, strict=True)):
        if a == b or best not in (a, b, tie):
            raise RatingsError(
                f"ratings: row {place}: needs two models and one of them, or {tie!r}, "
                f"as the winner, got {shown(a)}, {shown(b)} and {shown(best)}"
            )
    items, _ = coded(item, "item")
    models, names = coded([*first, *second], "model")
    a, b = models[: len(first)], models[len(first) :]
    pairs = zip(first, winner, strict=True)
    # 1 where the first has won, -1 where it has not
    score = [0.0 if best == tie else 2.0 * (best == of) - 1.0 for of, best in pairs]
    return items, a, b, np.array(score), names


# -- strengths -------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class BradleyTerry:
    """Strengths of models, from preferences between two of them.

    Attributes
    ----------
    models : tuple
        Their names, in the order in which they are first met.
    strengths : ndarray, shape (n_models,)
        Logarithms of the odds with which each wins against an average one: their mean
        is 0, the difference of two is the logarithm of the odds between them.
    low, high : ndarray, shape (n_models,)
        Ends of the interval of each.
    covariance : ndarray, shape (n_models, n_models)
        Covariance of the strengths, by items, for differences of two.
    n_comparisons, n_ties, n_items : int
        Verdicts, ties among them, and items.
    level : float
        Nominal level.
    method : str
        How the intervals were computed.
    notes : tuple of str
        What the reader must know before relying on them.
    reason : str or None
        Why there are no finite strengths, or None.
    """

    models: tuple[object, ...]
    strengths: Floats = field(compare=False)
    low: Floats = field(compare=False)
    high: Floats = field(compare=False)
    covariance: Floats = field(compare=False, repr=False)
    n_comparisons: int
    n_ties: int
    n_items: int
    level: float
    method: str
    notes: tuple[str, ...] = ()
    reason: str | None = None


def bradley_terry(
    comparisons: object,
    *,
    tie: str = "tie",
    level: float = 0.95,
) -> BradleyTerry:
    """Estimate the strengths of models from verdicts on two of them at a time.

    Parameters
    ----------
    comparisons : iterable of (item, first, second, winner), or long DataFrame
        One row a verdict, as `position_bias` takes them; any order, any number.
    tie : str, optional
        Word for a tie in place of a winner; a tie is half a win for each.
    level : float, optional
        Nominal level.

    Returns
    -------
    BradleyTerry
        Strengths with intervals for other items like these.

    Raises
    ------
    RatingsError
        If they are not such rows, or there are no rows.
    ParameterError
        If the level is invalid.

    Warns
    -----
    UndefinedStatisticWarning
        If some models never lose to any of the others, so that they have no finite
        strength, or verdicts on all items are alike, so that there is no interval.
    SmallSampleWarning
        Below 10 items.

    Notes
    -----
    Verdicts on one item, such as those in both orders, are not independent: the
    variance is of sums over items, and Student's t has one degree of freedom an item,
    less one.

    References
    ----------
    .. [1] Bradley, R. A., Terry, M. E. (1952). Rank analysis of incomplete block
       designs: I. The method of paired comparisons. Biometrika, 39(3/4), 324-345.
       https://doi.org/10.2307/2334029
    .. [2] Ford, L. R. (1957). Solution of a ranking problem from binary comparisons.
       American Mathematical Monthly, 64(8), 28-33. https://doi.org/10.2307/2308513

    Examples
    --------
    Of 30 comparisons the first model wins 20, so its odds are 2 and their logarithm
    .69, half of it on either side of the mean:

    >>> rows = [(i, "a", "b", "a" if i < 20 else "b") for i in range(30)]
    >>> bradley_terry(rows).strengths.round(3).tolist()
    [0.347, -0.347]
    """
    check_level(level)
    items, first, second, score, models = _read(comparisons, tie)
    k = len(models)
    refuse((k < 2, "ratings: needs verdicts, got none"), error=RatingsError)
    wins = np.zeros((k, k))  # of the model in the row
    np.add.at(wins, (first, second), 0.5 + 0.5 * score)
    np.add.at(wins, (second, first), 0.5 - 0.5 * score)
    reason = _infinite(wins, models)
    strengths = np.full(k, math.nan) if reason else _climb(wins)
    slope = 0.5 + 0.5 * score - expit(strengths[first] - strengths[second])
    sums = np.zeros((items.max() + 1, k))  # of the log-likelihood, by items
    np.add.at(sums, (items, first), slope)
    np.add.at(sums, (items, second), -slope)
    n_items = len(np.unique(items))
    information = _information(wins, strengths)
    inverse = information if reason else np.linalg.pinv(information)  # all are nan
    covariance = inverse @ (sums.T @ sums) @ inverse * n_items / max(n_items - 1, 1)
    error = np.sqrt(np.diag(covariance))
    notes = warn_small(n_items, 10, "items")
    if (error < _SETTLED).any():  # items that all say the same show no error
        notes = (undefined("the interval of a strength", NO_SPREAD), *notes)
        error[error < _SETTLED] = math.nan
    half = student_t(level, n_items - 1) * error
    return BradleyTerry(
        models=tuple(models),
        strengths=strengths,
        low=strengths - half,
        high=strengths + half,
        covariance=covariance,
        n_comparisons=len(items),
        n_ties=int((score == 0).sum()),
        n_items=n_items,
        level=level,
        method=f"variance by items, t({n_items - 1})",
        notes=notes,
        reason=reason,
    )


def _infinite(wins: Floats, models: list[object]) -> str | None:
    """Return which models never lose to any other, so that none is finite [2]_."""
    n_groups, group = connected_components(wins > 0, connection="strong")
    for number in range(n_groups if n_groups > 1 else 0):
        inside = group == number
        if not wins[~inside][:, inside].any():
            names = listed(repr(models[i]) for i in np.flatnonzero(inside))
            return undefined(
                "the Bradley-Terry model",
                f"{names}: no loss to any other model, so no finite strength",
            )
    return None


def _climb(wins: Floats) -> Floats:
    """Return the strengths of the highest likelihood by Newton's method."""
    strengths, step = np.zeros(len(wins)), np.ones(len(wins))
    n_steps = 0
    while np.abs(step).max() > _SETTLED and n_steps < _MAX_STEPS:
        odds = expit(strengths[:, None] - strengths)
        slope = (wins - (wins + wins.T) * odds).sum(axis=1)
        step = np.linalg.pinv(_information(wins, strengths)) @ slope
        strengths = strengths + step / max(1.0, float(np.abs(step).max()))
        n_steps += 1
    return strengths


def _information(wins: Floats, strengths: Floats) -> Floats:
    """Return Fisher's information: n p (1 - p) of every two models, as a Laplacian."""
    odds = expit(strengths[:, None] - strengths)
    weights = (wins + wins.T) * odds * (1.0 - odds)
    return np.asarray(np.diag(weights.sum(axis=1)) - weights)
