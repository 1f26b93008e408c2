"""A category's polynomial Π_j (x + j)^N_j, tilted so that floats hold what matters.

All coefficients are positive, so that sums and products of them lose no digits.
"""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from scipy.special import gammaln, xlogy

from masrel.agreement._kernel import Floats
from masrel.errors import ConvergenceError

__all__ = ["TRIMMED", "Category", "Powers"]

TRIMMED = 1e-120
"""What is dropped of a product, relative to its largest value."""

_DROPPED = 1e-250  # what is dropped of a law; it is right above 1e-230
_RIGHT = 1e-230
_MOST_FACTORS = 20_000  # of a polynomial multiplied out in logarithms: some seconds


@dataclass(frozen=True, slots=True, kw_only=True)
class Powers:
    """Coefficients of consecutive powers, as value times exp(scale)."""

    first: int  # the lowest power
    values: Floats = field(compare=False, repr=False)  # (n_powers,): positive
    scale: float = 0.0  # logarithm of what all are to be multiplied by

    @property
    def exponents(self) -> Floats:
        """The powers, shape (n_powers,)."""
        return self.first + np.arange(self.values.size, dtype=np.float64)

    def above(self, least: float) -> "Powers":
        """Drop both ends as far as they are below a share of the largest."""
        high = np.flatnonzero(self.values > least * self.values.max())
        return Powers(
            first=self.first + int(high[0]),
            values=self.values[high[0] : high[-1] + 1],
            scale=self.scale,
        )

    def times(self, other: "Powers") -> "Powers":
        """Multiply two polynomials."""
        values = np.convolve(self.values, other.values)
        largest = float(values.max())
        return Powers(
            first=self.first + other.first,
            values=values / largest,
            scale=self.scale + other.scale + float(np.log(largest)),
        )


class Category:
    """One category's coefficients times the moments Γ(a + t) / Γ(a) of its share."""

    # Takes powers (n_depths,)

    def __init__(self, powers: Floats, a: float) -> None:
        self._powers = powers
        self._a = a

    def tilted(self, x: float, log_tilt: float) -> Powers:
        """Return the coefficients of λ^t, the constant Γ(a) left out."""
        law = self._law(x)
        log = np.log(law.values) - law.exponents * np.log(x)
        found = self._with_moments(law.first, law.scale + log, log_tilt)
        if self._is_right(law, found):
            return found
        return self._with_moments(
            int(self._powers[0]), self._log_coefficients, log_tilt
        )

    def _with_moments(self, first: int, log: Floats, log_tilt: float) -> Powers:
        t = first + np.arange(log.size)
        log = log + gammaln(self._a + t) + t * log_tilt
        largest = float(log.max())
        return Powers(first=first, values=np.exp(log - largest), scale=largest).above(
            TRIMMED
        )

    def _law(self, x: float) -> Powers:
        # Divided by its value at x, Π_j (x + j)^N_j is the law of a sum of binomials
        # with chances x / (x + j).
        value = float(self._powers @ np.log(x + np.arange(self._powers.size)))
        law = Powers(first=int(self._powers[0]), values=np.ones(1), scale=value)
        for j, n in enumerate(self._powers.tolist()):
            if j and n:
                law = law.times(_binomial(int(n), x, j)).above(_DROPPED)
        return law

    def _is_right(self, law: Powers, kept: Powers) -> bool:
        # The moments rise faster than any tilt: they may need what the law dropped.
        inside = law.values[kept.first - law.first :][: kept.values.size]
        below = law.first > self._powers[0] and inside[0] < _RIGHT
        end = law.first + law.values.size - 1
        above = end < self._powers.sum() and inside[-1] < _RIGHT
        return not (below or above)

    @cached_property
    def _log_coefficients(self) -> Floats:
        # factor by factor in logarithms, which drops nothing
        if self._powers[1:].sum() > _MOST_FACTORS:
            raise ConvergenceError(
                f"the exact posterior needs {self._powers.sum():.0f} ratings in one "
                'category multiplied out in logarithms; method="emcee" samples it'
            )
        log = np.zeros(1)
        for j, n in enumerate(self._powers.tolist()):
            for _ in range(int(n) if j else 0):
                raised = np.append(-np.inf, log)
                log = np.logaddexp(raised, np.append(log + np.log(j), -np.inf))
        return log


def _binomial(n: int, x: float, j: int) -> Powers:
    # chances x / (x + j); only as far out as Bernstein's inequality says is kept
    p, q = x / (x + j), j / (x + j)
    nats = -np.log(_DROPPED)
    reach = nats / 3.0 + np.sqrt(nats**2 / 9.0 + 2.0 * nats * n * p * q)
    k = np.arange(max(0, int(n * p - reach)), min(n, int(n * p + reach) + 1) + 1)
    log = gammaln(n + 1.0) - gammaln(k + 1.0) - gammaln(n - k + 1.0)
    log += xlogy(k, p) + xlogy(n - k, q)
    return Powers(first=int(k[0]), values=np.exp(log))
