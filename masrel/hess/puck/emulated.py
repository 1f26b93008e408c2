"""The devices of pucks that are emulated."""

from typing import ClassVar

from masrel.hess.clock import Clock
from masrel.hess.hand import Hand
from masrel.hess.puck.bus import open_link
from masrel.hess.puck.device import PuckDevice
from masrel.hess.puck.emulator import PuckEmulator
from masrel.hess.puck.emulator_options import EmulatorOptions
from masrel.hess.puck.options import PuckOptions

__all__ = ["EmulatedPuckDevice", "UnwiredPuckDevice"]


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
        self.emulator = PuckEmulator(
            link=open_link(options.interface, options.channel, clock=clock),
            clock=clock,
            hand=self._hand,
            range_end=self._range_end,
            options=options.emulator or EmulatorOptions(),
            puck=options.puck,
        )
        self._link = open_link(
            options.interface, options.channel, clock=clock, neighbour=self.emulator
        )

    def _disconnect(self) -> None:
        super()._disconnect()
        self.emulator.close()
