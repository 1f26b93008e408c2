"""What ``check`` and ``probe`` find on pucks that are well, and on others."""

import pytest

from masrel.errors import DeviceError
from masrel.hess import Hand, SimulatedClock
from masrel.hess.puck.checks import Check, check
from masrel.hess.puck.connection import awake, connected
from masrel.hess.puck.faults import InjectedFault
from masrel.hess.puck.properties import property_table
from masrel.hess.puck.survey import Found, probe
from tests.hess.puck.rig import END, fault, loose, puck_options, stretching


def checked(hand: Hand | None = None, **emulator) -> dict[str, Check]:
    clock, hand = SimulatedClock(), hand or loose()
    options = puck_options(hand, emulator=emulator)
    with connected(options, clock=clock, hand=hand, range_end=END) as link:
        found = check(awake(link, clock, options), options)
    return {one.name: one for one in found}


def failing(found: dict[str, Check]) -> list[str]:
    return [name for name, one in found.items() if not one.holds]


def early(kind, **more) -> InjectedFault:
    return fault(kind, 0.0, **more)


def test_a_puck_that_is_well_passes_everything() -> None:
    found = checked(awake=True)
    assert failing(found) == []
    assert found["position"].found == "90.00 deg; look whether the arm is there"


def test_one_that_was_woken_is_not_zeroed() -> None:
    assert checked()["position"].found == "0.00 deg; not zeroed yet"


def test_noise_of_others_is_counted_and_does_no_harm() -> None:
    found = checked(is_noisy=True)
    assert failing(found) == []
    assert found["error frames"].found == "0, and 4000 frames of others"


def test_a_torque_that_does_not_read_back_fails() -> None:
    found = checked(faults=(early("dropped-torques"),))
    assert failing(found) == ["torque mode"]
    assert "needs a T that reads back" in found["torque mode"].found


def test_a_puck_that_is_kept_from_torque_mode_fails() -> None:
    found = checked(faults=(early("idled"),))
    assert failing(found) == ["torque mode"]
    assert "is an emergency stop pressed" in found["torque mode"].found


@pytest.mark.parametrize(
    ("fault_kind", "more", "failed"),
    [
        ("dropped-replies", {"every": 100}, ["answers"]),
        ("late-replies", {"size": 0.0006}, ["answers"]),
        ("late-replies", {"size": 0.0004}, []),
        ("jumping-encoder", {"every": 2, "size": 5.0}, ["rest"]),
        ("jumping-encoder", {"every": 2, "size": 4.0}, []),
        ("jumping-encoder", {"size": 30_000.0}, ["position"]),
        ("error-frames", {"every": 400}, ["error frames"]),
        ("unplugged", {"end_s": 1.0}, ["answers"]),
    ],
)
def test_what_is_wrong_with_a_puck_is_found(
    fault_kind, more: dict, failed: list[str]
) -> None:
    # The faults of an emulated puck begin with its first torque mode: put it there
    # and back before it is looked at.
    clock, hand = SimulatedClock(), loose()
    emulator = {"awake": True, "faults": (fault(fault_kind, 0.004, **more),)}
    options = puck_options(hand, emulator=emulator)
    with connected(options, clock=clock, hand=hand, range_end=END) as link:
        puck = awake(link, clock, options)
        puck.node.tell(puck.table.number("MODE"), 2)
        puck.node.wait(0.001)
        puck.node.tell(puck.table.number("MODE"), 0)
        puck.node.wait(0.004)
        found = {one.name: one for one in check(puck, options)}
    assert failing(found) == failed


def test_probe_tells_what_it_can_drive_from_what_it_cannot() -> None:
    def found(**emulator) -> Found:
        clock, hand = SimulatedClock(), stretching()
        options = puck_options(hand, emulator=emulator)
        with connected(
            options, clock=clock, hand=hand, range_end=END, hears_all=True
        ) as link:
            (one,) = probe(link, clock)
        return one

    well = found(awake=True)
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
    assert found().properties == {}  # asleep it says no more
    assert found(role=2).kind == "safety module"
    assert found(role=9).kind == "unknown, ROLE 9"
    broken = found(has_error=True)  # and the nodes after it are asked all the same
    assert (broken.kind, broken.firmware) == ("in error, STAT 1", None)
    assert not broken.is_supported
    other = found(awake=True, firmware=40, properties=property_table(148))
    assert (other.is_supported, other.properties) == (False, {})


def test_a_bus_on_which_nobody_is_cannot_be_checked() -> None:
    clock, hand = SimulatedClock(), loose()
    options = puck_options(hand, emulator={"wake_s": 3.0})
    with (
        connected(options, clock=clock, hand=hand, range_end=END) as link,
        pytest.raises(DeviceError, match="no answer for property 5"),
    ):
        awake(link, clock, options)


def test_the_emulated_arm_is_where_its_hand_holds_it() -> None:
    found = checked(loose(45.0), awake=True)
    assert found["position"].found.startswith("45.00 deg")
