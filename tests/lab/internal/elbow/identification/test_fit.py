"""A joint comes back from its recordings, and what is not in them is said."""

import math
import warnings
from dataclasses import replace

import numpy as np
import pytest

from masrel.errors import (
    ParameterError,
    RecordingError,
    RecordingWarning,
    SmallSampleWarning,
)
from masrel.lab.elbow import (
    STANDARD_MODELS,
    ConstantSpeed,
    ElbowParameters,
    fit,
    trace,
)
from masrel.lab.elbow.identification import ElbowFit, Movement
from masrel.lab.elbow.identification._quantities import QUANTITIES
from tests.lab.elbow.identification.synthesis import Scatter, recording, study

HM2, HM3 = STANDARD_MODELS["HM2"], STANDARD_MODELS["HM3"]
SCATTER = Scatter(
    catch_angle=math.radians(2.0), catch_torque=0.1, catch_travel=math.radians(2.0)
)


def without(movement: Movement, keep: np.ndarray) -> Movement:
    return Movement(
        name=movement.name,
        time=movement.time[keep],
        angle=movement.angle[keep],
        torque=movement.torque[keep],
        simulated=True,
    )


@pytest.fixture(scope="module")
def movements() -> list[Movement]:
    return study(HM3, seed=11, scatter=SCATTER)


@pytest.fixture(scope="module")
def found(movements: list[Movement]) -> ElbowFit:
    return fit(movements)


@pytest.mark.parametrize(
    ("model", "speeds"),
    [("HM2", (95.0, 140.0)), ("HM3", (60.0, 120.0)), ("HM4", (45.0, 90.0))],
)
def test_without_noise_a_joint_comes_back(
    model: str, speeds: tuple[float, float]
) -> None:
    # What is left are the 0.09 degrees of the encoder and the half millisecond by
    # which a sample misses an event: less than 2 % of every parameter.
    joint = STANDARD_MODELS[model]
    made = fit(study(joint, seed=2, noise=0.0, fast=speeds))
    for estimate in made.estimates:
        truth = getattr(joint, estimate.name)
        assert estimate.value == pytest.approx(truth, rel=0.02), estimate.name
    assert made.remarks == () or model == "HM2"


def test_inertia_comes_back() -> None:
    joint = replace(HM3, inertia=0.07)
    made = fit(study(joint, seed=3, noise=0.05), inertia="fitted")
    for estimate in made.estimates:
        truth = getattr(joint, estimate.name)
        assert estimate.value == pytest.approx(truth, rel=0.03), estimate.name
    assert made.joint().inertia == made["inertia"].value


def test_the_other_reading_of_5_comes_back() -> None:
    joint = replace(HM3, post_catch="additive")
    made = fit(study(joint, seed=3, noise=0.05), constants=joint)
    for estimate in made.estimates:
        truth = getattr(joint, estimate.name)
        assert estimate.value == pytest.approx(truth, rel=0.03), estimate.name
    assert made.joint().post_catch == "additive"


def test_slow_trials_are_fitted_as_numpy_fits_them(found: ElbowFit) -> None:
    # step 1 with a dummy column a trial
    slow = [trial.pre_catch for trial in found.trials if trial.pace == "slow"]
    rows = []
    for i, part in enumerate(slow):
        own = np.zeros((part.time.size, len(slow)))
        own[:, i] = 1.0
        rows.append(np.column_stack([part.velocity, part.angle, own]))
    torque = np.concatenate([part.torque for part in slow])
    values = np.linalg.lstsq(np.concatenate(rows), torque, rcond=None)[0]
    step = found.steps[0]
    assert step["damping"].value == pytest.approx(values[0], rel=1e-8)
    assert step["stiffness"].value == pytest.approx(values[1], rel=1e-8)
    law = np.concatenate(rows) @ values
    measured = np.concatenate([part.measured for part in slow])
    error = np.abs(measured - law).mean() / np.abs(measured).mean()
    assert found.relative_error == pytest.approx(float(error), rel=1e-8)


def test_every_trial_is_there_with_what_was_seen_of_it(found: ElbowFit) -> None:
    assert [t.pace for t in found.trials] == ["slow"] * 8 + ["fast"] * 16
    for trial, law in zip(found.trials, found.fitted_torque, strict=True):
        n = trial.pre_catch.time.size
        n += 0 if trial.after is None else trial.after.time.size
        assert law.shape == (n,)
    assert found.torque_sd == pytest.approx(0.1, rel=0.05)  # the noise that was made
    assert found.simulated


