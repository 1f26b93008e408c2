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
from statistics import NormalDist

import numpy as np

from masrel._input import refuse
from masrel.agreement._engine import Floats, check_level, student_t
from masrel.planning._studies import all_studies, icc_ratio
from masrel.planning._study_plan import FORMULAS, chance_of
from masrel.planning._truth import ONE_WAY, Design, at_value, probabilities, rows_of

_NORMAL = NormalDist()


def size_by_formula(design: Design) -> int:
    """Return the items that a design's formula asks for."""
    study, is_icc = design.study, design.is_icc
    is_of_one = study.null is not None or (is_icc and study.upper is None)
    refuse(
        (
            study.n_raters is None,
            f"method: {study.method} solves for items, not for raters: it needs "
            "n_raters",
        ),
        (
            chance_of(study) is not None and not is_of_one,
            f"{'assurance' if study.power is None else 'power'}: method "
            f'{study.method} has no formula for this aim; use "auto", "exact" or '
            '"simulation"',
        ),
        (
            is_icc and study.coefficient != ONE_WAY,
            f"method: the formulas are for icc_1, got {study.coefficient}",
        ),
    )
    items = _wald_items if study.method == "wald" else _fit_items
    return math.ceil((_icc_items if is_icc else items)(design))


def items_nearby(design: Design) -> float | None:
    """Return about how many items an aim needs, where a formula says it."""
    if design.is_icc:
        return _n_icc_width(design)
    is_wald = design.study.target == "items" and design.model.has_rows
    return items_by_half(design, _z(design) * design.item_sd) if is_wald else None


def items_by_half(design: Design, half: float) -> float:
    """Return n of an aim by the half-width of one item, which goes with 1/√n [1]_."""
    # with power 1 - β it is to be smaller by z_a/(z_a + z_b)
    power, z = design.study.power, _z(design)
    z_b = 0.0 if power is None else _NORMAL.inv_cdf(power)
    return (half * max(1.0 + z_b / z, 0.0) / _half(design)) ** 2


def _z(design: Design) -> float:
    """Return the normal quantile that leaves (1 - level)/sides in a tail."""
    level, sides = design.study.level, design.study.sides
    return _NORMAL.inv_cdf(1.0 - (1.0 - level) / sides)


def _half(design: Design) -> float:
    """Return the half-width that is needed, or the distance of the nearest limit."""
    study = design.study
    limits = [x for x in (study.null, study.lower, study.upper) if x is not None]
    nearest = min((abs(design.value - x) for x in limits), default=1.0)
    return study.half_width or max(nearest, 1e-6)


# -- Wald intervals -------------------------------------------------------------------


def _wald_items(design: Design) -> float:
    """Return n of a width, or n = ((z_a sd_0 + z_b sd_1)/(κ_1 - κ_0))² [4]_."""
    null, power = design.study.null, design.study.power
    if null is None or power is None:
        return items_by_half(design, _z(design) * design.item_sd)
    sd_0, sd_1 = at_value(design, null).item_sd, design.item_sd
    z_b = _NORMAL.inv_cdf(power)
    return ((_z(design) * sd_0 + z_b * sd_1) / (design.value - null)) ** 2


def _wald_numbers(design: Design) -> dict[str, float]:
    """Return half-width, ends, and power by the variance of the null value [4]_."""
    half = _z(design) * design.item_sd / math.sqrt(design.n_items)
    numbers = {
        "expected_half_width": half,
        "expected_low": design.value - half,
        "expected_high": design.value + half,
    }
    if (null := design.study.null) is not None:
        of_null = _z(design) * at_value(design, null).item_sd
        difference = abs(design.value - null) * math.sqrt(design.n_items)
        numbers["power"] = _NORMAL.cdf((difference - of_null) / design.item_sd)
    return numbers


# -- goodness of fit ------------------------------------------------------------------


def _cells(design: Design) -> Floats:
    """Return the probabilities of the cells of a goodness-of-fit test."""
    # two categories: how many raters name the second; else each unanimous one, the rest
    rows = rows_of(design.model, design.n_raters, ordered=False)
    p = probabilities(design.model, rows, ordered=False)
    if len(design.model.scale) == 2:
        return p
    alike = (rows == rows[:, :1]).all(axis=1)
    return np.append(p[alike], p[~alike].sum())


def _chi_square_per_item(design: Design, limit: float) -> float:
    """Return Σ_h (P_h(κ) - P_h(limit))² / P_h(limit) [2]_."""
    p, p_limit = _cells(design), _cells(at_value(design, limit))
    occurs = p_limit > 0.0
    return float(((p - p_limit)[occurs] ** 2 / p_limit[occurs]).sum())


def _fit_items(design: Design) -> float:
    """Return n at which every limit fits badly enough [2]_, [3]_, or (z_a + z_b)²/u."""
    study, value = design.study, design.value
    if study.null is not None and study.power is not None:
        z = _z(design) + _NORMAL.inv_cdf(study.power)
        return z**2 / _chi_square_per_item(design, study.null)
    limits = [study.lower, study.upper]
    if study.half_width is not None:
        limits = [value - study.half_width, value + study.half_width]
    least = min(_chi_square_per_item(design, x) for x in limits if x is not None)
    return _z(design) ** 2 / least


def _fit_numbers(design: Design) -> dict[str, float]:
    """Return the exact power, or its mean over a prior of the true value."""
    null, prior = design.study.null, design.study.prior
    if null is None or (design.n_raters, len(design.model.scale)) != (2, 2):
        return {}
    if prior is None:
        return {"power": _fit_power(design, null)}
    from scipy.stats import beta  # slow to load

    # O'Hagan, Stevens and Campbell (2005)
    power = beta(*prior).expect(
        lambda value: _fit_power(at_value(design, value), null), epsrel=1e-9
    )
    return {"power": float(power)}


