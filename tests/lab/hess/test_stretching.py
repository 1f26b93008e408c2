"""Many stretches in one presentation: when each begins and ends, and when all does."""

from math import radians

import numpy as np
import pytest

from masrel.lab.elbow import STANDARD_MODELS
from masrel.lab.hess import (
    HandTraits,
    HumanHand,
    PresentationStatus,
    Presented,
    SimulatedHand,
    StretchRules,
)
from masrel.lab.recording import stretches

from .rig import CATCH, END, START, law_of, path, present, scripted

SPEEDS = (radians(92.0), radians(60.0), radians(110.0))
WAY = {"start": START, "end": END, "mean_speed": SPEEDS[0], "again": SPEEDS[1:]}
BACK = {**WAY, "returns": True}


def shown(hand: SimulatedHand | None = None, n: int | None = 3, **options) -> Presented:
    rules = StretchRules(n=n, time_limit=options.pop("time_limit", 60.0))
    return present(hand=hand or SimulatedHand(**BACK), stretches=rules, **options)


def led(points_deg: list[tuple[float, float]], **options) -> Presented:
    rules = {"n": None, "time_limit": 60.0, "stretch_limit": 20.0}
    rules = StretchRules(**{name: options.pop(name, rules[name]) for name in rules})
    options = {"end_angle": END, "max_duration_s": None, **options}
    return scripted(path(points_deg), "HM1", stretches=rules, **options)[1]


def test_the_law_and_the_column_go_on_through_all_of_them() -> None:
    many = shown().recording
    columns = many.columns
    law = law_of(STANDARD_MODELS["HM3"], many)
    np.testing.assert_allclose(columns["model_torque_nm"], law, rtol=0.0, atol=1e-9)
    one = present().recording
    for name, column in one.columns.items():
        n_rows = one.n_presented
        np.testing.assert_array_equal(columns[name][:n_rows], column[:n_rows])
    assert stretches(many)[0] == stretches(one)[0]
    changes = columns["stretch"][np.flatnonzero(np.diff(columns["stretch"], prepend=9))]
    assert changes.tolist() == [0.0, 1.0, 0.0, 2.0, 0.0, 3.0, 0.0]
    first = int(np.argmax(columns["stretch"] == 1.0))
    assert columns["velocity_deg_s"][first - 1] == 0.0  # from the very first movement


@pytest.mark.parametrize(("seed", "rest"), [(20011, 0.3), (20011, 1.0), (7, 1.2)])
def test_a_soft_hand_that_a_catch_throws_back_is_caught_once_a_push(
    seed: int, rest: float
) -> None:
    # and is held at the joint's end for a second without a fault
    way = {"start": START, "end": END, "mean_speed": radians(74.44)}
    again = (radians(114.9), radians(71.47))
    traits = HandTraits.sample(np.random.default_rng(seed))
    hand = HumanHand(traits, **way, again=again, returns=True, rest=rest)
    presented = present("HM4", hand=hand, stretches=StretchRules(n=3))
    assert presented.fault is None
    columns = presented.recording.columns
    begins = np.flatnonzero(np.diff(columns["phase"]) == CATCH) + 1
    begins = begins[columns["phase"][begins] == CATCH]
    assert columns["stretch"][begins].tolist() == [1.0, 2.0, 3.0]


def test_the_last_stretch_is_held_until_the_arm_is_brought_back() -> None:
    recording = shown(SimulatedHand(**BACK, rest=1.5)).recording
    last = stretches(recording)[-1]
    assert recording.facts["ended"] == "stretches"
    held_s = recording.n_presented * 1e-3 - last.end_s
    assert held_s == pytest.approx(1.5, abs=0.15)
    columns = recording.columns
    assert columns["velocity_deg_s"][recording.n_presented - 1] < -15.0
    assert not columns["ramp"][: recording.n_presented][-1000:].any()


