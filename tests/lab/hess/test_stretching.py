"""Many stretches in one presentation: when each begins and ends, and when all does."""

import math
from collections.abc import Callable
from math import radians

import numpy as np
import pytest

from masrel.errors import ParameterError
from masrel.lab.elbow import STANDARD_MODELS, SampledJoint
from masrel.lab.hess import (
    Controller,
    HandTraits,
    HumanHand,
    PresentationStatus,
    Presented,
    SimulatedClock,
    SimulatedHand,
    StretchRules,
    YieldingHand,
    open_device,
    run_presentation,
)
from masrel.lab.recording import stretches

from .rig import END, LIMITS, START, ScriptedDevice, present

SPEEDS = (radians(92.0), radians(60.0), radians(110.0))
WAY = {"start": START, "end": END, "mean_speed": SPEEDS[0], "again": SPEEDS[1:]}
BACK = {**WAY, "returns": True}


def shown(
    hand: SimulatedHand,
    rules: StretchRules,
    *,
    model: str = "HM3",
    status: PresentationStatus | None = None,
    clock: SimulatedClock | None = None,
) -> Presented:
    clock = clock or SimulatedClock()
    controller = Controller(STANDARD_MODELS[model], start_angle=START)
    with open_device("simulated", clock=clock, hand=hand) as device:
        return run_presentation(
            device,
            controller,
            clock=clock,
            limits=LIMITS,
            end_angle=END,
            stretches=rules,
            status=status,
        )


def scripted(
    angles_deg: list[tuple[float, float]],
    rules: StretchRules,
    status: PresentationStatus | None = None,
) -> Presented:
    """An arm that goes in straight lines through (time s, angle deg)."""
    times, angles = zip(*angles_deg, strict=True)
    clock = SimulatedClock()

    def angle(time_s: float) -> float:
        tremor = 0.02 * math.sin(2.0 * math.pi * 9.0 * time_s)
        return radians(np.interp(time_s, times, angles) + tremor)

    controller = Controller(STANDARD_MODELS["HM1"], start_angle=START)
    with ScriptedDevice(clock, angle) as device:
        return run_presentation(
            device,
            controller,
            clock=clock,
            limits=LIMITS,
            end_angle=END,
            stretches=rules,
            status=status,
        )


class Saying(SimulatedClock):
    """A clock on which somebody says done at a time."""

    def __init__(self, at_s: float, status: PresentationStatus) -> None:
        super().__init__()
        self.at_s, self.status = at_s, status

    def sleep_until_ns(self, deadline_ns: int) -> None:
        super().sleep_until_ns(deadline_ns)
        if deadline_ns >= self.at_s * 1e9:
            self.status.done()


@pytest.mark.parametrize(
    "hand",
    [
        lambda: SimulatedHand(**BACK),
        lambda: YieldingHand(**BACK),
        lambda: HumanHand(HandTraits(), **BACK),
    ],
    ids=["clamp", "yielding", "human"],
)
@pytest.mark.parametrize("model", ["HM1", "HM4"])
def test_every_hand_may_stretch_again(
    hand: Callable[[], SimulatedHand], model: str
) -> None:
    presented = shown(hand(), StretchRules(n=3), model=model)
    facts, made = presented.recording.facts, stretches(presented.recording)
    assert (presented.fault, facts["ended"]) == (None, "stretches")
    assert [one.number for one in made] == [1, 2, 3]
    for one in made:
        assert one.phases[:2] == ("pre-catch", "catch")
        assert one.reached_threshold
    slow = min(made, key=lambda one: one.mean_speed_deg_s or 0.0)
    assert slow.number == 2
    assert facts["mean_speed_deg_s"] == made[0].mean_speed_deg_s
    assert facts["phases"] == ", ".join(made[0].phases)
    assert presented.recording.columns["command_torque_nm"][-1] == 0.0


