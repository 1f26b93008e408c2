"""An emulated moteus on a CAN-FD bus, with its watchdog, limits and faults.

It does what a driver must cope with: it forgets what a frame leaves out; it lets go
after silence, or brakes, and then obeys nothing until it is stopped; an answer says
what was before the commands that came with the question.
"""

import math
from collections import deque
from collections.abc import Iterator

from masrel.lab.hess._can import Frame, Link
from masrel.lab.hess._clock import Clock
from masrel.lab.hess._emulated import EmulatedAmplifier, InjectedFault, Motor, _Event
from masrel.lab.hess.hand import Hand
from masrel.lab.hess.moteus._frames import (
    ANSWER,
    CONSOLE,
    COUNTER,
    FROM_CONSOLE,
    INT8,
    POLL,
    READ,
    READ_ERROR,
    TO_CONSOLE,
    WRITE,
    WRITE_ERROR,
    Subframe,
    decode,
    encode,
    raw_of,
    value_of,
)
from masrel.lab.hess.moteus._moteus_options import (
    CODE,
    DRIVEN,
    FAULT,
    FEEDFORWARD,
    FIRMWARE,
    FREE,
    HOME_STATE,
    MODE,
    MOST_TORQUE,
    POSITION,
    PREPARING,
    SERIAL_NUMBER,
    SET_POSITION,
    STOPPED,
    TEMPERATURE,
    TIMEOUT,
    TORQUE,
    VELOCITY,
    VOLTAGE,
    WATCHDOG,
    MoteusEmulatorOptions,
    MoteusOptions,
)

_FRAME_NS, _REPLY_NS = 140_000, 100_000  # a frame of the host, and its answer
_OTHER_HOST_NS = 300_000
_PREPARING_NS = 3_000_000  # from a stop to the first torque; chosen
_COUNTS_PER_TURN = 131072  # of an encoder with 17 bits; chosen
_DAMPING = 1.0  # of an arm that it brakes, N·m·s/rad; chosen
_MAX_KEPT = 100_000  # torques that are remembered
_ZERO_VELOCITY_NM = 5.0  # servo.timeout_max_torque_Nm
_OUTSIDE_LIMITS, _TORQUE_LIMITED, _POSITION_LIMITED = 39, 102, 103
_KP_SCALE, _KD_SCALE = 0x023, 0x024
_NO_SUCH_REGISTER = 1
_COUNTER_BITS = (8, 16, 32, 23)  # as int8, int16, int32 and float
_WRITABLE = frozenset((MODE, SET_POSITION, *range(0x020, 0x02E)))


