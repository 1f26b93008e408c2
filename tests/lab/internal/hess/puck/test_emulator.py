"""The emulated puck, frame by frame: every trait a driver has to cope with."""

from math import degrees, radians

import pytest

from masrel.errors import BusError, DeviceTimeoutError, FrameError, ParameterError
from masrel.lab.hess.puck import EmulatorOptions, Frame, InjectedFault
from masrel.lab.hess.puck._codec import HOST, encode_get, from_node
from tests.lab.hess.puck.rig import Bench, bench, fault, loose, packed_torques

VERS, ROLE, STAT = 0, 1, 5
MODE, T, MT, P, CTS, IPNM, GRPA, PIDX = 8, 42, 43, 48, 68, 86, 26, 70


@pytest.fixture
def on():
    benches: list[Bench] = []

    def make(**options) -> Bench:
        benches.append(bench(**options))
        return benches[-1]

    yield make
    for one in benches:
        one.close()


def frames_after(one: Bench, *sent: Frame, wait_s: float = 0.001) -> list[Frame]:
    for frame in sent:
        one.link.send(frame)
    end_ns = one.clock.now_ns() + round(wait_s * 1e9)
    received = []
    while (frame := one.link.receive(end_ns)) is not None:
        received.append(frame)
    return received


def silent(one: Bench, number: int) -> bool:
    return frames_after(one, Frame(1, encode_get(number))) == []


def driving(one: Bench, units: int = 0) -> Bench:
    one.node.set(T, units)
    one.node.set(MODE, 2)
    one.node.wait(0.001)
    one.node.receive_waiting()
    return one


# Asleep and awake


def test_it_starts_in_its_monitor_and_answers_what_every_puck_does(on) -> None:
    node = on().node
    assert [node.get(number) for number in (STAT, VERS, ROLE)] == [0, 148, 0]


@pytest.mark.parametrize("number", [MODE, T, P, CTS, IPNM])
def test_asleep_it_answers_nothing_else(on, number: int) -> None:
    assert silent(on(), number)


def test_asleep_8_is_not_its_mode(on) -> None:
    one = on()
    one.node.set(MODE, 2)
    one.node.wait(0.001)
    one.node.receive_waiting()
    assert one.emulator.settings[-1].name == "LOCK"
    assert one.emulator.mode == 0


@pytest.mark.parametrize("wake_s", [0.01, 1.0])
def test_it_leaves_the_bus_while_it_wakes(on, wake_s: float) -> None:
    one = on(wake_s=wake_s)
    one.node.set(STAT, 2)
    one.node.wait(wake_s - 0.001)
    assert silent(one, STAT)
    assert one.emulator.n_disturbances == 1
    one.node.wait(0.001)
    assert one.node.get(STAT) == 2


def test_it_counts_from_where_the_arm_is_when_switched_on(on) -> None:
    one = on(wake_s=0.01)
    one.node.set(STAT, 2)
    one.node.wait(0.02)
    assert one.node.position(P, patience_s=0.001)[1] == 0


# Answers


def test_an_answer_takes_150_microseconds_and_the_encoder_is_read_after_75(on) -> None:
    one = on(awake=True)
    asked_ns = one.clock.now_ns()
    sampled_ns, counts = one.node.position(P, patience_s=0.001)
    assert sampled_ns == asked_ns + 75_000
    assert one.clock.now_ns() == asked_ns + 150_000
    assert counts == 19251  # 90 deg of 77004.8 counts in 360


@pytest.mark.parametrize("size", [4, 6])
def test_answers_of_four_and_of_six_bytes_say_the_same(on, size: int) -> None:
    one = on(awake=True, reply_bytes=size)
    (frame,) = frames_after(one, Frame(1, encode_get(IPNM)))
    assert len(frame.data) == size
    assert one.node.get(IPNM) == 2700


def test_what_16_bits_cannot_hold_comes_in_six_bytes(on) -> None:
    assert on(awake=True, reply_bytes=4, counts_per_turn=40960).node.get(CTS) == 40960


