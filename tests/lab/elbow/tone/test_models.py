"""What holds for every model of tone: one list of properties, one table of joints."""

import dataclasses
import inspect
import re
from math import inf, nan, radians

import numpy as np
import pytest

from masrel.errors import ParameterError
from masrel.lab.elbow import MODELS, ConstantSpeed, Hold, Joined, MinimumJerk, Motion
from masrel.lab.elbow._motion import Piece, piece_of
from masrel.lab.elbow.tone import Dystonia, LeadPipe, ToneModel
from tests.lab.elbow.tone.joints import (
    END,
    JOINTS,
    START,
    m1,
    random_motion,
    stepped,
    work_of_a_cycle,
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
def test_the_defaults_are_a_valid_joint(law: type[ToneModel]) -> None:
    assert law().kind == law.kind
    assert dataclasses.replace(law()) == law()


@EVERY_KIND
def test_a_parameter_outside_its_range_is_refused_by_name(law: type[ToneModel]) -> None:
    for name, known in law.quantities().items():
        for value in (nan, inf, "much", True, *OUTSIDE[known.needs]):
            with pytest.raises(ParameterError, match=f"^{name}: needs .*got ") as error:
                law(**{name: value})
            assert "\n" not in str(error.value)


@EVERY_KIND
def test_numbers_far_out_of_a_joint_give_a_torque_all_the_same(
    law: type[ToneModel],
) -> None:
    for name, known in law.quantities().items():
        for value in (1e-300, 1e300):
            if known.needs in ("share", "angle", "frequency") and value > 1.0:
                continue
            try:
                model = law(**{name: value})
            except ParameterError:  # with the others it makes no sense
                continue
            _, torque, _ = stepped(model, m1(), 100.0)
            assert not np.isnan(torque).any(), name
            assert model.events(m1()) is not None


@EVERY_KIND
def test_a_value_of_no_source_is_said_to_be_our_choice(law: type[ToneModel]) -> None:
    text = inspect.cleandoc(law.__doc__ or "")
    attributes = text.split("Attributes\n----------\n")[1].split("\n\nRaises")[0]
    entries = re.split(r"\n(?=\w)", attributes)
    for name, known in law.quantities().items():
        (entry,) = (e for e in entries if name in e.split(" :")[0].split(", "))
        is_marked = "choice of ours, not from a source" in re.sub(r"\s+", " ", entry)
        assert is_marked == known.is_choice, name


@EVERY
def test_no_motion_passes_the_largest_torque(model: ToneModel) -> None:
    rng = np.random.default_rng(1)
    bound = model.largest_torque(start_angle=radians(20), speed=radians(375))
    for _ in range(5):  # minimum jerk peaks at 15/8 of its mean speed
        _, torque, _ = stepped(model, random_motion(rng, range_end=model.range_end))
        assert np.isfinite(torque).all()
        assert np.abs(torque).max() <= bound * (1 + 1e-12)


@EVERY
def test_the_largest_torque_is_not_much_more_than_is_reached(model: ToneModel) -> None:
    speed = radians(100)
    there = ConstantSpeed(start=START, end=model.range_end, speed=speed)
    held = Joined([there, Hold(start=model.range_end, duration=2.0)])
    _, torque, _ = stepped(model, held)
    assert torque.max() > 0.45 * model.largest_torque(start_angle=START, speed=speed)


@EVERY
def test_no_sample_is_steeper_than_the_largest_slope(model: ToneModel) -> None:
    if isinstance(model, Dystonia):
        model = dataclasses.replace(model, episode_duration=0.0)
    if not model.is_passive and model.catch_event is None:
        return  # it changes in time
    stretch = ConstantSpeed(start=START, end=radians(80), speed=radians(8))
    times, torque, _ = stepped(model, stretch)
    over_angle, _ = model.largest_slope(speed=radians(8))
    travel = np.diff(stretch.angle(times))
    assert np.all(np.abs(np.diff(torque)) <= over_angle * travel + 1e-9)


@EVERY
def test_time_may_begin_anywhere(model: ToneModel) -> None:
    motion = m1()
    times, torque, _ = stepped(model, motion)
    joint = model.stepper(motion.start)
    samples = zip(
        (times + 7.0).tolist(),
        motion.angle(times).tolist(),
        motion.velocity(times).tolist(),
        strict=True,
    )
    later = np.array([joint.step(*sample) for sample in samples])
    # a latch or a gap may close one sample later, by rounding
    assert np.mean(np.abs(later - torque) > 1e-9) < 0.01


@EVERY
def test_a_missed_tick_is_survived(model: ToneModel) -> None:
    motion = random_motion(np.random.default_rng(3))
    rng = np.random.default_rng(4)
    times = np.arange(int(motion.duration * 1000)) / 1000
    times = times[rng.random(times.size) > 0.05]
    joint = model.stepper(motion.start)
    angle, velocity = motion.angle(times).tolist(), motion.velocity(times).tolist()
    samples = zip(times.tolist(), angle, velocity, strict=True)
    assert all(np.isfinite(joint.step(*sample)) for sample in samples)


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


class Wave(Motion):
    """60 deg and a cubic in time on it, one piece that turns twice."""

    start, end, duration = radians(60), radians(60), 6.0

    def pieces(self) -> list[Piece]:
        # 300·x·(x - 1/2)·(x - 1) deg, x = t/6
        cubic = (0.0, radians(25), -radians(12.5), radians(300) / 216)
        return [piece_of(0.0, self.duration, cubic)]


def test_a_piece_may_turn() -> None:
    model, motion = LeadPipe.of_updrs(3), Wave()
    times, torque, _ = stepped(model, motion, 2000.0)
    assert np.abs(torque - model.torque(motion, times)).max() < 1e-3
    assert [e.name for e in model.events(motion)] == ["slip", "stick"] * 2 + ["slip"]


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
def test_what_is_released_stays_so_while_the_stretch_goes_on(model: ToneModel) -> None:
    joint, speed = model.stepper(START), radians(150)
    samples = iter([(i / 1000, START + speed * i / 1000, speed) for i in range(600)])
    for sample in samples:
        joint.step(*sample)
        if joint.phase:
            break
    joint.release()
    for sample in samples:
        joint.step(*sample)
        assert joint.phase == 0


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
def test_work_of_a_cycle(model: ToneModel) -> None:
    """Not below 0 unless the law is active by nature."""
    if model.kind in ("clonus", "dystonia") or model is JOINTS["stiffening"]:
        return
    for rate_hz in (0.5, 1.0, 3.0):
        assert work_of_a_cycle(model, rate_hz, 1000) >= 0.0


def test_the_reflex_that_stiffens_gives_energy_in_a_cycle() -> None:
    assert work_of_a_cycle(JOINTS["stiffening"], 5.0) < -0.5


@EVERY
def test_a_time_before_the_motion_is_refused(model: ToneModel) -> None:
    for times in ([-0.1], [nan]):
        with pytest.raises(ParameterError, match="times: needs 0 s or later"):
            model.torque(m1(), times)
    assert model.torque(m1(), []).shape == (0,)
    last = model.torque(m1(), [m1().duration, 100.0])
    assert last[0] == last[1]
