"""A puck on a bus where others never fall silent, or on one that cannot be heard."""

from collections.abc import Callable

import pytest

from masrel.errors import BusError, DeviceError, DeviceTimeoutError
from masrel.lab.hess import SimulatedClock
from masrel.lab.hess.puck import Frame, Link
from masrel.lab.hess.puck._bus import open_link
from masrel.lab.hess.puck._node import PuckNode, release
from tests.lab.hess.puck.rig import bench

T, MODE = 42, 8
_FRAME_NS = 50_000  # what a busy bus or a slow reader takes for a frame


class Babbling(Link):
    """Whoever waits gets a frame of another puck; what waited before was read."""

    def __init__(self, link: Link, clock: SimulatedClock) -> None:
        super().__init__(link._bus, clock)
        self.n_frames = 0

    def receive(self, deadline_ns: int) -> Frame | None:
        if deadline_ns == 0:
            return None
        self.n_frames += 1
        if self.n_frames > 10_000:
            raise AssertionError("it listens to others for ever")
        self._clock.sleep_until_ns(self._clock.now_ns() + _FRAME_NS)
        return Frame(0x443, b"\x00\x00\x00")


@pytest.mark.parametrize(
    "wait",
    [
        lambda node: node.get(8, patience_s=0.001),
        lambda node: node.position(48, patience_s=0.001),
    ],
    ids=["ask", "position"],
)
def test_it_does_not_wait_for_ever_while_others_speak(
    wait: Callable[[PuckNode], object],
) -> None:
    clock = SimulatedClock()
    link = Babbling(open_link("virtual", "babbling", clock=clock), clock)
    node = PuckNode(link, clock, 1)
    for _ in range(2):  # the second position has a marker, too
        begun_ns = clock.now_ns()
        with pytest.raises(DeviceTimeoutError, match="within 1 ms"):
            wait(node)
        assert clock.now_ns() - begun_ns <= 4_000_000
    link.close()


# Letting go


class Deaf(Link):
    """Takes frames, and gives none."""

    def receive(self, deadline_ns: int) -> Frame | None:
        super().receive(deadline_ns)
        raise BusError("puck: the bus cannot be read (test)")


def test_a_puck_that_cannot_be_heard_is_idled_all_the_same() -> None:
    one = bench(awake=True)
    one.node.set(MODE, 2)
    one.node.set(T, 100)
    assert one.node.get(T) == 100
    node = PuckNode(Deaf(one.link._bus, one.clock, peer=one.emulator), one.clock, 1)
    begun_ns = one.clock.now_ns()
    with pytest.raises(DeviceError, match=r"cannot be read .* SWITCH ITS SUPPLY OFF"):
        release(node, torque_id=T, mode_id=MODE)
    assert one.clock.now_ns() - begun_ns <= 110_000_000
    assert (one.emulator.mode, one.emulator.torque) == (0, 0)
    one.close()
