"""A joint comes back from its recordings, and what is not in them is said."""

import math
import warnings
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from masrel.errors import (
    ParameterError,
    RecordingError,
    RecordingWarning,
    SmallSampleWarning,
)
from masrel.lab.elbow import STANDARD_MODELS, fit
from masrel.lab.elbow.identification import ElbowFit, Movement
from tests.lab.elbow.identification.synthesis import (
    HM2,
    HM3,
    HM4,
    NAMES,
    SCATTER,
    recording,
    study,
)


def part_of(movement: Movement, keep: np.ndarray) -> Movement:
    columns = ("time", "angle", "torque")
    return replace(
        movement, **{name: getattr(movement, name)[keep] for name in columns}
    )


@pytest.fixture(scope="module")
def movements() -> list[Movement]:
    return study(HM3, seed=11, scatter=SCATTER)


@pytest.fixture(scope="module")
def found(movements: list[Movement]) -> ElbowFit:
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # a clean fit warns of nothing
        return fit(movements)


def test_an_angle_that_is_late_is_put_right(
    movements: list[Movement], found: ElbowFit
) -> None:
    late = [
        replace(m, angle=np.interp(m.time - 0.005, m.time, m.angle)) for m in movements
    ]
    right = fit(late, lag=-0.005)
    for name in NAMES:
        assert right[name].value == pytest.approx(found[name].value, rel=0.01)
    wrong = fit(late)
    assert wrong["catch_slope"].value != pytest.approx(
        found["catch_slope"].value, rel=0.03
    )
    assert wrong.lack_of_fit.sentence.endswith("try --lag fitted.")
    # and the search finds by how much
    searched = fit(late, lag="fitted")
    assert searched["lag"].value == pytest.approx(-0.005, abs=0.001)
    assert searched["lag"].low < -0.004
    for name in NAMES:
        assert searched[name].value == pytest.approx(found[name].value, rel=0.01)


@pytest.mark.parametrize(
    ("joint", "noise", "options", "within"),
    [
        # What is left are the 0.09 degrees of the encoder and the half millisecond by
        # which a sample misses an event: less than 2 % of every parameter.
        (HM2, 0.0, {"fast": (95.0, 140.0)}, 0.02),
        (HM3, 0.0, {}, 0.02),
        (HM4, 0.0, {"fast": (45.0, 90.0)}, 0.02),
        (replace(HM3, inertia=0.07), 0.05, {}, 0.03),
        (replace(HM3, post_catch="additive"), 0.05, {}, 0.03),
    ],
)
def test_a_joint_comes_back(
    joint: Any, noise: float, options: dict[str, Any], within: float
) -> None:
    inertia = "fitted" if joint.inertia else "zero"
    constants = replace(HM3, post_catch=joint.post_catch)
    movements = study(joint, seed=3 if noise else 2, noise=noise, **options)
    made = fit(movements, constants=constants, inertia=inertia)
    for estimate in made.estimates:
        truth = getattr(joint, estimate.name)
        assert estimate.value == pytest.approx(truth, rel=within), estimate.name
    assert made.joint().inertia == (made["inertia"].value if joint.inertia else 0.0)
    assert made.joint().post_catch == joint.post_catch


def test_slow_trials_are_fitted_as_numpy_fits_them(found: ElbowFit) -> None:
    # step 1 with a dummy column a trial
    slow = [trial.pre_catch for trial in found.trials if trial.stretch.pace == "slow"]
    which = np.repeat(np.arange(len(slow)), [part.time.size for part in slow])
    speed, angle, torque, measured = (
        np.concatenate([getattr(part, name) for part in slow])
        for name in ("velocity", "angle", "torque", "measured")
    )
    design = np.column_stack([speed, angle, np.eye(len(slow))[which]])
    values = np.linalg.lstsq(design, torque, rcond=None)[0]
    step = found.steps[0]
    assert step["damping"].value == pytest.approx(values[0], rel=1e-8)
    assert step["stiffness"].value == pytest.approx(values[1], rel=1e-8)
    error = np.abs(measured - design @ values).mean() / np.abs(measured).mean()
    assert found.relative_error == pytest.approx(float(error), rel=1e-8)


def test_only_slow_trials_say_what_they_cannot(movements: list[Movement]) -> None:
    made = fit(movements[:8])
    assert made["damping"].value == pytest.approx(HM3.damping, rel=0.05)
    for name in NAMES[2:]:
        assert math.isnan(made[name].value)
        assert "only slow stretches" in str(made[name].reason)
    assert len(made.remarks) == 6
    with pytest.raises(ParameterError, match="catch_angle_constant: there are only"):
        made.joint()


