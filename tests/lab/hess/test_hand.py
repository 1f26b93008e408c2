import math
from math import radians

import pytest
from hypothesis import given
from hypothesis import strategies as st

from masrel.errors import ParameterError
from masrel.lab.hess import SimulatedHand


def hand(**change: float) -> SimulatedHand:
    return SimulatedHand(**{"start": 0.5, "end": 2.5, "mean_speed": 1.5, **change})


def test_the_intention_by_hand() -> None:
    # Rest to 0.1 s, 0.2 s up, 0.4 s down, 1 rad/s between, 2 rad in all: the ramps
    # take 0.1 and 0.2 rad, the rest 1.7 s. Brake at 2.0 s, at rest at 2.4 s.
    stretch = hand(
        mean_speed=1.0, delay=0.1, ramp_up=0.2, ramp_down=0.4, follow_through=0.0
    )
    expected = {
        0.0: (0.5, 0.0),
        0.1: (0.5, 0.0),
        0.2: (0.525, 0.5),
        0.3: (0.6, 1.0),
        1.3: (1.6, 1.0),
        2.0: (2.3, 1.0),
        2.2: (2.45, 0.5),
        2.4: (2.5, 0.0),
        9.0: (2.5, 0.0),
    }
    for time_s, (angle, speed) in expected.items():
        assert stretch.intended(time_s) == pytest.approx((angle, speed), abs=1e-12)


@given(st.floats(0.2, 4.0), st.floats(0.0, 12.0))
def test_the_intended_speed_is_the_derivative_of_the_intended_angle(
    mean_speed: float, time_s: float
) -> None:
    stretch = hand(mean_speed=mean_speed)
    step = 1e-6
    before, after = stretch.intended(time_s)[0], stretch.intended(time_s + step)[0]
    # The speed changes by at most mean_speed / 0.02 s within the step.
    slack = mean_speed / 0.02 * step + 1e-8
    assert (after - before) / step == pytest.approx(
        stretch.intended(time_s)[1], abs=slack
    )


def test_it_means_to_press_against_the_end() -> None:
    assert hand().intended(10.0)[0] == pytest.approx(2.5 + radians(2.5))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"mean_speed": 0.0}, "mean_speed: needs more than 0"),
        ({"mean_speed": math.nan}, "mean_speed"),
        ({"mean_speed": 40.0}, "ramps shorter than the stretch"),
        ({"stiffness": -1.0}, "stiffness"),
        ({"damping": math.inf}, "damping"),
        ({"ramp_up": 0.0}, "ramp_up"),
        ({"ramp_down": 0.0}, "ramp_down"),
        ({"delay": -0.1}, "delay"),
        ({"follow_through": -0.1}, "follow_through"),
        ({"slip_time": -0.1}, "slip_time"),
        ({"end": 0.4}, "start, end"),
        ({"end": 3.2}, "start, end"),
        ({"start": -0.1}, "start, end"),
    ],
)
def test_an_impossible_hand_is_refused(change: dict[str, float], words: str) -> None:
    with pytest.raises(ParameterError, match=words):
        hand(**change)


def test_it_may_bring_the_arm_back_after_the_last_stretch_too() -> None:
    hand = SimulatedHand(start=0.5, end=2.5, mean_speed=1.5, rest=1.0, returns=True)
    assert hand.intended(2.4)[0] == pytest.approx(2.5 + math.radians(2.5))
    assert hand.intended(hand.final_time + 1.0) == (0.5, 0.0)
