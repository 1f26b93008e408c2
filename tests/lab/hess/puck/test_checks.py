"""What ``check`` and ``probe`` find on pucks; a free arm turned, and its friction."""

import math
from dataclasses import replace
from math import radians

import numpy as np
import pytest
from hypothesis import strategies as st

from masrel.errors import (
    DeviceError,
    EmergencyStopError,
    LimitExceededError,
    ParameterError,
)
from masrel.lab.hess import Device, EmergencyStop, Hand, SimulatedClock, open_device
from masrel.lab.hess.puck import (
    Check,
    NodeReport,
    SteadyRun,
    check,
    connected,
    fit_friction,
    probe,
    property_table,
    steady_runs,
)
from tests.lab.hess.faults import FaultyDevice, dropped, repeated
from tests.lab.hess.puck.rig import END, fault, loose, opened, puck_options
from tests.lab.hess.rig import ActingClock, Heard, ScriptedDevice, stretching

# What a check finds


def checked(hand: Hand | None = None, n: int = 1, **emulator) -> dict[str, Check]:
    """What the last of so many checks finds."""
    clock, hand = SimulatedClock(), hand or loose()
    options = puck_options(hand, emulator=emulator)
    with connected(options, clock=clock, hand=hand, range_end=END) as link:
        checks = [check(link, clock, options) for _ in range(n)]
    assert n == 1 or all(one.holds for one in checks[0])
    return {one.name: one for one in checks[-1]}


# The faults of an emulated puck begin after its first torque mode: that of a check
# before, 20 ms in which it is woken and configured once more.
@pytest.mark.parametrize(
    ("kind", "start_s", "more", "failed", "said"),
    [
        ("dropped-replies", 0.02, {"every": 100}, ["answers"], "lost; needs 99 %"),
        ("late-replies", 0.02, {"size": 0.0006}, ["answers"], "longest 0.75 ms"),
        ("late-replies", 0.02, {"size": 0.0004}, [], ""),
        ("jumping-encoder", 0.02, {"every": 2, "size": 5.0}, ["rest"], "5 counts in a"),
        ("jumping-encoder", 0.02, {"every": 2, "size": 4.0}, [], ""),
        (
            "jumping-encoder",
            0.02,
            {"size": 30_000.0},
            ["position", "rest"],
            "deg; look",
        ),
        ("error-frames", 0.02, {"every": 400}, ["error frames"], "3, and 0 frames of"),
        ("unplugged", 0.02, {"end_s": 1.0}, ["answers"], " of 1000 lost"),
        (
            "dropped-torques",
            0.0,
            {},
            ["torque mode"],
            "needs a property T that reads back",
        ),
        ("idled", 0.0, {}, ["torque mode"], "is an emergency stop pressed"),
    ],
)
def test_what_is_wrong_with_a_puck_is_found(
    kind, start_s: float, more: dict, failed: list[str], said: str
) -> None:
    faults = (fault(kind, start_s, **more),)
    checks = checked(n=2 if start_s else 1, awake=True, faults=faults)
    found = [one for one in checks.values() if not one.holds]
    assert [one.name for one in found] == failed
    assert not failed or said in found[0].result


@pytest.mark.parametrize(
    ("hand", "emulator", "name", "result"),
    [
        (
            loose(),
            {"awake": True},
            "position",
            "90.00 deg; look whether the arm is the",
        ),
        (loose(45.0), {"awake": True}, "position", "45.00 deg"),
        (loose(), {}, "position", "0.00 deg; not zeroed yet"),  # it was woken
        # noise of others does no harm
        (
            loose(),
            {"awake": True, "faults": (fault("foreign-frames", 0.02),), "n": 2},
            "error frames",
            "0, and 3928 frames of others",
        ),
    ],
)
def test_a_puck_that_is_well_passes_everything(
    hand: Hand, emulator: dict, name: str, result: str
) -> None:
    checks = checked(hand, **emulator)
    assert all(one.holds for one in checks.values())
    assert checks[name].result.startswith(result)