def test_a_joint_whose_catch_never_ends_leaves_d_and_k_post_open() -> None:
    made = fit(study(STANDARD_MODELS["HM1"], seed=4))
    assert "no catch ends within its stretch; D is more than" in str(
        made["catch_travel"].reason
    )
    assert "no stretch continues after" in str(made["post_catch_stiffness"].reason)
    assert made["catch_torque_constant"].covers(1.4)


def test_catches_that_outlast_their_stretch_count_as_longer() -> None:
    found = fit(study(HM2, seed=3, scatter=SCATTER, fast=(70, 130)))
    made = found["catch_travel"]
    catches = [trial.catch for trial in found.trials if trial.catch is not None]
    seen = [catch.travel for catch in catches if catch.end is not None]
    assert (len(seen), len(catches)) == (3, 16)
    # what was seen to end is short: the truth lies above its mean
    assert np.mean(seen) < HM2.catch_travel
    assert made.value > np.mean(seen) + math.radians(1.0)
    assert made.covers(HM2.catch_travel)
    assert made.high - made.value > made.value - made.low
    assert (made.n_trials, made.df, made.reason) == (16, 2.0, None)
    assert found.remarks == (
        "13 of 16 catches do not end within their stretch: D counts each as longer "
        "than was recorded (censored), and assumes that travels are normally "
        "distributed",
    )
    (step,) = [s for s in found.steps if s.name.startswith("catch travel")]
    assert made == step["catch_travel"]


def test_one_fast_trial_or_one_slow_one_has_values_without_intervals(
    movements: list[Movement],
) -> None:
    with pytest.warns(SmallSampleWarning, match="^H, Q, D, k_post: too few trials"):
        made = fit([movements[8], *movements[:8]])
    words = "needs catches at mean speeds that differ by 5 deg/s"
    assert words in str(made["catch_slope"].reason)
    height = made["catch_torque_constant"]
    assert height.value == pytest.approx(HM3.catch_torque_constant, rel=0.4)
    assert math.isnan(height.standard_error)
    with pytest.warns(SmallSampleWarning, match="^b, k: too few trials"):
        made = fit(movements[:1])
    assert made["damping"].value == pytest.approx(HM3.damping, rel=0.2)
    assert not made["damping"].covers(HM3.damping)


def test_b_below_0_within_its_error_is_a_caution() -> None:
    joint = replace(HM3, damping=0.0)
    with pytest.warns(RecordingWarning, match="^b is negative"):
        made = fit(study(joint, seed=1, noise=0.3, n_slow=4, n_fast=0))
    assert made["damping"].covers(0.0)


def wrong_velocity(movements: list[Movement]) -> list[Movement]:
    first = movements[0]
    velocity = np.gradient(first.angle, first.time)
    fit([replace(first, velocity=velocity), *movements[1:8]])  # which is right
    return [replace(first, velocity=57.3 * velocity), *movements[1:]]


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda m: m[8:], "below 20 deg/s; the slowest of 16 reac"),
        (wrong_velocity, "times the derivative of the angle"),
        (lambda m: [m[0], m[0]], "slow 0: the recording was given twice"),
        (
            lambda m: [replace(x, torque=-x.torque) for x in m[:8]],
            "the law does not apply: b is -1.*are both signs right",
        ),
    ],
)
def test_what_cannot_be_fitted_is_refused(
    movements: list[Movement], change: Any, said: str
) -> None:
    with pytest.raises(RecordingError, match=said):
        fit(change(movements))


def test_slow_stretches_of_which_none_can_be_used_are_not_called_fast() -> None:
    slow = study(HM3, seed=5, n_slow=2, n_fast=0)
    with pytest.warns(RecordingWarning, match="the sensor is saturated"):
        stuck = [replace(m, torque=0.0 * m.torque) for m in slow]
    with (
        pytest.warns(RecordingWarning, match="missing or saturated; not used"),
        pytest.raises(RecordingError, match="slow stretch; none of 2 can be used"),
    ):
        fit(stuck)


def test_a_saturated_torque_is_left_out_and_said() -> None:
    movements = study(HM3, seed=5)
    torque = movements[8].torque
    with pytest.warns(RecordingWarning, match="the sensor is saturated"):
        cut = replace(movements[8], torque=np.minimum(torque, 0.8 * torque.max()))
    with pytest.warns(RecordingWarning, match="fast 0: torque is saturated: nothing"):
        made = fit([*movements[:8], cut, *movements[9:]])
    assert made.trials[8].after is None
    assert made["catch_torque_constant"].n_trials == 15
    assert made["catch_torque_constant"].covers(HM3.catch_torque_constant)