@np.errstate(invalid="ignore", divide="ignore")
def _fit_power(design: Design, null: float) -> float:
    """Return the exact power of the test of two raters and two categories [2]_."""
    n, power = design.n_items, 0.0
    # cells: none names the second category, one does, both. Its share is estimated.
    for freq, p in all_studies(n, _cells(design)):
        share = (freq[:, 1] + 2 * freq[:, 2]) / (2 * n)
        chance = share * (1.0 - share)
        error = chance * null
        cells = [(1 - share) ** 2 + error, 2 * (chance - error), share**2 + error]
        expected = n * np.column_stack(cells)
        chi_square = ((freq - expected) ** 2 / expected).sum(axis=1)
        rejects = (chance > 0) & (chi_square > _z(design) ** 2)
        if design.study.sides == 1:
            rejects &= 1.0 - freq[:, 1] / (2 * n * chance) > null
        power += float(p[rejects].sum())
    return power


# -- intraclass correlations ----------------------------------------------------------


def _icc_items(design: Design) -> float:
    study, chance = design.study, chance_of(design.study)
    if chance is None:
        return _n_icc_width(design)
    r, k, z, z_b = design.value, design.n_raters, _z(design), _NORMAL.inv_cdf(chance)
    if (limit := study.lower if study.null is None else study.null) is not None:
        # n = 1 + 2k(z_a + z_b)²/((k - 1) ln(θ/θ_0)²) of [5]_; eq. 7 of [7]_
        ratio = math.log(icc_ratio(r, k) / icc_ratio(limit, k))
        return 1 + 2 * k * (z + z_b) ** 2 / ((k - 1) * ratio**2)
    # of a half-width that holds with assurance, eq. 5 of [7]_
    half, a, b = _half(design), (1 - r) * (1 + (k - 1) * r), k - 2 + 2 * r - 2 * k * r
    root = math.sqrt((a * z) ** 2 + 4 * half * z * z_b * a * abs(b))
    return 1 + ((a * z + root) / (half * math.sqrt(2 * k * (k - 1)))) ** 2


def _n_icc_width(design: Design) -> float:
    """Return n of an expected width of ICC(1), eq. 3 of [6]_."""
    r, k, width = design.value, design.n_raters, 2.0 * _half(design)
    error = (1 - r) * (1 + (k - 1) * r)
    n = 8 * _z(design) ** 2 * error**2 / (k * (k - 1) * width**2)
    return n + 1 + (5 * r if k == 2 and r >= 0.7 else 0.0)


# -- at a given size ------------------------------------------------------------------


def numbers_by_formula(design: Design) -> dict[str, float]:
    """Return what the method's formula says of a design; nothing without one."""
    numbers = _wald_numbers if design.study.method == "wald" else _fit_numbers
    return {} if design.is_icc else numbers(design)


def check_has_numbers(design: Design) -> None:
    """Check that a formula says something of a given size."""
    study, q = design.study, len(design.model.scale)
    is_fit = study.method == "goodness-of-fit" and study.null is not None
    refuse(
        (
            design.is_icc and study.method in FORMULAS,
            f"method: {study.method} of {design.entry.title} gives only a size: use "
            'sample_size, or method "exact"',
        ),
        (
            is_fit and (study.n_raters, q) != (2, 2),
            "method: the power of a goodness-of-fit test at a given size needs two "
            f"raters and two categories, got {study.n_raters} and {q}",
        ),
    )


def units_needed(
    standard_error: float, n_units: int, *, half_width: float, level: float = 0.95
) -> int:
    """Return how many items, documents or clusters make an interval narrow enough.

    Parameters
    ----------
    standard_error : float
        That of any estimate, in a study of `n_units` of them: of a pilot, or by a
        formula.
    n_units : int
        How many that study has.
    half_width : float
        What half of the interval may be, in the units of the estimate.
    level : float, optional
        Level of the interval.

    Returns
    -------
    int
        The least n for which t(n − 1) · `standard_error` · √(`n_units`/n) is at most
        `half_width`.

    Raises
    ------
    ParameterError
        If the error or the half is not above 0, there are fewer than two units, or the
        level is not within (0, 1).

    References
    ----------
    .. [1] Bland, J. M., Altman, D. G. (1999). Measuring agreement in method comparison
       studies. Statistical Methods in Medical Research, 8(2), 135-160.
       https://doi.org/10.1177/096228029900800204

    Examples
    --------
    A limit of agreement of n items has the error s √(1/n + 1.96²/(2 (n − 1))) [1]_;
    with s = 3, for limits ± 1:

    >>> import math
    >>> units_needed(3.0 * math.sqrt(1 / 20 + 1.96**2 / 38), 20, half_width=1.0)
    107
    """
    check_level(level)
    refuse(
        (
            not 0.0 < standard_error < math.inf or not half_width > 0.0,
            "standard_error, half_width: need numbers above 0, got "
            f"{standard_error!r} and {half_width!r}",
        ),
        (n_units < 2, f"n_units: needs two or more, got {n_units!r}"),
    )
    of_one = standard_error**2 * n_units / half_width**2
    n = max(2, math.ceil(of_one * student_t(level, math.inf) ** 2))  # too few
    while of_one * student_t(level, n - 1) ** 2 > n:
        n += 1
    return n
