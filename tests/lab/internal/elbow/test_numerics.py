"""Polynomials row by row, clustered least squares, and travels not seen to end."""

import math
from collections.abc import Sequence

import mpmath
import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from scipy import stats

from masrel.lab.elbow._polynomials import (
    first_above,
    largest,
    product,
    split_at_roots,
    value,
)
from masrel.lab.elbow.identification._catches import Catch
from masrel.lab.elbow.identification._clusters import (
    FittedParameter,
    Rows,
    fitted,
    left_out_steps,
    partial_out,
    solve,
)
from masrel.lab.elbow.identification._equations import DetectionLimit, beyond
from masrel.lab.elbow.identification._steps import (
    Travels,
    fit_catch_line,
    fit_censored,
    on_the_line,
)
from masrel.lab.elbow.parameters import STANDARD_MODELS

places = st.lists(
    st.integers(1, 99).map(lambda k: k / 100), min_size=1, max_size=5, unique=True
)


def with_roots(*roots: float, scale: float = 1.0) -> list[float]:
    p = [scale]
    for root in roots:
        p = product(p, [-root, 1.0])
    return p


@given(roots=places)
@example(roots=[0.5])  # in the middle to the bit
@example(roots=[0.2, 0.5, 0.9])
def test_a_product_is_cut_at_the_roots_of_its_factors(roots: list[float]) -> None:
    cuts = split_at_roots(with_roots(*roots), 1.0)
    # five factors a hundredth apart magnify rounding 1e8 times at most
    assert cuts == pytest.approx([0.0, *sorted(roots), 1.0], abs=1e-7)


@given(
    rows=st.lists(st.lists(places, min_size=1, max_size=4), min_size=1, max_size=5),
    low=st.floats(0.0, 0.9),
)
def test_a_row_of_columns_is_what_its_numbers_are(
    rows: list[list[list[float]]], low: float
) -> None:
    several = [with_roots(*(roots + [2.0] * 5)[:5]) for (roots, *_) in rows]
    columns = [np.array(c) for c in zip(*several, strict=True)]
    n = len(several)
    places_of_rows = first_above(columns, low, np.ones(n), among=np.ones(n, bool))
    alone = [first_above(p, low, 1.0) for p in several]
    # five factors a hundredth apart magnify rounding 1e8 times at most
    assert places_of_rows == pytest.approx(alone, abs=1e-7, nan_ok=True)
    tops = largest(columns, np.ones(n))
    assert tops == pytest.approx([largest(p, 1.0) for p in several], abs=1e-13)


# Clustered least squares


def without_own(own: np.ndarray, design: np.ndarray, target: np.ndarray) -> Rows:
    rest = partial_out(np.column_stack([own, design, target]), own.shape[1])
    return Rows(design=rest[:, :-1], target=rest[:, -1])


def trials(seed: int, sizes: Sequence[int], n_parameters: int = 2) -> list[Rows]:
    rng = np.random.default_rng(seed)
    made = []
    for size in sizes:
        design = rng.standard_normal((size, n_parameters)) + 1.0
        target = design.sum(axis=1) + rng.standard_normal() + rng.standard_normal(size)
        made.append(Rows(design=design, target=target))
    return made


def test_what_leaving_a_trial_out_does_is_what_a_fit_without_it_says() -> None:
    rows = trials(6, [7, 9, 6, 8])
    fit = solve(rows)
    at_zero = [
        Rows(design=r.design, target=r.target - r.design @ fit.values) for r in rows
    ]
    for i, step in enumerate(left_out_steps(at_zero)):
        others = solve([r for j, r in enumerate(rows) if j != i])
        np.testing.assert_allclose(fit.values + step, others.values, rtol=1e-9)


def test_what_no_row_tells_is_undefined_and_the_rest_is_not() -> None:
    # a column of zeros, and two that say the same
    rng = np.random.default_rng(1)
    rows = []
    for _ in range(4):
        one, other = rng.standard_normal((2, 6))
        design = np.stack([one, np.zeros(6), other, 2.0 * other], axis=1)
        rows.append(Rows(design=design, target=2.0 * one))
    fit = solve(rows)
    assert fit.values[0] == pytest.approx(2.0, rel=1e-12)
    assert np.isnan(fit.values[1:]).all()
    assert fit.n_trials.tolist() == [4, 0, 4, 4]
    lone = solve(trials(4, [8]))
    assert np.isfinite(lone.values).all()
    assert np.isnan(lone.covariance).all()
    assert np.isnan(lone.df).all()


