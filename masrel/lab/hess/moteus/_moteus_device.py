"""One moteus: asked and told, brought up, driven as a device, stopped.

An answer carries no number. So each question asks for the controller's counter of
milliseconds as another type than the three before: an answer to an earlier one is told
by that, and one that is repeated later by its count.

A torque and its answer are one exchange a tick: an answer is read in the tick after,
when it has long come, and says what was 0.9 ms ago. In the process of a watchdog
`prepare` joins the bus.
"""

import atexit
import math
from collections import deque
from collections.abc import Callable
from typing import NamedTuple

from masrel.errors import (
    BusError,
    DeviceError,
    DeviceTimeoutError,
    FrameError,
    IdledError,
    LimitExceededError,
)
from masrel.lab.hess._can import (
    CanDevice,
    Frame,
    Link,
    Node,
    check_angle,
    options_of,
)
from masrel.lab.hess._clock import Clock, RealClock
from masrel.lab.hess.device import DeviceSetup, Reading
from masrel.lab.hess.moteus._frames import (
    CONSOLE,
    COUNTER,
    FLOAT,
    INT8,
    POLL,
    READ,
    READ_ERROR,
    TO_CONSOLE,
    WRITE_ERROR,
    Subframe,
    decode,
    encode,
    value_of,
    write,
)
from masrel.lab.hess.moteus._moteus_emulator import connected
from masrel.lab.hess.moteus._moteus_options import (
    CODE,
    COMMAND,
    DRIVEN,
    FAULT,
    FAULTS,
    FREE,
    HOME_STATE,
    INTEGRAL_SCALE,
    LIMITS,
    MODE,
    OUTPUT_KNOWN,
    POSITION,
    PREPARING,
    STOPPED,
    TIMEOUT,
    TORQUE,
    VOLTAGE,
    WATCHDOG,
    MoteusOptions,
)
from masrel.lab.recording import ESTIMATED_TORQUE

_QUERY = (
    Subframe(READ, INT8, MODE),
    Subframe(READ, FLOAT, POSITION, 3),
    Subframe(READ, INT8, VOLTAGE, 3),
)
_STOP = write(INT8, MODE, STOPPED)
_ANSWERED = 0x8000  # in an identifier: the host, number 0, wants an answer

_SAMPLING_NS = 140_000  # from a question to the sample: own estimate for 64 bytes
_PATIENCE_S = 0.02  # outside the loop
_CONSOLE_NS, _POLL_NS = 200_000_000, 2_000_000  # for text, for a part of it
_CONSOLE_BYTES = 48

_COMPARED_NS = 100_000_000  # for how long two counts of milliseconds are: they wrap

_RECENT_NS = 1_500_000  # since a torque: then its answer is still of this tick
_LATE_S = 0.0005  # more than its patience, of which a tick has passed
_PREPARING_NS = 50_000_000  # from a stop to the first torque; chosen

_MAX_LIMITED = 2  # answers in a row that say that something limits the torque
# Between the torque that it was told in the last ticks and its own estimate
_TORQUE_TOLERANCE = 1.0  # N·m at the elbow; chosen
_TOLD_TICKS = 4  # a current takes some ticks to follow
_MAX_OFF = 10  # answers in a row


class State(NamedTuple):
    """What an answer says."""

    time_ns: int  # when it was sampled, as this end has it
    mode: int
    position: float  # turns
    torque_nm: float  # its own estimate from the current, at the output
    code: int


