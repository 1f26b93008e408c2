"""Raters who agree with themselves, each to a degree of his or her own."""

import math
import warnings
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from masrel.agreement import Label
from masrel.agreement._data import code_pairs, pairs_of_raters
from masrel.agreement._pairs import pair_table
from masrel.errors import ParameterError, UndefinedStatisticWarning
from masrel.estimates import Interval, Target
from masrel.intervals.dirichlet.prior import Prior, PriorName
from masrel.intervals.quantity import Quantity

if TYPE_CHECKING:
    from masrel.intervals.retest.posterior import RetestPosterior

__all__ = ["RetestModel", "retest_model"]

_METHOD = "hierarchical kappa model, exact"


@dataclass(frozen=True, slots=True, kw_only=True)
class RetestModel:
    """Agreement of a population of raters with themselves."""

    kappa: Quantity  # mean of raters' kappas over their population
    spread: Quantity  # standard deviation of raters' kappas over their population
    # kappa of every rater with a pair, pulled towards the others
    raters: tuple[Quantity, ...]
    n_pairs: tuple[int, ...]  # items that each of them graded in both sessions
    prior: str  # what was believed before the data
    other_kappa: Quantity  # the mean under the other prior that moves its interval most
    other_prior: str  # that prior


def retest_model(
    pairs: object,
    *,
    categories: Sequence[Label] | None = None,
    level: float = 0.95,
    prior: PriorName = "uniform",
    concentration: float = 1.0,
) -> RetestModel:
    """Estimate raters' agreement with themselves, each pulled towards the others.

    Parameters
    ----------
    pairs : nested sequence or array_like, shape (n_raters, n_items, 2)
        Per rater, the grades of both sessions, items in the same order for every
        rater; None and ``nan`` are missing.
    categories : sequence of str, int or float, optional
        The declared scale; the labels met when not given.
    level : float, optional
        Level of the central credible intervals.
    prior : {"uniform", "jeffreys"}, optional
        The mean is U(0, 1), or Beta(1/2, 1/2).
    concentration : float, optional
        A rater's shares of the categories are Dirichlet(concentration, ...).

    Returns
    -------
    RetestModel
        The mean over raters, the spread between them, and every rater's kappa.

    Raises
    ------
    RatingsError
        If the pairs are not such a table.
    ParameterError
        If an option is none.

    Warns
    -----
    UndefinedStatisticWarning
        If no rater has a pair, or one category is declared.

    Notes
    -----
    Rater r grades an item k and then l with probability
    κ_r π_rk [k = l] + (1 - κ_r) π_rk π_rl, so that κ_r is the kappa of that rater's
    sessions, which have the same margins. Over raters κ_r ~ Beta with mean m and
    variance g m (1 - m), g ~ U(0, 1/3). The shares π_r and the κ_r integrate out in
    closed form, and m and g by quadrature: nothing is drawn. Kappas below 0 are not
    in the model. Items are taken as exchangeable, and pairs as independent given the
    rater.

    References
    ----------
    .. [1] Bloch, D. A., Kraemer, H. C. (1989). 2 x 2 kappa coefficients: measures of
       agreement or association. Biometrics, 45(1), 269-287.
       https://doi.org/10.2307/2532052

    Examples
    --------
    >>> first = [["a", "a"], ["b", "b"], ["a", "b"], ["b", "b"]]
    >>> second = [["a", "a"], ["b", "b"], ["a", "a"], ["b", "b"]]
    >>> found = retest_model([first, second])
    >>> found.n_pairs, round(found.kappa.value, 3)
    ((4, 4), 0.631)
    """
    if not 0.0 < level < 1.0:
        raise ParameterError(f"level: needs (0, 1), got {level}")
    believed = Prior.of(prior, concentration)
    coded = code_pairs(pairs, categories)
    every = [pair_table(codes, coded.n_categories) for codes in pairs_of_raters(coded)]
    tables = {rater: table for rater, table in enumerate(every) if table.any()}
    if not tables:
        return _undefined("no rater has a pair of grades", believed, level)
    if coded.n_categories < 2:
        return _undefined("one category is declared", believed, level)
    used = list(tables.values())
    shares = (0.5, 0.5 - 0.5 * level, 0.5 + 0.5 * level)
    found = _integrate(used, believed, shares)
    kappa = _quantity("kappa, mean of raters", found.quantiles, level, "raters")
    other, other_kappa = _most_moved(used, believed, kappa, coded.n_categories, shares)
    spread = found.spread_quantiles(shares)
    return RetestModel(
        kappa=kappa,
        spread=_quantity(
            "kappa, standard deviation over raters", spread, level, "raters"
        ),
        raters=_of_raters(found, list(tables), shares, level),
        n_pairs=tuple(int(table.sum()) for table in used),
        prior=_words(believed),
        other_kappa=other_kappa,
        other_prior=_words(other),
    )


def _of_raters(
    found: "RetestPosterior",
    raters: Sequence[int],
    shares: Sequence[float],
    level: float,
) -> tuple[Quantity, ...]:
    # of each rater with pairs, under the number he or she has in the study
    return tuple(
        _quantity(
            f"rater {rater + 1}", found.rater_quantiles(at, shares), level, "items"
        )
        for at, rater in enumerate(raters)
    )


def _integrate(
    tables: Sequence[NDArray[np.int64]], prior: Prior, shares: Sequence[float]
) -> "RetestPosterior":
    # Imported here: other intervals load no scipy.
    from masrel.intervals.retest.posterior import RetestPosterior

    return RetestPosterior.of(
        tables, shares, shape=prior.shape, concentration=prior.concentration
    )


def _quantity(
    name: str, quantiles: Sequence[float], level: float, target: Target
) -> Quantity:
    # quantiles: median, low, high
    value, low, high = quantiles
    return Quantity(
        name=name,
        value=value,
        interval=Interval(
            low=low,
            high=high,
            level=level,
            kind="credible",
            method=_METHOD,
            target=target,
        ),
    )


def _most_moved(
    tables: Sequence[NDArray[np.int64]],
    prior: Prior,
    kappa: Quantity,
    n_categories: int,
    shares: Sequence[float],
) -> tuple[Prior, Quantity]:
    level = kappa.interval.level
    candidates = [
        (
            other,
            _quantity(
                kappa.name, _integrate(tables, other, shares).quantiles, level, "raters"
            ),
        )
        for other in prior.others(n_categories)
    ]

    def moved(candidate: tuple[Prior, Quantity]) -> float:
        there, here = candidate[1].interval, kappa.interval
        return max(abs(there.low - here.low), abs(there.high - here.high))

    return max(candidates, key=moved)


def _words(prior: Prior) -> str:
    of_mean, of_shares = prior.words.split(", ", 1)
    return f"{of_mean.replace('ρ', 'mean kappa')}, {of_shares}, g ~ U(0, 1/3)"


def _undefined(reason: str, prior: Prior, level: float) -> RetestModel:
    warnings.warn(
        f"{_METHOD}: undefined: {reason}", UndefinedStatisticWarning, stacklevel=3
    )
    nothing = _quantity("kappa, mean of raters", (math.nan,) * 3, level, "raters")
    nothing = replace(nothing, interval=replace(nothing.interval, reason=reason))
    return RetestModel(
        kappa=nothing,
        spread=nothing,
        raters=(),
        n_pairs=(),
        prior=_words(prior),
        other_kappa=nothing,
        other_prior=_words(prior),
    )
