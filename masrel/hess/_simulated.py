"""The simulated device: a plant behind an encoder and an amplifier."""

import math
from typing import ClassVar

from masrel.errors import DeviceError, ParameterError
from masrel.hess._plant import Plant, PlantParameters
from masrel.hess.clock import Clock
from masrel.hess.device import Device, DeviceSetup, Reading
from masrel.hess.hand import Hand


class SimulatedDevice(Device):
    """A device without hardware that obeys the same interface."""

    # The arm is a `Plant`, brought up to the clock's now whenever the device is read or
    # commanded; the last command is held meanwhile, as an amplifier holds it.
    # [1] Park, H.-S., Kim, J., Damiano, D. L. (2012). IEEE TNSRE 20(3), 361-370, Table
    # II. https://doi.org/10.1109/TNSRE.2012.2195330

    name: ClassVar[str] = "simulated"
    simulated: ClassVar[bool] = True

    def __init__(
        self,
        *,
        clock: Clock,
        hand: Hand,
        parameters: PlantParameters | None = None,
        resolution: float = math.radians(0.005),
    ) -> None:
        if not 0.0 < resolution < math.inf:
            raise ParameterError(f"resolution: needs more than 0, got {resolution}")
        self._clock = clock
        self._resolution = resolution
        self._hand = hand
        self._parameters = parameters or PlantParameters()
        self._plant = Plant(hand, self._parameters, start_ns=0)
        self._started = False

    @property
    def hand_torque(self) -> float:
        """Torque of the hand on the arm now, as a sensor between them reads, N·m."""
        return self._plant.hand_torque if self._started else 0.0

    @property
    def motor_torque(self) -> float:
        """Torque of the motor at the elbow now, N·m; positive resists extension."""
        return self._plant.motor_torque

    def _start(self) -> None:
        """Nothing to take hold of."""

    def _read(self) -> Reading:
        now_ns = self._advance()
        steps = math.floor(self._plant.angle_at(now_ns) / self._resolution + 0.5)
        return Reading(now_ns, steps * self._resolution)

    def _send(self, torque_nm: float) -> None:
        now_ns = self._advance()
        self._plant.command(torque_nm, now_ns)

    def _stop(self) -> None:
        """Nothing to let go of."""

    def _advance(self) -> int:
        # Brings the plant to the clock's now -> now, ns
        now_ns = self._clock.now_ns()
        if not self._started:
            self._started = True
            self._plant = Plant(self._hand, self._parameters, start_ns=now_ns)
        self._plant.advance(now_ns)
        return now_ns


def build(setup: DeviceSetup) -> SimulatedDevice:
    """Make a simulated device."""
    if setup.hand is None:
        raise DeviceError("simulated: needs a hand, there is nobody to move the arm")
    if setup.options is not None:
        got = type(setup.options).__name__
        raise DeviceError(f"simulated: needs no options, got {got}")
    return SimulatedDevice(
        clock=setup.clock,
        hand=setup.hand,
        parameters=PlantParameters(range_end=setup.range_end),
    )
