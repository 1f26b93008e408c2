"""One puck: asked and told, brought up from its monitor, driven as a device, let go.

Source of the order: Barrett WAM Arm User's Manual D1001 AH.00, pp. 46-48, and what
the two public drivers of the arm do. The permanent memory is never written. In the
process of a watchdog `prepare` joins the bus.
"""

import atexit
import itertools
import math
from collections.abc import Callable

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
    check_elbow_angle,
    options_of,
)
from masrel.lab.hess._clock import Clock, RealClock
from masrel.lab.hess.device import DeviceSetup, Reading
from masrel.lab.hess.puck._bus import (
    MAX_TORQUE,
    SAMPLING_NS,
    decode_position,
    decode_value,
    encode_get,
    encode_value,
    reply_identifiers,
)
from masrel.lab.hess.puck._emulator import connected
from masrel.lab.hess.puck._puck_options import (
    ASLEEP,
    ID,
    IDLE,
    READY,
    ROLE,
    SERIAL_NUMBER,
    STATUS,
    TORQUE,
    VERSION,
    PropertyTable,
    PuckOptions,
    Transmission,
    property_table,
)

_POSITION = -1  # stands for its position among the numbers of other properties

# What every puck answers; requested for the order of the answers, not for the values
_MARKERS = (VERSION, ROLE, SERIAL_NUMBER, ID, STATUS)

ROLE_MASK = 0x1F  # the other bits of ROLE say what encoder it has
_MOTOR_KIND = 0
_OFF_BUS_S = 1.2  # a waking puck leaves the bus; public drivers wait 1.0 and 1.2 s
_COUNT_TOLERANCE = 2  # an arm that is held moves the encoder by no more
_SETTING_TIME_S = 0.001  # a setting takes 0.11 ms on the bus

_REPLY_PATIENCE_S = 0.005
_BLIND_AFTER_S = 0.05

_POLL_TICKS = 5  # torques after which it is asked for its mode, or for its torque
_MAX_UNANSWERED = 2  # polls in a row; one may get lost
_MAX_LOST_TORQUES = 1  # in a row; the next comes after a tick


class PuckNode(Node):
    """One puck, as this end of the bus speaks to it."""

    def __init__(self, link: Link, clock: Clock, puck: int) -> None:
        super().__init__(link, clock, f"puck {puck}")
        self._position_reply, self._property_reply = reply_identifiers(puck)
        self._in_doubt = False  # whether a position may still come for an old request
        self._markers = itertools.cycle(_MARKERS)
        self.puck = puck
        self.values: dict[int, int] = {}  # the last of each property, by its number

    def set(self, number: int, value: int) -> None:
        """Set a property; a puck does not acknowledge it."""
        self.link.send(Frame(self.puck, encode_value(number, value)))

    def request(self, number: int) -> int:
        """Request a property without waiting, and return when, ns; see `values`."""
        return self.link.send(Frame(self.puck, encode_get(number)))

    def get(self, number: int, *, patience_s: float = 0.05) -> int:
        """Request a property, wait for the reply, and return its value."""
        self.receive_waiting()
        self.values.pop(number, None)
        self._await(
            lambda: number in self.values,
            self.request(number),
            patience_s,
            f"no answer for property {number}",
        )
        return self.values.pop(number)

    def position(self, number: int, *, patience_s: float) -> tuple[int, int]:
        """Request the position -> when it was sampled, ns, and the count."""
        # A reply does not say to which request it belongs. So what waits is thrown
        # away first. After a request that was not answered in time, whose reply may
        # only be late, the next is followed by one for another property, a different
        # one each time: a puck answers requests in their order, so that the last
        # position before that reply is the one that was requested now.
        self.receive_waiting()
        self.values.pop(_POSITION, None)
        request_ns = self.request(number)
        awaited = _POSITION
        if self._in_doubt:
            awaited = next(self._markers)
            self.values.pop(awaited, None)
            self.request(awaited)
        deadline_ns = request_ns + round(patience_s * 1e9)
        # After the awaited reply nothing earlier can come any more.
        self._in_doubt = not self._receive_until(
            lambda: awaited in self.values, deadline_ns
        )
        counts = self.values.pop(_POSITION, None)
        if self._in_doubt or counts is None:
            raise DeviceTimeoutError(
                f"puck {self.puck}: no position within {patience_s * 1e3:g} ms"
            )
        return min(request_ns + SAMPLING_NS, self.clock.now_ns()), counts

    def _sort(self, frame: Frame) -> None:
        if frame.identifier == self._position_reply:
            self.values[_POSITION] = decode_position(frame.data)
        elif frame.identifier == self._property_reply:
            number, value = decode_value(frame.data)
            self.values[number] = value
        else:
            self.n_foreign += 1


