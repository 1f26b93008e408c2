"""Filters, change points and what could be seen of an end: by hand, against numpy."""

import math
from dataclasses import replace

import numpy as np
import pytest

from masrel.lab.elbow import STANDARD_MODELS
from masrel.lab.elbow.identification._catches import (
    Catch,
    Law,
    Part,
    Trial,
    differentiate,
    fast_trial,
    filter_alike,
    find_changes,
    find_stretches,
    state_at_break,
    window_length,
)
from masrel.lab.elbow.identification._steps import detection_limit
from tests.lab.elbow.identification.synthesis import recording

PERIOD = 1e-3
TIME = np.arange(600) * PERIOD


def test_a_cubic_is_kept_with_its_derivatives_up_to_the_ends() -> None:
    cubic = np.polynomial.Polynomial([0.3, 1.0, -2.0, 4.0])
    angle, velocity, acceleration = differentiate(cubic(TIME), PERIOD, 0.06)
    np.testing.assert_allclose(angle, cubic(TIME), atol=1e-12)
    np.testing.assert_allclose(velocity, cubic.deriv()(TIME), atol=1e-9)
    np.testing.assert_allclose(acceleration, cubic.deriv(2)(TIME), atol=1e-6)


def test_speed_at_20_5_hz_comes_out_at_half_its_power() -> None:
    turn = 2.0 * math.pi * 20.5  # as the page on identification has it
    _, velocity, _ = differentiate(np.sin(turn * TIME), PERIOD, 0.06)
    inner = slice(100, 500)
    ratio = velocity[inner] @ np.cos(turn * TIME[inner])
    ratio /= turn * (np.cos(turn * TIME[inner]) @ np.cos(turn * TIME[inner]))
    assert ratio == pytest.approx(math.sqrt(0.5), rel=5e-3)


def test_a_linear_law_survives_filtering_angle_and_torque_alike() -> None:
    # whatever the motion: here one far beyond the filter's bandwidth
    rng = np.random.default_rng(3)
    angle = np.cumsum(np.cumsum(rng.standard_normal(900))) * 1e-5
    law = np.zeros_like(angle)
    law[1:-1] = 1.3 * (angle[2:] - angle[:-2]) / (2 * PERIOD) + 3.0 * angle[1:-1]
    x, v, a, torque = filter_alike(angle[1:-1], law[1:-1], PERIOD, 0.1)
    np.testing.assert_allclose(torque, 1.3 * v + 3.0 * x, atol=1e-10)
    assert a.shape == x.shape


def test_a_break_in_acceleration_does_not_reach_the_speed_before_it() -> None:
    # speed 2 rad/s that falls by 40 rad/s² from 0.3 s on
    late = np.maximum(TIME - 0.3, 0.0)
    angle = 2.0 * TIME - 20.0 * late**2
    _, speed, acceleration = state_at_break(TIME, angle, 0.3)
    assert speed == pytest.approx(2.0, abs=1e-9)
    assert acceleration == pytest.approx(0.0, abs=1e-6)
    smooth = differentiate(angle, PERIOD, 0.06)[1][300]
    assert smooth < 1.95  # what a filter that knows nothing of the break would say


@pytest.mark.parametrize(("window", "length"), [(0.001, 7), (0.006, 7), (0.06, 61)])
def test_a_window_has_samples_enough_for_its_cubic(window: float, length: int) -> None:
    assert window_length(window, PERIOD) == length


N, PEAK = 400, 50
ANGLE = np.linspace(0.5, 2.3, N)
PRE = 3.0 * ANGLE


def search(
    felt: np.ndarray, *, additive: bool = False, pushed: np.ndarray | float = 0.0
) -> tuple[int | None, int | None, float]:
    return find_changes(
        felt,
        PRE[: felt.size],
        ANGLE[: felt.size],
        first=20,
        lengths=(PEAK, 0, 0),
        additive=additive,
        pushed=pushed,
    )


def torque(
    catch: int, end: int | None, *, rise: float = 4.0, residual: float = 2.0
) -> np.ndarray:
    made = PRE.copy()
    made[catch:] = PRE[catch] + rise
    step = catch + PEAK if end is None else min(catch + PEAK, end)
    made[step:] = PRE[catch] + residual
    if end is not None:
        made[end:] += 5.8 * (ANGLE[end:] - ANGLE[end])
    return made


