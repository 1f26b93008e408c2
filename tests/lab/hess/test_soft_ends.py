"""Every end takes torque away slowly: of post-catch, of a presentation, by a fault."""

import dataclasses
import math
import warnings
from math import radians

import numpy as np
import pytest

from masrel.errors import OverrunWarning
from masrel.lab.elbow import STANDARD_MODELS
from masrel.lab.hess import (
    DeviceLimits,
    EmergencyStop,
    HandTraits,
    HumanHand,
    Presented,
    SimulatedHand,
    StretchRules,
)
from masrel.lab.recording import RAMPS, stretches

from . import faults as f
from .rig import (
    LIMITS,
    MODELS,
    ActingClock,
    controls,
    law_of,
    missing,
    present,
    scripted,
)

POST_CATCH, END, FAULT = (RAMPS.index(name) for name in RAMPS[1:])


def steepest(torque: float, ramp_s: float, rate_hz: int = 1000) -> float:
    """The most that a torque may fall in a tick of its ramp, N·m."""
    if ramp_s == 0.0:
        return math.inf
    return math.pi / 2.0 * abs(torque) / ramp_s / rate_hz + 1e-9


def assert_soft(
    presented: Presented, limits: DeviceLimits = LIMITS, post_catch_s: float = 0.1
) -> int:
    """Hold every fall under a ramp to its bound -> how many ramps there were."""
    columns = presented.recording.columns
    ramp, torque = columns["ramp"], columns["command_torque_nm"]
    starts = np.flatnonzero((np.diff(ramp, prepend=0.0) != 0.0) & (ramp != 0.0))
    lasts = {
        POST_CATCH: post_catch_s,
        END: limits.end_ramp_time,
        FAULT: limits.ramp_time,
    }
    for start in starts:
        code = int(ramp[start])
        end = start + (int(np.argmax(ramp[start:] != code)) or ramp.size - start)
        stands = slice(max(start - 1, 0), end)  # from the torque that stands
        falls = -np.diff(np.abs(torque[stands]))
        if code == FAULT:  # in time: a machine that is away leaves ticks out
            n_ticks = np.round(np.diff(columns["time_s"][stands]) * 1e3)
            falls /= np.maximum(n_ticks, 1.0)
        assert falls.max(initial=0.0) <= steepest(torque[stands][0], lasts[code])
    if presented.recording.n_samples:
        assert torque[-1] == 0.0
    return len(starts)


# One presentation


def test_an_end_on_arrival_is_a_raised_cosine_from_the_torque_that_stands() -> None:
    recording = present().recording
    torque, end = recording.columns["command_torque_nm"], recording.n_presented
    assert recording.facts["ended"] == "arrived"
    stood = torque[end - 1]
    assert stood > 5.0
    # By hand: half of it after 50 ms, a part of (2 - √2)/4 left after 75
    assert torque[end + 49] == pytest.approx(stood / 2.0)
    assert torque[end + 74] == pytest.approx(stood * (2.0 - math.sqrt(2.0)) / 4.0)
    assert torque.size == end + 100
    assert torque[-1] == 0.0
    assert set(recording.columns["ramp"][end:]) == {END}


def test_a_time_limit_in_mid_stretch_ends_softly() -> None:
    presented = present(max_duration_s=0.7)
    recording = presented.recording
    assert (presented.fault, recording.facts["ended"]) == (None, "max-duration")
    assert recording.columns["command_torque_nm"][recording.n_presented - 1] > 8.0
    assert assert_soft(presented) == 1


def test_post_catch_ends_from_the_torque_that_stands_to_that_of_the_law() -> None:
    recording = present("HM4").recording
    columns, ramp = recording.columns, recording.columns["ramp"]
    (rows,) = np.nonzero(ramp == POST_CATCH)
    assert len(rows) == 99  # the hundredth is the law's again
    assert np.all(np.diff(rows) == 1)
    first = rows[0]
    assert columns["phase"][first - 1 : first + 1].tolist() == [2.0, 0.0]
    torque, law = columns["command_torque_nm"], columns["model_torque_nm"]
    assert law[first - 1] - law[first] > 5.0  # the step of Fig. 7
    half = first + 49
    assert torque[half] == pytest.approx((torque[first - 1] + law[half]) / 2.0, abs=0.1)
    assert np.max(-np.diff(torque[first - 1 : rows[-1] + 2])) <= steepest(
        torque[first - 1], 0.1
    )


