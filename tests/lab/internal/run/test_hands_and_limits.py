"""Hands, raters who are simulated, what is felt, and [device] as the driver has it."""

import dataclasses
import hashlib
import json
import math
from collections.abc import Callable
from math import radians
from pathlib import Path
from random import Random

import msgspec
import numpy as np
import pytest

from masrel.errors import ParameterError, ProtocolError
from masrel.lab.hess import (
    DeviceLimits,
    SimulatedHand,
    SimulatedOptions,
    TorqueSensor,
)
from masrel.lab.hess.puck import EmulatorOptions, PuckOptions, property_table
from masrel.lab.protocol import (
    DeviceSettings,
    PresentationRules,
    Protocol,
    SimulatedRaters,
    StudyPaths,
    copy_template,
    joint_model,
    read_protocol,
)
from masrel.lab.recording import RECORDING_COLUMNS, Recording, stretches
from masrel.lab.run._grade_sources import GradeRequest
from masrel.lab.run._present import StatusOfHand, _felt
from masrel.lab.run._settings import (
    _largest_torque,
    backend_options,
    check_backend,
    device_limits,
    device_notes,
    has_simulated_hand,
    model_controller,
    moves_hardware,
)
from masrel.lab.run._simulated_raters import SimulatedGrades, intended_speeds
from masrel.lab.schedule.presentation import Presentation

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
    "actuator_limit_nm": ("actuator_torque", 1.0),
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

Small = tuple[StudyPaths, Protocol]


def test_each_limit_has_a_key_that_sets_it_and_no_other() -> None:
    usual = DeviceSettings()
    before = device_limits(usual)
    defaults = dataclasses.asdict(DeviceLimits())
    assert dataclasses.asdict(before) == pytest.approx(defaults, rel=1e-12)
    assert {field for field, _ in FIELDS.values()} == set(defaults)
    for key, (field, unit) in FIELDS.items():
        value = getattr(usual, key)
        changed = msgspec.structs.replace(usual, **{key: type(value)(0.8 * value)})
        made = device_limits(changed)
        assert getattr(made, field) == pytest.approx(getattr(changed, key) * unit)
        assert dataclasses.replace(made, **{field: getattr(before, field)}) == before


def test_a_torque_sensor_is_the_simulated_device_s_alone(small: Small) -> None:
    sensing = DeviceSettings(torque_sensor=True)
    assert backend_options(sensing, seed=7) == SimulatedOptions(
        torque_sensor=TorqueSensor(seed=7)
    )
    puck = msgspec.structs.replace(sensing, backend="puck")
    words = r"device\.torque_sensor: needed false, .* 'puck' has no torque sensor"
    with pytest.raises(ParameterError, match=words):
        check_backend(msgspec.structs.replace(small[1], device=puck))


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
    usual = DeviceSettings()
    keys = {key for key in DeviceSettings.__struct_fields__ if key.startswith("puck")}
    assert keys == set(PUCK) - {"backend"}  # none of them at its default
    assert all(getattr(puck(), key) != getattr(usual, key) for key in PUCK)
    assert backend_options(puck()) == PuckOptions(
        interface="pcan",
        channel="can3",
        puck=3,
        direction=-1,
        gear_ratio=20.5,
        checks_torque=False,
        properties=property_table(148),
    )
    assert backend_options(DeviceSettings(backend="puck")) == PuckOptions()
    assert backend_options(usual) == SimulatedOptions()
    # no answer is waited for longer than a tick
    for rate_hz, patience_s in ((250, 0.001), (2000, 0.0005)):
        options = backend_options(DeviceSettings(backend="puck", rate_hz=rate_hz))
        assert isinstance(options, PuckOptions)
        assert options.patience_s == patience_s
    hand = SimulatedHand(start=0.5, end=2.5, mean_speed=1.5)
    emulated = backend_options(puck(puck_interface="virtual"), hand)
    assert isinstance(emulated, PuckOptions)
    assert emulated.angle_after_reset == 0.5
    assert emulated.emulator == EmulatorOptions(
        gear_ratio=20.5, direction=-1, properties=property_table(148)
    )
    numbers = {**property_table(148).numbers}
    del numbers["MT"]
    with pytest.raises(
        ParameterError, match=r"^device\.puck\.properties: .*need MT too"
    ):
        backend_options(puck(puck_properties=numbers))