class Servo(Node):
    """A moteus on a bus."""

    def __init__(self, link: Link, clock: Clock, options: MoteusOptions) -> None:
        super().__init__(link, clock, f"moteus {options.servo}")
        self._options = options
        self._answer: dict[int, float] = {}  # by register
        self._counter_kind = INT8
        self._accepted: tuple[int, int] | None = None  # when that was asked, its count
        self._console = b""
        self.asked_ns = 0
        self.is_asked = False  # whether an answer may still come

    # In the loop

    def ask(self, *commands: Subframe) -> None:
        """Send commands and a question; `answer` waits for what comes of it."""
        self._counter_kind = (self._counter_kind + 1) % 4
        self._answer = {}
        counter = Subframe(READ, self._counter_kind, COUNTER)
        self.asked_ns = self._send(*commands, *_QUERY, counter)
        self.is_asked = True

    def command(self, torque_nm: float) -> None:
        """Send a torque of the elbow, and a question."""
        # All registers each time: one that is left out takes its default, and scales
        # of 1 would make it hold a position
        options = self._options
        feedforward = options.output_torque(torque_nm)
        most = options.largest_torque_nm / options.gear_ratio
        self.ask(
            write(INT8, MODE, DRIVEN),
            write(FLOAT, COMMAND, math.nan, 0.0, feedforward, 0.0, 0.0, most),
            write(FLOAT, WATCHDOG, options.watchdog_ms * 1e-3),
            write(FLOAT, INTEGRAL_SCALE, 0.0),
        )

    def answer(self, patience_s: float = _PATIENCE_S) -> State:
        """Return the answer to the last question, which may be waiting already."""
        self.is_asked = False
        self._await(self._is_current, self.asked_ns, patience_s, "no answer")
        answer, self._answer = self._answer, {}
        if math.isnan(answer[POSITION]):
            raise FrameError(f"{self.name}: its position is not a number")
        self._accepted = self.asked_ns, int(answer[COUNTER])
        return State(
            min(self.asked_ns + _SAMPLING_NS, self.clock.now_ns()),
            int(answer[MODE]),
            answer[POSITION],
            answer[TORQUE],
            int(answer[CODE]),
        )

    def _is_current(self) -> bool:
        # Whether an answer is there, and none that the controller has given before
        count = self._answer.get(COUNTER)
        if count is None or self._accepted is None:
            return count is not None
        asked_ns, count_then = self._accepted
        count_on = (int(count) - count_then + 128) % 256 - 128
        if count_on < 0 and self.asked_ns - asked_ns < _COMPARED_NS:
            self._answer = {}
        return bool(self._answer)

    # Outside the loop

    def stop(self) -> State:
        """Stop it, which also clears a fault and its timeout, until it confirms."""
        states: list[State] = []

        def attempt(_since_s: float) -> bool:
            self.ask(_STOP)
            states.append(self.answer())
            return states[-1].mode == STOPPED

        self.insist(attempt, "IF THE ARM IS NOT FREE, SWITCH ITS SUPPLY OFF")
        return states[-1]

    def get(
        self, kind: int, first: int, n: int = 1, *, patience_s: float = _PATIENCE_S
    ) -> tuple[float, ...]:
        """Return registers."""
        self._answer = {}
        registers = range(first, first + n)
        self._await(
            lambda: registers[-1] in self._answer,
            self._send(Subframe(READ, kind, first, n)),
            patience_s,
            f"no answer for register {first:#05x}",
        )
        return tuple(self._answer.pop(register) for register in registers)

    def setting(self, name: str) -> float:
        """Return a setting, which its console alone tells."""
        self._console = b""
        text = f"conf get {name}\n".encode()
        question = Subframe(TO_CONSOLE, 0, CONSOLE, len(text), text=text)
        deadline_ns = self._send(question, wants_answer=False) + _CONSOLE_NS
        while not self._console.endswith(b"\n"):
            if self._send(Subframe(POLL, 0, CONSOLE, _CONSOLE_BYTES)) > deadline_ns:
                raise DeviceTimeoutError(f"{self.name}: does not say its {name}")
            self._receive_until(lambda: False, self.clock.now_ns() + _POLL_NS)
        try:
            return float(self._console)
        except ValueError as error:
            raise DeviceError(
                f"{self.name}: needs a firmware with {name}, it says {self._console!r}"
            ) from error

    # The bus

    def _send(self, *subframes: Subframe, wants_answer: bool = True) -> int:
        identifier = self._options.servo + (_ANSWERED if wants_answer else 0)
        return self.link.send(Frame(identifier, encode(subframes)))

    def _sort(self, frame: Frame) -> None:
        if frame.identifier != self._options.servo << 8:
            self.n_foreign += 1
            return
        for act, kind, first, number, values, text in decode(frame.data):
            if act in (WRITE_ERROR, READ_ERROR):
                raise DeviceError(
                    f"{self.name}: does not allow register {first:#05x} to be "
                    f"{'written' if act == WRITE_ERROR else 'read'} (error {number})"
                )
            if first == COUNTER and kind != self._counter_kind:
                self._answer = {}  # to an earlier question
                return
            for register, raw in enumerate(values, first):
                self._answer[register] = value_of(register, kind, raw)
            self._console += text


