"""What the simulated arm, its motor and its amplifier are like."""

import math
from dataclasses import dataclass, field

from masrel.errors import ParameterError
from masrel.hess.friction import Friction

__all__ = ["PlantParameters"]


@dataclass(frozen=True, slots=True, kw_only=True)
class PlantParameters:
    """What the simulated arm, motor and amplifier are like, in SI units."""

    # inertia of the motor and friction, (7)
    friction: Friction = field(default_factory=Friction)
    # inertia of the mannequin's forearm and hand, kg·m². Not printed in the source: a
    # rod of 0.8 kg and 0.25 m and a hand of 0.3 kg at 0.33 m give 0.05.
    arm_inertia: float = 0.05
    # where the arm meets its end stop, rad; the other one is at 0
    range_end: float = math.radians(146.0)
    # stop_stiffness, stop_damping: of both end stops, N·m/rad and N·m·s/rad: 10 N·m
    # move one by 0.03 deg, and the arm does not bounce
    stop_stiffness: float = 20_000.0
    stop_damping: float = 50.0
    # quantum of the commanded torque, N·m; 0 for none. One unit of an amplifier with
    # 2700 units to the N·m behind a gear of 18.8:1.
    torque_step: float = 18.8 / 2700.0
    # time constant of the current loop, s; 0 for none. Not printed; chosen.
    lag_time: float = 0.0005
    # from the command until the current begins to follow, s. Not printed; chosen.
    delay: float = 0.0005
    step_ns: int = 500_000  # step of the integration, ns

    def __post_init__(self) -> None:
        zero_or_more = ("arm_inertia", "torque_step", "lag_time", "delay")
        for name in (*zero_or_more, "stop_stiffness", "stop_damping"):
            if not 0.0 <= getattr(self, name) < math.inf:
                raise ParameterError(
                    f"{name}: needs 0 or more, got {getattr(self, name)}"
                )
        if not 0.0 < self.range_end <= math.pi:
            raise ParameterError(
                "range_end: needs more than 0 and at most 180 degrees, "
                f"got {self.range_end} rad"
            )
        if self.step_ns < 1:
            raise ParameterError(f"step_ns: needs 1 or more, got {self.step_ns}")