def test_the_law_goes_on_through_all_of_them() -> None:
    columns = shown(SimulatedHand(**BACK), StretchRules(n=3)).recording.columns
    joint = SampledJoint(STANDARD_MODELS["HM3"], start_angle=START)
    for time_s, angle, velocity, torque, phase in zip(
        columns["time_s"].tolist(),
        np.radians(columns["angle_deg"]).tolist(),
        np.radians(columns["velocity_deg_s"]).tolist(),
        columns["model_torque_nm"].tolist(),
        columns["phase"].tolist(),
        strict=True,
    ):
        assert joint.step(time_s, angle, velocity) == pytest.approx(torque, abs=1e-9)
        assert joint.phase == phase


def test_the_first_stretch_is_that_of_a_presentation_of_one() -> None:
    many = shown(SimulatedHand(**BACK), StretchRules(n=3)).recording
    one = present("HM3", 92.0).recording
    for name, column in one.columns.items():
        n_rows = one.n_presented
        np.testing.assert_array_equal(many.columns[name][:n_rows], column[:n_rows])
    assert stretches(many)[0] == stretches(one)[0]


def test_the_column_is_zero_before_between_and_after() -> None:
    columns = shown(SimulatedHand(**BACK), StretchRules(n=3)).recording.columns
    changes = columns["stretch"][np.flatnonzero(np.diff(columns["stretch"], prepend=9))]
    assert changes.tolist() == [0.0, 1.0, 0.0, 2.0, 0.0, 3.0, 0.0]
    first = int(np.argmax(columns["stretch"] == 1.0))
    assert columns["velocity_deg_s"][first - 1] == 0.0  # from the very first movement


def test_the_last_stretch_is_held_until_the_arm_is_brought_back() -> None:
    hand = SimulatedHand(**BACK, rest=1.5)
    recording = shown(hand, StretchRules(n=3)).recording
    last = stretches(recording)[-1]
    assert recording.facts["ended"] == "stretches"
    held_s = recording.n_presented * 1e-3 - last.end_s
    assert held_s == pytest.approx(1.5, abs=0.15)
    columns = recording.columns
    assert columns["velocity_deg_s"][recording.n_presented - 1] < -15.0
    assert not columns["ramp"][: recording.n_presented][-1000:].any()


def test_an_arm_that_is_not_brought_back_is_held_to_the_time_limit() -> None:
    path = [(0.0, 30.0), (0.5, 30.0), (1.5, 146.0), (9.0, 146.0)]
    presented = scripted(path, StretchRules(n=1, time_limit=3.0))
    assert presented.recording.facts["ended"] == "arrived"
    path = [*path[:2], (1.5, 120.0), (2.5, 30.0), (3.5, 146.0), (9.0, 146.0)]
    presented = scripted(path, StretchRules(n=2, time_limit=4.0))
    assert presented.recording.facts["ended"] == "time-limit"
    assert presented.recording.n_presented == pytest.approx(4550, abs=100)


def test_free_stretches_end_where_the_rater_says_done() -> None:
    status = PresentationStatus()
    presented = shown(
        SimulatedHand(**WAY),
        StretchRules(n=None),
        status=status,
        clock=Saying(5.0, status),
    )
    recording = presented.recording
    assert (presented.fault, recording.facts["ended"]) == (None, "done")
    assert [one.number for one in stretches(recording)] == [1, 2]
    assert stretches(recording)[1].end_s == pytest.approx(5.0)
    assert recording.columns["time_s"][-1] == pytest.approx(5.1)
    assert (status.n_stretches, status.is_armed) == (2, False)


def test_a_rater_may_be_done_with_one_stretch_as_well() -> None:
    status = PresentationStatus()
    presented = shown(
        SimulatedHand(**WAY), StretchRules(), status=status, clock=Saying(0.6, status)
    )
    assert presented.recording.facts["ended"] == "done"
    assert status.n_stretches == 1