def test_the_correlation_is_one(found: ElbowFit) -> None:
    matrix = found.correlation
    np.testing.assert_allclose(np.diag(matrix), 1.0, rtol=1e-12)
    np.testing.assert_allclose(matrix, matrix.T, rtol=1e-9, atol=1e-12)
    assert np.linalg.eigvalsh(matrix).min() > -1e-9
    names = [estimate.name for estimate in found.estimates]
    line = names.index("catch_angle_constant"), names.index("catch_slope")
    assert matrix[line] > 0.9  # a line's height at 0 and its slope


def test_offsets_of_the_torque_sensor_change_nothing(
    movements: list[Movement], found: ElbowFit
) -> None:
    shifted = [
        Movement(
            name=movement.name,
            time=movement.time,
            angle=movement.angle,
            torque=movement.torque + 0.1 * i,
        )
        for i, movement in enumerate(movements)
    ]
    for one, two in zip(found.estimates, fit(shifted).estimates, strict=True):
        assert two.value == pytest.approx(one.value, rel=1e-5)
        assert two.low == pytest.approx(one.low, rel=1e-4)


def test_only_slow_trials_say_what_they_cannot(movements: list[Movement]) -> None:
    made = fit(movements[:8])
    assert made["damping"].value == pytest.approx(HM3.damping, rel=0.05)
    assert made["stiffness"].value == pytest.approx(HM3.stiffness, rel=0.02)
    for name in QUANTITIES:
        if name not in ("damping", "stiffness", "inertia"):
            assert math.isnan(made[name].value)
            assert "only slow stretches" in str(made[name].reason)
    assert len(made.remarks) == 6
    with pytest.raises(ParameterError, match="catch_angle_constant: there are only"):
        made.joint()
    whole = made.joint(missing=HM3)
    assert whole.catch_slope == HM3.catch_slope
    assert whole.damping == made["damping"].value


def test_slow_stretches_at_constant_speeds_do_not_tell_b(
    movements: list[Movement],
) -> None:
    # b·θ̇ is then a constant, which each trial has of its own
    slow = []
    for speed in (6.0, 8.0, 9.0):
        stretch = ConstantSpeed(
            start=math.radians(30), end=math.radians(70), speed=math.radians(speed)
        )
        made = trace(HM3, stretch)
        slow.append(
            Movement(
                name=f"{speed:g}", time=made.time, angle=made.angle, torque=made.torque
            )
        )
    with pytest.raises(RecordingError, match="a speed that varies within a stretch"):
        fit([*slow, *movements[8:]])


def test_a_joint_whose_catch_never_ends_leaves_d_and_k_post_open() -> None:
    made = fit(study(STANDARD_MODELS["HM1"], seed=4))
    assert "no catch ends within its stretch; D is more than" in str(
        made["catch_travel"].reason
    )
    assert "no stretch goes on after" in str(made["post_catch_stiffness"].reason)
    assert made["catch_torque_constant"].covers(1.4)


@pytest.fixture(scope="module")
def outlasting() -> ElbowFit:
    """Thirteen of sixteen catches outlast their stretch."""
    return fit(study(STANDARD_MODELS["HM2"], seed=3, scatter=SCATTER, fast=(70, 130)))


def test_catches_that_outlast_their_stretch_count_as_longer(
    outlasting: ElbowFit,
) -> None:
    made = outlasting["catch_travel"]
    catches = [trial.catch for trial in outlasting.trials if trial.catch is not None]
    seen = [catch.travel for catch in catches if catch.end is not None]
    assert (len(seen), len(catches)) == (3, 16)
    # what was seen to end is short: the truth lies above its mean
    assert np.mean(seen) < HM2.catch_travel
    assert made.value > np.mean(seen) + math.radians(1.0)
    assert made.covers(HM2.catch_travel)
    assert made.high - made.value > made.value - made.low
    assert (made.n_trials, made.df) == (16, 2.0)
    assert made.reason is None
    assert outlasting.remarks == (
        "13 of 16 catches do not end within their stretch: D counts each as longer "
        "than what could be seen of it (censored), and takes travels to be normal",
    )


def test_correlations_hold_where_travels_are_censored(outlasting: ElbowFit) -> None:
    matrix = outlasting.correlation
    assert np.isfinite(matrix).all()
    np.testing.assert_allclose(np.diag(matrix), 1.0, rtol=1e-12)
    assert np.linalg.eigvalsh(matrix).min() > 0.0
    assert (np.abs(matrix) <= 1.0 + 1e-12).all()