def written(path: Path, device: str) -> DeviceSettings:
    """[device] of the small study, read from its file."""
    copy_template("small", path)
    study = StudyPaths(path)
    text = study.protocol.read_text(encoding="utf-8")
    text = text.replace('backend = "simulated"\n', device + "\n")
    study.protocol.write_text(text, encoding="utf-8")
    return read_protocol(study.protocol).device


def test_a_device_has_a_table_of_its_own_in_the_protocol(
    small: Small, tmp_path: Path
) -> None:
    assert backend_options(puck(backends={"puck": {"puck": 4, "channel": "can9"}})) == (
        dataclasses.replace(backend_options(puck()), puck=4, channel="can9")
    )
    # one of another device stays where it is, for the site that has that
    device = 'backend = "puck"\npuck = { puck = 4, properties = { numbers = %s } }\n'
    numbers = ", ".join(f"{n} = {k}" for n, k in PUCK["puck_properties"].items())
    settings = written(
        tmp_path / "puck",
        device % f"{{ {numbers} }}" + "simulated = { torque_sensor = { noise = 0.5 } }",
    )
    assert backend_options(settings) == PuckOptions(
        puck=4, properties=property_table(148)
    )
    moment = puck(backends={"puck": {"angle_after_reset": 0.5}})
    with pytest.raises(ParameterError, match=r"device\.puck\.angle_after_reset: "):
        backend_options(moment)
    nobodys = DeviceSettings(backends={"nobodys": {}})
    with pytest.raises(ParameterError, match=r"^device\.nobodys: "):
        check_backend(msgspec.structs.replace(small[1], device=nobodys))
    elsewhere = msgspec.structs.replace(settings, backend="simulated")
    assert backend_options(elsewhere, seed=3) == SimulatedOptions(
        torque_sensor=TorqueSensor(noise=0.5, seed=3)
    )


def test_what_a_motor_does_in_silence_is_said(small: Small) -> None:
    of_puck = msgspec.structs.replace(small[1], device=puck())
    (note, never, *_), usual = (
        [*device_notes(protocol, small[0])] for protocol in (of_puck, small[1])
    )
    assert never == 'device.backend: "puck" was never calibrated for this study'
    assert note.startswith('device.backend: "puck" keeps its last torque')
    assert not [note for note in usual if "backend" in note]


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


def felt(protocol: Protocol, model: str, speed_deg_s: float, phase: float) -> str:
    # the arm goes from 30 deg for 0.2 s at a speed, and stops
    n = 400
    columns = {name: np.zeros(n) for name in RECORDING_COLUMNS}
    time_s = np.arange(n) * 1e-3
    columns["time_s"] = time_s
    columns["angle_deg"] = 30.0 + speed_deg_s * np.minimum(time_s, 0.2)
    columns["velocity_deg_s"] = np.where(time_s < 0.2, speed_deg_s, 0.0)
    columns["stretch"] = np.ones(n)
    columns["phase"][300:] = phase
    (made,) = stretches(Recording(columns=columns, facts={}))
    return _felt([made], joint_model(protocol, model), math.radians(30.0))


ELBOW = """catch_angle_constant_deg = 118.0
catch_torque_nms_rad = 2.1
residual_ratio = 0.40
catch_travel_deg = 40.0
"""