@pytest.mark.parametrize(
    ("catch", "end"), [(120, 260), (120, 190), (150, 185), (90, 330), (200, None)]
)
@pytest.mark.parametrize("noise", [0.0, 0.05])
def test_a_catch_is_found_to_the_sample(
    catch: int, end: int | None, noise: float
) -> None:
    # noise of 0.05 against steps of 2 and 4: a miss of one sample is 40 sd away; the
    # end is a kink, known to a few samples
    rng = np.random.default_rng(5)
    felt = torque(catch, end) + noise * rng.standard_normal(N)
    found = find_changes(
        felt, PRE, ANGLE, first=20, lengths=(PEAK, 0, 0), additive=False
    )
    assert found[0] == catch
    if end is None:
        assert found[1] is None
    else:
        assert found[1] == pytest.approx(end, abs=1 if noise == 0.0 else 8)


def test_no_pair_of_instants_fits_better_than_what_is_found() -> None:
    # the same sum of squares by numpy's lstsq for every pair of a coarser grid
    rng = np.random.default_rng(8)
    felt = torque(120, 230) + 0.3 * rng.standard_normal(N)
    found = find_changes(
        felt, PRE, ANGLE, first=20, lengths=(PEAK, 0, 0), additive=False
    )
    assert found[1] is not None
    assert found[0] is not None
    best = _squares(felt, *found[:2])
    others = [
        _squares(felt, catch, end)
        for catch in range(60, 200, 7)
        for end in range(catch + PEAK + 5, N - 10, 11)
    ]
    assert best < min(others)


def _squares(felt: np.ndarray, catch: int, end: int) -> float:
    # two samples at the end of the peak are left out, as the rule says
    step = catch + PEAK
    place = np.arange(N)
    used = (place < step - 1) | (place > step)
    after = np.where(place >= end, ANGLE - ANGLE[end], 0.0)
    design = np.stack(
        [
            place < catch,
            (place >= catch) & (place < step),
            place >= step,
            after,
        ],
        axis=1,
    ).astype(float)
    target = np.where(place < catch, felt - PRE, felt)
    left = np.linalg.lstsq(design[used], target[used], rcond=None)[1]
    return float(left[0])


def test_the_additive_reading_goes_on_from_the_residual_with_the_law() -> None:
    felt = torque(120, None)
    end = 250
    felt[end:] = PRE[end:] + 2.0 + 5.8 * (ANGLE[end:] - ANGLE[end])
    rng = np.random.default_rng(4)
    felt = felt + 0.05 * rng.standard_normal(N)
    found = find_changes(
        felt, PRE, ANGLE, first=20, lengths=(PEAK, 0, 0), additive=True
    )
    assert found[:2] == (120, end)


def test_an_inertial_torque_after_the_catch_is_told_from_its_climb() -> None:
    # (5) has m·θ̈ where (3) has not: a step down at the end of the catch
    end = 230
    pushed = np.linspace(-2.0, -0.5, N)
    felt = torque(120, end)
    felt[end:] += pushed[end:]
    felt = felt + 0.05 * np.random.default_rng(9).standard_normal(N)
    found = search(felt, pushed=pushed)
    assert found[:2] == (120, end)


def test_neither_noise_nor_a_fall_nor_a_short_stretch_is_a_catch() -> None:
    # A rise of 3 sd of the residuals over 50 samples is 21 standard errors: not in
    # 60 series, nor in 1e50.
    for seed in range(60):
        noise = 0.2 * np.random.default_rng(seed).standard_normal(N)
        found = search(PRE + noise)
        assert found[:2] == (None, None)
    assert search(torque(150, None, rise=-3.0, residual=-3.0))[0] is None
    assert search(PRE[:22])[0] is None


HM2 = STANDARD_MODELS["HM2"]