def test_probe_tells_what_it_can_drive_from_what_it_cannot() -> None:
    def report(**emulator) -> NodeReport:
        clock, hand = SimulatedClock(), stretching()
        options = puck_options(hand, emulator=emulator)
        with connected(
            options, clock=clock, hand=hand, range_end=END, all_nodes=True
        ) as link:
            (one,) = probe(link, clock)
        return one

    well = report(awake=True)
    assert well.is_supported
    assert well.properties == {
        **{"MODE": 0, "CTS": 4096, "IPNM": 2700, "MT": 4860},
        **{"GRPA": 0, "GRPB": 2, "GRPC": 5, "TEMP": 31, "VBUS": 48},
    }
    assert report().properties == {}  # asleep it says no more
    assert report(role=2).kind == "safety module"
    assert report(role=9).kind == "unknown, ROLE 9"
    broken = report(has_error=True)  # and the nodes after it are asked all the same
    assert (broken.kind, broken.firmware) == ("in error, STAT 1", None)
    assert not broken.is_supported
    other = report(awake=True, firmware=40, properties=property_table(148))
    assert (other.is_supported, other.properties) == (False, {})


# A free arm turned by its motor

TWO = (radians(60.0), radians(80.0))


def simulated(clock: SimulatedClock, **faults) -> FaultyDevice:
    """The simulated device with a free arm at 60 deg, and what is wrong."""
    inner = open_device("simulated", clock=clock, hand=loose(60.0))
    device = FaultyDevice(inner, clock, **faults)
    device.open()
    return device


def test_it_runs_on_the_simulated_device_too_and_the_watchdog_hears_every_tick() -> (
    None
):
    heard = Heard()
    clock = heard.clock
    with simulated(clock) as device:
        estimate = fit_friction(steady_runs(device, clock, watchdog=heard))
    assert estimate.viscous == pytest.approx(0.168, rel=0.015)
    assert estimate.coulomb == pytest.approx(0.189, rel=0.015)
    assert len(heard.said) == clock.now_ns() // 1_000_000 + 2
    assert heard.said[-1] == "rest"


@pytest.mark.parametrize(
    ("hand", "words"),
    [
        # Rests for a minute before it does anything
        (
            stretching(57.3, start=radians(60.0), delay=60.0),
            r"needs a free arm, 0.5 N·m do not move it",
        ),
        (loose(130.0), "between 30 and 125 deg to begin with"),
    ],
)
def test_an_arm_that_is_held_or_near_its_end_is_not_turned(
    hand: Hand, words: str
) -> None:
    clock = SimulatedClock()
    with opened(clock, hand) as device, pytest.raises(DeviceError, match=words):
        steady_runs(device, clock)


def test_a_first_reading_that_is_lost_is_waited_for() -> None:
    clock = SimulatedClock()
    with simulated(clock, read_fault=dropped(0.0, 2)) as device:
        assert len(steady_runs(device, clock, speeds=TWO[1:])) == 2


def test_a_motor_that_turns_the_other_way_is_noticed_at_once() -> None:
    # Under speed control it would run away.
    clock = SimulatedClock()
    with simulated(clock, send_fault=lambda _time_s, torque: -torque) as device:
        words = "torque and counts have different signs"
        with pytest.raises(DeviceError, match=words):
            steady_runs(device, clock)
        assert abs(device.read().angle - radians(60.0)) < radians(2.0)


def turned(device: Device, clock: SimulatedClock, ends: str, **options) -> DeviceError:
    """What ends an arm that turns by itself."""
    with pytest.raises(DeviceError, match=ends) as caught:
        steady_runs(device, clock, speeds=TWO, **options)
    return caught.value


@pytest.mark.parametrize(
    ("one", "words", "kind"),
    [
        (
            fault("frozen-encoder", 0.9),
            "frozen: needs a change of angle within 10",
            "frozen",
        ),
        (fault("jumping-encoder", 0.9), "jump: needs an angle within 0.3 deg", "jump"),
        (fault("idled", 0.9), "needs MODE 2, but something else set it to 0", "idled"),
        # As in a presentation: three in a row, and every fourth of a hundred
        (
            fault("dropped-replies", 0.6, end_s=0.61),
            r"needs at most 2 ticks in a row .*no position within 1 ms",
            "missed-replies",
        ),
        (
            fault("dropped-replies", 0.6, every=4),
            "at most 10 of 100 ticks",
            "missed-replies",
        ),
    ],
)
def test_a_fault_while_the_arm_turns_by_itself_ends_it(one, words, kind) -> None:
    clock = SimulatedClock()
    with opened(clock, loose(60.0), emulator={"faults": (one,)}) as device:
        assert turned(device, clock, words).kind == kind
        motor, now_ns = device.emulator.motor, clock.now_ns()
        assert radians(35.0) < motor.angle(now_ns) < radians(120.0)
        assert abs(motor.plant.velocity) < radians(150.0)
    assert device.emulator.mode == 0


