"""Many scenes at once: what one scene gives, only what is asked, bounded memory."""

from dataclasses import replace
from math import isnan

import numpy as np
import pytest

from masrel.lab.elbow import (
    STANDARD_MODELS,
    Columns,
    ConstantSpeed,
    ElbowParameters,
    MinimumJerk,
    Motion,
    Trapezoid,
    evaluate,
    events,
    impulse,
    peak_torque,
    residual_torque,
    work,
)
from tests.lab.elbow.scenes import KINDS, random_scene
from tests.lab.elbow.stretches import constant

HM3 = STANDARD_MODELS["HM3"]
ANGLES = ("catch_angle", "catch_speed", "mean_speed")
EVENTS = ("onset", "catch", *ANGLES, "peak_end", "catch_end", "post_catch_end", "end")
FUNCTIONS = {
    "peak_torque": peak_torque,
    "residual_torque": residual_torque,
    "work": work,
    "impulse": impulse,
}
LOADS = tuple(FUNCTIONS)


def drawn(
    kind: str, n: int, *, wide: bool, plain: bool = False
) -> tuple[list[ElbowParameters], list[Motion]]:
    """Random scenes; `plain` ones without inertia or a smoothed onset."""
    found = []
    for seed in range(3 * n):
        rng = np.random.default_rng([seed, KINDS.index(kind), 11])
        joint, motion = random_scene(rng, kind, wide=wide)
        if plain:
            joint = replace(joint, inertia=0.0, catch_rise=0.0)
        if motion.start < joint.range_end:
            found.append((joint, motion))
    joints, motions = zip(*found[:n], strict=True)
    return list(joints), list(motions)


def same(one: float, other: float | None, size: float) -> bool:
    # to some units in the last place of the time, angle or speed
    return isnan(one) if other is None else abs(one - other) <= 1e-12 * size


@pytest.mark.parametrize("wide", [False, True])
@pytest.mark.parametrize(
    "kind", ["constant", "minimum jerk", "trapezoid", "interrupted"]
)
def test_events_are_those_of_one_scene_to_rounding(kind: str, wide: bool) -> None:
    joints, motions = drawn(kind, 150, wide=wide)
    table = evaluate(joints, motions, EVENTS)
    assert table.n_alone == (150 if kind == "interrupted" else 0)
    for i, (joint, motion) in enumerate(zip(joints, motions, strict=True)):
        found = events(joint, motion)
        for name in EVENTS:
            value = table.column(name)[i]
            size = max(value, 1.0) if name in ANGLES else motion.duration
            assert same(value, getattr(found, name), size), (i, name)


@pytest.mark.parametrize("kind", ["constant", "minimum jerk", "trapezoid"])
def test_torques_and_integrals_are_those_of_one_scene(kind: str) -> None:
    joints, motions = drawn(kind, 120, wide=False)
    table = evaluate(joints, motions, LOADS)
    for name, function in FUNCTIONS.items():
        expected = [
            function(joint, motion)
            for joint, motion in zip(joints, motions, strict=True)
        ]
        # sums of up to seven terms that may cancel: 1e-12 of the largest in a study; a
        # smoothed onset is as steep as H·v_c over its time, which is rounded
        steep = [1e-12 + (1e-14 / j.catch_rise if j.catch_rise else 0) for j in joints]
        found = table.column(name)
        assert np.isnan(found).tolist() == np.isnan(expected).tolist()
        assert (np.nan_to_num(np.abs(found - expected)) <= steep).all()


def test_slow_stretches_turn_where_one_by_one_they_do() -> None:
    # pre-catch to the end, its torque a quintic that turns twice
    speeds = np.radians(np.random.default_rng(1).uniform(2.0, 9.0, 50))
    many = Columns(MinimumJerk, start=0.5, end=2.5, mean_speed=speeds)
    table = evaluate(HM3, many, LOADS)
    each = [evaluate(HM3, many.row(i), LOADS).values[0] for i in range(50)]
    assert table.n_alone == 0
    assert table.values == pytest.approx(np.array(each), rel=1e-14, nan_ok=True)


def test_one_joint_for_many_motions_and_one_motion_for_many_joints() -> None:
    speeds = [constant(speed) for speed in (70.0, 92.0)]
    table = evaluate(HM3, speeds, ["catch_angle"])
    assert np.degrees(table.column("catch_angle")) == pytest.approx([90.5, 82.8])
    models = list(STANDARD_MODELS.values())
    table = evaluate(models, constant(92.0), ["catch_angle"])
    expected = [97.8, 87.8, 82.8, 77.8]  # L - 0.35 · 92
    assert np.degrees(table.column("catch_angle")) == pytest.approx(expected)
    assert evaluate(HM3, constant(92.0)).values.shape == (1, 2)


# Columns


@pytest.mark.parametrize("kind", [ConstantSpeed, MinimumJerk, Trapezoid])
def test_columns_are_their_rows(kind: type) -> None:
    rng = np.random.default_rng(3)
    joints = Columns(
        ElbowParameters,
        catch_angle_constant=rng.uniform(1.9, 2.3, 40),
        catch_torque_constant=rng.uniform(1.4, 3.8, 40),
        residual_ratio=0.3,
        catch_travel=rng.uniform(0.2, 1.0, 40),
        inertia=rng.choice([0.0, 0.1], 40),
        rest_angle=rng.choice([np.nan, 0.4], 40),
        post_catch=rng.choice(["continuous", "additive"], 40),
        residual_reading=rng.choice(["residual", "decrease"], 40),
        catch_rise=rng.choice([0.0, 0.05], 40),
    )
    name = "mean_speed" if kind is MinimumJerk else "speed"
    rates = {name: rng.uniform(0.3, 2.4, 40)}
    if kind is Trapezoid:
        rates["acceleration_rate"] = 10.0
    motions = Columns(kind, start=0.5, end=rng.uniform(2.0, 2.6, 40), **rates)
    table = evaluate(joints, motions, (*EVENTS, *LOADS))
    rows = [joints.row(i) for i in range(40)], [motions.row(i) for i in range(40)]
    for i, (joint, motion) in enumerate(zip(*rows, strict=True)):
        alone = evaluate(joint, motion, (*EVENTS, *LOADS))
        assert table.values[i] == pytest.approx(
            alone.values[0], rel=1e-12, nan_ok=True
        ), i
    objects = evaluate(*rows, (*EVENTS, *LOADS))
    assert objects.values == pytest.approx(table.values, rel=1e-14, nan_ok=True)


# Refused
