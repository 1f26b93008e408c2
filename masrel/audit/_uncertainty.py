"""Which of some tables have a printed standard error, interval or p of kappa.

What a program prints as the standard error of kappa is one of several; the interval is
kappa plus and minus a normal quantile of it, and p that of kappa over it. All are
floats: a printed number fits where it is nearer than half of its last decimal.
"""

from dataclasses import dataclass, field
from statistics import NormalDist

import numpy as np
from numpy.typing import NDArray

from masrel.agreement import cohen_kappa, count_table
from masrel.audit._claims import Claim
from masrel.audit._printed import PrintedNumber
from masrel.audit._windows import (
    AuditWeights,
    Integers,
    by_distance,
    matrix_of,
)

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]

ERROR_KINDS = ("delta", "delta n-1", "null", "simple")
"""Standard errors of kappa that programs print."""

_TESTS = {
    "null, two-sided": ("null", 2),
    "null, one-sided": ("null", 1),
    "delta, two-sided": ("delta", 2),
    "delta, one-sided": ("delta", 1),
}
_NORMAL = NormalDist()
_SLACK = 1e-9  # of floats, either side of a tie


@dataclass(frozen=True, slots=True, eq=False)
class Uncertainty:
    """Kappa of tables with its standard errors, and what is printed of them."""

    claim: Claim
    printed: dict[str, PrintedNumber]
    kappa: Floats  # (n_tables,)
    errors: dict[str, Floats] = field(default_factory=dict)

    @classmethod
    def of(cls, claim: Claim, tables: Integers, weights: AuditWeights) -> "Uncertainty":
        """Return those of tables, (n_tables, n_categories, n_categories)."""
        printed = claim.printed()
        if not printed:
            return cls(claim, printed, np.zeros(len(tables)))
        estimates = [cohen_kappa(count_table(t), weights=weights) for t in tables]
        kappa = np.array([estimate.value for estimate in estimates])
        delta = np.array([estimate.standard_error for estimate in estimates])
        n = tables.sum(axis=(1, 2)) if len(tables) else np.ones(0)
        errors = {"delta n-1": delta, "delta": delta * np.sqrt((n - 1) / n)}
        errors["null"], errors["simple"] = _other_errors(tables, weights)
        return cls(claim, printed, kappa, errors)

    @property
    def has_error(self) -> bool:
        """Whether a standard error or an interval is printed."""
        return bool(self.printed.keys() - {"p"})

    @property
    def tests(self) -> dict[str, tuple[str, int]]:
        """What p may be of; nothing where none is printed."""
        return _TESTS if "p" in self.printed else {}

    def fits(self, error: str | None, test: str | None) -> Flags:
        """Return which tables have all that is printed, by one reading of it."""
        fits = np.ones(len(self.kappa), dtype=bool)
        if error is not None:
            standard_error = self.errors[error]
            if "standard_error" in self.printed:
                fits &= _near(standard_error, self.printed["standard_error"])
            if "low" in self.printed:
                z = _NORMAL.inv_cdf(0.5 + self.claim.level / 2)
                fits &= _near(
                    self.kappa - z * standard_error, self.printed["low"], -1.0
                )
                fits &= _near(
                    self.kappa + z * standard_error, self.printed["high"], 1.0
                )
        if test is not None:
            fits &= self._has_p(*_TESTS[test])
        return fits

    def _has_p(self, error: str, sides: int) -> Flags:
        with np.errstate(divide="ignore", invalid="ignore"):
            z = self.kappa / self.errors[error]
        above = np.array([1 - _NORMAL.cdf(value) for value in z])
        p = above if sides == 1 else 2 * np.minimum(above, 1 - above)
        printed = self.printed["p"]
        if str(self.claim.p).startswith("<"):
            return p < float(printed.value)
        return _near(p, printed)


def _near(values: Floats, printed: PrintedNumber, end: float | None = None) -> Flags:
    # end: of the scale, where intervals may have been cut off
    reach = float(printed.half_unit) + _SLACK
    near = abs(values - float(printed.value)) <= reach
    if end is not None and float(printed.value) == end:
        near |= values * end > 1
    return near


def _other_errors(tables: Integers, weights: AuditWeights) -> tuple[Floats, Floats]:
    # of kappa 0, and the first one of Cohen; w = 1 - v / v_max
    v = matrix_of(by_distance(weights, tables.shape[1])).astype(float)
    w = 1 - v / v.max()
    n = tables.sum(axis=(1, 2))
    p = tables / n[:, None, None]
    rows, columns = p.sum(axis=2), p.sum(axis=1)
    observed = (p * w).sum(axis=(1, 2))
    chance = np.einsum("tk,km,tm->t", rows, w, columns)
    means = (columns @ w.T)[:, :, None] + (rows @ w)[:, None, :]
    # [1], eq. 9: Σ p_i. p_.j [w_ij - (w_i. + w_.j)]² - p_e²
    variance = np.einsum("tk,tkm,tm->t", rows, (w - means) ** 2, columns) - chance**2
    with np.errstate(divide="ignore", invalid="ignore"):
        null = np.sqrt(np.maximum(variance, 0.0) / n) / (1 - chance)
        squares = np.maximum((p * w**2).sum(axis=(1, 2)) - observed**2, 0.0)
        simple = np.sqrt(squares / n) / (1 - chance)
    return null, simple
