"""The table [device] of a protocol reaches the driver whole."""

import dataclasses
from math import radians

import msgspec
import pytest

from masrel.hess import DeviceLimits
from masrel.hess.puck.options import PuckOptions
from masrel.protocol import DeviceSettings
from masrel.run.settings import backend_options, device_limits

# Key of [device] to field of DeviceLimits, and what one unit of the key is there
FIELDS = {
    "torque_limit_nm": ("torque", 1.0),
    "torque_rate_limit_nm_s": ("torque_rate", 1.0),
    "speed_limit_deg_s": ("speed", radians(1.0)),
    "lowest_angle_deg": ("lowest_angle", radians(1.0)),
    "highest_angle_deg": ("highest_angle", radians(1.0)),
    "soft_stop_deg": ("soft_stop_width", radians(1.0)),
    "soft_stop_torque_nm": ("soft_stop_torque", 1.0),
    "missed_ticks_limit": ("missed_ticks", 1.0),
    "missed_replies_limit": ("missed_replies", 1.0),
    "missed_replies_per_100_limit": ("missed_replies_per_100", 1.0),
    "stale_limit_ms": ("stale_time", 1e-3),
    "frozen_limit_ms": ("frozen_time", 1e-3),
    "standing_limit_ms": ("standing_time", 1e-3),
    "standing_torque_nm": ("standing_torque", 1.0),
    "jump_limit_deg": ("jump_angle", radians(1.0)),
    "watchdog_ms": ("watchdog_time", 1e-3),
    "ramp_ms": ("ramp_time", 1e-3),
}


def test_the_defaults_of_a_protocol_are_those_of_the_driver() -> None:
    made = dataclasses.asdict(device_limits(DeviceSettings()))
    assert made == pytest.approx(dataclasses.asdict(DeviceLimits()), rel=1e-12)


def test_every_limit_has_a_key() -> None:
    fields = {field.name for field in dataclasses.fields(DeviceLimits)}
    assert {field for field, _ in FIELDS.values()} == fields


@pytest.mark.parametrize("key", FIELDS)
def test_each_key_sets_its_limit_and_no_other(key: str) -> None:
    usual = DeviceSettings()
    value = getattr(usual, key)
    changed = msgspec.structs.replace(usual, **{key: type(value)(0.8 * value)})
    field, unit = FIELDS[key]
    made, before = device_limits(changed), device_limits(usual)
    assert getattr(made, field) == pytest.approx(getattr(changed, key) * unit)
    assert dataclasses.replace(made, **{field: getattr(before, field)}) == before


def test_a_puck_is_told_where_it_is() -> None:
    settings = DeviceSettings(
        backend="puck",
        puck_interface="virtual",
        puck_channel="bench",
        puck_node=3,
        puck_direction=-1,
    )
    made = backend_options(settings)
    assert isinstance(made, PuckOptions)
    assert (made.interface, made.channel, made.puck, made.direction) == (
        "virtual",
        "bench",
        3,
        -1,
    )
    assert backend_options(DeviceSettings()) is None
