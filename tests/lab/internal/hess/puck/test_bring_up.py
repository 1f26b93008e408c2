"""What is refused of a puck that is woken and configured; its answers are altered."""

from collections.abc import Iterator
from contextlib import contextmanager
from math import radians

import can
import pytest

from masrel.errors import DeviceError, ParameterError
from masrel.lab.hess import RealClock
from masrel.lab.hess.puck import Frame, Link, PuckOptions, connected
from masrel.lab.hess.puck._codec import encode_position, encode_value
from masrel.lab.hess.puck._commissioning import awake
from masrel.lab.hess.puck._node import AwakePuck
from tests.lab.hess.puck.rig import bench

STAT, MODE, CTS, IPNM, GRPA = 5, 8, 68, 86, 26


class Altered(Link):
    """A bus on which some properties, and maybe the position, read otherwise."""

    values: dict[int, int]
    counts: int | None = None

    def receive(self, deadline_ns: int) -> Frame | None:
        frame = super().receive(deadline_ns)
        if frame is None:
            return None
        if frame.identifier == 0x423 and self.counts is not None:
            return frame._replace(data=encode_position(self.counts))
        number = frame.data[0] & 0x7F
        if frame.identifier == 0x426 and number in self.values:
            return frame._replace(data=encode_value(number, self.values[number]))
        return frame


@contextmanager
def woken(
    values: dict[int, int] | None = None, counts: int | None = None, **emulator
) -> Iterator[AwakePuck]:
    one = bench(**emulator)
    link = Altered(one.link._bus, one.clock, peer=one.emulator)
    link.values, link.counts = values or {}, counts
    try:
        yield awake(link, one.clock, PuckOptions())
    finally:
        one.close()


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({STAT: 0}, "puck 1: needs STAT 2 after waking, got 0"),
        ({CTS: 0}, "puck 1: needs CTS and IPNM above 0, got 0 and 2700"),
        ({IPNM: -3}, "puck 1: needs CTS and IPNM above 0, got 4096 and -3"),
        ({GRPA: 9}, "puck 1: GRPA needs 0, reads 9"),
        ({MODE: 3}, "puck 1: MODE needs 0, reads 3"),
    ],
)
def test_answers_that_make_no_sense_are_refused(
    values: dict[int, int], words: str
) -> None:
    with pytest.raises(DeviceError, match=words), woken(values):
        pass


def test_a_puck_under_torque_is_not_zeroed() -> None:
    with woken(awake=True) as puck:
        puck.node.set(MODE, 2)
        puck.node.wait(0.001)
        with pytest.raises(DeviceError, match="needs MODE 0 to be zeroed, is 2"):
            puck.set_position(radians(90.0))


@pytest.mark.parametrize(("off", "is_refused"), [(2, False), (-3, True)])
def test_a_position_that_does_not_read_back_is_refused(
    off: int, is_refused: bool
) -> None:
    with woken(counts=19251 + off) as puck:  # 90 deg
        if is_refused:
            words = "needs a position of 19251 counts after zeroing, got 19248"
            with pytest.raises(DeviceError, match=words):
                puck.set_position(radians(90.0))
        else:
            assert puck.set_position(radians(90.0)) == 19253


@pytest.mark.parametrize("angle_deg", [-0.1, 180.1, float("nan")])
def test_no_arm_is_beyond_its_ends(angle_deg: float) -> None:
    with (
        woken() as puck,
        pytest.raises(ParameterError, match="angle: needs 0 to 180 degrees"),
    ):
        puck.set_position(radians(angle_deg))


@pytest.mark.parametrize("all_nodes", [False, True])
def test_the_kernel_filters_unless_all_nodes_are_to_be_received(
    all_nodes: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    filters = []
    real = can.Bus

    def opened(**settings):
        filters.append(settings["can_filters"])
        return real(interface="virtual", channel="nodes", ignore_config=True)

    monkeypatch.setattr(can, "Bus", opened)
    with connected(PuckOptions(), clock=RealClock(), all_nodes=all_nodes):
        pass
    assert [one is None for one in filters] == [all_nodes]