def motor_table(
    puck: int, role: int, firmware: int, properties: PropertyTable | None
) -> PropertyTable:
    """Return the user's property numbers of a motor's puck, or its firmware's."""
    kind = role & ROLE_MASK  # on other kinds the same numbers mean other things
    if kind != _MOTOR_KIND:
        raise DeviceError(f"puck {puck}: needs a motor's puck, its ROLE is {kind}")
    return properties or property_table(firmware)


class AwakePuck:
    """A puck that is awake, idle and configured for the driver."""

    # Making one wakes the puck if it sleeps, unless that is refused, idles it, and sets
    # what the driver needs.

    def __init__(
        self, link: Link, clock: Clock, options: PuckOptions, *, wakes: bool = True
    ) -> None:
        self.node = node = PuckNode(link, clock, options.puck)
        status = node.get(STATUS)
        node.needs(status in (ASLEEP, READY), f"STAT 0 or 2, it reports {status}")
        firmware, role = node.get(VERSION), node.get(ROLE)
        self.table = table = motor_table(node.puck, role, firmware, options.properties)
        self.torque_id, self.mode_id = table.number("T"), table.number("MODE")
        self.position_id = table.number("P")
        # Whether it is woken now, and so does not know where the arm is
        self.was_asleep = status == ASLEEP
        if self.was_asleep:
            if not wakes:
                raise DeviceError(
                    f"puck {node.puck}: has been switched on and does not know where "
                    "the arm is; hold the arm at a known angle and run masrel device "
                    "zero, or set angle_after_reset"
                )
            self._wake()
        self._configure(options)

    def _wake(self) -> None:
        # Talking to a puck that has left the bus may throw the host off it, too.
        node = self.node
        node.set(STATUS, READY)
        node.wait(_OFF_BUS_S)
        status = node.get(STATUS)
        node.needs(status == READY, f"STAT {READY} after waking, got {status}")

    def _configure(self, options: PuckOptions) -> None:
        # It may still hold the torque of a driver that was killed.
        self._set("T", 0)
        self._set("MODE", IDLE)
        # Masks of a whole arm: 1 and 2 are packed torques for pucks 1-4 and 5-7.
        arm_half = 1 if self.node.puck <= 4 else 2
        for name, group in (("GRPA", 0), ("GRPB", arm_half), ("GRPC", 4)):
            self._set(name, group)
        counts, units = self._get("CTS"), self._get("IPNM")  # what it counts in
        self.node.needs(
            counts >= 1 and units >= 1,
            f"CTS and IPNM above 0, got {counts} and {units}",
        )
        self.transmission = Transmission(
            counts_per_turn=counts,
            units_per_nm=units,
            gear_ratio=options.gear_ratio,
            direction=options.direction,
        )
        largest = options.largest_torque
        self.max_units = math.floor(largest / self.transmission.torque_step)
        self.node.needs(
            0 < self.max_units <= MAX_TORQUE,
            f"a largest_torque of 1 to {MAX_TORQUE} current units, {largest:g} N·m are "
            f"{self.max_units}",
        )
        self._set("MT", self.max_units)

    def _get(self, name: str) -> int:
        return self.node.get(self.table.number(name))

    def _set(self, name: str, value: int) -> None:
        # A setting is not acknowledged: it is read back.
        self.node.set(self.table.settable(name), value)
        actual = self._get(name)
        self.node.needs(actual == value, f"{name} {value}, reads {actual}")

    def set_position(self, angle: float) -> int:
        """Set the position of an idle puck, and return the count that it reports."""
        node = self.node
        check_elbow_angle(angle)
        mode = self._get("MODE")
        # its position is about to jump
        node.needs(mode == IDLE, f"MODE {IDLE} to be zeroed, is {mode}")
        target = self.transmission.counts(angle)
        node.set(self.table.settable("P"), target)
        node.wait(_SETTING_TIME_S)
        _, counts = node.position(self.position_id, patience_s=0.05)
        node.needs(
            abs(counts - target) <= _COUNT_TOLERANCE,
            f"a position of {target} counts after zeroing, got {counts}",
        )
        return counts

    def activate(self, *, checks_torque: bool) -> None:
        """Go into torque mode with zero torque, and see whether T reads back."""
        node, table = self.node, self.table
        self._set("T", 0)
        node.set(table.settable("MODE"), TORQUE)
        mode = self._get("MODE")
        node.needs(  # on a whole arm its safety module decides
            mode == TORQUE,
            f"MODE {TORQUE}, stays in {mode}; is an emergency stop pressed, or does a "
            "safety module want to be activated?",
        )
        if not checks_torque:
            return
        # One current unit is 0.007 N·m, less than friction holds.
        node.set(table.settable("T"), 1)
        torque = self._get("T")
        self._set("T", 0)
        node.needs(  # or lost torques could not be noticed
            torque == 1,
            "a property T that reads back as it was set, set to 1 it reads "
            f"{torque}; checks_torque = false skips this check",
        )

    def release(self) -> None:
        """Zero the torque and idle it, until it confirms."""
        release(self.node, torque_id=self.torque_id, mode_id=self.mode_id)