@pytest.mark.parametrize(("flagged", "first"), [(False, 0x00), (True, 0x80)])
def test_a_position_comes_with_and_without_its_top_bit(
    on, flagged: bool, first: int
) -> None:
    one = on(awake=True, is_flagged=flagged)
    (frame,) = frames_after(one, Frame(1, encode_get(P)))
    assert frame.identifier == 0x423
    assert frame.data[0] & 0xC0 == first
    assert one.node.position(P, patience_s=0.001)[1] == 19251


def test_a_position_comes_with_that_of_a_second_encoder(on) -> None:
    one = on(awake=True, has_secondary=True)
    (frame,) = frames_after(one, Frame(1, encode_get(P)))
    assert len(frame.data) == 6
    assert one.node.position(P, patience_s=0.001)[1] == 19251


def test_positions_wrap_at_22_bits(on) -> None:
    one = on(awake=True)
    one.node.set(P, 2**21 - 1)
    one.node.wait(0.001)
    assert one.node.position(P, patience_s=0.001)[1] == 2**21 - 1
    one.node.set(P, 2**21)
    one.node.wait(0.001)
    assert one.node.position(P, patience_s=0.001)[1] == -(2**21)


def test_a_group_is_answered_by_its_members(on) -> None:
    one = on(awake=True)
    group_2 = Frame(from_node(HOST, 2), encode_get(P))  # factory: 0, 2, 5
    group_1 = Frame(from_node(HOST, 1), encode_get(P))
    assert len(frames_after(one, group_2)) == 1
    assert frames_after(one, group_1) == []
    one.node.set(GRPA, 1)
    one.node.wait(0.001)
    assert len(frames_after(one, group_1)) == 1


@pytest.mark.parametrize(
    "frame",
    [
        Frame(2, encode_get(P)),  # another puck's
        Frame(1, b""),
        Frame(1, b"\xaa\x00\x01"),
        Frame(0x426, encode_get(P)),  # from itself
        Frame(1, encode_get(127)),
    ],
)
def test_what_is_not_for_it_or_means_nothing_stays_unanswered(on, frame: Frame) -> None:
    assert frames_after(on(awake=True), frame) == []


def test_noise_of_others_does_not_hide_its_answer(on) -> None:
    one = on(awake=True, is_noisy=True)
    for _ in range(3):
        assert one.node.position(P, patience_s=0.001)[1] == 19251
    assert one.node.n_foreign == 12
    assert 0x540 in {
        frame.identifier for frame in frames_after(one, Frame(1, encode_get(P)))
    }


# Torque


def test_idle_it_ignores_torques(on) -> None:
    one = on(awake=True)
    one.node.set(T, 1000)
    one.node.wait(0.1)
    assert one.node.position(P, patience_s=0.001)[1] == 19251


def test_it_holds_its_last_torque_for_ever(on) -> None:
    one = driving(on(awake=True), 144)
    one.node.wait(0.05)
    one.node.receive_waiting()
    assert one.emulator.motor.plant.motor_torque == pytest.approx(
        -144 * 18.8 / 2700, abs=1e-9
    )
    one.node.wait(60.0)  # nobody says anything for a minute
    one.node.receive_waiting()
    assert one.emulator.motor.plant.motor_torque == pytest.approx(
        -144 * 18.8 / 2700, abs=1e-9
    )
    assert degrees(one.emulator.motor.angle(one.clock.now_ns())) > 145.9


def test_its_own_limit_clips(on) -> None:
    one = on(awake=True)
    one.node.set(MT, 100)
    driving(one, 8000)
    assert one.node.get(T) == 100
    one.node.set(T, -8000)
    one.node.wait(0.001)
    assert one.node.get(T) == -100


def test_idle_it_brakes(on) -> None:
    def coasted_deg(idle: bool) -> float:
        one = driving(on(awake=True, hand=loose(45.0)), 288)  # 2 N·m
        one.node.wait(0.1)
        one.node.set(T, 0)
        if idle:
            one.node.set(MODE, 0)
        one.node.wait(0.001)
        one.node.receive_waiting()
        here = one.emulator.motor.angle(one.clock.now_ns())
        one.node.wait(0.3)
        return degrees(one.emulator.motor.angle(one.clock.now_ns()) - here)

    # 0.06 kg·m² against B = 0.168 and β = 0.189, with or without 1 N·m·s/rad more
    assert 0.0 < coasted_deg(True) < 0.3 * coasted_deg(False)


