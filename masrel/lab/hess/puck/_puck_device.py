"""The puck as a device: read and commanded once a tick, idled when it is closed."""

import itertools
import math
from contextlib import suppress
from typing import ClassVar

from masrel.errors import BusError, DeviceError, LimitExceededError
from masrel.lab.hess.clock import Clock, SimulatedClock
from masrel.lab.hess.device import Device, DeviceSetup, IdleCommand, Reading
from masrel.lab.hess.hand import Hand
from masrel.lab.hess.limits import DeviceLimits
from masrel.lab.hess.puck._bring_up import (
    AwakePuck,
    Identity,
    activate,
    identify,
    motor_table,
    set_position,
    wake_and_configure,
)
from masrel.lab.hess.puck._bus import open_link
from masrel.lab.hess.puck._codec import reply_identifiers
from masrel.lab.hess.puck._emulator import PuckEmulator, emulate
from masrel.lab.hess.puck._node import Polls, PuckNode
from masrel.lab.hess.puck._puck_options import PuckOptions
from masrel.lab.hess.puck._release import release, release_command
from masrel.lab.hess.puck._transmission import Transmission

_channels = itertools.count(1)


class PuckDevice(Device):
    """A motor puck on a CAN bus, in torque mode while the device is open."""

    # The torque is set by a frame to this puck alone, not by the packed frame that sets
    # four: that one would set the torques of its neighbours, and which of the four a
    # puck obeys depends on two more of its properties. No setting is acknowledged:
    # `Polls` see now and then whether it obeys.

    name: ClassVar[str] = "puck"
    simulated: ClassVar[bool] = False

    def __init__(self, options: PuckOptions, *, clock: Clock) -> None:
        self._options = options
        self._clock = clock
        self._node: PuckNode
        self._puck: AwakePuck
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
            accepted=reply_identifiers(options.puck),
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
        table = motor_table(identity, options.properties)
        if not identity.is_awake and options.angle_after_reset is None:
            raise DeviceError(
                f"puck {node.puck}: has been switched on and does not know where "
                "the arm is; hold the arm at a known angle and run masrel device "
                "zero, or set angle_after_reset"
            )
        self._puck = puck = wake_and_configure(node, identity, table, options)
        self.transmission = puck.transmission
        if puck.was_asleep and options.angle_after_reset is not None:
            set_position(puck, options.angle_after_reset)
        self._position_id = table.number("P")
        self._torque_id, self._mode_id = table.number("T"), table.number("MODE")
        self._check_angle()
        self._polls = Polls(
            node,
            torque_id=self._torque_id,
            mode_id=self._mode_id,
            every=options.poll_ticks,
            checks_torque=options.checks_torque,
        )
        try:
            activate(puck, checks_torque=options.checks_torque)
        except BaseException:
            self._release()
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
        self._polls.check_replies()
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
        self._polls.count_torque(units)

    def _check(self) -> None:
        self._polls.check_mode(patience_s=self._options.patience_s)

    def _stop(self) -> None:
        try:
            self._release()
        except BaseException:
            self._abandon()
            raise
        self._disconnect()

    def _release(self) -> None:
        release(self._node, torque_id=self._torque_id, mode_id=self._mode_id)

    def idle_command(self) -> IdleCommand | None:
        """Return how another process can idle the puck, once it is open."""
        return release_command(
            self._options, torque_id=self._torque_id, mode_id=self._mode_id
        )


class UnwiredPuckDevice(PuckDevice):
    """A puck on a bus without hardware, emulated by another thread or process."""

    simulated: ClassVar[bool] = True


class EmulatedPuckDevice(PuckDevice):
    """A puck that is emulated, on a bus inside this process."""

    simulated: ClassVar[bool] = True

    def __init__(
        self, options: PuckOptions, *, clock: Clock, hand: Hand, range_end: float
    ) -> None:
        super().__init__(options, clock=clock)
        self._hand = hand
        self._range_end = range_end
        self.emulator: PuckEmulator

    def _connect(self) -> None:
        options, clock = self._options, self._clock
        self.emulator = emulate(
            options, clock=clock, hand=self._hand, range_end=self._range_end
        )
        self._link = open_link(
            options.interface, options.channel, clock=clock, peer=self.emulator
        )

    def _disconnect(self) -> None:
        super()._disconnect()
        self.emulator.close()


def emulated_options(hand: Hand) -> PuckOptions:
    """Return options for an emulated puck on a bus that nobody else is on."""
    channel = f"masrel-{next(_channels)}"
    return PuckOptions(interface="virtual", channel=channel).emulated(hand.start)


def build(setup: DeviceSetup) -> PuckDevice:
    """Make the device of a puck: emulated when there is a hand, else on a real bus."""
    options, hand = setup.options, setup.hand
    if options is None:
        if hand is None:
            raise DeviceError("puck: needs options that say on which bus it is")
        options = emulated_options(hand)
    if not isinstance(options, PuckOptions):
        got = type(options).__name__
        raise DeviceError(f"puck: needs options of type PuckOptions, got {got}")
    if (hand is None) != (options.emulator is None):
        raise DeviceError(
            "puck: needs a simulated hand with an emulated puck and none without, got "
            + ("an emulator alone" if hand is None else "a hand alone")
        )
    if hand is not None:
        return EmulatedPuckDevice(
            options, clock=setup.clock, hand=hand, range_end=setup.range_end
        )
    if isinstance(setup.clock, SimulatedClock):
        raise DeviceError("puck: needs a real clock, its bus is outside this process")
    kind = PuckDevice if options.moves_hardware else UnwiredPuckDevice
    return kind(options, clock=setup.clock)
