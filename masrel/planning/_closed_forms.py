"""Sizes by formula: one line of algebra each, cited where it stands.

In: probabilities or standard deviations under a model. Out: items needed, and chances.

References
----------
.. [1] Fleiss, J. L., Cohen, J., Everitt, B. S. (1969). Large sample standard errors of
   kappa and weighted kappa. Psychological Bulletin, 72(5), 323-327.
.. [2] Donner, A., Eliasziw, M. (1992). A goodness-of-fit approach to inference
   procedures for the kappa statistic. Statistics in Medicine, 11(11), 1511-1519.
.. [3] Donner, A., Rotondi, M. A. (2010). Sample size requirements for interval
   estimation of the kappa statistic for interobserver agreement studies with a binary
   outcome and multiple raters. International Journal of Biostatistics, 6(1), 31.
.. [4] Cantor, A. B. (1996). Sample-size calculations for Cohen's kappa. Psychological
   Methods, 1(2), 150-153.
.. [5] Walter, S. D., Eliasziw, M., Donner, A. (1998). Sample size and optimal designs
   for reliability studies. Statistics in Medicine, 17(1), 101-110.
.. [6] Bonett, D. G. (2002). Sample size requirements for estimating intraclass
   correlations with desired precision. Statistics in Medicine, 21(9), 1331-1335.
.. [7] Zou, G. Y. (2012). Sample size formulas for estimating intraclass correlation
   coefficients with precision and assurance. Statistics in Medicine, 31(29), 3972-3981.
"""

import math
from collections.abc import Sequence
from statistics import NormalDist

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def critical(level: float, sides: int) -> float:
    """Return the normal quantile that leaves (1 - level)/sides in a tail."""
    return NormalDist().inv_cdf(1.0 - (1.0 - level) / sides)


def n_for_half_width(sd: float, half_width: float, z: float) -> int:
    """Return n of a Wald half-width z sd/√n [1]_."""
    return math.ceil((z * sd / half_width) ** 2)


def n_for_power(
    sds: tuple[float, float], difference: float, z: float, power: float
) -> int:
    """Return n = ((z_a sd_0 + z_b sd_1)/(κ_1 - κ_0))² [4]_."""
    z_beta = NormalDist().inv_cdf(power)
    return math.ceil(((z * sds[0] + z_beta * sds[1]) / difference) ** 2)


def chi_square_per_item(p: Floats, p_limit: Floats) -> float:
    """Return Σ_h (P_h(κ) - P_h(limit))² / P_h(limit) [2]_."""
    occurs = p_limit > 0.0
    return float(((p - p_limit)[occurs] ** 2 / p_limit[occurs]).sum())


def n_by_fit(p: Floats, p_limits: Sequence[Floats], z: float) -> int:
    """Return the smallest n at which every limit fits badly enough [2]_, [3]_."""
    least = min(chi_square_per_item(p, limit) for limit in p_limits)
    return math.ceil(z**2 / least)


def n_by_fit_power(p: Floats, p_null: Floats, z: float, power: float) -> int:
    """Return n = (z_a + z_b)²/u of a goodness-of-fit test [2]_."""
    z_beta = NormalDist().inv_cdf(power)
    return math.ceil((z + z_beta) ** 2 / chi_square_per_item(p, p_null))


def fit_power(n: int, p: Floats, null: float, level: float, sides: int) -> float:
    """Return the exact power of the test of two raters and two categories [2]_."""
    # p (3,): both name the second category, one, none. The prevalence is estimated.
    from scipy.special import gammaln

    second, one = np.triu_indices(n + 1)
    one = one - second  # both ≥ 0 and their sum ≤ n
    freq = np.column_stack([n - second - one, one, second])
    logs = gammaln(n + 1) - gammaln(freq + 1.0).sum(1) + freq @ np.log(p)
    share = (one + 2 * second) / (2 * n)
    chance = share * (1.0 - share)
    error = chance * null
    expected = n * np.column_stack(
        [(1 - share) ** 2 + error, 2 * (chance - error), share**2 + error]
    )
    with np.errstate(invalid="ignore", divide="ignore"):
        chi_square = ((freq - expected) ** 2 / expected).sum(axis=1)
        kappa = 1.0 - one / (2 * n * chance)
        rejects = chi_square > critical(level, sides) ** 2
        if sides == 1:
            rejects &= kappa > null
    return float(np.exp(logs)[rejects & (chance > 0)].sum())


def n_icc_width(r: float, k: int, width: float, z: float) -> int:
    """Return n of an expected width of ICC(1), eq. 3 of [6]_."""
    error = (1 - r) * (1 + (k - 1) * r)
    n = 8 * z**2 * error**2 / (k * (k - 1) * width**2) + 1
    if k == 2 and r >= 0.7:
        n += 5 * r
    return math.ceil(n)


def n_icc_assurance(r: float, k: int, half: float, z: float, assurance: float) -> int:
    """Return n of a half-width of ICC(1) that holds with assurance, eq. 5 of [7]_."""
    z_beta = NormalDist().inv_cdf(assurance)
    a, b = (1 - r) * (1 + (k - 1) * r), k - 2 + 2 * r - 2 * k * r
    root = math.sqrt((a * z) ** 2 + 4 * half * z * z_beta * a * abs(b))
    return math.ceil(1 + ((a * z + root) / (half * math.sqrt(2 * k * (k - 1)))) ** 2)


def n_icc_power(r: float, null: float, k: int, z: float, power: float) -> int:
    """Return n = 1 + 2k(z_a + z_b)²/((k - 1) ln(θ/θ_0)²) of [5]_; eq. 7 of [7]_."""
    ratio = math.log(icc_ratio(r, k) / icc_ratio(null, k))
    z_beta = NormalDist().inv_cdf(power)
    return math.ceil(1 + 2 * k * (z + z_beta) ** 2 / ((k - 1) * ratio**2))


def icc_ratio(r: float, k: int) -> float:
    """Return θ = (1 + (k - 1) ρ)/(1 - ρ), the ratio of expected mean squares."""
    return (1 + (k - 1) * r) / (1 - r)