def trial(n_samples: int, residual_sd: float, speed: float = 1.0) -> Trial:
    """A hand of constant speed, the catch at 1 s and 1 rad, a sample each ms."""
    time = 1.0 + np.arange(n_samples) * 1e-3
    angle = 1.0 + speed * (time - 1.0)
    zero = np.zeros(n_samples)
    part = Part(
        time=time,
        angle=angle,
        velocity=zero + speed,
        acceleration=zero,
        jerk=zero,
        torque=zero,
        measured=zero,
    )
    catch = Catch(
        time=1.0,
        angle=1.0,
        speed=speed,
        acceleration=0.0,
        mean_speed=speed,
        speed_gain=0.0,
        end=None,
        travel=float(angle[-1]) - 1.0,
        mean_catch_speed=speed,
        within_peak=False,
        residual_sd=residual_sd,
    )
    return Trial(
        name="made",
        pace="fast",
        start=0.0,
        duration=float(time[-1]),
        peak_speed=speed,
        rest_angle=1.0,
        pre_catch=part,
        after=part,
        catch=catch,
    )


def test_a_climb_at_constant_speed_by_hand() -> None:
    # After the peak N samples at h = ω·1 ms; the last m + 1 climb 0, h, ..., m·h. The
    # sum of squares about the mean is h²(Σi² - (Σi)²/N), which k_post²/sd² makes the
    # gain: 50 of it are needed, and m·h·k_post ≥ 3 sd.
    k, sd, h, n = 5.8, 0.1, 1e-3, 1000
    made = trial(n, sd)
    after = n - int((made.after.time < 1.0 + HM2.peak_duration).sum())  # type: ignore[union-attr]

    def is_seen(m: int) -> bool:
        i = np.arange(m + 1.0)
        squares = h**2 * (float(i @ i) - float(i.sum()) ** 2 / after)
        t = k * math.sqrt(squares) / sd
        slope_t = 3.0 * math.sqrt(squares) / (m * h)  # a climb of 3 sd, as a t
        return t >= max(math.sqrt(50.0), slope_t)

    least = next(m for m in range(1, after) if is_seen(m))
    found = detection_limit(made, k, HM2)
    assert found is not None
    # candidates are some 4 samples apart, and between them t is taken as straight
    expected = float(made.after.angle[-1]) - 1.0 - least * h  # type: ignore[union-attr]
    assert found.travel == pytest.approx(expected, abs=1.5 * h)
    assert 0.0 < found.sd < 10.0 * h


def test_where_no_end_could_be_seen_there_is_none() -> None:
    assert detection_limit(trial(1000, 1e3), 5.8, HM2) is None  # noise
    assert detection_limit(trial(1000, 0.1), math.nan, HM2) is None  # no k_post
    assert detection_limit(trial(1000, 0.1), -1.0, HM2) is None
    assert detection_limit(trial(20, 0.1), 5.8, HM2) is None  # shorter than its peak
    assert detection_limit(replace(trial(1000, 0.1), after=None), 5.8, HM2) is None
    assert detection_limit(replace(trial(1000, 0.1), catch=None), 5.8, HM2) is None


def test_the_search_finds_ends_before_and_none_behind() -> None:
    # 60 simulated stretches whose catches end 38° to 54° on. Of those further than
    # four softnesses from their horizon, none is on the wrong side; the seed is fixed.
    rng = np.random.default_rng(5)
    law = Law(damping=HM2.damping, stiffness=HM2.stiffness, inertia=HM2.inertia)
    sides = []
    for _ in range(60):
        joint = replace(HM2, catch_travel=math.radians(rng.uniform(38.0, 54.0)))
        movement = recording(
            joint,
            start=math.radians(30.0),
            end=joint.range_end,
            mean_speed=math.radians(rng.uniform(70.0, 130.0)),
            rng=rng,
        )
        (stretch,), _ = find_stretches(
            movement, window=0.06, slow_below=math.radians(20.0)
        )
        made = fast_trial(stretch, "trial", HM2, law, 0.06)
        found = detection_limit(made, HM2.post_catch_stiffness, HM2)
        if made.catch is None or found is None:
            continue
        ahead = (joint.catch_travel - found.travel) / found.sd
        if abs(ahead) > 4.0:
            sides.append((ahead < 0.0, made.catch.end is not None))
    assert len(sides) >= 45
    assert {before for before, _ in sides} == {True, False}
    assert all(before == ends for before, ends in sides)
