"""A moteus as a device: what is refused at opening, what it is told, how it begins."""

from math import degrees, nan, radians

import pytest

from masrel.errors import DeviceError, IdledError, LimitExceededError
from masrel.lab.hess import SimulatedClock, run_presentation
from masrel.lab.hess.moteus import check, connected, probe, zero
from masrel.lab.hess.puck import InjectedFault, fit_friction, steady_runs
from tests.lab.hess.moteus.rig import loose, moteus_options, opened, presented
from tests.lab.hess.rig import (
    END,
    LIMITS,
    MODELS,
    ActingClock,
    controls,
    stretching,
)


def wait(clock: SimulatedClock, time_s: float) -> None:
    clock.sleep_until_ns(clock.now_ns() + round(time_s * 1e9))


@pytest.mark.parametrize(
    ("emulator", "words"),
    [
        ({"home_state": 1}, r"home state 1.* hold the arm .* masrel device zero"),
        ({"timeout_mode": 12}, r"needs servo\.timeout_mode 0, .* got 12"),
        ({"timeout_mode": 10}, r"needs servo\.timeout_mode 0, .* got 10"),
        ({"lowest_angle_deg": nan}, r"needs servopos\.position_min and .* nan"),
        ({"highest_angle_deg": 900.0}, "a little beyond the arm's stops, got"),
    ],
)
def test_what_must_not_be_near_a_person_is_not_opened(
    emulator: dict, words: str
) -> None:
    with pytest.raises(DeviceError, match=words):
        opened(emulator=emulator)


def test_an_arm_outside_the_bounds_is_stopped_by_the_controller_itself() -> None:
    clock = SimulatedClock()
    emulator = {"lowest_angle_deg": 70.0}
    with opened(clock=clock, emulator=emulator) as device:
        for _ in range(2):  # an answer says what was before the torque
            device.command(0.0)
            wait(clock, 0.001)
        with pytest.raises(IdledError, match="code 39: outside-limits") as caught:
            device.read()
    assert caught.value.kind == "outside-limits"


@pytest.mark.parametrize(
    "changes",
    [
        {"servo": 100, "direction": -1, "gear_ratio": 0.5, "zero_rev": 3.0},
        pytest.param({"gear_ratio": 6.0, "zero_rev": -0.4}, marks=pytest.mark.slow),
    ],
)
def test_a_mirrored_or_geared_one_presents_the_same(changes: dict) -> None:
    plain, _ = presented(model="HM2")
    done, device = presented(model="HM2", **changes)
    assert done.fault is None
    catch, expected = (p.recording.facts["catch_angle_deg"] for p in (done, plain))
    assert catch == pytest.approx(expected, abs=0.02)
    most = max(abs(nm) for _, nm in device.emulator.torques)
    expected = max(abs(plain.recording.columns["command_torque_nm"]))
    assert most == pytest.approx(expected, abs=0.05)  # 7.99: the arm's at its catch


def test_one_exchange_a_tick_makes_a_reading_of_the_tick_before() -> None:
    clock = SimulatedClock()
    with opened(clock=clock) as device:
        ages_ms = []
        for _ in range(5):
            wait(clock, 0.001)
            reading = device.read()
            ages_ms.append((clock.now_ns() - reading.time_ns) * 1e-6)
            device.command(0.0)
    # the first is asked for; the others are sampled 0.14 ms after their torque
    assert ages_ms[0] == pytest.approx(0.10, abs=0.001)
    assert ages_ms[1:] == [pytest.approx(0.86, abs=0.001)] * 4


def test_after_silence_without_torque_it_is_stopped_and_started_anew() -> None:
    clock = SimulatedClock()
    with opened(clock=clock) as device:
        for _ in range(2):
            for torque in (0.0, 1.0, 0.0):
                device.read()
                device.command(torque)
                wait(clock, 0.001)
            wait(clock, 5.0)  # as between two presentations
        assert degrees(device.read().angle) == pytest.approx(60.0, abs=1.0)
        device.command(1.0)
        wait(clock, 0.1)
        with pytest.raises(IdledError, match="received nothing for 20 ms") as caught:
            device.read()
    assert caught.value.kind == "watchdog"


