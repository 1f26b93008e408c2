"""Raters who agree with themselves: the likelihood of kappas that vary by rater.

A rater of self-agreement κ and category shares π grades an item k and then l with
probability κ π_k [k = l] + (1 - κ) π_k π_l. Over raters κ ~ Beta with mean m and
spread g = variance / (m (1 - m)), at most 1/3: then its density has no rise at both
ends, as if raters agreed either always or never. π integrates out.
"""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.special import expit, gammaln

from masrel.agreement._kernel import Floats

__all__ = ["GRID", "RaterPairs", "Risen", "log_weights"]

GRID = np.linspace(-20.0, 20.0, 65)
"""Points of logit 3 g, for a trapezoid sum over all of it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Risen:
    """Moments E[κ^p (1 - κ)^q] of the Beta of mean m and spread g, as factors."""

    # Times g in every factor they are Π_{i<p}(m (1 - g) + i g) Π_{i<q}((1 - m)(1 - g) +
    # i g) / Π_{i<p+q}(1 - g + i g).

    # up, down, below: (n, largest p + q + 1): logarithms of the three products, by
    # their number of factors
    up: Floats = field(compare=False, repr=False)
    down: Floats = field(compare=False, repr=False)
    below: Floats = field(compare=False, repr=False)

    @classmethod
    def of(cls, mean: Floats, spread: Floats, most: int) -> "Risen":
        """Compute them for logit m and logit 3 g, both (n,), up to p + q = most."""
        g = (expit(spread) / 3.0)[:, None]
        depth = np.arange(most) * g  # (n, most)
        rest = 1.0 - g
        return cls(
            up=_log_products(expit(mean)[:, None] * rest + depth),
            down=_log_products(expit(-mean)[:, None] * rest + depth),
            below=_log_products(rest + depth),
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class RaterPairs:
    """The pairs of one rater, as all that the likelihood of κ needs."""

    # L(κ) = Σ_j weight_j κ^(agree - j) (1 - κ)^(differ + j), all weights positive.

    # agree, differ: pairs of equal and of unequal grades
    agree: int
    differ: int
    # (agree + 1,): logarithms of the weights
    log_weights: Floats = field(compare=False, repr=False)

    @classmethod
    def of(cls, table: NDArray[np.int64], concentration: float) -> "RaterPairs":
        """Integrate the shares of the categories out."""
        # Takes table (n_categories, n_categories)
        # The likelihood of κ.
        equal = np.diagonal(table)
        agree = int(equal.sum())
        return cls(
            agree=agree,
            differ=int(table.sum()) - agree,
            log_weights=log_weights(table, concentration),
        )

    def log_terms(self, risen: Risen) -> Floats:
        """Return the terms of the likelihood of (m, g), κ integrated out."""
        # -> (n, agree + 1)
        # Logarithms; in term j κ has the powers agree - j and differ + j.
        n = self.agree + self.differ
        return np.asarray(
            self.log_weights
            + risen.up[:, self.agree :: -1]
            + risen.down[:, self.differ : n + 1]
            - risen.below[:, [n]]
        )


def _log_products(factors: Floats) -> Floats:
    # (n, p) -> (n, p + 1): logarithms of the products of the first 0, 1, ..., p
    logs = np.zeros((factors.shape[0], factors.shape[1] + 1))
    np.cumsum(np.log(factors), axis=1, out=logs[:, 1:])
    return logs


def log_weights(table: NDArray[np.int64], concentration: float) -> Floats:
    """Expand the likelihood of κ in powers, with π integrated out."""
    # With d_k pairs of k and k, and o_k unequal grades of k, it is (1 - κ)^differ times
    # the mean of Π_k π_k^(d_k + o_k) (κ + (1 - κ) π_k)^d_k over the Dirichlet, whose
    # moments are Π_k Γ(a + t_k) / Γ(a) · Γ(K a) / Γ(K a + Σ t_k).
    # table (n_categories, n_categories) -> (agree + 1,)
    # Logarithm of the weight of κ^(agree - j) (1 - κ)^(differ + j).
    equal = np.diagonal(table)
    graded = table.sum(axis=0) + table.sum(axis=1) - equal  # d_k + o_k
    total = np.zeros(1)
    for d, t in zip(equal.tolist(), graded.tolist(), strict=True):
        j = np.arange(d + 1)
        binomial = gammaln(d + 1) - gammaln(j + 1) - gammaln(d - j + 1)
        moment = gammaln(concentration + t + j) - gammaln(concentration)
        total = _log_convolve(total, binomial + moment)
    mass = concentration * len(table)
    power = graded.sum() + np.arange(total.size)
    return np.asarray(total + gammaln(mass) - gammaln(mass + power))


def _log_convolve(one: Floats, other: Floats) -> Floats:
    product = np.full(one.size + other.size - 1, -np.inf)
    for j, log in enumerate(one.tolist()):
        reached = slice(j, j + other.size)
        product[reached] = np.logaddexp(product[reached], log + other)
    return product
