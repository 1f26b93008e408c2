"""One moteus, driven as a device: brought up, told a torque a tick, stopped.

A torque and its answer are one exchange a tick: an answer is read in the tick after,
when it has long come, and says what was 0.9 ms ago. In the process of a watchdog
`prepare` joins the bus.
"""

import atexit
import math
from collections import deque
from collections.abc import Callable
from contextlib import ExitStack

from masrel.errors import BusError, DeviceError, IdledError, LimitExceededError
from masrel.lab.hess._can import Link, check_angle, options_of
from masrel.lab.hess._clock import Clock, RealClock
from masrel.lab.hess.device import Device, DeviceSetup, IdleCommand, Reading
from masrel.lab.hess.moteus._frames import INT8
from masrel.lab.hess.moteus._moteus_emulator import connected
from masrel.lab.hess.moteus._moteus_options import (
    DRIVEN,
    FAULT,
    FAULTS,
    FREE,
    HOME_STATE,
    LIMITS,
    OUTPUT_KNOWN,
    PREPARING,
    STOPPED,
    TIMEOUT,
    MoteusOptions,
)
from masrel.lab.hess.moteus._servo import Servo, State

_RECENT_NS = 1_500_000  # since a torque: then its answer is still of this tick
_PATIENCE_S = 0.001  # for a question in the loop: a tick
_LATE_S = 0.0015  # for the answer to a torque, of which a tick has passed
_PREPARING_NS = 50_000_000  # from a stop to the first torque; chosen

_MAX_LIMITED = 2  # answers in a row that say that something limits the torque
# Between the torque that it was told in the last ticks and its own estimate
_TORQUE_TOLERANCE = 1.0  # N·m at the elbow; chosen
_TOLD_TICKS = 4  # a current takes some ticks to follow
_MAX_OFF = 10  # answers in a row


class ReadyServo:
    """A moteus that is stopped and may be driven."""

    # Making one stops it and refuses what must not be near a person

    def __init__(self, link: Link, clock: Clock, options: MoteusOptions) -> None:
        self.servo = servo = Servo(link, clock, options)
        state = servo.stop()
        if state.code in FAULTS:
            raise stopped_itself(servo, state.code)
        (home_state,) = servo.get(INT8, HOME_STATE)
        if home_state < OUTPUT_KNOWN:
            raise DeviceError(
                f"{servo.name}: does not know where its output is (home state "
                f"{home_state:.0f}); hold the arm at a known angle and run masrel "
                "device zero"
            )
        self.timeout_mode = servo.setting("servo.timeout_mode")
        if self.timeout_mode != FREE:
            raise DeviceError(
                f"{servo.name}: needs servo.timeout_mode {FREE}, which lets the arm go "
                f"after silence, got {self.timeout_mode:g}"
            )
        self.bounds = _bounds(servo, options)
        self.angle = options.angle(state.position)
        check_angle(servo.name, self.angle)


def _bounds(servo: Servo, options: MoteusOptions) -> tuple[float, float]:
    # The least and the largest angle that it lets the arm have, rad
    ends = [servo.setting(f"servopos.position_{end}") for end in ("min", "max")]
    low, high = sorted(map(options.angle, ends))
    if not -math.pi < low < high < math.tau:
        raise DeviceError(
            f"{servo.name}: needs servopos.position_min and servopos.position_max a "
            f"little beyond the arm's stops, got {ends[0]:g} and {ends[1]:g} turns"
        )
    return low, high


def stopped_itself(servo: Servo, code: int) -> IdledError:
    """Return the fault of a controller that has stopped itself."""
    kind = FAULTS.get(code, "unknown-fault")
    return IdledError(f"{servo.name}: has stopped itself, code {code}: {kind}", kind)