def test_an_arm_that_is_not_brought_back_is_held_to_the_time_limit() -> None:
    way = [(0.0, 30.0), (0.5, 30.0), (1.5, 146.0), (9.0, 146.0)]
    assert led(way, n=1, time_limit=3.0).recording.facts["ended"] == "arrived"
    way = [*way[:2], (1.5, 120.0), (2.5, 30.0), (3.5, 146.0), (9.0, 146.0)]
    recording = led(way, n=2, time_limit=4.0).recording
    assert recording.facts["ended"] == "time-limit"
    assert recording.n_presented == pytest.approx(4550, abs=100)


def test_a_stretch_that_goes_on_at_the_time_limit_goes_on_to_its_end() -> None:
    recording = shown(SimulatedHand(**WAY), None, time_limit=5.0).recording
    first, second = stretches(recording)
    assert recording.facts["ended"] == "time-limit"
    assert second.end_s > 5.0 + first.onset_s
    assert recording.n_presented < second.end_s * 1000 + 5


def test_the_time_limit_runs_from_the_first_stretch() -> None:
    way = [(0.0, 30.0), (3.0, 30.0), (4.5, 120.0), (6.0, 30.0), (9.0, 30.0)]
    recording = led(way, time_limit=2.0).recording
    assert recording.facts["ended"] == "time-limit"
    (only,) = stretches(recording)
    assert only.onset_s == pytest.approx(3.0, abs=0.1)
    ended_s = float(recording.columns["time_s"][-1])
    assert ended_s == pytest.approx(3.05 + 2.0, abs=0.2)


def test_an_arm_that_nobody_moves_ends_at_the_longest_duration() -> None:
    still = led([(0.0, 30.0), (9.0, 30.0)], n=2, time_limit=0.5, stretch_limit=0.25)
    assert still.recording.facts["ended"] == "max-duration"
    assert still.recording.n_presented == 1250
    assert stretches(still.recording) == ()
    assert still.recording.facts["mean_speed_deg_s"] is None
    trembling = [(0.05 * n, 30.0 + 2.5 * (n % 2)) for n in range(40)]
    assert stretches(led(trembling, time_limit=0.5, stretch_limit=0.5).recording) == ()


def test_a_stretch_that_does_not_end_is_a_fault_with_a_ramp() -> None:
    way = [(0.0, 30.0), (0.5, 30.0), (1.5, 100.0), (9.0, 101.0)]
    presented = led(way, stretch_limit=2.0)
    fault, recording = presented.fault, presented.recording
    assert fault is not None
    assert (fault.kind, recording.facts["ended"]) == ("stretch-limit", "fault")
    assert fault.message == (
        "stretch limit: needs a stretch that ends within 2 s, number 1 has not ended"
    )
    assert fault.time_s == pytest.approx(2.54, abs=0.02)
    falls = -np.diff(recording.columns["command_torque_nm"][recording.n_presented :])
    assert falls.max() <= abs(fault.torque_nm) / 50 + 1e-9
    assert stretches(recording)[0].end_s == pytest.approx(fault.time_s, abs=2e-3)


def test_an_arm_that_is_brought_back_slowly_ends_its_stretch_and_arms_none() -> None:
    slow = [(0.0, 30.0), (1.0, 120.0), (1.2, 120.0), (8.0, 30.0), (9.0, 120.0)]
    status = PresentationStatus()
    recording = led([*slow, (9.5, 120.0)], n=2, time_limit=9.3, status=status).recording
    assert len(stretches(recording)) == status.n_stretches == 1
    # As the law has it, which catches once
    assert np.count_nonzero(np.diff(recording.columns["phase"]) == 1.0) == 1


def test_a_slow_way_back_without_a_catch_arms_the_next_as_the_law_is() -> None:
    gently = [(0.0, 30.0), (0.05, 30.1), (0.1, 30.4), (0.2, 31.5)]
    slow = [*gently, (5.0, 100.0), (10.0, 30.0), (10.2, 30.0), (11.2, 125.0)]
    recording = led([*slow, (12.4, 30.0)], n=2).recording
    assert recording.facts["ended"] == "stretches"
    first, second = stretches(recording)
    assert (first.phases, first.reached_threshold) == (("pre-catch",), False)
    assert second.phases[:2] == ("pre-catch", "catch")
    assert recording.facts["mean_speed_deg_s"] == second.mean_speed_deg_s
