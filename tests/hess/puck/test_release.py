"""Letting go of a puck, over a bus that does not let it say so."""

import pytest

from masrel.errors import BusError, DeviceError
from masrel.hess.puck.bus import Frame, Link
from masrel.hess.puck.node import PuckNode
from masrel.hess.puck.release import release
from tests.hess.puck.rig import bench

T, MODE = 42, 8


class Deaf(Link):
    """Takes frames, and gives none."""

    def receive(self, deadline_ns: int) -> Frame | None:
        super().receive(deadline_ns)
        raise BusError("puck: the bus cannot be read (test)")


def test_a_puck_that_cannot_be_heard_is_idled_all_the_same() -> None:
    one = bench(awake=True)
    one.node.tell(MODE, 2)
    one.node.tell(T, 100)
    assert one.node.ask(T) == 100
    node = PuckNode(
        Deaf(one.link._bus, one.clock, neighbour=one.emulator), one.clock, 1
    )
    begun_ns = one.clock.now_ns()
    with pytest.raises(DeviceError, match=r"cannot be read .* SWITCH ITS SUPPLY OFF"):
        release(node, torque_number=T, mode_number=MODE)
    assert one.clock.now_ns() - begun_ns <= 110_000_000
    assert (one.emulator.registers.mode, one.emulator.registers.torque) == (0, 0)
    one.close()
