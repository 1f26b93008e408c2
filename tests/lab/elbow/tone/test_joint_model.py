"""The seam: what every law of the joint offers, and the paper's law as one of them."""

from dataclasses import replace
from itertools import pairwise
from math import radians

import numpy as np
import pytest

from masrel.lab.elbow import (
    MODELS,
    STANDARD_MODELS,
    ConstantSpeed,
    ElbowParameters,
    Joined,
    JointModel,
    MinimumJerk,
    Reversed,
    SampledJoint,
)

START = radians(30)


def stepped(model: JointModel, motion: Joined) -> np.ndarray:
    """Torque at every sample of 1 kHz."""
    joint = model.stepper(motion.start)
    times = np.arange(int(motion.duration * 1000)) / 1000
    samples = zip(times, motion.angle(times), motion.velocity(times), strict=True)
    return np.array([joint.step(*map(float, sample)) for sample in samples])


def test_the_default_kind_is_the_paper_s_elbow() -> None:
    assert next(iter(MODELS)) == "spastic-elbow"
    assert MODELS["spastic-elbow"] is ElbowParameters


def test_models_are_registered_by_their_kind() -> None:
    assert all(model.kind == name for name, model in MODELS.items())


def test_the_paper_s_elbow_is_stepped_as_the_sampled_law() -> None:
    model = STANDARD_MODELS["HM3"]
    stepper, law = model.stepper(START), SampledJoint(model, start_angle=START)
    for i in range(1200):
        sample = (i / 1000, START + 1.6 * i / 1000, 1.6)
        assert stepper.step(*sample) == law.step(*sample)
        assert stepper.phase == law.phase
    assert law.phase == 2


@pytest.mark.parametrize("name", STANDARD_MODELS)
@pytest.mark.parametrize("post_catch", ["continuous", "additive"])
def test_no_stretch_passes_the_largest_torque(name: str, post_catch: str) -> None:
    model = replace(STANDARD_MODELS[name], post_catch=post_catch)
    shares = []
    for degrees in (25, 60, 92, 131, 200, 300):
        speed, end = radians(degrees), model.range_end
        there = ConstantSpeed(start=START, end=end, speed=speed)
        gentle = MinimumJerk(start=START, end=end, mean_speed=speed * 8 / 15)
        slow = ConstantSpeed(start=START, end=end - 0.1, speed=radians(15))
        late = Joined([slow, ConstantSpeed(start=end - 0.1, end=end, speed=speed)])
        bound = model.largest_torque(start_angle=START, speed=speed)
        for stretch in (there, gentle, late):
            motion = Joined([stretch, Reversed(motion=stretch)])
            shares.append(float(abs(stepped(model, motion)).max()) / bound)
    assert max(shares) <= 1.0
    assert max(shares) > 0.8  # a bound that is reached, more or less


def test_a_catch_at_the_smallest_angle_may_be_after_that_of_a_slow_stretch() -> None:
    # nu_L is above nu_H: slower than nu_H it catches at L - 0.35 · 2 = 0.8, else at 1.4
    model = ElbowParameters(
        catch_angle_constant=1.5,
        catch_torque_constant=20.0,
        residual_ratio=0.0,
        catch_travel=1.0,
        slowest_mean_speed=2.0,
        smallest_catch_angle=1.4,
        post_catch_stiffness=0.0,
    )
    stretch = ConstantSpeed(start=START, end=2.0, speed=1.0)
    torque = stepped(model, Joined([stretch]))
    assert torque.max() > 21.26 + 3.15 * (1.4 - START)
    assert torque.max() <= model.largest_torque(start_angle=START, speed=1.0)


def test_no_sample_is_steeper_than_the_largest_slope() -> None:
    model = STANDARD_MODELS["HM2"]
    over_angle, over_velocity = model.largest_slope(speed=2.0)
    motion = MinimumJerk(start=START, end=model.range_end, mean_speed=0.18)  # no catch
    times = np.arange(int(motion.duration * 1000)) / 1000
    torque, angle = stepped(model, motion), motion.angle(times)
    speed = motion.velocity(times)
    for (t1, t2), (a1, a2), (v1, v2) in zip(
        pairwise(torque), pairwise(angle), pairwise(speed), strict=True
    ):
        limit = over_angle * abs(a2 - a1) + over_velocity * abs(v2 - v1)
        assert abs(t2 - t1) <= limit * (1 + 1e-9) + 1e-12
