"""The simulated device: a plant behind an encoder, an amplifier and a torque sensor."""

import math
import random
from dataclasses import dataclass
from typing import ClassVar

from masrel.errors import DeviceError, ParameterError
from masrel.lab.hess._plant import Plant, PlantParameters
from masrel.lab.hess.clock import Clock
from masrel.lab.hess.device import BackendOptions, Device, DeviceSetup, Reading
from masrel.lab.hess.hand import Hand
from masrel.lab.recording import MEASURED_TORQUE


@dataclass(frozen=True, slots=True, kw_only=True)
class TorqueSensor:
    """The torque sensor of the simulated device, between motor and arm.

    It reads what the arm pulls at: the motor's torque, friction and what moves the
    motor itself. The numbers are of no product; ``docs/driver.md`` gives reasons.

    Attributes
    ----------
    noise : float, optional
        Standard deviation of a reading, N·m.
    lag_time : float, optional
        Time constant of its low-pass, s; 0 for none.
    step : float, optional
        Its quantum, N·m; 0 for none.
    seed : int, optional
        Seed of the noise.

    Raises
    ------
    ParameterError
        If a value is below 0 or not finite.

    Examples
    --------
    >>> TorqueSensor(noise=0.1).lag_time
    0.0008
    """

    noise: float = 0.02
    lag_time: float = 0.0008
    step: float = 0.01
    seed: int = 0

    def __post_init__(self) -> None:
        for name in ("noise", "lag_time", "step", "seed"):
            if not 0.0 <= getattr(self, name) < math.inf:
                raise ParameterError(
                    f"{name}: needs 0 or more, got {getattr(self, name)}"
                )


@dataclass(frozen=True, slots=True, kw_only=True)
class SimulatedOptions(BackendOptions):
    """What `open_device` can be told of the simulated device.

    Attributes
    ----------
    torque_sensor : TorqueSensor or None, optional
        Its torque sensor; None for none.
    """

    torque_sensor: TorqueSensor | None = None


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
        self._clock = clock
        self._resolution = resolution
        self._hand = hand
        self._parameters = parameters or PlantParameters()
        self._plant = self._make_plant(0)
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
            self._plant = self._make_plant(now_ns)
        self._plant.advance(now_ns)
        return now_ns

    def _make_plant(self, start_ns: int) -> Plant:
        return Plant(self._hand, self._parameters, start_ns=start_ns)


class _SensedPlant(Plant):
    """An arm with a torque sensor between it and the device."""

    __slots__ = ("_left", "_raw", "_sensor", "torque")

    def __init__(
        self,
        hand: Hand,
        parameters: PlantParameters,
        sensor: TorqueSensor,
        *,
        start_ns: int,
    ) -> None:
        super().__init__(hand, parameters, start_ns=start_ns)
        self._sensor = sensor
        lag, step = sensor.lag_time, parameters.step_ns * 1e-9
        self._left = math.exp(-step / lag) if lag > 0.0 else 0.0  # of a lag, per step
        self._raw = self.torque = 0.0  # before and behind the sensor's low-pass, N·m

    def advance(self, now_ns: int) -> None:
        """Integrate as before, and sense the torque at the end of every step."""
        # The low-pass is exact for a torque in straight lines between these
        step_ns = self._step_ns
        periods = self._sensor.lag_time / (step_ns * 1e-9)
        while self.now_ns + step_ns <= now_ns:
            super().advance(self.now_ns + step_ns)
            before, self._raw = self._raw, self.arm_torque
            behind = periods * (self._raw - before)  # of such a slope, in the long run
            late = self.torque - before + behind
            self.torque = self._raw - behind + self._left * late


class SensingDevice(SimulatedDevice):
    """A simulated device with a torque sensor."""

    # A class of its own: a device without a sensor pays for none.

    channels = (MEASURED_TORQUE,)
    _plant: _SensedPlant

    def __init__(
        self,
        *,
        clock: Clock,
        hand: Hand,
        sensor: TorqueSensor,
        parameters: PlantParameters | None = None,
    ) -> None:
        self._sensor = sensor
        self._noise = random.Random(sensor.seed)
        super().__init__(clock=clock, hand=hand, parameters=parameters)

    def _make_plant(self, start_ns: int) -> _SensedPlant:
        return _SensedPlant(
            self._hand, self._parameters, self._sensor, start_ns=start_ns
        )

    def _read(self) -> Reading:
        time_ns, angle, _ = super()._read()
        sensor = self._sensor
        torque = self._noise.gauss(self._plant.torque, sensor.noise)
        if sensor.step > 0.0:
            torque = math.floor(torque / sensor.step + 0.5) * sensor.step
        return Reading(time_ns, angle, (torque,))


def build(setup: DeviceSetup) -> SimulatedDevice:
    """Make a simulated device."""
    if setup.hand is None:
        raise DeviceError("simulated: needs a hand, there is nobody to move the arm")
    options = setup.options or SimulatedOptions()
    if not isinstance(options, SimulatedOptions):
        got = type(options).__name__
        raise DeviceError(
            f"simulated: needs options of type SimulatedOptions or none, got {got}"
        )
    parameters = PlantParameters(range_end=setup.range_end)
    clock, hand = setup.clock, setup.hand
    if options.torque_sensor is None:
        return SimulatedDevice(clock=clock, hand=hand, parameters=parameters)
    sensor = options.torque_sensor
    return SensingDevice(clock=clock, hand=hand, sensor=sensor, parameters=parameters)