@pytest.mark.parametrize("model", MODELS)
def test_while_no_ramp_is_active_it_is_the_law_to_the_last_bit(model: str) -> None:
    recording = present(model).recording
    columns = recording.columns
    law = law_of(STANDARD_MODELS[model], recording)
    np.testing.assert_allclose(columns["model_torque_nm"], law, rtol=0.0, atol=1e-9)
    at_once = controls(model, post_catch_ramp=0.0)
    samples = zip(
        columns["time_s"].tolist(),
        np.radians(columns["angle_deg"]).tolist(),
        np.radians(columns["velocity_deg_s"]).tolist(),
        strict=True,
    )
    plain = np.array([at_once.step(*sample) for sample in samples])
    is_plain = columns["ramp"] == 0.0  # degrees in the recording cost the last bits
    off = np.abs(plain - columns["command_torque_nm"])[is_plain]
    assert off.max() <= 1e-9


def test_a_grip_that_is_lost_under_the_ramp_ends_it_at_once() -> None:
    controller = controls("HM4")

    def step(tick: int, angle_deg: float, speed_deg_s: float) -> float:
        return controller.step(tick * 1e-3, radians(angle_deg), radians(speed_deg_s))

    for tick in range(800):  # 30 to 110 deg: beyond the catch, and brake
        step(tick, 30.0 + 0.1 * tick, min(100.0, 10.0 + 2.0 * (800 - tick)))
    stood = step(800, 110.0, 10.0)  # post-catch ends
    assert controller.is_easing
    torque = step(801, 110.0, -100.0)
    assert not controller.is_easing
    assert controller.grip_lost
    assert torque < 0.5 * stood


def test_a_fault_under_the_ramp_of_an_end_ramps_from_there() -> None:
    stop = EmergencyStop()
    _, presented = scripted(
        lambda _time_s: radians(145.0),
        clock=ActingClock({0.15: lambda _: stop.press("test")}),
        limits=dataclasses.replace(LIMITS, standing_torque=20.0),
        max_duration_s=10.0,
        stop=stop,
    )
    columns, fault = presented.recording.columns, presented.fault
    assert fault is not None
    assert fault.kind == "emergency-stop"
    assert presented.recording.facts["ended"] == "fault"
    ramp = columns["ramp"]
    assert set(ramp) == {0.0, END, FAULT}
    assert np.all(np.diff(ramp) >= 0.0)
    assert 0.0 < fault.torque_nm < max(columns["command_torque_nm"])
    assert assert_soft(presented) == 2


def test_ticks_that_are_missed_under_the_ramp_make_it_longer_and_no_steeper() -> None:
    clock = ActingClock(missing({0.75: 0.007}))
    with pytest.warns(OverrunWarning):
        presented = present(clock=clock, max_duration_s=0.7)
    assert presented.n_missed_ticks == 7
    columns = presented.recording.columns
    assert np.count_nonzero(columns["ramp"] == END) == 100
    assert columns["time_s"][-1] == pytest.approx(0.806, abs=1e-6)
    assert assert_soft(presented) == 1


def test_both_may_be_at_once() -> None:
    limits = dataclasses.replace(LIMITS, end_ramp_time=0.0)
    recording = present(controls(post_catch_ramp=0.0), limits=limits).recording
    assert set(recording.columns["ramp"]) == {0.0}
    assert recording.columns["command_torque_nm"][-1] > 5.0


# Random ones