@pytest.mark.parametrize("slot", [1, 2, 3, 4])
def test_it_obeys_its_place_in_a_packed_frame(on, slot: int) -> None:
    one = on(awake=True)
    one.node.set(GRPA, 1)
    one.node.set(PIDX, slot)
    driving(one)
    one.link.send(Frame(from_node(HOST, 1), packed_torques(10, 20, 30, 40)))
    one.node.wait(0.001)
    assert one.node.get(T) == 10 * slot


def test_writing_its_memory_is_counted(on) -> None:
    one = on(awake=True)
    for number in (30, 31, 32):  # SAVE, LOAD, DEF
        one.node.set(number, -1)
    one.node.wait(0.001)
    one.node.receive_waiting()
    assert one.emulator.n_memory_writes == 3


# Faults; they begin when it is first put into torque mode


def failing(on, kind, **more) -> Bench:
    return driving(on(awake=True, faults=(fault(kind, 0.0, **more),)))


@pytest.mark.parametrize("kind", ["dropped-requests", "dropped-replies", "unplugged"])
def test_what_is_lost_is_not_answered(on, kind) -> None:
    one = failing(on, kind)
    with pytest.raises(DeviceTimeoutError, match="puck 1: no position within 1 ms"):
        one.node.position(P, patience_s=0.001)


def test_every_third_answer_can_be_lost(on) -> None:
    one = failing(on, "dropped-replies", every=3)
    answered = []
    for _ in range(6):
        try:
            one.node.position(P, patience_s=0.001)
            answered.append(True)
        except DeviceTimeoutError:
            answered.append(False)
    # After a loss a second question marks the answer: the third one sent, the fourth
    # to be lost, is a position again.
    assert answered == [False, True, False, True, False, True]


def test_a_lost_torque_leaves_the_one_before(on) -> None:
    one = driving(on(awake=True, faults=(fault("dropped-torques", 0.05),)), 50)
    one.node.wait(0.1)
    one.node.receive_waiting()
    one.node.set(T, 0)
    one.node.wait(0.001)
    assert one.node.get(T) == 50


def test_a_late_answer_is_not_taken_for_the_next_one(on) -> None:
    # Each comes 1.2 ms late, for the first 2 ms; the arm moves meanwhile.
    options = {"faults": (fault("late-replies", 0.1, end_s=0.102, size=0.0012),)}
    one = driving(on(awake=True, hand=loose(45.0), **options), 288)
    one.node.wait(0.0985)
    n_lost, previous = 0, (0, 0)
    for _ in range(12):
        next_ns = one.clock.now_ns() + 1_000_000
        try:
            sampled_ns, counts = one.node.position(P, patience_s=0.001)
        except DeviceTimeoutError:
            n_lost += 1
            previous = (0, 0)
        else:
            if previous[0]:  # the speed between readings is that of the arm
                speed = (counts - previous[1]) / (sampled_ns - previous[0]) * 1e9
                true = one.emulator.motor.plant.velocity / radians(360 / 77004.8)
                assert speed == pytest.approx(true, rel=0.06)
            previous = sampled_ns, counts
        one.clock.sleep_until_ns(next_ns)
    assert n_lost == 2
    assert one.node.n_late == 2


def test_a_second_answer_is_thrown_away(on) -> None:
    one = failing(on, "duplicated-replies")
    for _ in range(5):
        one.node.position(P, patience_s=0.001)
        one.node.wait(0.001)
    assert one.node.n_late == 4  # the last has not been listened to


def test_a_short_answer_is_refused(on) -> None:
    one = failing(on, "short-replies")
    with pytest.raises(FrameError, match="position: needs 3 or 6 bytes, got 00 4b"):
        one.node.position(P, patience_s=0.001)


