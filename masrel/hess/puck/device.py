"""The puck as a device: read and commanded once a tick, idled when it is closed."""

import math
from typing import ClassVar

from masrel.errors import (
    BusError,
    DeviceError,
    DeviceTimeoutError,
    IdledError,
    LimitExceededError,
)
from masrel.hess.clock import Clock
from masrel.hess.device import Device, IdleCommand, Reading
from masrel.hess.puck import bring_up
from masrel.hess.puck.arrivals import accepted_identifiers
from masrel.hess.puck.bus import open_link
from masrel.hess.puck.identity import Identity, identify, table_of
from masrel.hess.puck.node import PuckNode
from masrel.hess.puck.options import PuckOptions
from masrel.hess.puck.properties import PropertyTable
from masrel.hess.puck.release import release
from masrel.hess.puck.states import TORQUE
from masrel.hess.puck.transmission import Transmission

__all__ = ["PuckDevice"]

_LOWEST_ANGLE, _HIGHEST_ANGLE = math.radians(-5.0), math.radians(185.0)
_UNANSWERED_POLLS = 2  # one may get lost
_LOST_TORQUES = 1  # the next comes after a tick

_SHARED_INTERFACES = frozenset({"socketcan", "udp_multicast"})
_IDLING_MODULE = "masrel.hess.puck.idling"


class PuckDevice(Device):
    """A motor puck on a CAN bus, in torque mode while the device is open.

    The torque is set by a frame to this puck alone, not by the packed frame that sets
    four: that one would set the torques of its neighbours, and which of the four a
    puck obeys hangs on two more of its properties. No setting is acknowledged, so
    that every `poll_ticks` torques the puck is asked for its mode and for the torque
    it holds, in turn. Nobody waits for the answer: it comes before the next position.

    Parameters
    ----------
    options : PuckOptions
        Where the puck is and how to treat it.
    clock : Clock
        The clock of the loop.

    Attributes
    ----------
    transmission : Transmission
        What it counts in, once it is open.
    identity : Identity
        What it said of itself, once it is open.
    """

    name: ClassVar[str] = "puck"
    simulated: ClassVar[bool] = False

    def __init__(self, options: PuckOptions, *, clock: Clock) -> None:
        self._options = options
        self._clock = clock
        self._until_poll = options.poll_ticks
        self._polls_mode = True  # the next time; its torque the time after
        self._n_unanswered = 0
        self._told = 0  # current units, when its torque was asked for
        self._n_lost = 0
        self._highest = 0
        self._node: PuckNode
        self._table: PropertyTable
        self.transmission: Transmission
        self.identity: Identity

    def _start(self) -> None:
        self._connect()
        try:
            self._bring_up()
        except BaseException:
            self._disconnect()
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
        _, counts = node.position(table.number("P"), patience_s=0.05)
        if not _LOWEST_ANGLE <= turns.angle(counts) <= _HIGHEST_ANGLE:
            raise DeviceError(
                f"puck {node.puck}: needs an arm between -5 and 185 deg, it reports "
                f"{math.degrees(turns.angle(counts)):.1f}; run masrel device zero"
            )
        self._numbers = table.number("P"), table.number("T"), table.number("MODE")
        try:
            bring_up.activate(node, table)
            if options.checks_torque:
                bring_up.check_torque(node, table)
        except BaseException:
            self._release()
            raise

    def _read(self) -> Reading:
        position, torque, mode = self._numbers
        node = self._node
        time_ns, counts = node.position(position, patience_s=self._options.patience_s)
        heard = node.heard
        if heard:
            if mode in heard:
                self._check_mode(heard[mode])
            if torque in heard:
                self._check_torque(heard[torque])
            heard.clear()
        if self._n_unanswered > _UNANSWERED_POLLS:
            raise self._unanswered()
        return Reading(time_ns, self.transmission.angle(counts))

    def _send(self, torque_nm: float) -> None:
        _, torque, _ = self._numbers
        units = self.transmission.units(torque_nm)
        if abs(units) > self._highest:
            raise LimitExceededError(
                f"torque: needs at most {self._options.largest_torque:g} N·m on this "
                f"puck, got {torque_nm:.3f} N·m",
                "torque",
            )
        self._node.tell(torque, units)
        self._until_poll -= 1
        if self._until_poll == 0:
            self._until_poll = self._options.poll_ticks
            self._poll(units)

    def _poll(self, units: int) -> None:
        # An unanswered one is complained of when the next position is read: a torque
        # that is being taken back must not be kept from it.
        _, torque, mode = self._numbers
        self._n_unanswered += 1  # until the answer comes
        if self._polls_mode or not self._options.checks_torque:
            self._node.inquire(mode)
        else:
            self._told = units
            self._node.inquire(torque)
        self._polls_mode = not self._polls_mode

    def _check(self) -> None:
        # In the loop the answers to polls come with readings; here it is waited for.
        _, _, mode = self._numbers
        try:
            found = self._node.ask(mode, patience_s=self._options.patience_s)
        except DeviceTimeoutError:
            self._n_unanswered += 1
            if self._n_unanswered > _UNANSWERED_POLLS:
                raise self._unanswered() from None
        else:
            self._check_mode(found)

    def _check_mode(self, mode: int) -> None:
        self._n_unanswered = 0
        if mode != TORQUE:
            raise IdledError(
                f"puck {self._node.puck}: needs MODE {TORQUE}, somebody else "
                f"has set it to {mode}; an emergency stop, or a pendant?"
            )

    def _check_torque(self, units: int) -> None:
        self._n_unanswered = 0
        if units == self._told:
            self._n_lost = 0
            return
        self._n_lost += 1
        if self._n_lost > _LOST_TORQUES:
            raise BusError(
                f"puck {self._node.puck}: needs the torque it was told, "
                f"{self._told} current units, holds {units}, "
                f"{self._n_lost} times in a row: torques get lost",
                "lost-torques",
            )

    def _unanswered(self) -> DeviceTimeoutError:
        return DeviceTimeoutError(
            f"puck {self._node.puck}: has not said its mode or torque "
            f"{self._n_unanswered} times in a row"
        )

    def _stop(self) -> None:
        try:
            self._release()
        finally:
            self._disconnect()

    def _release(self) -> None:
        _, torque, mode = self._numbers
        release(self._node, torque_number=torque, mode_number=mode)

    def idle_command(self) -> IdleCommand | None:
        """Return how another process can idle the puck, once it is open.

        Returns
        -------
        IdleCommand or None
            None where two processes cannot share a bus: python-can's "virtual" is
            inside this one, and most makers' adapters belong to whoever opened them.
        """
        options = self._options
        if options.interface not in _SHARED_INTERFACES:
            return None
        where = (options.interface, options.channel, str(options.puck))
        _, torque, mode = self._numbers
        return IdleCommand(_IDLING_MODULE, (*where, str(torque), str(mode)))
