"""Springs before the ends of the range push back, and nothing does between them."""

from math import radians

import pytest

from masrel.hess import DeviceLimits
from masrel.hess._guard import SoftStops


def test_they_push_back_from_five_degrees_before_the_ends() -> None:
    stops = SoftStops(DeviceLimits())
    assert stops.torque(radians(-5.0)) == pytest.approx(-10.0)
    assert stops.torque(radians(182.5)) == pytest.approx(5.0)  # resists extension
    assert stops.torque(radians(-1.0)) == pytest.approx(-2.0)
    for angle in (0.0, 90.0, 180.0):
        assert stops.torque(radians(angle)) == 0.0


def test_there_may_be_none() -> None:
    stops = SoftStops(DeviceLimits(soft_stop_torque=0.0))
    assert stops.torque(radians(184.0)) == 0.0
