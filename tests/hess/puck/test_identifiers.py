import pytest

from masrel.errors import FrameError
from masrel.hess.puck.identifiers import (
    POSITION_GROUP,
    PROPERTY_GROUP,
    TORQUE_GROUP,
    Address,
    from_puck,
    split_identifier,
    to_group,
    to_puck,
)


def test_the_identifiers_of_puck_1_are_those_of_the_manual() -> None:
    # G FFFFF TTTTT: 0 00000 00001; 1 00001 00110; 1 00001 00011; 1 00000 00001
    assert to_puck(1) == 0b0_00000_00001 == 0x001
    assert from_puck(1, PROPERTY_GROUP) == 0b1_00001_00110 == 0x426
    assert from_puck(1, POSITION_GROUP) == 0b1_00001_00011 == 0x423
    assert to_group(TORQUE_GROUP) == 0b1_00000_00001 == 0x401


def test_the_safety_module_broadcasts_on_1344() -> None:
    assert split_identifier(1344) == Address(sender=10, receiver=0, is_group=True)


def test_every_identifier_comes_apart_and_goes_together_again() -> None:
    for identifier in range(0x800):
        sender, receiver, is_group = split_identifier(identifier)
        assert identifier == is_group << 10 | sender << 5 | receiver
        if is_group and sender:
            assert from_puck(sender, receiver) == identifier
        elif is_group:
            assert to_group(receiver) == identifier


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: to_puck(0), "puck: needs 1 to 31, got 0"),
        (lambda: to_puck(32), "puck: needs 1 to 31, got 32"),
        (lambda: to_group(-1), "group: needs 0 to 31, got -1"),
        (lambda: from_puck(3, 32), "group: needs 0 to 31, got 32"),
        (lambda: split_identifier(0x800), "identifier: needs 11 bits, got 0x800"),
    ],
)
def test_what_is_not_on_this_bus_is_refused(call, words: str) -> None:
    with pytest.raises(FrameError, match=words):
        call()
