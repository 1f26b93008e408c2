import math
from math import radians

import pytest
from hypothesis import given
from hypothesis import strategies as st

from masrel.errors import ParameterError
from masrel.lab.hess import Friction, FrictionCompensation

SPEEDS = st.floats(-6.0, 6.0)


def friction_torque(velocity: float) -> float:
    # (7) without inertia, with the source's B and β
    return 0.168 * velocity + math.copysign(0.189, velocity)


def test_the_defaults_are_those_identified_for_equation_7() -> None:
    friction = Friction()
    assert (friction.inertia, friction.viscous, friction.coulomb) == (
        0.0097,
        0.168,
        0.189,
    )


def test_the_whole_friction_is_scaled_by_the_share() -> None:
    # 0.9 (0.168 × 2 + 0.189) = 0.9 × 0.525 = 0.4725 N·m
    compensation = FrictionCompensation(Friction(), share=0.9)
    assert compensation.torque(2.0) == pytest.approx(0.4725, rel=1e-12)
    assert compensation.torque(-2.0) == pytest.approx(-0.4725, rel=1e-12)


def test_inside_the_dead_zone_only_the_viscous_part_is_left() -> None:
    compensation = FrictionCompensation(Friction(), share=0.5)
    assert compensation.torque(0.0) == 0.0
    speed = radians(0.09)
    assert compensation.torque(speed) == pytest.approx(0.5 * 0.168 * speed)


def test_halfway_up_the_ramp_half_of_the_coulomb_part_helps() -> None:
    compensation = FrictionCompensation(
        Friction(viscous=0.0), share=1.0, dead_zone=0.1, full_speed=0.3
    )
    assert compensation.torque(0.2) == pytest.approx(0.189 / 2)


@given(SPEEDS, st.floats(0.0, 1.0))
def test_it_never_gives_more_than_the_friction_takes(
    velocity: float, share: float
) -> None:
    helping = FrictionCompensation(Friction(), share=share).torque(velocity)
    assert helping * velocity >= 0.0
    assert abs(helping) <= abs(friction_torque(velocity)) * (1 + 1e-12)


@given(SPEEDS | st.floats(-0.05, 0.05), st.floats(0.0, 1e-4))
def test_it_never_jumps(velocity: float, change: float) -> None:
    # Steepest from 0.1 to 2 deg/s: 0.168 + 0.189 / radians(1.9) = 5.87 N·m per rad/s
    compensation = FrictionCompensation(Friction(), share=1.0)
    step = compensation.torque(velocity + change) - compensation.torque(velocity)
    assert abs(step) <= 5.87 * change + 1e-12


@pytest.mark.parametrize("share", [-0.1, 1.01, math.nan])
def test_more_than_the_friction_is_refused(share: float) -> None:
    with pytest.raises(ParameterError, match=r"share: needs \[0, 1\]"):
        FrictionCompensation(Friction(), share=share)


@pytest.mark.parametrize(("low", "high"), [(-0.1, 0.1), (0.2, 0.1), (0.1, 0.1)])
def test_a_ramp_needs_its_ends_in_order(low: float, high: float) -> None:
    with pytest.raises(ParameterError, match="dead_zone, full_speed"):
        FrictionCompensation(Friction(), share=0.9, dead_zone=low, full_speed=high)


@pytest.mark.parametrize(
    "field", [{"inertia": 0.0}, {"viscous": -1.0}, {"coulomb": math.inf}]
)
def test_friction_outside_its_range_is_refused(field: dict[str, float]) -> None:
    with pytest.raises(ParameterError, match=next(iter(field))):
        Friction(**field)