class MoteusDevice(Device):
    """A moteus on a CAN-FD bus, in torque mode from the first torque on."""

    name = "moteus"

    def __init__(self, setup: DeviceSetup, options: MoteusOptions) -> None:
        self.simulated = not options.moves_hardware
        self._setup = setup
        self._options = options
        self._driven_ns: int | None = None  # since when it has been told torques
        self._commanded: deque[float] = deque([0.0], maxlen=_TOLD_TICKS)  # N·m
        self._n_limited = self._n_off = 0  # answers in a row
        self._has_let_go = False  # by itself, or because somebody else stopped it

    def _start(self) -> None:
        setup = self._setup
        link = connected(
            self._options, clock=setup.clock, hand=setup.hand, range_end=setup.range_end
        )
        self.emulator = link.peer
        with ExitStack() as failing:  # then the bus is left
            self._link = failing.enter_context(link)
            self._servo = ReadyServo(link, setup.clock, self._options).servo
            failing.pop_all()

    def _read(self) -> Reading:
        try:
            state = self._latest()
            self._check_mode(state)
        except IdledError:
            self._has_let_go = True
            raise
        self._check_torque(state)
        return Reading(state.time_ns, self._options.angle(state.position))

    def _latest(self) -> State:
        servo = self._servo
        silent_ns = self._setup.clock.now_ns() - servo.asked_ns
        if servo.is_asked and silent_ns <= _RECENT_NS:
            return servo.answer(_LATE_S)
        if self._driven_ns and silent_ns > self._options.watchdog_ms * 1e6:
            # It has let go, and obeys nothing until it is stopped
            if self._commanded[-1] != 0.0:
                raise self._timed_out()
            self._driven_ns = None
            return servo.stop()
        servo.ask()
        return servo.answer(_PATIENCE_S)

    def _timed_out(self) -> IdledError:
        return IdledError(
            f"{self._servo.name}: heard nothing for {self._options.watchdog_ms:g} ms "
            "and has let the arm go",
            "watchdog",
        )

    def _check_mode(self, state: State) -> None:
        servo, mode = self._servo, state.mode
        if mode == FAULT:
            raise stopped_itself(servo, state.code)
        if mode == TIMEOUT:
            raise self._timed_out()
        driven_ns = self._driven_ns
        if driven_ns is None or state.time_ns - driven_ns < _PREPARING_NS:
            is_right = mode in (STOPPED, *(PREPARING if driven_ns else ()), DRIVEN)
        else:
            is_right = mode == DRIVEN
        if not is_right:
            raise IdledError(
                f"{servo.name}: needs mode {DRIVEN}, somebody else has set it to {mode}"
            )
        self._n_limited = self._n_limited + 1 if state.code in LIMITS else 0
        if self._n_limited > _MAX_LIMITED:
            raise LimitExceededError(
                f"{servo.name}: gives less torque than it was told, code {state.code}: "
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
                f"gives {torque:.2f}, {self._n_off} times in a row: torques get lost, "
                "or no current flows",
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
        self._driven_ns = self._driven_ns or self._servo.asked_ns

    def _stop(self) -> None:
        with self._link:  # which is left whatever comes
            self._servo.stop()

    def idle_command(self) -> IdleCommand | None:
        """Return how another process can stop it, once it is open."""
        options = self._options
        if not options.is_shared:
            return None
        where = (options.interface, options.channel, str(options.servo))
        return IdleCommand("masrel.lab.hess.moteus._moteus_device", where)


def prepare(interface: str, channel: str, servo: str) -> Callable[[], object]:
    """Join the bus, as the watchdog's process, and return what stops the moteus."""
    options = MoteusOptions(interface=interface, channel=channel, servo=int(servo))
    clock = RealClock()
    link = options.open_link(clock, accepted=(options.servo << 8,))
    atexit.register(link.close)
    return Servo(link, clock, options).stop


def build(setup: DeviceSetup) -> MoteusDevice:
    """Make the device of a moteus: emulated when there is a hand."""
    return MoteusDevice(setup, options_of(setup, MoteusOptions))
