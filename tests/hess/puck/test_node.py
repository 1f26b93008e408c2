"""Waiting for a puck while others never fall silent."""

from collections.abc import Callable

import pytest

from masrel.errors import DeviceTimeoutError
from masrel.hess import SimulatedClock
from masrel.hess.puck.bus import Frame, Link, open_link
from masrel.hess.puck.node import PuckNode

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
        lambda node: node.ask(8, patience_s=0.001),
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
