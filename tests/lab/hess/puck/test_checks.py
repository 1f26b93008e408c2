"""What ``check`` and ``probe`` find on pucks that are well, and on others."""

import pytest

from masrel.errors import DeviceError
from masrel.lab.hess import Hand, SimulatedClock
from masrel.lab.hess.puck import (
    Check,
    InjectedFault,
    NodeReport,
    check,
    connected,
    probe,
    property_table,
)
from tests.lab.hess.puck.rig import END, fault, loose, puck_options, stretching


def checked(hand: Hand | None = None, **emulator) -> dict[str, Check]:
    clock, hand = SimulatedClock(), hand or loose()
    options = puck_options(hand, emulator=emulator)
    with connected(options, clock=clock, hand=hand, range_end=END) as link:
        checks = check(link, clock, options)
    return {one.name: one for one in checks}


def failing(checks: dict[str, Check]) -> list[str]:
    return [name for name, one in checks.items() if not one.holds]


def early(kind, **more) -> InjectedFault:
    return fault(kind, 0.0, **more)


def test_a_puck_that_is_well_passes_everything() -> None:
    checks = checked(awake=True)
    assert failing(checks) == []
    assert checks["position"].result == "90.00 deg; look whether the arm is there"


def test_one_that_was_woken_is_not_zeroed() -> None:
    assert checked()["position"].result == "0.00 deg; not zeroed yet"


def test_noise_of_others_is_counted_and_does_no_harm() -> None:
    checks = checked(is_noisy=True)
    assert failing(checks) == []
    assert checks["error frames"].result == "0, and 4000 frames of others"


def test_a_torque_that_does_not_read_back_fails() -> None:
    checks = checked(faults=(early("dropped-torques"),))
    assert failing(checks) == ["torque mode"]
    assert "needs a T that reads back" in checks["torque mode"].result


def test_a_puck_that_is_kept_from_torque_mode_fails() -> None:
    checks = checked(faults=(early("idled"),))
    assert failing(checks) == ["torque mode"]
    assert "is an emergency stop pressed" in checks["torque mode"].result


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
        "MODE": 0,
        "CTS": 4096,
        "IPNM": 2700,
        "MT": 4860,
        "GRPA": 0,
        "GRPB": 2,
        "GRPC": 5,
        "TEMP": 31,
        "VBUS": 48,
    }
    assert report().properties == {}  # asleep it says no more
    assert report(role=2).kind == "safety module"
    assert report(role=9).kind == "unknown, ROLE 9"
    broken = report(has_error=True)  # and the nodes after it are asked all the same
    assert (broken.kind, broken.firmware) == ("in error, STAT 1", None)
    assert not broken.is_supported
    other = report(awake=True, firmware=40, properties=property_table(148))
    assert (other.is_supported, other.properties) == (False, {})


def test_a_bus_on_which_nobody_is_cannot_be_checked() -> None:
    clock, hand = SimulatedClock(), loose()
    options = puck_options(hand, emulator={"wake_s": 3.0})
    with (
        connected(options, clock=clock, hand=hand, range_end=END) as link,
        pytest.raises(DeviceError, match="no answer for property 5"),
    ):
        check(link, clock, options)


def test_the_emulated_arm_is_where_its_hand_holds_it() -> None:
    checks = checked(loose(45.0), awake=True)
    assert checks["position"].result.startswith("45.00 deg")


@pytest.mark.parametrize(
    ("kind", "more", "failed"),
    [
        ("dropped-replies", {"every": 100}, ["answers"]),
        ("late-replies", {"size": 0.0006}, ["answers"]),
        ("late-replies", {"size": 0.0004}, []),
        ("jumping-encoder", {"every": 2, "size": 5.0}, ["rest"]),
        ("jumping-encoder", {"every": 2, "size": 4.0}, []),
        ("jumping-encoder", {"size": 30_000.0}, ["position", "rest"]),
        ("error-frames", {"every": 400}, ["error frames"]),
        ("unplugged", {"end_s": 1.0}, ["answers"]),
    ],
)
def test_what_is_wrong_with_a_puck_is_found(
    kind, more: dict, failed: list[str]
) -> None:
    # The faults of an emulated puck begin after its first torque mode: that of a check
    # before, 20 ms in which it is woken and configured once more.
    clock, hand = SimulatedClock(), loose()
    emulator = {"awake": True, "faults": (fault(kind, 0.02, **more),)}
    options = puck_options(hand, emulator=emulator)
    with connected(options, clock=clock, hand=hand, range_end=END) as link:
        assert all(one.holds for one in check(link, clock, options))
        checks = check(link, clock, options)
    assert [one.name for one in checks if not one.holds] == failed
