"""What holds for every model of tone: one list of properties, one table of joints."""

from math import inf, nan, radians

import numpy as np
import pytest

from masrel.errors import ParameterError
from masrel.lab.elbow import MODELS, MinimumJerk
from masrel.lab.elbow.tone import Dystonia, ToneModel
from tests.lab.elbow.tone.joints import (
    END,
    JOINTS,
    START,
    m1,
    random_motion,
    stepped,
)

EVERY = pytest.mark.parametrize("model", JOINTS.values(), ids=JOINTS.keys())
KINDS = [law for law in MODELS.values() if issubclass(law, ToneModel)]
EVERY_KIND = pytest.mark.parametrize("law", KINDS, ids=[law.kind for law in KINDS])

OUTSIDE = {
    "positive": (0.0, -1.0),
    "not negative": (-1e-9,),
    "share": (-0.1, 1.1),
    "angle": (-0.1, 3.2),
    "frequency": (0.0, 101.0),
}


def test_every_registered_model_is_tested() -> None:
    tested = {model.kind for model in JOINTS.values()}
    assert {law.kind for law in KINDS} == tested
    assert len(KINDS) == len(MODELS) - 1


@EVERY_KIND
def test_a_parameter_outside_its_range_is_refused_by_name(law: type[ToneModel]) -> None:
    for name, known in law.quantities().items():
        for value in (nan, inf, "much", True, *OUTSIDE[known.needs]):
            with pytest.raises(ParameterError, match=f"^{name}: needs .*got ") as error:
                law(**{name: value})
            assert "\n" not in str(error.value)


@EVERY
def test_no_motion_passes_the_largest_torque(model: ToneModel) -> None:
    rng = np.random.default_rng(1)
    bound = model.largest_torque(start_angle=radians(20), speed=radians(375))
    for _ in range(5):  # minimum jerk peaks at 15/8 of its mean speed
        _, torque, _ = stepped(model, random_motion(rng, range_end=model.range_end))
        assert np.isfinite(torque).all()
        assert np.abs(torque).max() <= bound * (1 + 1e-12)


@EVERY
def test_stepping_converges_to_the_exact_torque(model: ToneModel) -> None:
    motions = [random_motion(np.random.default_rng(seed)) for seed in (5, 6)]
    errors = [0.0, 0.0]
    for motion in motions:
        for i, rate in enumerate((500.0, 4000.0)):
            times, torque, _ = stepped(model, motion, rate)
            exact = model.torque(motion, times)
            errors[i] += float(np.mean(np.abs(torque - exact))) / len(motions)
    assert errors[0] < 0.04
    assert errors[1] <= max(0.75 * errors[0], 1e-9)


@EVERY
def test_the_phase_catch_begins_at_the_catch_event(model: ToneModel) -> None:
    n_catches = 0
    for seed in range(8):
        motion = random_motion(np.random.default_rng(seed))
        times, _, phase = stepped(model, motion)
        begins = times[np.flatnonzero((phase == 1) & (np.roll(phase, 1) != 1))]
        if model.catch_event is None:
            assert isinstance(model, Dystonia) or not begins.size
            continue
        events = [e for e in model.events(motion) if e.name == model.catch_event]
        # one so short that no sample falls into it is not seen
        late = [float(np.min(np.abs(begins - e.time), initial=1.0)) for e in events]
        assert sum(lag > 0.002 for lag in late) <= 0.1 * len(late)
        n_catches += len(events)
    assert n_catches > 5 or model.catch_event is None


@EVERY
def test_events_are_in_order_and_at_their_angles(model: ToneModel) -> None:
    # these end with a reflex on, 25 and 45 a rounding before their duration
    short = MinimumJerk(start=START, end=END, mean_speed=1.3)
    for motion in (
        short,
        *(random_motion(np.random.default_rng(n)) for n in (0, 1, 25, 45)),
    ):
        events = model.events(motion)
        assert [e.time for e in events] == sorted(e.time for e in events)
        for event in events:
            assert 0.0 <= event.time < motion.duration - 1e-12
            assert event.angle == float(motion.angle(event.time))


@EVERY
def test_a_release_gives_up_what_was_triggered(model: ToneModel) -> None:
    motion = m1()
    times = np.arange(1400) / 1000
    joint = model.stepper(motion.start)
    before = 0.0
    angle, velocity = motion.angle(times).tolist(), motion.velocity(times).tolist()
    for sample in zip(times.tolist(), angle, velocity, strict=True):
        before = joint.step(*sample)
    was_triggered = joint.phase
    joint.release()
    assert joint.phase == 0
    for tick in range(1400, 1600):  # the arm is held
        after = joint.step(tick / 1000, angle[-1], 0.0)
        assert joint.phase == 0
        assert after <= before + 1e-9
    if was_triggered and model.kind != "clonus":  # which may be between two beats
        assert after < before


@EVERY
def test_a_passive_joint_never_gives_more_than_it_took(model: ToneModel) -> None:
    # Stored energy at the start is at most what leads the arm to where nothing is.
    if not model.is_passive:
        return
    for seed in range(3):
        motion = random_motion(np.random.default_rng(seed), range_end=model.range_end)
        times, torque, _ = stepped(model, motion, 2000.0)
        angle = motion.angle(times)
        taken = np.cumsum(0.5 * (torque[1:] + torque[:-1]) * np.diff(angle))
        static, grid = [], np.linspace(radians(20), model.range_end, 200)
        for goal in grid:  # the spring alone: what a slow way to anywhere gives
            joint = model.stepper(goal)
            static.append(joint.step(0.0, float(goal), 0.0))
        potential = np.concatenate(
            ([0.0], np.cumsum(np.diff(grid) * 0.5 * np.add(static[1:], static[:-1])))
        )
        stored = float(np.interp(START, grid, potential) - potential.min())
        assert taken.min() >= -stored - 1e-3


@EVERY
def test_a_time_before_the_motion_is_refused(model: ToneModel) -> None:
    for times in ([-0.1], [nan]):
        with pytest.raises(ParameterError, match="times: needs 0 s or later"):
            model.torque(m1(), times)
    assert model.torque(m1(), []).shape == (0,)
    last = model.torque(m1(), [m1().duration, 100.0])
    assert last[0] == last[1]
