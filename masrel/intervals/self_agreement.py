"""Raters' agreement with themselves, which may differ from rater to rater.

A rater of self-agreement κ and category shares π grades an item k and then l with
probability κ π_k [k = l] + (1 - κ) π_k π_l. Over raters κ ~ Beta with mean m and
spread g = variance / (m (1 - m)), at most 1/3: then its density has no rise at both
ends, as if raters agreed either always or never. π and the κ integrate out in closed
form, m and g by quadrature.
"""

import math
import warnings
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy.special import betainc, expit, gammaln, log_expit, logit

from masrel.agreement import Label
from masrel.agreement._codes import code_pairs, pair_table
from masrel.agreement._engine import Floats, check_level
from masrel.errors import UndefinedStatisticWarning
from masrel.estimates import Interval, Target
from masrel.intervals._quadrature import (
    LineDistribution,
    integrated_sinc,
    log_convolve,
    log_sum_exp,
    solve_quantile,
    where_it_matters,
)
from masrel.intervals._question import PriorName
from masrel.intervals._rho import PRIOR_SHAPES, Prior
from masrel.intervals.posterior import Quantity

_METHOD = "hierarchical kappa model, exact"
_MEAN = "kappa, mean of raters"
_GRID = np.linspace(-20.0, 20.0, 65)  # logit 3 g, for a trapezoid sum over all of it
_MAX_LOGIT = 48.0  # logit m beyond which a uniform prior has no mass that matters
_N_MEANS = 257  # of the mean, whose ends are within 1e-11
_LEFT_OUT = 1e-6  # probability of the smallest terms of a rater's mixture, together


@dataclass(frozen=True, slots=True, kw_only=True)
class RetestModel:
    """Agreement of a population of raters with themselves.

    Attributes
    ----------
    kappa : Quantity
        Mean of raters' kappas over their population.
    standard_deviation : Quantity
        Standard deviation of raters' kappas over their population.
    raters : tuple of Quantity
        Kappa of every rater with a pair, pulled towards the others.
    n_pairs : tuple of int
        Number of items that each rater graded in both sessions.
    prior : str
        What was believed before the data.
    other_kappa : Quantity
        The mean under the other prior that moves its interval most.
    other_prior : str
        The other prior.
    """

    kappa: Quantity
    standard_deviation: Quantity
    raters: tuple[Quantity, ...]
    n_pairs: tuple[int, ...]
    prior: str
    other_kappa: Quantity
    other_prior: str


def retest_model(
    pairs: object,
    *,
    categories: Sequence[Label] | None = None,
    level: float = 0.95,
    prior: PriorName = "uniform",
    concentration: float = 1.0,
) -> RetestModel:
    """Estimate raters' agreement with themselves, each shrunk towards the others.

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
        If an option is invalid.

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
    >>> model = retest_model([first, second])
    >>> model.n_pairs, round(model.kappa.value, 3)
    ((4, 4), 0.631)
    """
    check_level(level)
    checked_prior = Prior.of(prior, concentration)
    coded = code_pairs(pairs, categories)
    every = [
        pair_table(coded.codes[:, start : start + 2], coded.n_categories)
        for start in range(0, coded.codes.shape[1], 2)
    ]
    tables = {rater: table for rater, table in enumerate(every) if table.any()}
    if not tables:
        return _undefined("no rater has a pair of grades", checked_prior, level)
    if coded.n_categories < 2:
        return _undefined("one category is declared", checked_prior, level)
    used = list(tables.values())
    shares = (0.5, 0.5 - 0.5 * level, 0.5 + 0.5 * level)
    posterior = _Posterior.of(used, checked_prior)
    here = posterior.quantiles(shares)
    others = [
        (_Posterior.of(used, other).quantiles(shares), other)
        for other in checked_prior.others(coded.n_categories)
    ]
    # the one that moves an end most
    there, other = max(
        others, key=lambda of: float(np.abs(np.subtract(of[0], here))[1:].max())
    )
    return RetestModel(
        kappa=_quantity(_MEAN, here, level, "raters"),
        standard_deviation=_quantity(
            "kappa, standard deviation over raters",
            posterior.sd_quantiles(shares),
            level,
            "raters",
        ),
        raters=tuple(
            _quantity(
                f"rater {rater + 1}",
                posterior.rater_quantiles(at, shares),
                level,
                "items",
            )
            for at, rater in enumerate(tables)
        ),
        n_pairs=tuple(int(table.sum()) for table in used),
        prior=_describe(checked_prior),
        other_kappa=_quantity(_MEAN, there, level, "raters"),
        other_prior=_describe(other),
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
            raters_differ=True,
            target=target,
        ),
    )


