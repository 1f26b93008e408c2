"""Lead-pipe rigidity: an even, plastic resistance both ways, hardly of the speed."""

import math
from dataclasses import dataclass
from typing import ClassVar, Self

import numpy as np

from masrel.lab.elbow._motion import Floats, Motion
from masrel.lab.elbow.tone._model import (
    ToneEvent,
    ToneModel,
    events_at,
    grade_of,
    quantity,
)
from masrel.lab.elbow.tone._passages import negative, one_way

# F N·m, K N·m/rad, B N·m·s/rad by the UPDRS score of rigidity: choices of ours
_BY_UPDRS = {
    "0": (0.0, 0.5, 0.05),
    "1": (0.4, 0.7, 0.10),
    "2": (0.8, 1.0, 0.15),
    "3": (1.6, 1.4, 0.20),
    "4": (3.2, 2.0, 0.30),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class LeadPipe(ToneModel):
    """Rigidity as a spring, a damper and a bristle that sticks and slips.

    τ = K·(θ - θ0) + B·ω + F·z/z_c, where the bristle follows the arm and slips at ±z_c:
    z ← clip(z + Δθ, -z_c, z_c), 0 in the beginning. The bristle does not depend on the
    speed and holds the limb where it is put, as long as K·|θ - θ0| is at most F.

    Attributes
    ----------
    coulomb_torque : float
        F, N·m: torque of the slipping bristle. The default is that of UPDRS 3, a
        choice of ours, not from a source.
    stiffness : float
        K, N·m/rad. A choice of ours, not from a source.
    damping : float
        B, N·m·s/rad. A choice of ours, not from a source.
    bristle_travel : float
        z_c, rad: how far the bristle bends before it slips. A choice of ours, not
        from a source.
    rest_angle : float
        θ0, rad: where the spring has no torque. A choice of ours, not from a source.
    range_end : float
        End of the range of motion, rad; that of the spastic elbow.
    speed_threshold : float
        Speed from which the arm counts as moving, rad/s; that of the spastic elbow.

    Raises
    ------
    ParameterError
        If a parameter is not finite or outside its range; the message names it.

    References
    ----------
    .. [1] Endo, T. et al. (2009; 2015): rigidity of the elbow as an elastic
       coefficient and a difference of bias between extension and flexion, which grows
       with the speed. Abstracts only.
    .. [2] Park, H. S. et al. (2011): spring and damper at the wrist. Abstract only.

    Examples
    --------
    >>> joint = LeadPipe.of_updrs(3).stepper(0.5)
    >>> round(joint.step(0.0, 0.5, 0.0), 4), round(joint.step(0.1, 0.6, 1.0), 4)
    (-0.7661, 1.1739)
    """

    kind: ClassVar[str] = "lead-pipe-rigidity"
    is_passive: ClassVar[bool] = True

    coulomb_torque: float = quantity(1.6, "N·m", "not negative")
    stiffness: float = quantity(1.4, "N·m/rad", "not negative")
    damping: float = quantity(0.2, "N·m·s/rad", "not negative")
    bristle_travel: float = quantity(math.radians(2.0), "rad", "positive")
    rest_angle: float = quantity(math.radians(60.0), "rad", "angle")

    @classmethod
    def of_updrs(cls, score: int) -> Self:
        """Return the rigidity of a UPDRS score, 0 to 4: a choice of ours."""
        torque, stiffness, damping = grade_of(_BY_UPDRS, score, "score")
        return cls(coulomb_torque=torque, stiffness=stiffness, damping=damping)

    def stepper(self, start_angle: float) -> "RigidStepper":
        """Return the joint as a state machine that has not seen a sample yet."""
        del start_angle  # it has a rest angle of its own
        return RigidStepper(self)

    def largest_torque(self, *, start_angle: float, speed: float) -> float:
        """Return the largest torque of a stretch and the way back, N·m."""
        off = max(abs(start_angle - self.rest_angle), self.range_end - self.rest_angle)
        return self.stiffness * off + self.damping * speed + self.coulomb_torque

    def largest_slope(self, *, speed: float) -> tuple[float, float]:
        """Return the largest slopes, over angle and velocity: a bristle that sticks."""
        del speed
        return self.stiffness + self.coulomb_torque / self.bristle_travel, self.damping

    def _law(self, angle: float, velocity: float, bristle: float) -> float:
        """Return the torque, N·m, of a bristle bent by so much, rad."""
        spring = self.stiffness * (angle - self.rest_angle) + self.damping * velocity
        return spring + self.coulomb_torque * bristle / self.bristle_travel

    def events(self, motion: Motion) -> tuple[ToneEvent, ...]:
        """Return when the bristle slips and sticks along a motion, in order."""
        times: list[tuple[str, float]] = []
        bristle, limit, slips = 0.0, self.bristle_travel, 0
        for part in one_way(motion):
            if not part.direction:
                continue
            begin, end = part.angle[0], part.angle_at(part.end)
            if slips == -part.direction:
                times.append(("stick", part.start))
                slips = 0
            slips_at = begin - bristle + part.direction * limit
            over = part.beyond(slips_at)
            if part.direction < 0:
                over = negative(over)
            time = None if slips else part.reached(over)
            if time is not None:
                times.append(("slip", time))
                slips = part.direction
            bristle = _clip(bristle + end - begin, limit)
        return events_at(motion, times)

    def _bristles(self, motion: Motion, times: Floats) -> Floats:
        # how far the bristle is bent at each time, rad; times (n,)
        bent = np.zeros(times.size)
        bristle, limit = 0.0, self.bristle_travel
        for part in one_way(motion):
            mine = times >= part.start
            begin, end = part.angle[0], part.angle_at(part.end)
            travel = part.angle_at(np.minimum(times[mine], part.end)) - begin
            bent[mine] = np.clip(bristle + travel, -limit, limit)
            bristle = _clip(bristle + end - begin, limit)
        return bent

    def _torque(
        self, motion: Motion, times: Floats, angle: Floats, velocity: Floats
    ) -> Floats:
        bent = self._bristles(motion, times)
        rows = zip(angle, velocity, bent, strict=True)
        return np.array([self._law(*row) for row in rows])


class RigidStepper:
    """Rigidity that sees one sample at a time; nothing is ever triggered."""

    __slots__ = ("_angle", "_bristle", "_model", "phase")

    def __init__(self, model: LeadPipe) -> None:
        self._model = model
        self._angle = math.nan
        self._bristle = 0.0
        self.phase = 0

    def release(self) -> None:
        """Straighten the bristle."""
        self._bristle = 0.0

    def step(self, time_s: float, angle: float, velocity: float) -> float:
        """Decide the torque of one sample, N·m."""
        del time_s
        return self._model._law(angle, velocity, self.bend(angle))

    def bend(self, angle: float) -> float:
        """Return how far the bristle is bent now, rad."""
        if not math.isnan(self._angle):  # the first sample finds it straight
            moved = self._bristle + angle - self._angle
            self._bristle = _clip(moved, self._model.bristle_travel)
        self._angle = angle
        return self._bristle


def _clip(value: float, limit: float) -> float:
    return min(max(value, -limit), limit)