@pytest.mark.parametrize(
    ("model", "speed_deg_s", "phase", "what"),
    [
        ("HM1", 15.0, 0.0, "below-threshold"),
        ("HM1", 80.0, 0.0, "no-catch"),  # it stopped before the catch of HM1
        ("HM1", 80.0, 1.0, "felt"),
        ("D1", 80.0, 0.0, "felt"),  # without a catch there is none to miss
        ("D1", 15.0, 0.0, "below-threshold"),
    ],
)
def test_what_was_felt_follows_from_speed_and_catch(
    new_study, model: str, speed_deg_s: float, phase: float, what: str
) -> None:
    _, protocol = new_study((ELBOW, 'kind = "lead-pipe-rigidity"\n'))
    assert felt(protocol, model, speed_deg_s, phase) == what


Made = Callable[..., tuple[StudyPaths, Protocol]]


def test_speeds_have_the_mean_and_deviation_they_say(small: Small) -> None:
    protocol = with_settings(small[1], mean_speed_deg_s=85.0, speed_sd_deg_s=15.0)
    n = 2000
    speeds = [intended_speeds(protocol, ("R1", "test", "HM1", i))[0] for i in range(n)]
    mean = math.fsum(speeds) / n
    sd = math.sqrt(math.fsum((s - mean) ** 2 for s in speeds) / (n - 1))
    assert abs(mean - 85.0) < 4.5 * 15.0 / math.sqrt(n)
    assert abs(sd / 15.0 - 1.0) < 4.5 / math.sqrt(2 * n)
    assert min(speeds) >= 40.0
    assert max(speeds) <= 130.0


def test_who_is_free_stretches_one_to_three_times(small: Small) -> None:
    free = msgspec.structs.replace(
        small[1], presentation=PresentationRules(stretches="free")
    )
    n = 3000
    made = [intended_speeds(free, ("R1", "test", "HM1", i)) for i in range(n)]
    for count in (1, 2, 3):
        # within 4.5 standard errors: false alarm 2 in a hundred thousand
        share = sum(len(speeds) == count for speeds in made) / n
        assert abs(share - 1 / 3) < 4.5 * math.sqrt(2 / 9 / n)
    once = [intended_speeds(small[1], ("R1", "test", "HM1", i)) for i in range(n)]
    assert [speeds[:1] for speeds in made] == once  # the first is as it was
    assert all(len(set(speeds)) == len(speeds) for speeds in made)


def test_a_speed_is_never_near_zero_and_cues_are_followed(small: Small) -> None:
    protocol = with_settings(small[1], mean_speed_deg_s=50.0, speed_sd_deg_s=50.0)
    speeds = [
        intended_speeds(protocol, ("R1", "test", "HM1", i))[0] for i in range(500)
    ]
    assert min(speeds) == 10.0
    rules = PresentationRules(stretches=("slow", "fast", "slow"))
    cued = msgspec.structs.replace(small[1], presentation=rules)
    assert intended_speeds(cued, ("R1", "test", "HM1", 1)) == [10.0, 120.0, 10.0]


def with_settings(protocol: Protocol, **settings: float) -> Protocol:
    return msgspec.structs.replace(
        protocol, simulated_raters=SimulatedRaters(**settings)
    )


def asked(
    model: str, *, rater: str = "R1", session: str = "test", repeat: int = 1
) -> GradeRequest:
    return GradeRequest(
        rater=rater,
        session=session,
        presentation=Presentation(position=1, code="X", model=model, repeat=repeat),
        n_presentations=3,
        attempt=1,
    )


def share(n_hits: int, n: int, expected: float) -> bool:
    """Whether a share is within 4.5 standard errors: false alarm 7 in a million."""
    return abs(n_hits / n - expected) <= 4.5 * math.sqrt(expected * (1 - expected) / n)


def test_accuracy_is_what_it_says_and_the_rest_are_neighbours(small: Small) -> None:
    grades = SimulatedGrades(with_settings(small[1], accuracy=0.7))
    given = [grades.grade(asked("HM3", repeat=n)) for n in range(4000)]
    assert set(given) == {"1+", "2", "3"}
    assert share(given.count("2"), 4000, 0.7)
    assert share(given.count("3"), 4000, 0.15)