def random_hand(
    rng: np.random.Generator, start: float, end: float, n_stretches: int
) -> SimulatedHand:
    """A clamp or the hand of a person; it may let go."""
    speeds = [radians(speed) for speed in rng.uniform(15.0, 140.0, n_stretches)]
    if n_stretches > 1:
        speeds = [max(speed, radians(60.0)) for speed in speeds]
    slips = float(rng.uniform(0.2, 1.5 * n_stretches)) if rng.random() < 0.15 else None
    way = {"start": start, "end": end, "mean_speed": speeds[0], "again": speeds[1:]}
    way |= {"returns": n_stretches > 1, "slip_time": slips}
    rest, back = float(rng.uniform(0.0, 0.2)), radians(rng.uniform(40.0, 130.0))
    kind = rng.random()
    if kind < 0.5 and n_stretches > 1:
        traits = HandTraits.sample(rng)
        return HumanHand(traits, **way, rest=2.0 * rest, return_speed=back)
    return SimulatedHand(
        **way,
        stiffness=rng.uniform(100.0, 600.0),
        damping=rng.uniform(5.0, 40.0),
        ramp_down=rng.uniform(0.05, 0.3),
        rest=rest,
        return_speed=back,
    )


def random_presentation(seed: int, n_stretches: int = 1) -> tuple[int, int]:
    """Present at random, hold every end to its bound -> its ramps and its stretches."""
    rng = np.random.default_rng([2012, n_stretches, seed])
    longest_s = 1.5 * n_stretches
    gaps = {float(at): 0.004 for at in rng.uniform(0.0, longest_s, rng.integers(0, 3))}
    clock, stop = ActingClock(missing(gaps)), EmergencyStop()
    if rng.random() < 0.1:
        clock.acts[float(rng.uniform(0.1, longest_s))] = lambda _: stop.press("test")
    start, end = radians(rng.uniform(10.0, 80.0)), radians(rng.uniform(110.0, 146.0))
    hand = random_hand(rng, start, end, n_stretches)
    limits = DeviceLimits(
        ramp_time=float(rng.uniform(0.02, 0.1)),
        end_ramp_time=float(rng.uniform(0.05, 0.3)),
    )
    post_catch_s = float(rng.uniform(0.05, 0.3))
    at_s = rng.uniform(0.1, longest_s)
    fault = [
        *(None, None, None, f.dropped(at_s, 3), f.dropped(at_s, 2)),
        *(f.shifted(at_s, f.JUMP), f.frozen(at_s)),
    ][rng.integers(7)]
    model = STANDARD_MODELS[f"HM{rng.integers(1, 5)}"]
    model = dataclasses.replace(model, catch_rise=float(rng.choice([0.0, 0.03])))
    rules = StretchRules(n=n_stretches if rng.random() < 0.5 else None)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", OverrunWarning)
        presented = present(
            controls(model, start_angle=start, post_catch_ramp=post_catch_s),
            hand=hand,
            clock=clock,
            read_fault=fault,
            limits=limits,
            stop=stop,
            end_angle=end,
            stretches=rules if n_stretches > 1 else None,
            max_duration_s=float(rng.uniform(0.2, 2.0)) * longest_s,
        )
    assert_no_catch_ends_at_once(presented)
    n_ramps = assert_soft(presented, limits, post_catch_s)
    return n_ramps, len(stretches(presented.recording))


def assert_no_catch_ends_at_once(presented: Presented) -> None:
    """A ramp begins where a catch or post-catch ends, unless a grip is lost."""
    columns = presented.recording.columns
    phase, ramp = columns["phase"], columns["ramp"]
    ends = np.flatnonzero((phase[:-1] != 0.0) & (phase[1:] == 0.0)) + 1
    if not presented.recording.facts["grip_lost"]:
        assert np.all(ramp[ends] != 0.0)


@pytest.mark.parametrize(
    ("n", "n_stretches"),
    [
        (20, 1),
        (5, 3),
        pytest.param(50, 3, marks=pytest.mark.slow),
        pytest.param(10_000, 1, marks=pytest.mark.long),
        pytest.param(10_000, 3, marks=pytest.mark.long),
    ],
)
def test_random_presentations_end_softly(n: int, n_stretches: int) -> None:
    made = [random_presentation(seed, n_stretches) for seed in range(n)]
    n_ramps, n_made = np.sum(made, axis=0)
    assert n_ramps > 1.1 * n  # hardly one is without an end under torque
    assert n_made > 0.4 * n_stretches * n