def test_censored_travels_have_the_interval_of_their_step(
    outlasting: ElbowFit,
) -> None:
    (step,) = [s for s in outlasting.steps if s.name.startswith("catch travel")]
    assert outlasting["catch_travel"] == step["catch_travel"]


def test_one_catch_that_ends_says_nothing_of_how_travels_differ() -> None:
    movements = study(HM2, seed=3, scatter=SCATTER, fast=(70, 130))
    kept = [m for m in movements if m.name not in ("fast 8", "fast 10")]
    with pytest.warns(SmallSampleWarning, match="^D, k_post: too few trials"):
        made = fit(kept)
    assert math.isnan(made["catch_travel"].low)
    assert not math.isnan(made["catch_travel"].value)
    assert (
        "13 of 14 catches do not end within their stretch and say nothing"
        in " ".join(made.remarks)
    )


def test_one_speed_gives_no_line(movements: list[Movement]) -> None:
    lone = [movements[8], *movements[:8]]
    with pytest.warns(SmallSampleWarning, match="^H, Q, D, k_post: too few trials"):
        made = fit(lone)
    assert "needs catches at mean speeds that differ by 5 deg/s" in str(
        made["catch_slope"].reason
    )
    estimate = made["catch_torque_constant"]
    assert estimate.value == pytest.approx(HM3.catch_torque_constant, rel=0.4)
    assert math.isnan(estimate.standard_error)
    assert estimate.reason is not None


def test_one_slow_trial_has_values_without_intervals(
    movements: list[Movement],
) -> None:
    with pytest.warns(SmallSampleWarning, match="^b, k: too few trials"):
        made = fit(movements[:1])
    assert made["damping"].value == pytest.approx(HM3.damping, rel=0.2)
    assert math.isnan(made["damping"].low)
    assert not made["damping"].covers(HM3.damping)


def test_without_a_slow_trial_it_says_how_fast_the_slowest_is(
    movements: list[Movement],
) -> None:
    with pytest.raises(RecordingError, match=r"below 20 deg/s; the slowest of 16 reac"):
        fit(movements[8:])
    made = fit(movements[:8], slow_below=math.radians(40.0))
    assert len(made.trials) == 8


def test_slow_stretches_of_which_none_can_be_used_are_not_called_fast() -> None:
    slow = study(HM3, seed=5, n_slow=2, n_fast=0)
    with pytest.warns(RecordingWarning, match="the sensor is saturated"):
        stuck = [
            Movement(name=m.name, time=m.time, angle=m.angle, torque=0.0 * m.torque)
            for m in slow
        ]
    with (
        pytest.warns(RecordingWarning, match="missing or saturated; not used"),
        pytest.raises(RecordingError, match="slow stretch; none of 2 can be used"),
    ):
        fit(stuck)


def test_a_saturated_torque_is_left_out_and_said() -> None:
    movements = study(HM3, seed=5)
    fast = movements[8]
    top = 0.8 * float(fast.torque.max())
    with pytest.warns(RecordingWarning, match="the sensor is saturated"):
        cut = Movement(
            name=fast.name,
            time=fast.time,
            angle=fast.angle,
            torque=np.minimum(fast.torque, top),
        )
    with pytest.warns(RecordingWarning, match="fast 0: torque is saturated: nothing"):
        made = fit([*movements[:8], cut, *movements[9:]])
    assert made.trials[8].after is None
    assert made["catch_torque_constant"].n_trials == 15
    assert made["catch_torque_constant"].covers(HM3.catch_torque_constant)


def test_uneven_times_and_short_gaps_change_little_and_long_ones_are_said(
    movements: list[Movement], found: ElbowFit
) -> None:
    rng = np.random.default_rng(6)
    thinned = []
    for movement in movements:
        keep = rng.random(movement.time.size) > 0.2
        thinned.append(without(movement, keep))
    made = fit(thinned)
    for one, two in zip(found.estimates, made.estimates, strict=True):
        half = 0.5 * (one.high - one.low)
        assert abs(two.value - one.value) < half, one.name
    fast = movements[10]
    middle = 0.5 * (fast.time[0] + fast.time[-1])
    gap = np.abs(fast.time - middle) > 0.05
    with pytest.warns(RecordingWarning, match="not used: a gap in the recording"):
        made = fit([*movements[:10], without(fast, gap), *movements[11:]])
    assert made["catch_slope"].n_trials == 15
    slow = movements[0]
    gap = np.abs(slow.time - 0.5 * slow.time[-1]) > 0.05
    with pytest.warns(RecordingWarning, match="samples missing or saturated"):
        made = fit([without(slow, gap), *movements[1:]])
    assert made["damping"].covers(HM3.damping)