# By its height H between 1.4 (grade 1, rank 1) and 2.8 (grade 2, rank 3), and beyond
@pytest.mark.parametrize(
    ("changes", "shares"),
    [
        ([("= 2.1", "= 1.575")], {"1": 0.75, "1+": 0.25}),  # an eighth: rank 1.25
        ([], {"1+": 1.0}),
        ([("= 2.1", "= 0.5")], {"1": 1.0}),
        ([("= 2.1", "= 9.0")], {"2": 1.0}),
        ([("= 2.8", "= 1.4"), ("= 2.1", "= 1.4")], {"1+": 1.0}),  # the mean of ranks
    ],
)
def test_a_dummy_between_two_grades_gets_either_in_proportion(
    new_study: Made, changes: list[tuple[str, str]], shares: dict[str, float]
) -> None:
    _, protocol = new_study(*changes)
    grades = SimulatedGrades(with_settings(protocol, accuracy=1.0))
    given = [grades.grade(asked("D1", repeat=n)) for n in range(4000)]
    assert set(given) == {*shares}
    assert all(share(given.count(grade), 4000, of) for grade, of in shares.items())


def test_a_retest_repeats_the_first_grade_as_often_as_it_says(small: Small) -> None:
    settings = {"accuracy": 0.5, "retest_agreement": 0.6}
    grades = SimulatedGrades(with_settings(small[1], **settings))
    n = 2000
    same = sum(
        grades.grade(asked("HM3", repeat=i))
        == grades.grade(asked("HM3", session="retest", repeat=i))
        for i in range(n)
    )
    # Anew, two independent grades of shares 0.5, 0.25, 0.25 are equal with 0.375.
    assert share(same, n, 0.6 + 0.4 * 0.375)


def test_a_draw_is_the_hash_the_documentation_describes(small: Small) -> None:
    protocol = with_settings(small[1], seed=3, accuracy=0.5)
    key = json.dumps([3, "accuracy", "R1", "test", "HM1", 1]).encode()
    word = int.from_bytes(hashlib.sha256(key).digest(), "big") >> (256 - 52)
    is_accurate = (word + 0.5) / 2**52 < 0.5
    grade = SimulatedGrades(protocol).grade(asked("HM1"))
    assert (grade == "1") is is_accurate


def test_without_an_intended_grade_nobody_can_be_accurate(new_study: Made) -> None:
    _, protocol = new_study(('intended_grade = "1"', ""), ('intended_grade = "2"', ""))
    with pytest.raises(ProtocolError, match="need a model with an intended_grade"):
        SimulatedGrades(protocol)


def test_at_the_end_of_the_scale_there_is_one_neighbour(new_study: Made) -> None:
    _, protocol = new_study(('intended_grade = "1"', 'intended_grade = "0"'))
    grades = SimulatedGrades(with_settings(protocol, accuracy=0.0))
    assert {grades.grade(asked("HM1", repeat=n)) for n in range(50)} == {"1"}


@pytest.mark.parametrize(("agreement", "equal"), [(1.0, True), (0.0, False)])
def test_a_retest_can_repeat_everything_or_nothing(
    small: Small, agreement: float, equal: bool
) -> None:
    settings = {"accuracy": 0.5, "retest_agreement": agreement}
    grades = SimulatedGrades(with_settings(small[1], **settings))
    first, second = (
        [grades.grade(asked("HM3", session=s, repeat=i)) for i in range(40)]
        for s in ("test", "retest")
    )
    assert (first == second) is equal


def test_a_hand_that_holds_is_done_when_it_brings_the_arm_back_at_last() -> None:
    status = StatusOfHand(2, holds=True)
    for n_over in (1, 2):
        status.is_armed = True
        status.is_armed = False
        status.n_stretches = n_over
        assert not status.is_done
    status.is_armed = True
    assert status.is_done
