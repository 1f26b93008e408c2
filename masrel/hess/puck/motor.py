"""The motor of an emulated puck: the simulated arm in counts and current units."""

from masrel.hess._plant import Plant, PlantParameters
from masrel.hess.hand import Hand
from masrel.hess.puck.transmission import Transmission

__all__ = ["EmulatedMotor"]

_BRAKING_STEP_NS = 500_000


class EmulatedMotor:
    """An arm that is driven by current units, or braked, and read in counts."""

    __slots__ = ("_braking", "_hand", "_is_driven", "_parameters", "_plant", "_turns")

    def __init__(
        self,
        *,
        hand: Hand,
        range_end: float,
        transmission: Transmission,
        braking: float,
    ) -> None:
        self._hand = hand
        # The current units on the bus are the quantum already.
        self._parameters = PlantParameters(range_end=range_end, torque_step=0.0)
        self._turns = transmission
        self._braking = braking
        self._is_driven = False
        self._plant: Plant | None = None
        Plant(hand, self._parameters, start_ns=0)  # refuses what does not fit

    @property
    def torque_nm(self) -> float:
        """Torque of the motor at the elbow now, N·m; positive resists extension."""
        return 0.0 if self._plant is None else self._plant.motor_torque

    @property
    def velocity(self) -> float:
        """Speed of the arm now, rad/s."""
        return 0.0 if self._plant is None else self._plant.velocity

    def angle(self, now_ns: int) -> float:
        """Return where the arm is."""
        if self._plant is None:
            return self._hand.start
        self.advance(now_ns)
        return self._plant.angle_at(now_ns)

    def counts(self, now_ns: int) -> int:
        """Return what the encoder counts, from full flexion."""
        return self._turns.counts(self.angle(now_ns))

    def drive(self, units: int, now_ns: int) -> None:
        """Turn with a torque until told otherwise."""
        if self._plant is None:
            self._plant = Plant(self._hand, self._parameters, start_ns=now_ns)
        self.advance(now_ns)
        self._is_driven = True
        self._plant.command(self._turns.torque(units), now_ns)

    def brake(self, now_ns: int) -> None:
        """Short the windings: an idle motor damps the arm."""
        self.advance(now_ns)
        self._is_driven = False

    def advance(self, now_ns: int) -> None:
        """Let the arm move up to a time; it does not before it is first driven."""
        plant = self._plant
        if plant is None:
            return
        if self._is_driven:
            plant.advance(now_ns)
            return
        while plant.now_ns + _BRAKING_STEP_NS <= now_ns:
            plant.command(self._braking * plant.velocity, plant.now_ns)
            plant.advance(plant.now_ns + _BRAKING_STEP_NS)
