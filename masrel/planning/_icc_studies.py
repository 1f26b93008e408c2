"""Studies of an intraclass correlation: mean squares of normal ratings.

ICC(1) and ICC(C,1) exactly, from the F distribution of their ratio; ICC(A,1) by drawing
mean squares. The intervals are those of `masrel.agreement.icc`.
"""

import math

import numpy as np
from scipy.special import fdtr, fdtri, gammaln

from masrel.agreement.icc import _absolute_ends
from masrel.planning._closed_forms import icc_ratio
from masrel.planning._item_models import Floats
from masrel.planning._studies import StudyDesign, StudySums

ONE_WAY, CONSISTENCY, AGREEMENT = "icc_1", "icc_c1", "icc_a1"
FORMS = (ONE_WAY, CONSISTENCY, AGREEMENT)
_NODES = 4001  # of the sum over log F; smooth, so that it converges at once


def exact_icc(design: StudyDesign) -> StudySums:
    """Sum over the distribution of F, the only statistic of the interval."""
    n, k, r = design.n_items, design.n_raters, design.value
    first = float(n - 1)
    second = float(n * (k - 1) if design.coefficient == ONE_WAY else (n - 1) * (k - 1))
    # log of F/θ on a grid that holds all but 1e-15 of it
    ends = np.log([fdtri(first, second, 1e-15), fdtri(first, second, 1 - 1e-15)])
    x = np.linspace(float(ends[0]), float(ends[1]), _NODES)
    f = np.exp(x)
    # density of log F, by the trapezoid rule
    logs = 0.5 * first * (x + math.log(first / second))
    logs -= 0.5 * (first + second) * np.log1p(first / second * f)
    logs += gammaln(0.5 * (first + second)) - gammaln(0.5 * first)
    weight = np.exp(logs - gammaln(0.5 * second)) * (x[1] - x[0])
    f = f * icc_ratio(r, k)
    upper = 0.5 + 0.5 * design.level
    # McGraw and Wong (1996), table 7, for single ratings
    low, high, value = (
        (ratio - 1) / (ratio + k - 1)
        for ratio in (
            f / fdtri(first, second, upper),
            f * fdtri(second, first, upper),
            f,
        )
    )
    outcomes = np.column_stack([value, 0.5 * (high - low), low, high])
    sums = StudySums.of(design, outcomes, weight / weight.sum())
    return _with_exact_shares(sums, design, first, second)


def _with_exact_shares(
    sums: StudySums, design: StudyDesign, first: float, second: float
) -> StudySums:
    # a step of a share falls between nodes: its place is known
    k, upper = design.n_raters, 0.5 + 0.5 * design.level
    theta = icc_ratio(design.value, k)
    exact = sums.sums.copy()
    if design.half_width is not None:
        exact[10] = _share_narrow(design, first, second, theta)
    if design.null is not None and design.value >= design.null:
        least = fdtri(first, second, upper) * icc_ratio(design.null, k) / theta
        exact[11] = 1.0 - fdtr(first, second, least)
    if design.lower is not None and design.upper is None:
        least = fdtri(first, second, upper) * icc_ratio(design.lower, k) / theta
        exact[12] = 1.0 - fdtr(first, second, least)
    exact[13] = design.level  # of an exact interval
    return StudySums(exact)


def _share_narrow(
    design: StudyDesign, first: float, second: float, theta: float
) -> float:
    # P(width ≤ w): the width rises with F to one maximum, and falls
    k, upper = design.n_raters, 0.5 + 0.5 * design.level
    up, down = fdtri(first, second, upper), fdtri(second, first, upper)
    w = 2.0 * (design.half_width or 0.0)

    def width(f: Floats) -> Floats:
        low, high = (f / up - 1) / (f / up + k - 1), (f * down - 1) / (f * down + k - 1)
        return high - low

    # k f (down - 1/up) / ((f down + k - 1)(f/up + k - 1)) = w, quadratic in f
    a = w * down / up
    b = w * (k - 1) * (down + 1 / up) - k * (down - 1 / up)
    c = w * (k - 1) ** 2
    root = b * b - 4 * a * c
    if root <= 0.0:
        return 1.0
    ends = [(-b - math.sqrt(root)) / (2 * a), (-b + math.sqrt(root)) / (2 * a)]
    below, above = (
        fdtr(first, second, max(ends[0], 0.0) / theta),
        fdtr(first, second, max(ends[1], 0.0) / theta),
    )
    return float(below + 1.0 - above)


def simulate_icc(
    design: StudyDesign, rng: np.random.Generator, n_studies: int, rater_share: float
) -> StudySums:
    """Sum over studies of ICC(A,1) whose mean squares are drawn."""
    n, k, r = design.n_items, design.n_raters, design.value
    # variance of items 1; raters and residual share (1 - ρ)/ρ
    error = (1.0 - r) / r
    of_raters, residual = rater_share * error, (1.0 - rater_share) * error
    rows = (k + residual) * rng.chisquare(n - 1, n_studies) / (n - 1)
    columns = (n * of_raters + residual) * rng.chisquare(k - 1, n_studies) / (k - 1)
    df = (n - 1) * (k - 1)
    rest = residual * rng.chisquare(df, n_studies) / df
    value = (rows - rest) / (rows + (k - 1) * rest + k * (columns - rest) / n)
    low, high = _absolute_ends(n, k, (rows, columns, rest), value, design.level)
    outcomes = np.column_stack([value, 0.5 * (high - low), low, high])
    return StudySums.of(design, outcomes, np.ones(n_studies))
