"""Raters who agree with themselves, each to a degree of his or her own.

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

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq
from scipy.special import betainc, expit, gammaln, logit

from masrel.agreement import Label
from masrel.agreement._codes import code_pairs, pair_table
from masrel.agreement._engine import Floats, check_level
from masrel.errors import UndefinedStatisticWarning
from masrel.estimates import Interval, Target
from masrel.intervals._dirichlet_multinomial import log_convolve
from masrel.intervals._quadrature import (
    LineDistribution,
    integrated_sinc,
    line_distribution,
    log_sum_exp,
)
from masrel.intervals._rho import PRIOR_SHAPES, Prior, PriorName
from masrel.intervals.quantity import Quantity

_METHOD = "hierarchical kappa model, exact"
_GRID = np.linspace(-20.0, 20.0, 65)  # logit 3 g, for a trapezoid sum over all of it
_MAX_LOGIT = 48.0  # logit m beyond which a uniform prior has no mass that matters
_NEGLIGIBLE = 45.0  # log-density below its largest
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
        Items that each of them graded in both sessions.
    prior : str
        What was believed before the data.
    other_kappa : Quantity
        The mean under the other prior that moves its interval most.
    other_prior : str
        That prior.
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
    posterior = _Posterior.of(used, shares, checked_prior)
    kappa = _mean_kappa(posterior.quantiles, level)
    others = [
        (_mean_kappa(_Posterior.of(used, shares, other).quantiles, level), other)
        for other in checked_prior.others(coded.n_categories)
    ]
    other_kappa, other = max(others, key=lambda by: _moved(by[0].interval, kappa))
    return RetestModel(
        kappa=kappa,
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
        other_kappa=other_kappa,
        other_prior=_describe(other),
    )


def _mean_kappa(quantiles: Sequence[float], level: float) -> Quantity:
    return _quantity("kappa, mean of raters", quantiles, level, "raters")


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


def _moved(there: Interval, kappa: Quantity) -> float:
    # how far one end moves at most
    here = kappa.interval
    return max(abs(there.low - here.low), abs(there.high - here.high))


def _describe(prior: Prior) -> str:
    of_mean, of_shares = prior.description.split(", ", 1)
    return f"{of_mean.replace('ρ', 'mean kappa')}, {of_shares}, g ~ U(0, 1/3)"


def _undefined(reason: str, prior: Prior, level: float) -> RetestModel:
    warnings.warn(
        f"{_METHOD}: undefined: {reason}", UndefinedStatisticWarning, stacklevel=3
    )
    nothing = _mean_kappa((math.nan,) * 3, level)
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
    quantiles: tuple[float, ...]  # of m, at the requested shares
    # (n_means, n_spreads): probabilities of the points (`mean.points`, `_GRID`)
    masses: Floats = field(compare=False, repr=False)

    @classmethod
    def of(
        cls,
        tables: Sequence[NDArray[np.int64]],
        shares: Sequence[float],
        prior: Prior,
    ) -> "_Posterior":
        """Integrate the posterior of tables (n_categories, n_categories)."""
        # m ~ Beta(shape, shape); g ~ U(0, 1/3)
        shape = PRIOR_SHAPES[prior.name]
        raters = tuple(_RaterPairs.of(table, prior.concentration) for table in tables)
        known: dict[float, Floats] = {}  # log-density over _GRID, by logit m

        def log_density(mean: Floats) -> Floats:
            rows = _log_joint(raters, shape, mean, _GRID)
            known.update(zip(mean.tolist(), rows, strict=True))
            return log_sum_exp(rows)

        low, high = _reach(raters, shape)
        mean, ends = line_distribution(log_density, low, high, shares)
        joint = np.array([known[point] for point in mean.points.tolist()])
        masses = np.exp(joint - joint.max())
        return cls(
            raters=raters,
            mean=mean,
            quantiles=tuple(expit(ends).tolist()),
            masses=masses / masses.sum(),
        )

    def rater_quantiles(self, rater: int, shares: Sequence[float]) -> list[float]:
        """Return quantiles of one rater's kappa."""
        # Given m and g it is a mixture of Betas, one a term of the likelihood.
        mass, up, down = self._mixture(self.raters[rater])

        def excess(kappa: float, share: float) -> float:
            return float(mass @ betainc(up, down, kappa)) - share

        return [
            float(brentq(excess, 0.0, 1.0, args=(share,), xtol=1e-9))
            for share in shares
        ]

    def _mixture(self, pairs: "_RaterPairs") -> tuple[Floats, Floats, Floats]:
        # -> probability and both parameters of every Beta that weighs, all (n,)
        # every other mean: the lattice before the last halving, which moved nothing
        masses, points = self.masses[::2], self.mean.points[::2]
        at, of = np.nonzero(_weighs(masses))
        mean, logit_g = points[at], _GRID[of]
        terms = pairs.log_terms(_Moments.of(mean, logit_g, pairs.agree + pairs.differ))
        terms -= log_sum_exp(terms)[:, None]
        mass = masses[at, of, None] * np.exp(terms)  # (n, agree + 1)
        node, j = np.nonzero(_weighs(mass))
        size = 3.0 / expit(logit_g[node]) - 1.0  # 1 / g - 1, what the population weighs
        up = expit(mean[node]) * size + pairs.agree - j
        down = expit(-mean[node]) * size + pairs.differ + j
        weight = mass[node, j]
        return weight / weight.sum(), up, down

    def sd_quantiles(self, shares: Sequence[float]) -> list[float]:
        """Return quantiles of the standard deviation of kappa over raters."""
        # of √(m (1 - m) g), to about 1e-9
        variance = expit(self.mean.points) * expit(-self.mean.points)
        step = _GRID[1] - _GRID[0]

        def excess(deviation: float, share: float) -> float:
            # 3 g may go so far at every m
            max_g = np.minimum(3.0 * deviation**2 / variance, 1.0)
            below = integrated_sinc(logit(max_g)[:, None] - _GRID, step)
            return float((self.masses * below).sum()) - share

        return [
            float(brentq(excess, 1e-12, np.sqrt(1.0 / 12.0), args=(share,), xtol=1e-9))
            for share in shares
        ]


