"""The emulated puck, frame by frame: every trait a driver has to cope with."""

from math import degrees

import pytest

from masrel.errors import (
    BusError,
    DeviceError,
    DeviceTimeoutError,
)
from masrel.lab.hess import SimulatedClock
from masrel.lab.hess.puck import Frame, Link, PuckOptions
from tests.lab.hess.puck.rig import (
    Bench,
    PuckNode,
    bench,
    loose,
    n_memory_writes,
    open_link,
    release,
)

VERS, ROLE, STAT = 0, 1, 5
MODE, T, MT, P, CTS, IPNM = 8, 42, 43, 48, 68, 86
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


def angle_deg(one: Bench) -> float:
    return degrees(one.emulator.motor.angle(one.clock.now_ns()))


# Asleep and awake


def test_it_starts_in_its_monitor_and_leaves_the_bus_while_it_wakes(on) -> None:
    one = on(wake_s=0.01)
    assert [one.node.get(number) for number in (STAT, VERS, ROLE)] == [0, 148, 0]
    for number in (MODE, T, P, CTS, IPNM):  # asleep it answers nothing else
        assert answers(one, 1, bytes((number,))) == []
    told(one, (MODE, 2))
    assert one.emulator.settings[-1].name == "LOCK"  # asleep 8 is not its mode
    assert one.emulator.mode == 0
    told(one, (STAT, 2), wait_s=0.009)
    assert answers(one, 1, bytes((STAT,))) == []
    assert one.emulator.n_disturbances == 1
    assert told(one).node.get(STAT) == 2
    assert position(one) == 0  # it counts from where the arm was when it was asleep


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
    assert angle_deg(one) > 145.9


def test_its_own_limit_clips_and_writes_of_its_memory_are_counted(on) -> None:
    one = told(on(awake=True), (MT, 100), (MODE, 2), (T, 8000))
    assert one.node.get(T) == 100
    assert told(one, (T, -8000)).node.get(T) == -100
    told(one, *((number, -1) for number in (30, 31, 32)))
    assert n_memory_writes(one.emulator) == 3  # SAVE, LOAD, DEF


def test_idle_it_brakes(on) -> None:
    def coasted_deg(*settings: tuple[int, int]) -> float:
        one = told(on(awake=True, hand=loose(45.0)), (MODE, 2), (T, 288), wait_s=0.1)
        here = angle_deg(told(one, *settings))
        one.node.wait(0.3)
        return angle_deg(one) - here

    # 0.06 kg·m² against B = 0.168 and β = 0.189, with or without 1 N·m·s/rad more
    assert 0.0 < coasted_deg((T, 0), (MODE, 0)) < 0.3 * coasted_deg((T, 0))


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
    link = Babbling(
        open_link("virtual", "babbling", clock=clock)._bus, clock, PuckOptions()
    )
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
    node = PuckNode(
        Deaf(one.link._bus, one.clock, PuckOptions(), peer=one.emulator), one.clock, 1
    )
    begun_ns = one.clock.now_ns()
    with pytest.raises(DeviceError, match=r"cannot be read .* SWITCH ITS SUPPLY OFF"):
        release(node, torque_id=T, mode_id=MODE)
    assert one.clock.now_ns() - begun_ns <= 110_000_000
    assert (one.emulator.mode, one.emulator.torque) == (0, 0)
