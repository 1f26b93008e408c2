"""The table [device] of a protocol reaches the driver whole."""

import dataclasses
from math import radians
from pathlib import Path
from random import Random

import msgspec
import pytest

from masrel.errors import ParameterError
from masrel.lab.hess import DeviceLimits, SimulatedHand, SimulatedOptions, TorqueSensor
from masrel.lab.hess.puck import EmulatorOptions, PuckOptions, property_table
from masrel.lab.protocol import DeviceSettings, Protocol, copy_template, read_protocol
from masrel.lab.run._settings import (
    _largest_torque,
    backend_options,
    check_backend,
    device_limits,
    has_simulated_hand,
    model_controller,
    moves_hardware,
)

# Key of [device] to field of DeviceLimits, and what one unit of the key is there
FIELDS = {
    "torque_limit_nm": ("torque", 1.0),
    "torque_rate_limit_nm_s": ("torque_rate", 1.0),
    "active_torque_limit_nm": ("active_torque", 1.0),
    "active_energy_limit_j": ("active_energy", 1.0),
    "active_speed_limit_deg_s": ("active_speed", radians(1.0)),
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
    "end_ramp_ms": ("end_ramp_time", 1e-3),
    "drift_limit_deg": ("drift_angle", radians(1.0)),
    "drift_speed_deg_s": ("drift_speed", radians(1.0)),
    "encoder_noise_deg": ("encoder_noise", radians(1.0)),
    "arrival_deg": ("arrival_angle", radians(1.0)),
    "arrival_speed_deg_s": ("arrival_speed", radians(1.0)),
    "arrival_ms": ("arrival_time", 1e-3),
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


def test_a_torque_sensor_is_the_simulated_device_s_alone() -> None:
    sensing = DeviceSettings(torque_sensor=True)
    assert backend_options(sensing, seed=7) == SimulatedOptions(
        torque_sensor=TorqueSensor(seed=7)
    )
    words = r"device\.torque_sensor: needed false, .* 'puck' has no torque sensor"
    with pytest.raises(ParameterError, match=words):
        check_backend(msgspec.structs.replace(sensing, backend="puck"))


PUCK = {
    "backend": "puck",
    "puck_interface": "pcan",
    "puck_channel": "can3",
    "puck_node": 3,
    "puck_direction": -1,
    "puck_gear_ratio": 20.5,
    "puck_checks_torque": False,
    "puck_properties": dict(property_table(148).numbers),
}
"""Each key that a puck has, and none of them at its default."""


def puck(**changes: object) -> DeviceSettings:
    return msgspec.convert({**PUCK, **changes}, DeviceSettings)


def test_a_puck_is_told_what_the_protocol_says_of_it() -> None:
    made = backend_options(puck())
    assert made == PuckOptions(
        interface="pcan",
        channel="can3",
        puck=3,
        direction=-1,
        gear_ratio=20.5,
        checks_torque=False,
        properties=property_table(148),
    )
    assert backend_options(DeviceSettings(backend="puck")) == PuckOptions()
    assert backend_options(DeviceSettings()) is None


def test_no_key_of_a_puck_is_left_out() -> None:
    keys = {key for key in DeviceSettings.__struct_fields__ if key.startswith("puck")}
    assert keys == set(PUCK) - {"backend"}
    usual = DeviceSettings()
    assert all(getattr(puck(), key) != getattr(usual, key) for key in PUCK)


def test_an_emulated_puck_is_built_as_the_protocol_says() -> None:
    hand = SimulatedHand(start=0.5, end=2.5, mean_speed=1.5)
    made = backend_options(puck(puck_interface="virtual"), hand)
    assert isinstance(made, PuckOptions)
    assert made.angle_after_reset == 0.5
    assert made.emulator == EmulatorOptions(
        gear_ratio=20.5, direction=-1, properties=property_table(148)
    )


@pytest.mark.parametrize(
    ("settings", "by_simulated_hand", "hardware"),
    [
        (DeviceSettings(), True, False),
        (puck(puck_interface="virtual"), True, False),
        (puck(puck_interface="socketcan", puck_channel="vcan0"), False, False),
        (puck(puck_interface="udp_multicast"), False, False),
        (puck(), False, True),
        (puck(puck_interface="socketcan"), False, True),
    ],
)
def test_what_is_simulated(
    settings: DeviceSettings, by_simulated_hand: bool, hardware: bool
) -> None:
    assert has_simulated_hand(settings) == by_simulated_hand
    assert moves_hardware(settings) == hardware


def test_properties_that_lack_one_are_refused_with_their_key() -> None:
    numbers = {**property_table(148).numbers}
    del numbers["MT"]
    with pytest.raises(
        ParameterError, match=r"^\[device\] puck_properties: need MT too"
    ):
        backend_options(puck(puck_properties=numbers))


@pytest.mark.parametrize(("rate_hz", "patience_s"), [(250, 0.001), (2000, 0.0005)])
def test_no_answer_is_waited_for_longer_than_a_tick(rate_hz, patience_s) -> None:
    settings = DeviceSettings(backend="puck", rate_hz=rate_hz)
    options = backend_options(settings)
    assert isinstance(options, PuckOptions)
    assert options.patience_s == patience_s


def largest_command(protocol: Protocol, model: str, speed: float, end: float) -> float:
    # of random movements to and fro, each with minimum jerk, up to a speed
    random, controller = Random(3), model_controller(protocol, model)
    start, time_s = radians(protocol.stretch.start_deg), 0.0
    at, commands = start, []
    for _ in range(8):
        way = random.choice([start, end, random.uniform(start, end)]) - at
        duration = max(1.875 * abs(way) / (speed * random.choice([0.4, 1.0])), 0.01)
        for tick in range(int(duration * 1000)):
            s = tick / (duration * 1000)
            angle = at + way * (10 * s**3 - 15 * s**4 + 6 * s**5)
            velocity = way / duration * 30 * (s * (1 - s)) ** 2
            commands.append(abs(controller.step(time_s, angle, velocity)))
            time_s += 0.001
        at += way
    return max(commands)


@pytest.mark.parametrize("study", ["small", "tone"])
def test_no_command_passes_what_the_limits_are_held_against(
    study: str, tmp_path: Path
) -> None:
    copy_template(study, tmp_path)
    protocol = read_protocol(tmp_path / "protocol.toml")
    device = msgspec.structs.replace(protocol.device, friction_coulomb_nm=1.0)
    protocol = msgspec.structs.replace(protocol, device=device)
    for model in protocol.models:
        if not model_controller(protocol, model.id).is_guarded:
            bound = _largest_torque(protocol, model, 131.0)
            found = largest_command(protocol, model.id, radians(131.0), radians(126.0))
            assert 0.4 * bound < found <= bound + 1e-9, model.id