def _describe(prior: Prior) -> str:
    of_mean, of_shares = prior.description.split(", ", 1)
    return f"{of_mean.replace('ρ', 'mean kappa')}, {of_shares}, g ~ U(0, 1/3)"


def _undefined(reason: str, prior: Prior, level: float) -> RetestModel:
    warnings.warn(
        f"{_METHOD}: undefined: {reason}", UndefinedStatisticWarning, stacklevel=3
    )
    nothing = _quantity(_MEAN, (math.nan,) * 3, level, "raters")
    nothing = replace(nothing, interval=replace(nothing.interval, reason=reason))
    return RetestModel(
        kappa=nothing,
        standard_deviation=nothing,
        raters=(),
        n_pairs=(),
        prior=_describe(prior),
        other_kappa=nothing,
        other_prior=_describe(prior),
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class _Posterior:
    """The joint posterior of the mean m and the spread g of raters' kappas."""

    raters: "tuple[_RaterPairs, ...]" = field(compare=False, repr=False)  # the data
    # the distribution of logit m
    mean: LineDistribution = field(compare=False, repr=False)
    # (n_means, n_spreads): probabilities of the points (`mean.points`, `_GRID`)
    masses: Floats = field(compare=False, repr=False)

    @classmethod
    def of(cls, tables: Sequence[NDArray[np.int64]], prior: Prior) -> "_Posterior":
        """Integrate the posterior of tables (n_categories, n_categories)."""
        # m ~ Beta(shape, shape); g ~ U(0, 1/3)
        shape = PRIOR_SHAPES[prior.name]
        raters = tuple(_RaterPairs.of(table, prior.concentration) for table in tables)
        coarse = partial(_log_joint, raters, shape, logit_g=_GRID[::4])
        ends = -_MAX_LOGIT / shape, _MAX_LOGIT / shape
        low, high = where_it_matters(lambda mean: log_sum_exp(coarse(mean)), *ends)
        points = np.linspace(low, high, _N_MEANS)
        joint = _log_joint(raters, shape, points, _GRID)
        masses = np.exp(joint - joint.max())
        masses /= masses.sum()
        mean = LineDistribution(points=points, masses=masses.sum(axis=1))
        return cls(raters=raters, mean=mean, masses=masses)

    def quantiles(self, shares: Sequence[float]) -> list[float]:
        """Return quantiles of the mean."""
        return list(map(float, expit(self.mean.quantiles(shares))))

    def rater_quantiles(self, rater: int, shares: Sequence[float]) -> list[float]:
        """Return quantiles of one rater's kappa."""
        # Given m and g it is a mixture of Betas, one a term of the likelihood.
        pairs = self.raters[rater]
        at, of = np.nonzero(_weighs(self.masses))
        up, down = _parameters(self.mean.points[at], _GRID[of])
        terms = pairs.log_terms(up, down)
        mass = np.exp(terms - log_sum_exp(terms)[:, None]) * self.masses[at, of, None]
        node, j = np.nonzero(_weighs(mass))
        weights = mass[node, j] / mass[node, j].sum()
        up, down = up[node] + pairs.agree - j, down[node] + pairs.differ + j

        def probability(kappa: float) -> float:
            return float(weights @ betainc(up, down, kappa))

        return [solve_quantile(probability, share, 0.0, 1.0) for share in shares]

    def sd_quantiles(self, shares: Sequence[float]) -> list[float]:
        """Return quantiles of the standard deviation of kappa over raters."""
        # of √(m (1 - m) g), to about 2e-4: it has a kink in m
        variance = expit(self.mean.points) * expit(-self.mean.points)

        def probability(deviation: float) -> float:
            # 3 g may go so far at every m
            max_g = np.minimum(3.0 * deviation**2 / variance, 1.0)
            return float((self.masses * integrated_sinc(logit(max_g), _GRID)).sum())

        most = math.sqrt(1.0 / 12.0)
        return [solve_quantile(probability, share, 1e-12, most) for share in shares]


def _weighs(masses: Floats) -> NDArray[np.bool_]:
    # False for the smallest, which together are next to nothing
    ascending = np.sort(masses, axis=None)
    few = np.searchsorted(ascending.cumsum(), _LEFT_OUT)
    return np.asarray(masses >= ascending[few])


def _parameters(mean: Floats, logit_g: Floats) -> tuple[Floats, Floats]:
    # of the Beta of κ, of logit m and logit 3 g
    size = 3.0 / expit(logit_g) - 1.0  # 1 / g - 1, what the population weighs
    return expit(mean) * size, expit(-mean) * size


def _log_joint(
    raters: "Sequence[_RaterPairs]", shape: float, mean: Floats, logit_g: Floats
) -> Floats:
    # mean (n,), logit_g (s,) -> log-density of (logit m, logit 3 g) but for a constant
    up, down = _parameters(np.repeat(mean, logit_g.size), np.tile(logit_g, mean.size))
    likelihood = np.zeros(up.size)
    for pairs in raters:
        likelihood += log_sum_exp(pairs.log_terms(up, down))
    # densities of m and 3 g times the Jacobians of their logits
    of_mean = shape * (log_expit(mean) + log_expit(-mean))
    of_g = log_expit(logit_g) + log_expit(-logit_g)
    return likelihood.reshape(mean.size, -1) + of_mean[:, None] + of_g


@dataclass(frozen=True, slots=True, kw_only=True)
class _RaterPairs:
    """The pairs of one rater, as all that the likelihood of κ needs."""

    # L(κ) = Σ_j weight_j κ^(agree - j) (1 - κ)^(differ + j), all weights positive.

    agree: int  # pairs of equal grades
    differ: int  # and of unequal ones
    log_weights: Floats = field(compare=False, repr=False)  # (agree + 1,)

    @classmethod
    def of(cls, table: NDArray[np.int64], concentration: float) -> "_RaterPairs":
        """Integrate the shares of the categories out of a rater's table."""
        # With d_k pairs of k and k, and o_k unequal grades of k, the likelihood is
        # (1 - κ)^differ times the mean of Π_k π_k^(d_k + o_k) (κ + (1 - κ) π_k)^d_k
        # over the Dirichlet, whose moments are
        # Π_k Γ(a + t_k) / Γ(a) · Γ(K a) / Γ(K a + Σ t_k).
        equal = np.diagonal(table)
        graded = table.sum(axis=0) + table.sum(axis=1) - equal  # d_k + o_k
        total = np.zeros(1)
        for d, t in zip(equal.tolist(), graded.tolist(), strict=True):
            j = np.arange(d + 1)
            binomial = gammaln(d + 1) - gammaln(j + 1) - gammaln(d - j + 1)
            moment = gammaln(concentration + t + j) - gammaln(concentration)
            total = log_convolve(total, binomial + moment)
        mass = concentration * len(table)
        power = graded.sum() + np.arange(total.size)
        agree = int(equal.sum())
        return cls(
            agree=agree,
            differ=int(table.sum()) - agree,
            log_weights=total + gammaln(mass) - gammaln(mass + power),
        )

    def log_terms(self, up: Floats, down: Floats) -> Floats:
        """Return the logarithms of the terms of the likelihood, κ ~ Beta(up, down)."""
        # κ is integrated out: in term j it has the powers agree - j and differ + j
        # -> (n, agree + 1)
        j = np.arange(self.agree + 1)
        up, down = up[:, None], down[:, None]
        moments = _log_rising(up, self.agree - j) + _log_rising(down, self.differ + j)
        moments -= _log_rising(up + down, self.agree + self.differ)
        return self.log_weights + moments


def _log_rising(x: Floats, n: NDArray[np.int64] | int) -> Floats:
    # log x (x + 1) ... (x + n - 1)
    return np.asarray(gammaln(x + n) - gammaln(x))