def release(node: PuckNode, *, torque_id: int, mode_id: int) -> None:
    """Zero the torque and idle a puck, again and again until it confirms."""

    def attempt(since_s: float) -> bool:
        node.set(torque_id, 0)
        if _is_asleep(node, blindly=since_s > _BLIND_AFTER_S):
            return True
        node.set(mode_id, IDLE)
        node.set(mode_id, IDLE)  # twice: a regular loss may not hit both
        return node.get(mode_id, patience_s=_REPLY_PATIENCE_S) == IDLE

    node.insist(attempt, "it may hold its last torque: SWITCH ITS SUPPLY OFF")


def _is_asleep(node: PuckNode, *, blindly: bool) -> bool:
    # A puck that was reset drives nothing, and the number of MODE is that of LOCK, of
    # its memory. One that is silent for long is taken to be awake: idling it matters
    # more.
    try:
        return node.get(STATUS, patience_s=_REPLY_PATIENCE_S) == ASLEEP
    except (BusError, DeviceTimeoutError, FrameError):
        if blindly:
            return False
        raise


def prepare(
    interface: str, channel: str, puck: str, torque_id: str, mode_id: str
) -> Callable[[], None]:
    """Join the bus, as the watchdog's process, and return what releases the puck."""
    clock = RealClock()
    options = PuckOptions(interface=interface, channel=channel, puck=int(puck))
    link = options.open_link(clock, accepted=reply_identifiers(options.puck))
    atexit.register(link.close)
    node = PuckNode(link, clock, options.puck)
    return lambda: release(node, torque_id=int(torque_id), mode_id=int(mode_id))


