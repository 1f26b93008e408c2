"""The bus, against python-can itself at the other end."""

import time

import can
import pytest
from can.interfaces.virtual import VirtualBus

from masrel.errors import BusError
from masrel.lab.hess import RealClock, SimulatedClock
from masrel.lab.hess.puck import Frame, Link
from masrel.lab.hess.puck._bus import open_link, reply_identifiers


@pytest.fixture
def ends(request: pytest.FixtureRequest):
    channel = request.node.name
    link = open_link("virtual", channel, clock=RealClock())
    other = can.Bus(interface="virtual", channel=channel, ignore_config=True)
    yield link, other
    link.close()
    other.shutdown()


def test_a_frame_goes_out_as_it_is(ends) -> None:
    link, other = ends
    link.send(Frame(0x401, b"\xaa\x00\x01"))
    message = other.recv(0.0)
    assert (message.arbitration_id, bytes(message.data)) == (0x401, b"\xaa\x00\x01")
    assert not message.is_extended_id
    assert not message.is_error_frame


def test_frames_come_in_in_their_order(ends) -> None:
    link, other = ends
    for number in range(3):
        other.send(can.Message(arbitration_id=number, is_extended_id=False))
    assert [link.receive(0) for _ in range(4)] == [
        Frame(0, b""),
        Frame(1, b""),
        Frame(2, b""),
        None,
    ]


def test_an_error_frame_says_its_class(ends) -> None:
    link, other = ends
    other.send(
        can.Message(arbitration_id=0x40, is_error_frame=True, is_extended_id=False)
    )
    frame = link.receive(0)
    assert frame is not None
    assert (frame.identifier, frame.is_error) == (0x40, True)


@pytest.mark.parametrize("kind", ["is_extended_id", "is_remote_frame"])
def test_frames_that_no_puck_sends_are_nobodys(ends, kind: str) -> None:
    link, other = ends
    flags = {"is_extended_id": False, kind: True}
    other.send(can.Message(arbitration_id=0x423, **flags))
    assert link.receive(0) == Frame(0, b"")  # not a position of puck 1


def test_waiting_ends_at_the_deadline(ends) -> None:
    link, _ = ends
    begun = time.monotonic_ns()
    assert link.receive(begun + 20_000_000) is None
    assert time.monotonic_ns() - begun >= 19_000_000


def test_a_closed_bus_is_said_to_be(ends) -> None:
    link, _ = ends
    link.close()
    link.close()  # twice does nothing more
    with pytest.raises(BusError, match="the bus takes no frame") as caught:
        link.send(Frame(1, b""))
    assert caught.value.kind == "bus"
    with pytest.raises(BusError, match="the bus cannot be read"):
        link.receive(0)


@pytest.mark.parametrize(
    ("before", "said"),
    [(None, "the bus cannot be left"), ("still under torque", "still under torque")],
)
def test_a_bus_that_cannot_be_left_hides_no_error_before(before, said: str) -> None:
    class Stuck(VirtualBus):
        def shutdown(self) -> None:
            super().shutdown()
            raise can.CanOperationError("no such port")

    def leave() -> None:
        with Link(Stuck(channel="stuck"), RealClock()):
            if before is not None:
                raise BusError(before)

    with pytest.raises(BusError, match=said):
        leave()


class Metronome:
    """Acts every 2 ms of a simulated clock."""

    def __init__(self, clock: SimulatedClock, bus: can.BusABC) -> None:
        self.clock, self.bus, self.next_ns = clock, bus, 2_000_000

    def next_due_ns(self) -> int | None:
        return self.next_ns

    def serve(self) -> None:
        while self.clock.now_ns() >= self.next_ns:
            number = self.next_ns // 2_000_000
            self.bus.send(can.Message(arbitration_id=number, is_extended_id=False))
            self.next_ns += 2_000_000

    def close(self) -> None:
        self.next_ns = 0


def test_a_neighbour_acts_while_this_end_waits_on_a_simulated_clock() -> None:
    clock = SimulatedClock()
    with can.Bus(interface="virtual", channel="tick", ignore_config=True) as bus:
        link = open_link("virtual", "tick", clock=clock, peer=Metronome(clock, bus))
        received = [(link.receive(20_000_000), clock.now_ns()) for _ in range(3)]
        assert received == [
            (Frame(1, b""), 2_000_000),
            (Frame(2, b""), 4_000_000),
            (Frame(3, b""), 6_000_000),
        ]
        assert link.receive(7_000_000) is None
        assert clock.now_ns() == 7_000_000
        link.close()


@pytest.mark.parametrize(
    ("interface", "filters"),
    [
        (
            "socketcan",
            [
                {"can_id": 0x423, "can_mask": 0x7FF, "extended": False},
                {"can_id": 0x426, "can_mask": 0x7FF, "extended": False},
            ],
        ),
        ("pcan", None),  # python-can would filter error frames out with the rest
    ],
)
def test_the_kernel_is_asked_for_the_answers_of_one_puck_alone(
    interface: str, filters: list | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: dict = {}
    real = can.Bus

    def opened(**settings):
        asked.update(settings)
        return real(interface="virtual", channel="filters", ignore_config=True)

    monkeypatch.setattr(can, "Bus", opened)
    open_link(
        interface, "can0", clock=RealClock(), accepted=reply_identifiers(1)
    ).close()
    assert asked == {
        "interface": interface,
        "channel": "can0",
        "bitrate": 1_000_000,
        "can_filters": filters,
        "ignore_config": True,
    }
