"""The line of catch angles: what a plain regression gets wrong, and the clamps."""

import math

import numpy as np
import pytest

from masrel.lab.elbow.identification._catches import Catch
from masrel.lab.elbow.identification._equations import line_row
from masrel.lab.elbow.identification._steps import fit_catch_line, on_the_line
from masrel.lab.elbow.parameters import STANDARD_MODELS

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
    step = fit_catch_line(catches, HM3, level=0.95)
    assert step["catch_slope"].value == pytest.approx(SLOPE, abs=0.03)
    assert plain < SLOPE - 0.03
    assert step["catch_angle_constant"].value == pytest.approx(LINE, abs=0.06)


def test_slow_means_meet_the_catch_where_the_slowest_on_the_line_does() -> None:
    slowest = HM3.slowest_mean_speed
    held = catch(LINE - SLOPE * slowest, 0.6 * slowest, 0.7)
    assert line_row(held, LINE, SLOPE, slowest)[0] == pytest.approx(0.0, abs=1e-15)


def test_catches_at_the_smallest_angle_are_not_on_the_line() -> None:
    catches = caught(np.random.default_rng(3), 8, 0.0)
    fast = HM3.fastest_mean_speed * 1.3
    catches += [catch(HM3.smallest_catch_angle, fast, 0.5)] * 2
    assert on_the_line(catches, HM3).tolist() == [True] * 8 + [False] * 2
    step = fit_catch_line(catches, HM3, level=0.95)
    assert step["catch_slope"].value == pytest.approx(SLOPE, rel=1e-6)
    assert step["catch_slope"].n_trials == 8