class PuckDevice(CanDevice[PuckOptions]):
    """A motor puck on a CAN bus, in torque mode while the device is open."""

    # The torque is set by a frame to this puck alone, not by the packed frame that sets
    # four: that one would set the torques of its neighbours, and which of the four a
    # puck obeys depends on two more of its properties. No setting is acknowledged: so
    # every few torques it is asked for its mode and for the torque that it holds, in
    # turn. The loop does not wait for the replies: they come before the next position.

    name = "puck"
    holds_torque_when_silent = True  # as far as anybody knows

    def __init__(self, setup: DeviceSetup, options: PuckOptions) -> None:
        super().__init__(setup, options, connected)
        self._n_left = _POLL_TICKS  # torques until the next of these questions
        self._n_unanswered = 0
        self._asked_units = 0  # the torque it was set to when its torque was requested
        self._n_lost = 0

    def _bring_up(self) -> None:
        angle = self._options.angle_after_reset
        self._puck = puck = AwakePuck(
            self._link, self._setup.clock, self._options, wakes=angle is not None
        )
        self._node = puck.node
        of_torque = [puck.torque_id] * self._options.checks_torque
        self._questions = itertools.cycle([puck.mode_id, *of_torque])
        if puck.was_asleep and angle is not None:
            puck.set_position(angle)
        _, counts = puck.node.position(puck.position_id, patience_s=0.05)
        check_angle(puck.node.name, puck.transmission.angle(counts))
        try:
            puck.activate(checks_torque=self._options.checks_torque)
        except BaseException:
            puck.release()
            raise

    def _read(self) -> Reading:
        puck, values = self._puck, self._node.values
        time_ns, counts = self._node.position(
            puck.position_id, patience_s=self._options.patience_s
        )
        if values:
            if puck.mode_id in values:
                self._check_mode(values[puck.mode_id])
            if puck.torque_id in values:
                self._check_torque(values[puck.torque_id])
            values.clear()
        self._check_answers()
        return Reading(time_ns, puck.transmission.angle(counts))

    def _send(self, torque_nm: float) -> None:
        units = self._puck.transmission.units(torque_nm)
        if abs(units) > self._puck.max_units:
            raise LimitExceededError(
                f"torque: needs at most {self._options.largest_torque:g} N·m on this "
                f"puck, got {torque_nm:.3f} N·m",
                "torque",
            )
        self._node.set(self._puck.torque_id, units)
        self._n_left -= 1
        if self._n_left == 0:
            self._ask(units)

    def _ask(self, units: int) -> None:
        self._n_left = _POLL_TICKS
        self._n_unanswered += 1  # until the reply comes
        number = next(self._questions)
        if number == self._puck.torque_id:
            self._asked_units = units
        self._node.request(number)

    def _check(self) -> None:
        try:
            mode = self._node.get(
                self._puck.mode_id, patience_s=self._options.patience_s
            )
        except DeviceTimeoutError:
            self._n_unanswered += 1
            self._check_answers()
        else:
            self._check_mode(mode)

    def _check_answers(self) -> None:
        if self._n_unanswered > _MAX_UNANSWERED:
            raise DeviceTimeoutError(
                f"puck {self._node.puck}: did not report its mode or torque "
                f"{self._n_unanswered} times in a row"
            )

    def _check_mode(self, mode: int) -> None:
        self._n_unanswered = 0
        if mode != TORQUE:
            raise IdledError(
                f"puck {self._node.puck}: needs MODE {TORQUE}, but "
                f"something else set it to {mode}: an emergency stop, or a pendant?"
            )

    def _check_torque(self, units: int) -> None:
        self._n_unanswered = 0
        self._n_lost = 0 if units == self._asked_units else self._n_lost + 1
        if self._n_lost > _MAX_LOST_TORQUES:
            raise BusError(
                f"puck {self._node.puck}: needs the torque it was sent, "
                f"{self._asked_units} current units, holds {units}, "
                f"{self._n_lost} times in a row: commands get lost",
                "lost-torques",
            )

    def _release(self) -> None:
        self._puck.release()

    def _idle_arguments(self) -> tuple[int, ...]:
        return self._options.puck, self._puck.torque_id, self._puck.mode_id


OPTIONS = PuckOptions


def build(setup: DeviceSetup) -> PuckDevice:
    """Make the device of a puck: emulated when there is a hand, else on a real bus."""
    return PuckDevice(setup, options_of(setup, PuckOptions))