def test_a_host_that_is_away_while_it_lets_go_tries_again() -> None:
    clock = ActingClock({})
    with opened(clock=clock) as device:
        for _ in range(10):
            device.command(0.0)
            wait(clock, 0.001)
            device.read()
        assert device.emulator.mode == 10
        clock.acts[clock.now_ns() * 1e-9] = lambda _: clock.miss(0.15)
    assert device.emulator.mode == 0  # no error


def test_it_refuses_a_torque_above_its_own_limit() -> None:
    with opened(largest_torque_nm=10.0) as device:
        device.command(-9.99)
        with pytest.raises(LimitExceededError, match="at most 10 N·m on this moteus"):
            device.command(10.01)


@pytest.mark.parametrize(
    ("fault", "failed"),
    [
        (None, []),
        pytest.param(
            InjectedFault(kind="foreign-frames", start_s=0.0),
            [],
            marks=pytest.mark.slow,
        ),
        pytest.param(
            InjectedFault(kind="late-replies", start_s=0.0, size=0.0006),
            ["answers"],
            marks=pytest.mark.slow,
        ),
        (InjectedFault(kind="board-fault", start_s=0.01), ["torque mode"]),
    ],
)
def test_what_a_check_finds(fault: InjectedFault | None, failed: list[str]) -> None:
    clock, hand = SimulatedClock(), loose()
    options = moteus_options(*([fault] if fault else []))
    with connected(options, clock=clock, hand=hand) as link:
        # the faults begin with the torque mode of the first
        checks = [one for _ in range(2) for one in check(link, clock, options)]
        assert link.peer.mode == 0
    assert [one.name for one in checks if not one.holds] == failed
    assert len(checks) == 12


def test_one_that_is_not_known_is_zeroed_and_then_opened() -> None:
    clock, hand = SimulatedClock(), loose(60.0)
    options = moteus_options(emulator={"home_state": 0}, direction=-1, gear_ratio=2.0)
    with connected(options, clock=clock, hand=hand, all_nodes=True) as link:
        (report,) = probe(link, clock, options)
        assert (report.servo, report.home_state, report.fault) == (1, 0, None)
        assert zero(link, clock, options, angle=radians(90.0)) == pytest.approx(-0.5)
        (report,) = probe(link, clock, options)
        assert report.home_state == 2
        found = check(link, clock, options)[2]
        assert found.result.startswith("90.00 deg")


@pytest.mark.slow
def test_a_free_arm_says_its_friction() -> None:
    clock = SimulatedClock()
    with opened(clock=clock, direction=-1, gear_ratio=3.0) as device:
        two = (radians(40.0), radians(80.0))
        estimate = fit_friction(steady_runs(device, clock, speeds=two))
    assert estimate.viscous == pytest.approx(0.168, rel=0.03)
    assert estimate.coulomb == pytest.approx(0.189, rel=0.03)


@pytest.mark.parametrize(
    "numbers",
    [
        range(2),
        pytest.param(range(2, 8), marks=pytest.mark.slow),
        *(
            pytest.param(range(first, first + 500), marks=pytest.mark.long)
            for first in range(0, 10_000, 500)
        ),
    ],
    ids=str,
)
def test_no_presentation_fails_that_nothing_is_wrong_with(numbers: range) -> None:
    for number in numbers:
        clock, speed = SimulatedClock(), 40.0 + 80.0 * ((number * 0.618) % 1.0)
        hand = stretching(speed)
        with opened(clock=clock, hand=hand) as device:
            done = run_presentation(
                device,
                controls(MODELS[number % 4]),
                clock=clock,
                limits=LIMITS,
                end_angle=END,
            )
        assert done.fault is None, (number, done.fault)
        assert done.recording.facts["n_missed_replies"] == 0