def test_uneven_times_and_short_gaps_change_little_and_long_ones_are_said(
    movements: list[Movement], found: ElbowFit
) -> None:
    rng = np.random.default_rng(6)
    made = fit([part_of(m, rng.random(m.time.size) > 0.2) for m in movements])
    for one, two in zip(found.estimates, made.estimates, strict=True):
        assert abs(two.value - one.value) < 0.5 * (one.high - one.low), one.name

    def without_middle(place: int) -> list[Movement]:
        time = movements[place].time
        keep = np.abs(time - 0.5 * (time[0] + time[-1])) > 0.05
        left = part_of(movements[place], keep)
        return [*movements[:place], left, *movements[place + 1 :]]

    with pytest.warns(RecordingWarning, match="not used: a gap in the recording"):
        made = fit(without_middle(10))
    assert made["catch_slope"].n_trials == 15
    with pytest.warns(RecordingWarning, match="samples missing or saturated"):
        made = fit(without_middle(0))
    assert made["damping"].covers(HM3.damping)


def test_a_recording_of_several_stretches_is_several_trials() -> None:
    rng = np.random.default_rng(7)
    one = recording(HM3, start=0.6, end=1.0, mean_speed=0.1, rng=rng)
    two = recording(HM3, start=0.6, end=1.0, mean_speed=0.12, rng=rng)
    back = np.linspace(1.0, 0.6, 1500)[1:-1]
    joined = Movement(
        name="both",
        time=np.arange(one.time.size + back.size + two.time.size) * 1e-3,
        angle=np.concatenate([one.angle, back, two.angle]),
        torque=np.concatenate([one.torque, -0.1 * back, two.torque]),
    )
    assert [trial.stretch.name for trial in fit([joined]).trials] == [
        "both #1",
        "both #2",
    ]


def test_recordings_without_a_stretch_are_left_out_or_refused() -> None:
    time = np.arange(3000) * 1e-3
    angle = np.where(time < 1.5, 1.5 - 0.5 * time, 0.75)  # only flexion
    idle = Movement(name="idle", time=time, angle=angle, torque=0.1 * angle)
    with (
        pytest.warns(RecordingWarning, match="idle: no extension of 15 degrees"),
        pytest.raises(RecordingError, match="none has an extension of 15 degrees"),
    ):
        fit([idle])


# 5 studies of 8 parameters: at 95 % coverage 2 of 40 miss on average. Were they
# independent, 8 or more would miss once in 1000 times. 200 studies: an interval of true
# coverage 95 % is within 180 to 196 but once in 200 times. Seeds are fixed, so that
# this is a statement about the method.
CASES: dict[str, tuple[Any, dict[str, Any]]] = {
    "scattered": (HM3, {"scatter": SCATTER}),
    "exact": (HM3, {}),
    # two thirds of the catches outlast their stretch; leaving those out, D covers 89 %,
    # and travels are too short
    "outlasting": (HM2, {"scatter": SCATTER, "fast": (70.0, 130.0)}),
}


# A hand that wobbles above the threshold now and then makes a slow stretch one whose
# catch is not seen; in one study a single catch ends: no interval of D and k_post.
@pytest.mark.filterwarnings("ignore:slow .* no catch stands out")
@pytest.mark.filterwarnings("ignore:D, k_post. too few trials")
@pytest.mark.parametrize(
    ("case", "n", "fewest", "most_missed"),
    [
        ("scattered", 5, 2, 7),
        pytest.param("outlasting", 5, 2, 7, marks=pytest.mark.slow),
        *(pytest.param(c, 200, 180, 1600, marks=pytest.mark.long) for c in CASES),
    ],
)
def test_intervals_cover_as_often_as_they_say(
    case: str, n: int, fewest: int, most_missed: int
) -> None:
    joint, options = CASES[case]
    held = np.array(
        [
            [made[name].covers(getattr(joint, name)) for name in NAMES]
            for made in (
                fit(study(joint, seed=seed, **options))
                for seed in range(1000, 1000 + n)
            )
        ]
    )
    counts = held.sum(axis=0)
    assert (counts >= fewest).all(), counts
    assert (~held).sum() <= most_missed, counts
    assert n < 200 or (counts <= 196).all(), counts
