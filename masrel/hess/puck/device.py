"""The puck as a device: read and commanded once a tick, idled when it is closed."""

import math
from contextlib import suppress
from typing import ClassVar

from masrel.errors import BusError, DeviceError, LimitExceededError
from masrel.hess.clock import Clock
from masrel.hess.device import Device, IdleCommand, Reading
from masrel.hess.limits import DeviceLimits
from masrel.hess.puck import bring_up
from masrel.hess.puck.arrivals import accepted_identifiers
from masrel.hess.puck.bus import open_link
from masrel.hess.puck.identity import Identity, identify, table_of
from masrel.hess.puck.node import PuckNode
from masrel.hess.puck.options import PuckOptions
from masrel.hess.puck.polls import Polls
from masrel.hess.puck.properties import PropertyTable
from masrel.hess.puck.release import release
from masrel.hess.puck.transmission import Transmission

__all__ = ["PuckDevice"]

_SHARED_INTERFACES = frozenset({"socketcan", "udp_multicast"})
_IDLING_MODULE = "masrel.hess.puck.idling"


class PuckDevice(Device):
    """A motor puck on a CAN bus, in torque mode while the device is open."""

    # The torque is set by a frame to this puck alone, not by the packed frame that sets
    # four: that one would set the torques of its neighbours, and which of the four a
    # puck obeys hangs on two more of its properties. No setting is acknowledged:
    # `Polls` ask now and then whether it obeys.

    name: ClassVar[str] = "puck"
    simulated: ClassVar[bool] = False

    def __init__(self, options: PuckOptions, *, clock: Clock) -> None:
        self._options = options
        self._clock = clock
        self._highest = 0  # current units
        self._node: PuckNode
        self._table: PropertyTable
        self.transmission: Transmission
        self.identity: Identity

    def _start(self) -> None:
        self._connect()
        try:
            self._bring_up()
        except BaseException:
            self._abandon()
            raise

    def _connect(self) -> None:
        options = self._options
        self._link = open_link(
            options.interface,
            options.channel,
            clock=self._clock,
            accepted=accepted_identifiers(options.puck),
        )

    def _disconnect(self) -> None:
        self._link.close()

    def _abandon(self) -> None:
        with suppress(BusError):  # what is on its way to the caller matters more
            self._disconnect()

    def _bring_up(self) -> None:
        options = self._options
        self._node = node = PuckNode(self._link, self._clock, options.puck)
        self.identity = identity = identify(node)
        self._table = table = table_of(identity, options.properties)
        if not identity.is_awake:
            if options.angle_after_reset is None:
                raise DeviceError(
                    f"puck {node.puck}: has been switched on and does not know where "
                    "the arm is; hold the arm at a known angle and run masrel device "
                    "zero, or set angle_after_reset"
                )
            bring_up.wake(node)
        self.transmission = turns = bring_up.configure(node, table, options)
        self._highest = math.floor(options.largest_torque / turns.torque_step)
        if not identity.is_awake and options.angle_after_reset is not None:
            bring_up.set_position(node, table, turns, options.angle_after_reset)
        self._check_angle()
        self._torque_number, self._mode_number = table.number("T"), table.number("MODE")
        self._polls = Polls(
            node,
            torque_number=self._torque_number,
            mode_number=self._mode_number,
            every=options.poll_ticks,
            checks_torque=options.checks_torque,
        )
        self._activate()

    def _check_angle(self) -> None:
        self._position_number = number = self._table.number("P")
        _, counts = self._node.position(number, patience_s=0.05)
        angle = self.transmission.angle(counts)
        limits = DeviceLimits()
        if not limits.lowest_angle <= angle <= limits.highest_angle:
            raise DeviceError(
                f"puck {self._node.puck}: needs an arm between -5 and 185 deg, it "
                f"reports {math.degrees(angle):.1f}; run masrel device zero"
            )

    def _activate(self) -> None:
        try:
            bring_up.activate(self._node, self._table)
            if self._options.checks_torque:
                bring_up.check_torque(self._node, self._table)
        except BaseException:
            self._release()
            raise

    def _read(self) -> Reading:
        time_ns, counts = self._node.position(
            self._position_number, patience_s=self._options.patience_s
        )
        self._polls.hear()
        return Reading(time_ns, self.transmission.angle(counts))

    def _send(self, torque_nm: float) -> None:
        units = self.transmission.units(torque_nm)
        if abs(units) > self._highest:
            raise LimitExceededError(
                f"torque: needs at most {self._options.largest_torque:g} N·m on this "
                f"puck, got {torque_nm:.3f} N·m",
                "torque",
            )
        self._node.tell(self._torque_number, units)
        self._polls.sent(units)

    def _check(self) -> None:
        self._polls.ask_mode(patience_s=self._options.patience_s)

    def _stop(self) -> None:
        try:
            self._release()
        except BaseException:
            self._abandon()
            raise
        self._disconnect()

    def _release(self) -> None:
        release(
            self._node,
            torque_number=self._torque_number,
            mode_number=self._mode_number,
        )

    def idle_command(self) -> IdleCommand | None:
        """Return how another process can idle the puck, once it is open."""
        options = self._options
        if options.interface not in _SHARED_INTERFACES:
            return None
        where = (options.interface, options.channel, str(options.puck))
        numbers = (str(self._torque_number), str(self._mode_number))
        return IdleCommand(_IDLING_MODULE, (*where, *numbers))
