"""The emulated puck, frame by frame: every trait a driver has to cope with."""

from math import degrees

import pytest

from masrel.errors import (
    BusError,
    DeviceError,
    DeviceTimeoutError,
)
from masrel.lab.hess import SimulatedClock
from masrel.lab.hess.puck import Frame, Link
from tests.lab.hess.puck.rig import (
    Bench,
    PuckNode,
    bench,
    open_link,
    release,
)

MODE, T, P = 8, 42, 48
AT_90_DEG = 19251  # of 77004.8 counts in 360 deg


@pytest.fixture
def on():
    benches: list[Bench] = []

    def make(**options) -> Bench:
        benches.append(bench(**options))
        return benches[-1]

    yield make
    for one in benches:
        one.close()


def answers(one: Bench, identifier: int, data: bytes) -> list[Frame]:
    """What comes within a millisecond of a frame of the host."""
    one.link.send(Frame(identifier, data))
    end_ns = one.clock.now_ns() + 1_000_000
    received = []
    while (frame := one.link.receive(end_ns)) is not None:
        received.append(frame)
    return received


def told(one: Bench, *settings: tuple[int, int], wait_s: float = 0.001) -> Bench:
    for number, value in settings:
        one.node.set(number, value)
    one.node.wait(wait_s)
    one.node.receive_waiting()
    return one


def position(one: Bench) -> int:
    return one.node.position(P, patience_s=0.001)[1]


# Asleep and awake


# Answers


def test_an_answer_takes_150_microseconds_and_the_encoder_is_read_after_75(on) -> None:
    one = on(awake=True)
    asked_ns = one.clock.now_ns()
    assert one.node.position(P, patience_s=0.001) == (asked_ns + 75_000, AT_90_DEG)
    assert one.clock.now_ns() == asked_ns + 150_000


@pytest.mark.parametrize(
    ("identifier", "data", "n"),
    [
        (1, b"\x30", 1),
        (2, b"\x30", 0),  # another puck's
        (0x426, b"\x30", 0),  # from itself
        (1, b"", 0),
        (1, b"\xaa\x00\x01", 0),
        (1, b"\x7f", 0),  # no such property
    ],
)
def test_it_answers_what_is_for_it_and_means_something(
    on, identifier: int, data: bytes, n: int
) -> None:
    assert len(answers(on(awake=True), identifier, data)) == n


# Torque


def test_it_holds_its_last_torque_for_ever_but_not_idle(on) -> None:
    one = told(on(awake=True), (T, 1000), wait_s=0.1)
    assert position(one) == AT_90_DEG  # idle it ignores torques
    told(one, (MODE, 2), (T, 144), wait_s=60.0)  # nobody says anything for a minute
    torque = one.emulator.motor.plant.motor_torque
    assert torque == pytest.approx(-144 * 18.8 / 2700, abs=1e-9)
    assert degrees(one.emulator.motor.angle(one.clock.now_ns())) > 145.9


def test_the_babbling_of_others_is_bounded(on) -> None:
    one = on(awake=True)
    for _ in range(1001):
        one.emulator.link.send(Frame(0x443, b"\x00\x00\x00"))
    with pytest.raises(BusError, match="flooded") as caught:
        position(one)
    assert caught.value.kind == "flooded"


# A puck on a bus where others never fall silent, or on one that cannot be heard


class Babbling(Link):
    """Whoever waits gets a frame of another puck; what waited before was read."""

    n_frames = 0

    def receive(self, deadline_ns: int) -> Frame | None:
        if deadline_ns == 0:
            return None
        self.n_frames += 1
        if self.n_frames > 10_000:
            raise AssertionError("it listens to others for ever")
        self._clock.sleep_until_ns(self._clock.now_ns() + 50_000)  # a busy bus
        return Frame(0x443, b"\x00\x00\x00")


@pytest.mark.parametrize("wait", [PuckNode.get, PuckNode.position])
def test_it_does_not_wait_for_ever_while_others_speak(wait) -> None:
    clock = SimulatedClock()
    link = Babbling(open_link("virtual", "babbling", clock=clock)._bus, clock)
    node = PuckNode(link, clock, 1)
    for _ in range(2):  # the second position has a marker, too
        begun_ns = clock.now_ns()
        with pytest.raises(DeviceTimeoutError, match="within 1 ms"):
            wait(node, P, patience_s=0.001)
        assert clock.now_ns() - begun_ns <= 4_000_000
    link.close()


class Deaf(Link):
    """Takes frames, and gives none."""

    def receive(self, deadline_ns: int) -> Frame | None:
        super().receive(deadline_ns)
        raise BusError("puck: the bus cannot be read (test)")


def test_a_puck_that_cannot_be_heard_is_idled_all_the_same(on) -> None:
    one = told(on(awake=True), (MODE, 2), (T, 100))
    assert one.node.get(T) == 100
    node = PuckNode(Deaf(one.link._bus, one.clock, peer=one.emulator), one.clock, 1)
    begun_ns = one.clock.now_ns()
    with pytest.raises(DeviceError, match=r"cannot be read .* SWITCH ITS SUPPLY OFF"):
        release(node, torque_id=T, mode_id=MODE)
    assert one.clock.now_ns() - begun_ns <= 110_000_000
    assert (one.emulator.mode, one.emulator.torque) == (0, 0)
