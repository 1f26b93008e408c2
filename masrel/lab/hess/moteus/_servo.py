"""One moteus, as this end of the bus speaks to it: asked, told, stopped.

An answer carries no number. So each question asks for the controller's counter of
milliseconds as another type than the three before: an answer to an earlier one is told
by that, and one that is repeated later by its count.
"""

import math
from collections.abc import Callable
from typing import NamedTuple

from masrel.errors import DeviceError, DeviceTimeoutError, FrameError
from masrel.lab.hess._can import Frame, Link, Node
from masrel.lab.hess._clock import Clock
from masrel.lab.hess.moteus._frames import (
    FLOAT,
    INT8,
    Poll,
    Read,
    Refusal,
    Stream,
    Subframe,
    Values,
    decode,
    encode,
    value_of,
)
from masrel.lab.hess.moteus._moteus_options import (
    CODE,
    COMMAND,
    COUNTER,
    DRIVEN,
    INTEGRAL_SCALE,
    MODE,
    POSITION,
    STOPPED,
    TORQUE,
    VOLTAGE,
    WATCHDOG,
    MoteusOptions,
)

_QUERY = (Read(INT8, MODE, 1), Read(FLOAT, POSITION, 3), Read(INT8, VOLTAGE, 3))
_STOP = Values("write", INT8, MODE, (STOPPED,))
_DRIVE = Values("write", INT8, MODE, (DRIVEN,))
_NO_INTEGRAL = Values("write", FLOAT, INTEGRAL_SCALE, (0.0,))
_ANSWERED = 0x8000  # in an identifier: the host, number 0, wants an answer

_SAMPLING_NS = 140_000  # from a question to the sample: own estimate for 64 bytes
_PATIENCE_S = 0.02  # outside the loop
_CONSOLE_NS, _POLL_NS = 50_000_000, 2_000_000  # for text, for a part of it
_CONSOLE_BYTES = 48

# What the counter of an answer may lag behind the host's clock, ms, and over how long
# a time the two are compared: the controller's clock may be 1 % off
_MOST_LAG = 2
_COMPARED_NS = 100_000_000


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
        counter = Read(self._counter_kind, COUNTER, 1)
        self.asked_ns = self._send(*commands, *_QUERY, counter)
        self.is_asked = True

    def command(self, torque_nm: float) -> None:
        """Send a torque of the elbow, and a question."""
        # All registers each time: one that is left out takes its default, and scales
        # of 1 would make it hold a position
        options = self._options
        feedforward = options.output_torque(torque_nm)
        most = options.largest_torque_nm / options.gear_ratio
        numbers = (math.nan, 0.0, feedforward, 0.0, 0.0, most)
        watchdog = Values("write", FLOAT, WATCHDOG, (options.watchdog_ms * 1e-3,))
        command = Values("write", FLOAT, COMMAND, numbers)
        self.ask(_DRIVE, command, watchdog, _NO_INTEGRAL)

    def answer(self, patience_s: float = _PATIENCE_S) -> State:
        """Return the answer to the last question, which may be waiting already."""
        self.is_asked = False
        deadline_ns = self.asked_ns + round(patience_s * 1e9)
        self._wait_until(self._is_current, deadline_ns, "no answer")
        answer, self._answer = self._answer, {}
        if math.isnan(answer[POSITION]):
            raise FrameError(f"{self.name}: its position is no number")
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
        passed_ns = self.asked_ns - asked_ns
        lag = round(passed_ns * 1e-6) - (int(count) - count_then)
        if passed_ns < _COMPARED_NS and (lag + 128) % 256 - 128 > _MOST_LAG:
            self._answer = {}
        return bool(self._answer)

    # Outside the loop

    def stop(self) -> State:
        """Stop it, which also clears a fault and its timeout, until it confirms."""
        self.insist(self._stops, "IF THE ARM IS NOT FREE, SWITCH ITS SUPPLY OFF")
        self.ask()
        return self.answer()

    def _stops(self, _since_s: float) -> bool:
        self.ask(_STOP)
        return self.answer().mode == STOPPED

    def get(
        self, kind: int, first: int, n: int = 1, *, patience_s: float = _PATIENCE_S
    ) -> tuple[float, ...]:
        """Return registers."""
        self._answer = {}
        deadline_ns = self._send(Read(kind, first, n)) + round(patience_s * 1e9)
        registers = range(first, first + n)
        self._wait_until(
            lambda: registers[-1] in self._answer,
            deadline_ns,
            f"no answer for register {first:#05x}",
        )
        return tuple(self._answer.pop(register) for register in registers)

    def set(self, register: int, value: float) -> None:
        """Write a register."""
        self._send(Values("write", FLOAT, register, (value,)))

    def setting(self, name: str) -> float:
        """Return a setting, which its console alone tells."""
        self._console = b""
        question = Stream("is told", f"conf get {name}\n".encode())
        deadline_ns = self._send(question, wants_answer=False) + _CONSOLE_NS
        while not self._console.endswith(b"\n"):
            if self._send(Poll(_CONSOLE_BYTES)) > deadline_ns:
                raise DeviceTimeoutError(f"{self.name}: does not say its {name}")
            self._receive_until(lambda: False, self.clock.now_ns() + _POLL_NS)
        try:
            return float(self._console)
        except ValueError as error:
            text = self._console.decode(errors="replace").strip()
            raise DeviceError(
                f"{self.name}: needs a firmware with {name}, it says {text!r}"
            ) from error

    # The bus

    def _send(self, *subframes: Subframe, wants_answer: bool = True) -> int:
        identifier = self._options.servo + (_ANSWERED if wants_answer else 0)
        return self.link.send(Frame(identifier, encode(subframes)))

    def _wait_until(
        self, is_there: Callable[[], bool], deadline_ns: int, lacking: str
    ) -> None:
        if not self._receive_until(is_there, deadline_ns):
            raise DeviceTimeoutError(f"{self.name}: {lacking} in time")

    def _sort(self, frame: Frame) -> None:
        if frame.identifier != self._options.servo << 8:
            self.n_foreign += 1
            return
        for subframe in decode(frame.data):
            match subframe:
                case Values("answer", kind, first, values):
                    self._keep(kind, first, values)
                case Stream("says", data):
                    self._console += data
                case Refusal(act, register, number):
                    raise DeviceError(
                        f"{self.name}: does not let register {register:#05x} be "
                        f"{'written' if act == 'write' else 'read'} (error {number})"
                    )

    def _keep(self, kind: int, first: int, values: tuple[float, ...]) -> None:
        if first == COUNTER and kind != self._counter_kind:
            self._answer = {}  # to an earlier question
            return
        for register, raw in enumerate(values, first):
            self._answer[register] = value_of(register, kind, raw)
