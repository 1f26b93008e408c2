import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from masrel.errors import ParameterError
from masrel.lab.hess.puck._properties import Transmission

PUCK = Transmission(counts_per_turn=4096, units_per_nm=2700)
BACKWARDS = Transmission(counts_per_turn=4096, units_per_nm=2700, direction=-1)
both = st.sampled_from([PUCK, BACKWARDS])


def test_one_count_is_360_degrees_by_4096_times_18_point_8() -> None:
    # 360 / (4096 * 18.8) = 360 / 77004.8 = 0.0046750...
    assert math.degrees(PUCK.angle_step) == pytest.approx(360 / 77004.8, rel=1e-15)


def test_one_unit_is_18_point_8_newton_metres_by_2700() -> None:
    assert PUCK.torque_step == pytest.approx(0.006962962962962963, rel=1e-15)


def test_the_motors_continuous_torque_is_28_newton_metres_at_the_elbow() -> None:
    # 1.490 N·m at the motor are 1.490 * 2700 = 4023 units and 28.01 N·m
    assert PUCK.torque(-4023) == pytest.approx(28.012, abs=1e-9)


def test_resisting_extension_pulls_towards_where_counts_shrink() -> None:
    for puck in (PUCK, BACKWARDS):
        extension = puck.counts(1.0) - puck.counts(0.5)
        assert puck.units(3.0) * extension < 0


@given(both, st.integers(-(2**31), 2**31 - 1))
def test_a_count_comes_back(puck: Transmission, counts: int) -> None:
    assert puck.counts(puck.angle(counts)) == counts


@given(both, st.integers(-8192, 8191))
def test_a_unit_comes_back(puck: Transmission, units: int) -> None:
    assert puck.units(puck.torque(units)) == units


@given(both, st.floats(-30.0, 30.0))
def test_a_torque_is_off_by_half_a_unit_at_most(
    puck: Transmission, torque: float
) -> None:
    sent = puck.torque(puck.units(torque))
    assert abs(sent - torque) <= puck.torque_step * (0.5 + 1e-12)


@given(both, st.floats(0.0, math.pi))
def test_an_angle_is_off_by_half_a_count_at_most(
    puck: Transmission, angle: float
) -> None:
    seen = puck.angle(puck.counts(angle))
    assert abs(seen - angle) <= puck.angle_step * (0.5 + 1e-9)


def test_rounding_has_no_bias() -> None:
    # Over whole steps, errors to the nearest sum to 0; rounding down would leave half
    # a unit, 0.0035 N·m.
    torques = [number * PUCK.torque_step / 16 for number in range(-1600, 1601)]
    errors = [PUCK.torque(PUCK.units(torque)) - torque for torque in torques]
    assert abs(sum(errors) / len(errors)) < 1e-5


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"counts_per_turn": 0}, "counts_per_turn: needs more than 0, got 0"),
        ({"units_per_nm": -1}, "units_per_nm: needs more than 0, got -1"),
        ({"gear_ratio": math.nan}, "gear_ratio: needs more than 0, got nan"),
        ({"direction": 2}, "direction: needs 1 or -1, got 2"),
    ],
)
def test_values_out_of_range_are_refused(values: dict, words: str) -> None:
    with pytest.raises(ParameterError, match=words):
        Transmission(**{"counts_per_turn": 4096, "units_per_nm": 2700, **values})