def test_a_torque_of_the_wrong_sign_is_noticed(movements: list[Movement]) -> None:
    turned = [
        Movement(name=m.name, time=m.time, angle=m.angle, torque=-m.torque)
        for m in movements[:8]
    ]
    with pytest.raises(
        RecordingError, match=r"this is not the law: b is -1.*are both signs right"
    ):
        fit(turned)


def test_b_below_0_within_its_error_is_a_caution() -> None:
    joint = replace(HM3, damping=0.0)
    with pytest.warns(RecordingWarning, match="^b is negative"):
        made = fit(study(joint, seed=1, noise=0.3, n_slow=4, n_fast=0))
    assert made["damping"].covers(0.0)


def test_a_velocity_that_is_not_the_angles_is_refused(
    movements: list[Movement],
) -> None:
    first = movements[0]
    velocity = np.gradient(first.angle, first.time)
    for factor in (57.3, -1.0):
        wrong = Movement(
            name=first.name,
            time=first.time,
            angle=first.angle,
            torque=first.torque,
            velocity=factor * velocity,
        )
        with pytest.raises(RecordingError, match="times the derivative of the angle"):
            fit([wrong, *movements[1:]])
    right = Movement(
        name=first.name,
        time=first.time,
        angle=first.angle,
        torque=first.torque,
        velocity=velocity,
    )
    assert len(fit([right, *movements[1:]]).trials) == 24


def test_a_recording_of_several_stretches_is_several_trials() -> None:
    rng = np.random.default_rng(7)
    one, _ = recording(HM3, start=0.6, end=1.0, mean_speed=0.1, rng=rng)
    two, _ = recording(HM3, start=0.6, end=1.0, mean_speed=0.12, rng=rng)
    back = np.linspace(1.0, 0.6, 1500)[1:-1]
    joined = Movement(
        name="both",
        time=np.arange(one.time.size + back.size + two.time.size) * 1e-3,
        angle=np.concatenate([one.angle, back, two.angle]),
        torque=np.concatenate([one.torque, -0.1 * back, two.torque]),
    )
    made = fit([joined])
    assert [trial.name for trial in made.trials] == ["both #1", "both #2"]


def test_recordings_without_a_stretch_are_left_out_or_refused() -> None:
    time = np.arange(3000) * 1e-3
    angle = np.where(time < 1.5, 1.5 - 0.5 * time, 0.75)  # only flexion
    idle = Movement(name="idle", time=time, angle=angle, torque=0.1 * angle)
    with (
        pytest.warns(RecordingWarning, match="idle: no extension of 15 degrees"),
        pytest.raises(RecordingError, match="none has an extension of 15 degrees"),
    ):
        fit([idle])


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"level": 1.0}, "level: needs more than 0.5 and less than 1, got 1.0"),
        ({"slow_below": -1.0}, "slow_below: needs more than 0"),
        ({"inertia": "free"}, 'inertia: needs "zero" or "fitted"'),
        (
            {"inertia": "fitted", "constants": replace(HM3, post_catch="additive")},
            'inertia: with post_catch "additive"',
        ),
        (
            {"constants": replace(HM3, residual_reading="decrease")},
            "reads Q as section II does",
        ),
    ],
)
def test_options_outside_their_range_are_refused(
    movements: list[Movement], options: dict[str, object], said: str
) -> None:
    with pytest.raises(ParameterError, match=said):
        fit(movements[:2], **options)  # type: ignore[arg-type]


def test_the_same_recording_twice_is_refused(movements: list[Movement]) -> None:
    with pytest.raises(RecordingError, match="slow 0: the recording is there twice"):
        fit([movements[0], movements[0]])


def test_the_law_is_evaluated_a_few_times_only(found: ElbowFit) -> None:
    # counted, not timed: 24 trials are 13 000 samples of fast stretches
    assert found.n_evaluations <= 50


def test_a_clean_fit_warns_of_nothing(movements: list[Movement]) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        made = fit(movements, level=0.9)
    assert made.level == 0.9
    assert isinstance(made.joint(), ElbowParameters)