class ReadyServo(Servo):
    """A moteus that is stopped and may be driven."""

    # Making one stops it and refuses what must not be near a person

    def __init__(self, link: Link, clock: Clock, options: MoteusOptions) -> None:
        super().__init__(link, clock, options)
        state = self.stop()
        if state.code in FAULTS:
            raise stopped_itself(self, state.code)
        (home_state,) = self.get(INT8, HOME_STATE)
        self.needs(
            home_state >= OUTPUT_KNOWN,
            f"to know where its output is, got home state {home_state:.0f}; hold the "
            "arm at a known angle and run masrel device zero",
        )
        timeout_mode = self.setting("servo.timeout_mode")
        self.needs(
            timeout_mode == FREE,
            f"servo.timeout_mode {FREE}, which lets the arm go after silence, got "
            f"{timeout_mode:g}",
        )
        self.bounds = _bounds(self, options)
        check_angle(self.name, options.angle(state.position))


def _bounds(servo: Servo, options: MoteusOptions) -> tuple[float, float]:
    # The least and the largest angle that it lets the arm have, rad
    ends = [servo.setting(f"servopos.position_{end}") for end in ("min", "max")]
    low, high = sorted(map(options.angle, ends))
    servo.needs(
        -math.pi < low < high < math.tau,
        "servopos.position_min and servopos.position_max a little beyond the arm's "
        f"stops, got {ends[0]:g} and {ends[1]:g} turns",
    )
    return low, high


def stopped_itself(servo: Servo, code: int) -> IdledError:
    """Return the fault of a controller that has stopped itself."""
    kind = FAULTS.get(code, "unknown-fault")
    return IdledError(f"{servo.name}: has stopped itself, code {code}: {kind}", kind)