def test_what_own_parameters_explain_but_for_rounding_tells_nothing() -> None:
    # a speed that is constant in every trial, beside a constant of each trial's own
    rng = np.random.default_rng(3)
    rows = []
    for speed in (0.1396263, 0.1570796, 0.2):
        angle = np.cumsum(rng.uniform(0.5, 1.5, 40)) * speed
        design = np.stack([np.full(40, speed), angle], axis=1)
        own = np.ones((40, 1))
        rows.append(without_own(own, design, 1.26 * speed + 3.15 * angle))
    fit = solve(rows)
    assert math.isnan(fit.values[0])
    assert fit.values[1] == pytest.approx(3.15, rel=1e-12)


def test_as_many_trials_as_parameters_leave_no_freedom() -> None:
    # two points on a line: no warning of 0/0, and no interval
    rows = [
        Rows(design=np.array([[1.0, x]]), target=np.array([y]))
        for x, y in ((1.0, 3.0), (2.0, 5.0))
    ]
    found = solve(rows)
    np.testing.assert_allclose(found.values, [1.0, 2.0], atol=1e-12)
    estimates = fitted(("a", "b"), found, 0.95)
    assert all(np.isnan(estimate.low) for estimate in estimates)
    assert {estimate.reason for estimate in estimates} == {
        "these trials fit exactly; an interval needs trials that differ"
    }


# The line of catch angles, and travels of which some are not seen to end

HM3 = STANDARD_MODELS["HM3"]
LINE, SLOPE = HM3.catch_angle_constant, HM3.catch_slope


def catch(angle: float, mean_speed: float, gain: float) -> Catch:
    return Catch(
        time=1.0,
        angle=angle,
        speed=2.0,
        acceleration=0.0,
        mean_speed=mean_speed,
        speed_gain=gain,
        end=None,
        travel=0.3,
        mean_catch_speed=2.0,
        within_peak=False,
        residual_sd=0.1,
    )


def caught(rng: np.random.Generator, n: int, scatter: float) -> list[Catch]:
    """Hands whose mean speed grows with the angle, v̄ = v + g·(θ - 80°)."""
    made = []
    for _ in range(n):
        speed, gain = rng.uniform(1.2, 2.0), rng.uniform(0.3, 0.9)
        about = math.radians(80.0)
        # θ = L - α·(v + g·(θ - 80°)) + ε
        error = scatter * rng.standard_normal()
        angle = (LINE - SLOPE * (speed - gain * about) + error) / (1.0 + SLOPE * gain)
        made.append(catch(angle, speed + gain * (angle - about), gain))
    return made


def test_late_catches_of_hands_that_speed_up_do_not_bias_the_slope() -> None:
    # 1000 catches with a scatter of 4°: the standard error of α is 0.01 s; the seed
    # is fixed, and the plain regression's bias is four of them
    catches = caught(np.random.default_rng(1), 1000, math.radians(4.0))
    speeds = np.array([c.mean_speed for c in catches])
    plain = -np.polyfit(speeds, [c.angle for c in catches], 1)[0]
    on_line = np.ones(1000, dtype=np.bool_)
    step = fit_catch_line(catches, on_line, HM3, level=0.95)
    assert step["catch_slope"].value == pytest.approx(SLOPE, abs=0.03)
    assert plain < SLOPE - 0.03
    assert step["catch_angle_constant"].value == pytest.approx(LINE, abs=0.06)


def test_catches_at_the_smallest_angle_are_not_on_the_line() -> None:
    catches = caught(np.random.default_rng(3), 8, 0.0)
    fast = HM3.fastest_mean_speed * 1.3
    catches += [catch(HM3.smallest_catch_angle, fast, 0.5)] * 2
    on_line = on_the_line(catches, HM3)
    assert on_line.tolist() == [True] * 8 + [False] * 2
    step = fit_catch_line(catches, on_line, HM3, level=0.95)
    assert step["catch_slope"].value == pytest.approx(SLOPE, rel=1e-6)
    assert step["catch_slope"].n_trials == 8


SEEN = [0.81, 0.83, 0.86, 0.84, 0.88]
LIMITS = [0.82, 0.85, 0.9, 0.87]


def travels(seen: list[float], limits: list[float], softness: float = 0.0) -> Travels:
    return Travels(np.array(seen), np.array(limits), np.full(len(limits), softness))


def censored(
    seen: list[float], limits: list[float], softness: float = 0.0
) -> tuple[FittedParameter, float]:
    return fit_censored(travels(seen, limits, softness), level=0.95)


