"""The puck as a device: read and commanded once a tick, idled when it is closed."""

import itertools
import math
from contextlib import suppress

from masrel.errors import (
    BusError,
    DeviceError,
    DeviceTimeoutError,
    IdledError,
    LimitExceededError,
)
from masrel.lab.hess._clock import SimulatedClock
from masrel.lab.hess.device import Device, DeviceSetup, IdleCommand, Reading
from masrel.lab.hess.limits import DeviceLimits
from masrel.lab.hess.puck._bus import Link
from masrel.lab.hess.puck._emulator import PuckEmulator, join
from masrel.lab.hess.puck._node import AwakePuck, Identity, PuckNode, identify
from masrel.lab.hess.puck._properties import TORQUE
from masrel.lab.hess.puck._puck_options import PuckOptions

_MAX_UNANSWERED = 2  # polls in a row; one may get lost
_MAX_LOST_TORQUES = 1  # in a row; the next comes after a tick

# python-can's "virtual" is inside this process, and most makers' adapters belong to
# whoever opened them: on others no other process can idle a puck.
_SHARED_INTERFACES = frozenset({"socketcan", "udp_multicast"})

_channels = itertools.count(1)


class PuckDevice(Device):
    """A motor puck on a CAN bus, in torque mode while the device is open."""

    # The torque is set by a frame to this puck alone, not by the packed frame that sets
    # four: that one would set the torques of its neighbours, and which of the four a
    # puck obeys depends on two more of its properties. No setting is acknowledged: so
    # every few torques it is asked for its mode and for the torque that it holds, in
    # turn. The loop does not wait for the replies: they come before the next position.

    name = "puck"

    def __init__(self, setup: DeviceSetup, options: PuckOptions) -> None:
        self.simulated = not options.moves_hardware
        self._setup = setup
        self._options = options
        self._n_left = options.poll_ticks  # torques until the next of these questions
        self._next_is_mode = True
        self._n_unanswered = 0
        self._asked_units = 0  # the torque it was set to when its torque was requested
        self._n_lost = 0
        self._link: Link
        self._node: PuckNode
        self._puck: AwakePuck
        self.emulator: PuckEmulator | None
        self.identity: Identity

    def _start(self) -> None:
        setup, options = self._setup, self._options
        self._link, self.emulator = join(
            options, clock=setup.clock, hand=setup.hand, range_end=setup.range_end
        )
        try:
            self._bring_up()
        except BaseException:
            self._abandon()
            raise

    def _abandon(self) -> None:
        with suppress(BusError):  # what is on its way to the caller matters more
            self._link.close()

    def _bring_up(self) -> None:
        options = self._options
        self._node = node = PuckNode(self._link, self._setup.clock, options.puck)
        self.identity = identity = identify(node)
        table = identity.table(options.properties)
        if not identity.is_awake and options.angle_after_reset is None:
            raise DeviceError(
                f"puck {node.puck}: has been switched on and does not know where "
                "the arm is; hold the arm at a known angle and run masrel device "
                "zero, or set angle_after_reset"
            )
        self._puck = puck = AwakePuck(node, identity, table, options)
        self.transmission = puck.transmission
        if puck.was_asleep and options.angle_after_reset is not None:
            puck.set_position(options.angle_after_reset)
        self._position_id = table.number("P")
        self._torque_id, self._mode_id = table.number("T"), table.number("MODE")
        self._check_angle()
        try:
            puck.activate(checks_torque=options.checks_torque)
        except BaseException:
            puck.release()
            raise

    def _check_angle(self) -> None:
        _, counts = self._node.position(self._position_id, patience_s=0.05)
        angle = self.transmission.angle(counts)
        limits = DeviceLimits()
        if not limits.lowest_angle <= angle <= limits.highest_angle:
            raise DeviceError(
                f"puck {self._node.puck}: needs an arm between -5 and 185 deg, it "
                f"reports {math.degrees(angle):.1f}; run masrel device zero"
            )

    def _read(self) -> Reading:
        time_ns, counts = self._node.position(
            self._position_id, patience_s=self._options.patience_s
        )
        values = self._node.values
        if values:
            if self._mode_id in values:
                self._check_mode(values[self._mode_id])
            if self._torque_id in values:
                self._check_torque(values[self._torque_id])
            values.clear()
        self._check_answers()
        return Reading(time_ns, self.transmission.angle(counts))

    def _send(self, torque_nm: float) -> None:
        units = self.transmission.units(torque_nm)
        if abs(units) > self._puck.max_units:
            raise LimitExceededError(
                f"torque: needs at most {self._options.largest_torque:g} N·m on this "
                f"puck, got {torque_nm:.3f} N·m",
                "torque",
            )
        self._node.set(self._torque_id, units)
        self._n_left -= 1
        if self._n_left == 0:
            self._ask(units)

    def _ask(self, units: int) -> None:
        self._n_left = self._options.poll_ticks
        self._n_unanswered += 1  # until the reply comes
        if self._next_is_mode or not self._options.checks_torque:
            self._node.request(self._mode_id)
        else:
            self._asked_units = units
            self._node.request(self._torque_id)
        self._next_is_mode = not self._next_is_mode

    def _check(self) -> None:
        try:
            mode = self._node.get(self._mode_id, patience_s=self._options.patience_s)
        except DeviceTimeoutError:
            self._n_unanswered += 1
            self._check_answers()
        else:
            self._check_mode(mode)

    def _check_answers(self) -> None:
        if self._n_unanswered > _MAX_UNANSWERED:
            raise DeviceTimeoutError(
                f"puck {self._node.puck}: has not said its mode or torque "
                f"{self._n_unanswered} times in a row"
            )

    def _check_mode(self, mode: int) -> None:
        self._n_unanswered = 0
        if mode != TORQUE:
            raise IdledError(
                f"puck {self._node.puck}: needs MODE {TORQUE}, somebody else "
                f"has set it to {mode}; an emergency stop, or a pendant?"
            )

    def _check_torque(self, units: int) -> None:
        self._n_unanswered = 0
        self._n_lost = 0 if units == self._asked_units else self._n_lost + 1
        if self._n_lost > _MAX_LOST_TORQUES:
            raise BusError(
                f"puck {self._node.puck}: needs the torque it was told, "
                f"{self._asked_units} current units, holds {units}, "
                f"{self._n_lost} times in a row: torques get lost",
                "lost-torques",
            )

    def _stop(self) -> None:
        try:
            self._puck.release()
        except BaseException:
            self._abandon()
            raise
        self._link.close()

    def idle_command(self) -> IdleCommand | None:
        """Return how another process can idle the puck, once it is open."""
        options = self._options
        if options.interface not in _SHARED_INTERFACES:
            return None
        numbers = (options.puck, self._torque_id, self._mode_id)
        return IdleCommand(
            "masrel.lab.hess.puck._node",
            (options.interface, options.channel, *map(str, numbers)),
        )


def build(setup: DeviceSetup) -> PuckDevice:
    """Make the device of a puck: emulated when there is a hand, else on a real bus."""
    options, hand = setup.options, setup.hand
    if options is None:
        if hand is None:
            raise DeviceError("puck: needs options that say on which bus it is")
        # A bus that nobody else is on
        channel = f"masrel-{next(_channels)}"
        options = PuckOptions(interface="virtual", channel=channel)
        options = options.emulated(hand.start)
    if not isinstance(options, PuckOptions):
        got = type(options).__name__
        raise DeviceError(f"puck: needs options of type PuckOptions, got {got}")
    if (hand is None) != (options.emulator is None):
        raise DeviceError(
            "puck: needs a simulated hand with an emulated puck and none without, got "
            + ("an emulator alone" if hand is None else "a hand alone")
        )
    if hand is None and isinstance(setup.clock, SimulatedClock):
        raise DeviceError("puck: needs a real clock, its bus is outside this process")
    return PuckDevice(setup, options)