class MoteusDevice(CanDevice[MoteusOptions]):
    """A moteus on a CAN-FD bus, in torque mode from the first torque on."""

    name = "moteus"
    holds_torque_when_silent = False  # its own watchdog lets go

    def __init__(self, setup: DeviceSetup, options: MoteusOptions) -> None:
        super().__init__(setup, options, connected)
        self.channels = (ESTIMATED_TORQUE,) if options.estimates_torque else ()
        self._driven_ns: int | None = None  # since when it has been told torques
        self._commanded_ns = 0  # when it was told the last
        self._commanded: deque[float] = deque([0.0], maxlen=_TOLD_TICKS)  # N·m
        self._n_limited = self._n_off = 0  # answers in a row
        self._has_let_go = False  # by itself, or because somebody else stopped it

    def _bring_up(self) -> None:
        self._servo = ReadyServo(self._link, self._setup.clock, self._options)

    def _read(self) -> Reading:
        try:
            state = self._latest()
            self._check_mode(state)
        except IdledError:
            self._has_let_go = True
            raise
        self._check_torque(state)
        # It believes its own constant of the motor, whose error is the gain
        estimate = self.torque_gain * self._options.torque(state.torque_nm)
        channels = (estimate,) if self.channels else ()
        return Reading(state.time_ns, self._options.angle(state.position), channels)

    def _latest(self) -> State:
        servo = self._servo
        now_ns = self._setup.clock.now_ns()
        if servo.is_asked and now_ns - servo.asked_ns <= _RECENT_NS:
            return servo.answer(self._options.patience_s + _LATE_S)
        silent_ns = now_ns - self._commanded_ns
        if self._driven_ns and silent_ns > self._options.watchdog_ms * 1e6:
            # It has let go, and obeys nothing until it is stopped
            if self._commanded[-1] != 0.0:
                raise self._timed_out()
            self._driven_ns = None
            return servo.stop()
        servo.ask()
        return servo.answer(self._options.patience_s)

    def _timed_out(self) -> IdledError:
        return IdledError(
            f"{self._servo.name}: received nothing for {self._options.watchdog_ms:g} "
            "ms and let the arm go",
            "watchdog",
        )

    def _check_mode(self, state: State) -> None:
        servo, mode = self._servo, state.mode
        if mode == FAULT:
            raise stopped_itself(servo, state.code)
        if mode == TIMEOUT:
            raise self._timed_out()
        driven_ns = self._driven_ns
        expected: tuple[int, ...] = (DRIVEN,)
        if driven_ns is None:
            expected = (STOPPED,)
        elif state.time_ns - driven_ns < _PREPARING_NS:
            expected = (STOPPED, *PREPARING, DRIVEN)
        if mode not in expected:
            raise IdledError(
                f"{servo.name}: needs mode {expected[-1]}, but another program set it "
                f"to {mode}"
            )
        self._n_limited = self._n_limited + 1 if state.code in LIMITS else 0
        if self._n_limited > _MAX_LIMITED:
            raise LimitExceededError(
                f"{servo.name}: gives less torque than it was sent, code {state.code}: "
                f"{LIMITS[state.code]}",
                "limited",
            )

    def _check_torque(self, state: State) -> None:
        torque = self._options.torque(state.torque_nm)
        low, high = min(self._commanded), max(self._commanded)
        is_off = not low - _TORQUE_TOLERANCE <= torque <= high + _TORQUE_TOLERANCE
        self._n_off = self._n_off + 1 if is_off and state.mode == DRIVEN else 0
        if self._n_off > _MAX_OFF:
            raise BusError(
                f"{self._servo.name}: needs a torque of {self._commanded[-1]:.2f} N·m, "
                f"gives {torque:.2f}, {self._n_off} times in a row: commands get "
                "lost, or no current flows",
                "lost-torques",
            )

    def _send(self, torque_nm: float) -> None:
        largest = self._options.largest_torque_nm
        if abs(torque_nm) > largest:
            raise LimitExceededError(
                f"torque: needs at most {largest:g} N·m on this moteus, got "
                f"{torque_nm:.3f} N·m",
                "torque",
            )
        if self._has_let_go:
            return  # a torque would start one that somebody else has stopped
        self._servo.command(torque_nm)
        self._commanded.append(torque_nm)
        self._commanded_ns = self._servo.asked_ns
        self._driven_ns = self._driven_ns or self._commanded_ns

    def _release(self) -> None:
        self._servo.stop()

    def _idle_arguments(self) -> tuple[int, ...]:
        return (self._options.servo,)


def prepare(interface: str, channel: str, servo: str) -> Callable[[], object]:
    """Join the bus, as the watchdog's process, and return what stops the moteus."""
    options = MoteusOptions(interface=interface, channel=channel, servo=int(servo))
    clock = RealClock()
    link = options.open_link(clock, accepted=(options.servo << 8,))
    atexit.register(link.close)
    return Servo(link, clock, options).stop


OPTIONS = MoteusOptions


def build(setup: DeviceSetup) -> MoteusDevice:
    """Make the device of a moteus: emulated when there is a hand."""
    return MoteusDevice(setup, options_of(setup, MoteusOptions))