class MoteusEmulator(EmulatedAmplifier):
    """A moteus."""

    _torn_bytes = 8  # so that more than padding is lost
    _address_mask = 0xFF

    def __init__(
        self,
        *,
        link: Link,
        clock: Clock,
        hand: Hand,
        range_end: float,
        options: MoteusOptions,
    ) -> None:
        self._emulation = emulation = options.emulator or MoteusEmulatorOptions()
        super().__init__(
            link=link,
            clock=clock,
            faults=emulation.faults,
            motor=Motor(hand, range_end, emulation.arm),
            counts_per_turn=_COUNTS_PER_TURN,
            address=options.servo,
        )
        self._options = options
        self._home_state = emulation.home_state
        ends = (emulation.lowest_angle_deg, emulation.highest_angle_deg)
        low, high = sorted(options.position(math.radians(end)) for end in ends)
        self._bounds = low, high  # turns
        self._settings: dict[str, object] = {
            "servo.timeout_mode": emulation.timeout_mode,
            "servopos.position_min": low,
            "servopos.position_max": high,
        }
        self._offset = 0.0  # turns, between what it reports and where its output is
        self.mode, self._code = STOPPED, 0
        self._n_commands = 0
        self._console = b""
        self._last_answer = b""
        # When its torque changed, and to what, N·m at the elbow
        self.torques: deque[tuple[int, float]] = deque([(0, 0.0)], maxlen=_MAX_KEPT)

    # What comes from the bus

    def _obey(self, frame: Frame, now_ns: int) -> None:
        subframes = decode(frame.data)
        self._at(now_ns + _FRAME_NS, lambda due: self._execute(frame, subframes, due))
        self._interfere(now_ns)

    def _execute(
        self, frame: Frame, subframes: tuple[Subframe, ...], now_ns: int
    ) -> None:
        answer = [part for one in subframes for part in self._answers(one, now_ns)]
        self._write(
            {
                register: value_of(register, one.kind, raw)
                for one in subframes
                if one.act == WRITE
                for register, raw in enumerate(one.values, one.first)
            },
            now_ns,
        )
        if not frame.identifier & 0x8000:
            return
        is_stale = self.faults.hit("stale-replies", now_ns)
        self._last_answer = data = self._last_answer if is_stale else encode(answer)
        is_other = self.faults.hit("renumbered-replies", now_ns) is not None
        source = (self._options.servo + is_other) % 128
        identifier = source << 8 | frame.identifier >> 8 & 0x7F
        self._answer(Frame(identifier, data), now_ns + _REPLY_NS)

    def _answers(self, subframe: Subframe, now_ns: int) -> Iterator[Subframe]:
        act, kind, first, n, _, text = subframe
        if act == READ:
            yield self._read(kind, first, n, now_ns)
        elif act == WRITE:
            for register in range(first, first + n):
                if register not in _WRITABLE:
                    yield Subframe(WRITE_ERROR, 0, register, _NO_SUCH_REGISTER)
        elif act == TO_CONSOLE:
            setting = text.decode(errors="replace").strip().removeprefix("conf get ")
            value = self._settings.get(setting, "ERR unknown")
            self._console += f"{value}\r\n".encode()
        elif act == POLL:
            text, self._console = self._console[:n], self._console[n:]
            yield Subframe(FROM_CONSOLE, 0, CONSOLE, len(text), text=text)

    # What it is told

    def _write(self, written: dict[int, float], now_ns: int) -> None:
        if SET_POSITION in written:
            self._offset += written[SET_POSITION] - self._turns(now_ns)
            self._home_state = 2
        mode = written.get(MODE)
        if mode == STOPPED:
            self._let_go(STOPPED, now_ns)
        elif mode == DRIVEN and self.mode in (STOPPED, *PREPARING, DRIVEN):
            if self.faults.hit("dropped-torques", now_ns):
                return
            self._drive(written, now_ns)
            if self.faults.hit("other-torques", now_ns):
                others = {**written, FEEDFORWARD: 0.0}
                self._at(now_ns + _OTHER_HOST_NS, lambda due: self._drive(others, due))

    def _drive(self, written: dict[int, float], now_ns: int) -> None:
        low, high = self._bounds
        if self.mode == STOPPED:
            if not low <= self._turns(now_ns) <= high:
                self._let_go(FAULT, now_ns, code=_OUTSIDE_LIMITS)
                return
            self.mode = PREPARING[0]
            self._begin_faults(now_ns)
            self._at(now_ns + _PREPARING_NS, self._begin_torque)
        self._n_commands += 1
        number, watchdog_s = self._n_commands, written.get(WATCHDOG, 0.0) or 0.1
        if not math.isnan(watchdog_s):
            late_ns = now_ns + round(watchdog_s * 1e9)
            self._at(late_ns, lambda due: self._time_out(number, due))
        if self.mode != DRIVEN:
            return
        if written.get(_KP_SCALE, 1.0) or written.get(_KD_SCALE, 1.0):
            self.motor.brake(now_ns, 100.0)  # it holds its position
            return
        self._turn(written, now_ns)

    def _begin_torque(self, _now_ns: int) -> None:
        if self.mode in PREPARING:
            self.mode = DRIVEN

    def _turn(self, written: dict[int, float], now_ns: int) -> None:
        torque, most = written.get(FEEDFORWARD, 0.0), written.get(MOST_TORQUE, math.nan)
        self._code, (low, high) = 0, self._bounds
        if abs(torque) > most:
            torque, self._code = math.copysign(most, torque), _TORQUE_LIMITED
        position = self._turns(now_ns)
        if (torque > 0.0 and position > high) or (torque < 0.0 and position < low):
            torque, self._code = 0.0, _POSITION_LIMITED
        at_elbow = self.faults.torque(self._options.torque(torque), now_ns)
        self.torques.append((now_ns, at_elbow))
        self.motor.drive(at_elbow, now_ns)

    def _let_go(self, mode: int, now_ns: int, *, code: int = 0) -> None:
        self.mode, self._code = mode, code
        self.torques.append((now_ns, 0.0))
        damping, most = 0.0, math.inf
        if mode == TIMEOUT and self._emulation.timeout_mode != FREE:
            damping = _DAMPING
            most = _ZERO_VELOCITY_NM if self._emulation.timeout_mode == 12 else most
        self.motor.brake(now_ns, damping, most)

    def _time_out(self, number: int, now_ns: int) -> None:
        if number == self._n_commands and self.mode in (*PREPARING, DRIVEN):
            self._let_go(TIMEOUT, now_ns)

    # What goes wrong by itself

    def _events_of(self, fault: InjectedFault) -> tuple[_Event | None, _Event | None]:
        if fault.kind != "board-fault":
            return super()._events_of(fault)
        code = round(fault.amount)
        return (lambda due: self._let_go(FAULT, due, code=code)), None

    def _idle(self, now_ns: int) -> None:
        self._let_go(STOPPED, now_ns)

    def _reset(self, now_ns: int) -> None:
        self._let_go(STOPPED, now_ns)
        self._home_state = 0
        self._offset -= self._turns(now_ns)

    def _foreign_frames(self) -> tuple[Frame, ...]:
        other = self._options.servo % 127 + 1
        state = encode([Subframe(ANSWER, INT8, MODE, 1, (FAULT,))])
        return (
            Frame(other << 8, state),
            Frame(other, state),  # to another
            Frame(self._options.servo << 8 | 5, state),  # to another host
        )

    # What it answers

    def _turns(self, now_ns: int) -> float:
        return self._options.position(self.motor.angle(now_ns)) + self._offset

    def _read(self, kind: int, first: int, n: int, now_ns: int) -> Subframe:
        raws = []
        for register in range(first, first + n):
            value = self._value(register, now_ns)
            if value is None:
                return Subframe(READ_ERROR, 0, register, _NO_SUCH_REGISTER)
            if register == COUNTER:  # it wraps
                bits = _COUNTER_BITS[kind]
                value = (int(value) + 2 ** (bits - 1)) % 2**bits - 2 ** (bits - 1)
            raws.append(raw_of(register, kind, value))
        return Subframe(ANSWER, kind, first, n, tuple(raws))

    def _value(self, register: int, now_ns: int) -> float | None:
        if register == POSITION:
            counts = round(self._turns(now_ns) * self._counts_per_turn)
            turns = self._encoder_counts(counts, now_ns) / self._counts_per_turn
            return math.nan if self.faults.hit("nan-replies", now_ns) else turns
        limited = self.faults.active("limited", now_ns)
        speed = self.motor.plant.velocity * self._options.gear_ratio / math.tau
        return {
            MODE: self.mode,
            VELOCITY: self._options.direction * speed,
            TORQUE: self._current_torque(now_ns),
            HOME_STATE: self._home_state,
            VOLTAGE: 24.0,
            TEMPERATURE: 30.0,
            CODE: self._code if limited is None else limited.amount,
            COUNTER: now_ns // 1_000_000,
            FIRMWARE: 0x010000,
            SERIAL_NUMBER: 4711,
            SERIAL_NUMBER + 1: 0,
            SERIAL_NUMBER + 2: 0,
        }.get(register)

    def _current_torque(self, now_ns: int) -> float:
        # What it believes to give: a motor of another constant gives something else
        scaled = self.faults.active("scaled-torque", now_ns)
        torque = self._options.output_torque(self.motor.plant.motor_torque)
        return torque if scaled is None else torque / scaled.amount


def connected(
    options: MoteusOptions,
    *,
    clock: Clock,
    hand: Hand | None = None,
    range_end: float = math.radians(146.0),
    all_nodes: bool = False,
) -> Link:
    """Join a bus for a while, with an emulated moteus on it where there is a hand.

    Parameters
    ----------
    options : MoteusOptions
        Which bus, and which moteus on it.
    clock : Clock
        The clock of deadlines.
    hand : Hand or None, optional
        What moves the arm of an emulated moteus.
    range_end : float, optional
        Where that arm meets its end stop, rad.
    all_nodes : bool, optional
        Whether to receive the frames of all nodes rather than of one moteus.

    Returns
    -------
    Link
        This end of the bus, for a ``with`` block; its `peer` is the emulated moteus.

    Raises
    ------
    DeviceError
        If the bus cannot be opened.
    """
    emulator = None
    if hand is not None:
        emulator = MoteusEmulator(
            link=options.open_link(clock),
            clock=clock,
            hand=hand,
            range_end=range_end,
            options=options,
        )
    accepted = None if all_nodes else (options.servo << 8,)
    return options.open_link(clock, accepted=accepted, peer=emulator)