@pytest.mark.parametrize("softness", [0.0, 0.02])
def test_forty_digits_find_the_same_maximum_and_information(softness: float) -> None:
    with mpmath.workdps(40):

        def whole(mean: mpmath.mpf, sd: mpmath.mpf) -> mpmath.mpf:
            value = sum(-(((y - mean) / sd) ** 2) / 2 - mpmath.log(sd) for y in SEEN)
            size = mpmath.sqrt(sd**2 + mpmath.mpf(softness) ** 2)
            return value + sum(
                mpmath.log(mpmath.ncdf((mean - c) / size)) for c in LIMITS
            )

        def slope(mean: mpmath.mpf, sd: mpmath.mpf) -> list[mpmath.mpf]:
            return [
                mpmath.diff(whole, (mean, sd), (1, 0)),
                mpmath.diff(whole, (mean, sd), (0, 1)),
            ]

        mean, sd = mpmath.findroot(slope, (0.87, 0.03), tol=1e-25)
        second = [
            [-float(mpmath.diff(whole, (mean, sd), order)) for order in row]
            for row in (((2, 0), (1, 1)), ((1, 1), (0, 2)))
        ]
    found, spread = censored(SEEN, LIMITS, softness)
    assert (found.value, spread) == pytest.approx((float(mean), float(sd)), rel=1e-12)
    # of the 5 that were seen, one is spent on the mean
    error = math.sqrt(np.linalg.inv(np.array(second))[0, 0] * 5.0 / 4.0)
    assert found.standard_error == pytest.approx(error, rel=1e-7)


def test_a_limit_far_below_says_nothing() -> None:
    (alone, sd), (far, same) = censored(SEEN, []), censored(SEEN, [-50.0])
    assert (far.value, same) == pytest.approx((alone.value, sd), rel=1e-12)
    assert beyond(1.0, DetectionLimit(travel=-50.0, sd=0.0), 0.01) == (0.0, 0.0, 0.0)


@pytest.mark.parametrize("distance", [-30.0, -2.0, -0.1, 0.0, 0.4, 3.0, 8.0])
def test_the_row_of_the_last_fit_has_the_slope_and_curvature_of_the_chance(
    distance: float,
) -> None:
    # half the square of the residual is -ln Φ; its derivatives by 40 digits
    at, horizon = 0.9, DetectionLimit(travel=0.9 - 0.05 * distance, sd=0.03)
    left, slope, root = beyond(at, horizon, 0.04)  # √(0.04² + 0.03²) is 0.05
    with mpmath.workdps(40):

        def chance(mean: mpmath.mpf) -> mpmath.mpf:
            z = (mean - mpmath.mpf(horizon.travel)) / mpmath.mpf("0.05")
            return -mpmath.log(mpmath.ncdf(z))

        value, by_mean, twice = mpmath.taylor(chance, at, 2)
    assert left**2 / 2.0 == pytest.approx(float(value), rel=1e-9)
    assert left * slope == pytest.approx(float(by_mean), rel=1e-9)
    assert root**2 == pytest.approx(2.0 * float(twice), rel=1e-6)


def test_where_everything_is_seen_it_is_students_interval() -> None:
    found, _ = censored(SEEN, [])
    peer = stats.ttest_1samp(SEEN, 0.0)
    interval = peer.confidence_interval(0.95)
    assert (found.value, found.df) == (float(np.mean(SEEN)), len(SEEN) - 1)
    assert found.standard_error == pytest.approx(stats.sem(SEEN), rel=1e-8)
    assert (found.low, found.high) == pytest.approx(tuple(interval), rel=1e-12)


def test_intervals_of_censored_travels_cover_and_those_of_the_seen_do_not() -> None:
    # 100 studies of 12 travels, half of them cut off near their mean. True coverage
    # of 95 % gives fewer than 88 once in 700 times; the seed is fixed. Leaving out what
    # is not seen covers three quarters.
    rng = np.random.default_rng(20)
    covered = plain = 0
    for _ in range(100):
        all_travels = rng.standard_normal(12)
        limits = 0.5 * rng.standard_normal(12)
        ends = all_travels < limits
        if ends.sum() < 2:
            continue
        found, _ = censored(all_travels[ends].tolist(), limits[~ends].tolist())
        covered += found.low <= 0.0 <= found.high
        naive, _ = censored(all_travels[ends].tolist(), [])
        plain += naive.low <= 0.0 <= naive.high
    assert covered >= 88
    assert plain < 86


def test_a_place_nearer_to_the_end_than_a_tie_is_none() -> None:
    assert math.isnan(first_above([-1.0 + 1e-14, 1.0], 0.0, 1.0))
    assert first_above([-1.0 + 1e-12, 1.0], 0.0, 1.0) == pytest.approx(1.0)
    cubic = with_roots(1.0 - 1e-15, 3.0, 4.0)
    assert math.isnan(first_above(cubic, 0.0, 1.0))


def test_between_cuts_where_0_is_touched_there_is_nothing_but_rounding() -> None:
    touching = with_roots(0.3, 0.3)
    for place in split_at_roots(touching, 1.0)[1:-1]:
        assert value(touching, place) == pytest.approx(0.0, abs=1e-14)
    x = first_above([-c for c in touching], 0.0, 1.0)
    assert math.isnan(x) or value(touching, x) == pytest.approx(0.0, abs=1e-14)