def _weighs(masses: Floats) -> NDArray[np.bool_]:
    # False for the smallest, which together are next to nothing
    ascending = np.sort(masses, axis=None)
    few = np.searchsorted(ascending.cumsum(), _LEFT_OUT)
    return np.asarray(masses >= ascending[few])


def _reach(raters: "Sequence[_RaterPairs]", shape: float) -> tuple[float, float]:
    # logit m between which there is all that matters, from a coarse look
    coarse = np.linspace(-_MAX_LOGIT / shape, _MAX_LOGIT / shape, 129)
    log = _log_joint(raters, shape, coarse, _GRID[::8]).max(axis=1)
    inside = coarse[log > log.max() - _NEGLIGIBLE]
    step = coarse[1] - coarse[0]
    return float(inside[0] - step), float(inside[-1] + step)


def _log_joint(
    raters: "Sequence[_RaterPairs]", shape: float, mean: Floats, logit_g: Floats
) -> Floats:
    # mean (n,), logit_g (s,) -> log-density of (logit m, logit 3 g) but for a constant
    max_pairs = max(pairs.agree + pairs.differ for pairs in raters)
    means, logits_g = np.repeat(mean, logit_g.size), np.tile(logit_g, mean.size)
    moments = _Moments.of(means, logits_g, max_pairs)
    likelihood = np.zeros(mean.size * logit_g.size)
    for pairs in raters:
        likelihood += log_sum_exp(pairs.log_terms(moments))
    # densities of m and 3 g times the Jacobians of their logits
    of_mean = shape * (_log_expit(mean) + _log_expit(-mean))
    of_g = _log_expit(logit_g) + _log_expit(-logit_g)
    return likelihood.reshape(mean.size, -1) + of_mean[:, None] + of_g


def _log_expit(x: Floats) -> Floats:
    return -np.logaddexp(0.0, -x)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Moments:
    """Moments E[κ^p (1 - κ)^q] of the Beta of mean m and spread g, as factors."""

    # Times g in every factor they are Π_{i<p}(m (1 - g) + i g) Π_{i<q}((1 - m)(1 - g) +
    # i g) / Π_{i<p+q}(1 - g + i g).

    # (n, largest p + q + 1): logarithms of the three products, by their number of
    # factors
    up: Floats = field(compare=False, repr=False)
    down: Floats = field(compare=False, repr=False)
    denominator: Floats = field(compare=False, repr=False)

    @classmethod
    def of(cls, mean: Floats, logit_g: Floats, max_pairs: int) -> "_Moments":
        """Compute them for logit m and logit 3 g, both (n,), up to p + q."""
        g = (expit(logit_g) / 3.0)[:, None]
        depth = np.arange(max_pairs) * g  # (n, max_pairs)
        rest = 1.0 - g
        return cls(
            up=_log_products(expit(mean)[:, None] * rest + depth),
            down=_log_products(expit(-mean)[:, None] * rest + depth),
            denominator=_log_products(rest + depth),
        )


def _log_products(factors: Floats) -> Floats:
    # (n, p) -> (n, p + 1): logarithms of the products of the first 0, 1, ..., p
    logs = np.zeros((factors.shape[0], factors.shape[1] + 1))
    np.cumsum(np.log(factors), axis=1, out=logs[:, 1:])
    return logs


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
        agree = int(np.diagonal(table).sum())
        return cls(
            agree=agree,
            differ=int(table.sum()) - agree,
            log_weights=_log_weights(table, concentration),
        )

    def log_terms(self, moments: _Moments) -> Floats:
        """Return the logarithms of the terms of the likelihood of (m, g)."""
        # κ is integrated out: in term j it has the powers agree - j and differ + j
        # -> (n, agree + 1)
        n = self.agree + self.differ
        return np.asarray(
            self.log_weights
            + moments.up[:, self.agree :: -1]
            + moments.down[:, self.differ : n + 1]
            - moments.denominator[:, [n]]
        )


def _log_weights(table: NDArray[np.int64], concentration: float) -> Floats:
    # Expands the likelihood of κ: (n_categories, n_categories) -> (agree + 1,),
    # logarithms of the weights of κ^(agree - j) (1 - κ)^(differ + j). With d_k pairs of
    # k and k, and o_k unequal grades of k, it is (1 - κ)^differ times the mean of
    # Π_k π_k^(d_k + o_k) (κ + (1 - κ) π_k)^d_k over the Dirichlet, whose moments are
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
    return np.asarray(total + gammaln(mass) - gammaln(mass + power))
