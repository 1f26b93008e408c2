"""What is refused of a puck that is woken, configured and zeroed; it answers oddly."""

from math import radians

import can
import pytest

from masrel.errors import DeviceError, ParameterError
from masrel.lab.hess import RealClock
from masrel.lab.hess.puck import Frame, Link, PuckOptions, connected, zero
from tests.lab.hess.puck.rig import bench

STAT, MODE, CTS, IPNM, GRPA = 5, 8, 68, 86, 26


class Altered(Link):
    """A bus on which some properties, and maybe the position, read otherwise."""

    values: dict[int, list[int]]  # what comes in turn, the last one for ever
    counts: int | None

    def receive(self, deadline_ns: int) -> Frame | None:
        frame = super().receive(deadline_ns)
        if frame is None:
            return None
        if frame.identifier == 0x423 and self.counts is not None:
            return frame._replace(data=self.counts.to_bytes(3, "big"))
        said = self.values.get(frame.data[0] & 0x7F)
        if frame.identifier != 0x426 or not said:
            return frame
        value = said.pop(0) if len(said) > 1 else said[0]
        data = frame.data[:2] + value.to_bytes(4, "little", signed=True)
        return frame._replace(data=data)


def zeroed(
    values: dict[int, list[int]] | None = None,
    counts: int | None = None,
    angle_deg: float = 90.0,
) -> int:
    one = bench()
    link = Altered(one.link._bus, one.clock, peer=one.emulator)
    link.values, link.counts = values or {}, counts
    try:
        return zero(link, one.clock, PuckOptions(), angle=radians(angle_deg))
    finally:
        one.close()


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({STAT: [0]}, "puck 1: needs STAT 2 after waking, got 0"),
        ({CTS: [0]}, "puck 1: needs CTS and IPNM above 0, got 0 and 2700"),
        ({IPNM: [-3]}, "puck 1: needs CTS and IPNM above 0, got 4096 and -3"),
        ({GRPA: [9]}, "puck 1: GRPA needs 0, reads 9"),
        ({MODE: [3]}, "puck 1: MODE needs 0, reads 3"),
    ],
)
def test_answers_that_make_no_sense_are_refused(
    values: dict[int, list[int]], words: str
) -> None:
    with pytest.raises(DeviceError, match=words):
        zeroed(values)


def test_a_puck_under_torque_is_not_zeroed() -> None:
    with pytest.raises(DeviceError, match="needs MODE 0 to be zeroed, is 2"):
        zeroed({MODE: [0, 2]})


def test_a_position_that_does_not_read_back_is_refused() -> None:
    assert zeroed(counts=19251 + 2) == 19253
    words = "needs a position of 19251 counts after zeroing, got 19248"
    with pytest.raises(DeviceError, match=words):
        zeroed(counts=19251 - 3)


@pytest.mark.parametrize("angle_deg", [-0.1, 180.1, float("nan")])
def test_no_arm_is_beyond_its_ends(angle_deg: float) -> None:
    with pytest.raises(ParameterError, match="angle: needs 0 to 180 degrees"):
        zeroed(angle_deg=angle_deg)


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