def test_a_stretch_that_goes_on_at_the_time_limit_goes_on_to_its_end() -> None:
    presented = shown(SimulatedHand(**WAY), StretchRules(n=None, time_limit=5.0))
    made = stretches(presented.recording)
    assert presented.recording.facts["ended"] == "time-limit"
    assert len(made) == 2
    assert made[1].end_s > 5.0 + made[0].onset_s
    assert presented.recording.n_presented < made[1].end_s * 1000 + 5


def test_the_time_limit_runs_from_the_first_stretch() -> None:
    path = [(0.0, 30.0), (3.0, 30.0), (4.5, 120.0), (6.0, 30.0), (9.0, 30.0)]
    presented = scripted(path, StretchRules(n=None, time_limit=2.0))
    assert presented.recording.facts["ended"] == "time-limit"
    (only,) = stretches(presented.recording)
    assert only.onset_s == pytest.approx(3.0, abs=0.1)
    ended_s = float(presented.recording.columns["time_s"][-1])
    assert ended_s == pytest.approx(3.05 + 2.0, abs=0.2)


def test_an_arm_that_nobody_moves_ends_at_the_longest_duration() -> None:
    rules = StretchRules(n=2, time_limit=0.5, stretch_limit=0.25)
    presented = scripted([(0.0, 30.0), (9.0, 30.0)], rules)
    assert presented.recording.facts["ended"] == "max-duration"
    assert presented.recording.n_presented == 1250
    assert stretches(presented.recording) == ()
    assert presented.recording.facts["mean_speed_deg_s"] is None


def test_a_stretch_that_does_not_end_is_a_fault_with_a_ramp() -> None:
    path = [(0.0, 30.0), (0.5, 30.0), (1.5, 100.0), (9.0, 101.0)]
    presented = scripted(path, StretchRules(n=None, stretch_limit=2.0))
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
    presented = scripted(
        [*slow, (9.5, 120.0)], StretchRules(n=2, time_limit=9.3), status
    )
    assert len(stretches(presented.recording)) == 1
    assert status.n_stretches == 1
    # As the law has it, which catches once
    catches = np.diff(presented.recording.columns["phase"]) == 1.0
    assert np.count_nonzero(catches) == 1


def test_a_slow_way_back_without_a_catch_arms_the_next_as_the_law_is() -> None:
    gently = [(0.0, 30.0), (0.05, 30.1), (0.1, 30.4), (0.2, 31.5)]
    slow = [*gently, (5.0, 100.0), (10.0, 30.0), (10.2, 30.0), (11.2, 125.0)]
    presented = scripted([*slow, (12.4, 30.0)], StretchRules(n=2))
    assert presented.recording.facts["ended"] == "stretches"
    first, second = stretches(presented.recording)
    assert (first.phases, first.reached_threshold) == (("pre-catch",), False)
    assert second.phases[:2] == ("pre-catch", "catch")
    assert presented.recording.facts["mean_speed_deg_s"] == second.mean_speed_deg_s


def test_an_arm_that_trembles_is_not_stretched() -> None:
    to_and_fro = [(0.05 * n, 30.0 + 2.5 * (n % 2)) for n in range(40)]
    rules = StretchRules(n=None, time_limit=0.5, stretch_limit=0.5)
    assert stretches(scripted(to_and_fro, rules).recording) == ()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"n": 0}, "n: needs 1 stretch or more, got 0"),
        ({"time_limit": 0.0}, "time_limit: needs more than 0, got 0.0"),
        ({"stretch_limit": math.inf}, "stretch_limit: needs more than 0, got inf"),
    ],
)
def test_rules_that_leave_nothing_are_refused(options, message: str) -> None:
    with pytest.raises(ParameterError) as caught:
        StretchRules(**options)
    assert str(caught.value) == message


@pytest.mark.parametrize("again", [(0.0,), (1.0, math.nan), (1.0, 60.0)])
def test_speeds_that_no_hand_has_are_refused(again: tuple[float, ...]) -> None:
    with pytest.raises(ParameterError, match=r"again\[\d\]: needs|ramps shorter"):
        SimulatedHand(start=START, end=END, mean_speed=1.0, again=again)