def test_two_lost_readings_in_a_row_are_let_pass_and_one_that_comes_again_is_none() -> (
    None
):
    clock = SimulatedClock()
    faults = (fault("dropped-replies", 0.6, end_s=0.6015),)
    with opened(clock, loose(60.0), emulator={"faults": faults}) as device:
        assert len(steady_runs(device, clock, speeds=TWO)) == 4
    clock = SimulatedClock()
    with simulated(clock, read_fault=repeated(0.5)) as device:
        error = turned(device, clock, r"got 3 \(one of 0.499000 s again")
    assert isinstance(error, LimitExceededError)


def test_an_arm_that_is_caught_while_it_turns_is_let_go_soon() -> None:
    # At 20 deg/s until 0.5 s, then it comes to rest against something soft: 0.2 s
    # later at the latest the torque has been too much for an arm at rest for 0.2 s.
    def angle(time_s: float) -> float:
        after = max(0.0, time_s - 0.5)
        moved = min(time_s, 0.5) + 0.02 * -math.expm1(-after / 0.02)
        step = radians(0.005)
        return math.floor(radians(75.0 + 20.0 * moved) / step) * step

    clock = SimulatedClock()
    with ScriptedDevice(clock, angle) as device:
        turned(device, clock, "standing torque: needs at most 1 N·m")
    assert max(abs(torque) for _, torque in device.commands) <= 2.0
    assert clock.now_ns() < 1_100_000_000


def test_an_emergency_stop_ends_it() -> None:
    stop = EmergencyStop()
    clock = ActingClock({0.5: lambda _: stop.press("test")})
    with simulated(clock) as device:
        error = turned(device, clock, "emergency stop: test", stop=stop)
    assert isinstance(error, EmergencyStopError)
    assert clock.now_ns() <= 502_000_000


# The fit

speeds = st.lists(st.floats(0.1, 3.0), min_size=2, max_size=6, unique=True)


def runs_of(
    viscous: float, coulomb: float, offset: float, speeds: list[float]
) -> list[SteadyRun]:
    return [
        SteadyRun(speed=v, torque=viscous * v + math.copysign(coulomb, v) + offset)
        for speed in speeds
        for v in (speed, -speed)
    ]


def test_errors_are_those_of_least_squares() -> None:
    # Over 400 draws B ± 1.96 errors (11 degrees of freedom: t = 2.2) holds the truth
    # in 95 % of them; below 91 % or above 98 % has a chance of 1e-3 or less.
    rng = np.random.default_rng(5)
    clean = runs_of(0.168, 0.189, 0.0, [0.2, 0.4, 0.6, 0.8, 1.0, 1.2, 1.4])
    inside = 0
    for _ in range(400):
        noisy = [replace(r, torque=r.torque + rng.normal(0.0, 0.01)) for r in clean]
        estimate = fit_friction(noisy)
        inside += abs(estimate.viscous - 0.168) <= 2.201 * estimate.viscous_error
    assert 364 <= inside <= 392


@pytest.mark.parametrize(
    "runs",
    [
        [],
        runs_of(0.1, 0.1, 0.0, [1.0]),
        [SteadyRun(speed=v, torque=v) for v in (1.0, 2.0, 3.0, 4.0)],
        runs_of(0.1, 0.1, 0.0, [1.0]) * 2,
    ],
)
def test_runs_that_cannot_tell_are_refused(runs: list[SteadyRun]) -> None:
    with pytest.raises(ParameterError, match="at two speeds and in both directions"):
        fit_friction(runs)


# A mirrored puck is the same to everybody: counts and torques change their signs
# together, so that only a person who looks at the arm can tell
# (docs/howto/laboratory/hardware.md).
@pytest.mark.parametrize(
    ("start_deg", "options"), [(120.0, {}), (60.0, {"direction": -1})]
)
def test_a_free_arm_says_its_friction_from_wherever_it_starts(
    start_deg: float, options: dict
) -> None:
    clock, hand = SimulatedClock(), loose(start_deg)
    options = puck_options(hand, **options)
    two = (radians(40.0), radians(80.0))
    with open_device("puck", clock=clock, hand=hand, options=options) as device:
        estimate = fit_friction(steady_runs(device, clock, speeds=two))
    assert device.emulator.mode == 0
    assert estimate.viscous == pytest.approx(0.168, rel=0.03)
    assert estimate.coulomb == pytest.approx(0.189, rel=0.03)
