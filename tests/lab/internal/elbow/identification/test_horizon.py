"""How late an end can be and still be seen: by hand, and against the search itself."""

import math
from dataclasses import replace

import numpy as np
import pytest

from masrel.lab.elbow import STANDARD_MODELS
from masrel.lab.elbow.identification._catches import (
    Catch,
    Law,
    Trial,
    fast_trial,
)
from masrel.lab.elbow.identification._steps import detection_limit
from masrel.lab.elbow.identification._stretches import Part, find_stretches
from tests.lab.elbow.identification.synthesis import recording

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