def test_error_frames_are_counted_and_too_many_refused(on) -> None:
    one = failing(on, "error-frames")
    for _ in range(10):
        one.node.position(P, patience_s=0.001)
    assert one.node.n_errors == 10
    with pytest.raises(BusError, match="at most 10 error frames") as caught:
        one.node.position(P, patience_s=0.001)
    assert caught.value.kind == "error-frames"


def test_bus_off_is_named_and_ends_with_a_restart(on) -> None:
    one = driving(on(awake=True, faults=(fault("bus-off", 0.01, end_s=0.02),)))
    one.node.wait(0.015)
    with pytest.raises(BusError, match="bus off") as caught:
        one.node.position(P, patience_s=0.001)
    assert caught.value.kind == "bus-off"
    with pytest.raises(DeviceTimeoutError):
        one.node.position(P, patience_s=0.001)
    one.node.wait(0.01)
    assert one.node.position(P, patience_s=0.001)[1] == 19251


@pytest.mark.parametrize(
    ("kind", "counts"),
    [
        ("frozen-encoder", 19251),
        ("jumping-encoder", 21251),
        ("wrapping-encoder", 19251 % 4096),
    ],
)
def test_an_encoder_fails(on, kind, counts: int) -> None:
    one = failing(on, kind)
    assert one.node.position(P, patience_s=0.001)[1] == counts
    if kind == "frozen-encoder":
        one.node.set(T, 300)
        one.node.wait(0.1)
        assert one.node.position(P, patience_s=0.001)[1] == counts
        assert one.emulator.motor.angle(one.clock.now_ns()) > radians(91.0)


def test_it_is_idled_from_outside(on) -> None:
    one = driving(on(awake=True, faults=(fault("idled", 0.01),)), 100)
    assert one.node.get(MODE) == 2
    one.node.wait(0.01)
    assert one.node.get(MODE) == 0


def test_a_reset_puts_it_to_sleep(on) -> None:
    one = driving(on(awake=True, faults=(fault("reset", 0.01),)), 100)
    one.node.wait(0.02)
    assert one.node.get(STAT) == 0
    assert one.emulator.motor.plant.motor_torque == pytest.approx(0.0, abs=0.05)


def test_the_babbling_of_others_is_bounded(on) -> None:
    one = on(awake=True)
    other = on(awake=True)  # any second end would do
    assert other.node.get(STAT) == 2
    for _ in range(1001):
        one.emulator.link.send(Frame(0x443, b"\x00\x00\x00"))
    with pytest.raises(BusError, match="flooded") as caught:
        one.node.position(P, patience_s=0.001)
    assert caught.value.kind == "flooded"


# What it cannot be


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: EmulatorOptions(wake_s=-1.0), "wake_s: needs 0 or more, got -1.0"),
        (lambda: EmulatorOptions(reply_bytes=5), "reply_bytes: needs 4 or 6, got 5"),
        (
            lambda: InjectedFault(kind="fire", start_s=0.0),
            "kind: needs one of dropped-requests, .* got fire",
        ),
        (
            lambda: InjectedFault(kind="idled", start_s=2.0, end_s=1.0),
            "start_s, end_s: need 0 <= start_s < end_s, got 2.0 and 1.0",
        ),
        (
            lambda: InjectedFault(kind="idled", start_s=0.0, every=0),
            "every: needs 1 or more, got 0",
        ),
    ],
)
def test_options_out_of_range_are_refused(make, words: str) -> None:
    with pytest.raises(ParameterError, match=words):
        make()


def test_answers_come_in_the_order_of_their_questions(on) -> None:
    # Late until 2 ms after the beginning, and then not: nobody is overtaken.
    one = driving(on(awake=True, faults=(fault("late-replies", 0.001, end_s=0.002),)))
    late = one.clock.now_ns()
    numbers = [CTS, IPNM, STAT, VERS]
    for number in numbers:
        one.node.request(number)
        one.node.wait(0.0006)
    end_ns, answered = late + 10_000_000, []
    while (frame := one.link.receive(end_ns)) is not None:
        answered.append(frame.data[0] & 0x7F)
    assert answered == numbers
