"""Every law of the joint by its name, and the Tardieu scale's angles of any of them."""

import math
from dataclasses import dataclass

from masrel._input import refuse
from masrel.errors import ParameterError
from masrel.lab.elbow._events import events
from masrel.lab.elbow.joint_model import ToneModel
from masrel.lab.elbow.motions import ConstantSpeed
from masrel.lab.elbow.parameters import ElbowParameters
from masrel.lab.elbow.tone import LAWS

__all__ = ["MODELS", "JointModel", "Tardieu", "tardieu"]

_SPEEDS = (math.radians(10.0), math.radians(100.0), math.radians(150.0))

JointModel = ElbowParameters | ToneModel
"""A law of the joint with its parameters, in SI units."""

MODELS: dict[str, type[JointModel]] = {
    ElbowParameters.kind: ElbowParameters,
    **{law.kind: law for law in LAWS},
}
"""Every law by the name of its kind; `kind = "..."` of a protocol file."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Tardieu:
    """What three stretches of a joint at constant speed show.

    Attributes
    ----------
    speeds : tuple of three floats
        V1, V2 and V3, rad/s.
    catch_angles : tuple of three floats or None
        Where the joint catches at V1, V2 and V3, rad; None where it does not.
    range_angle : float
        R2, rad: how far the joint goes at V1, the end of its range of motion.

    References
    ----------
    .. [1] Boyd, R. N. and Graham, H. K. (1999). Objective measurement of clinical
       findings in the use of botulinum toxin type A for the management of children
       with cerebral palsy. European Journal of Neurology, 6(S4), S23-S35.
       https://doi.org/10.1111/j.1468-1331.1999.tb00031.x
    """

    speeds: tuple[float, float, float]
    catch_angles: tuple[float | None, float | None, float | None]
    range_angle: float

    @property
    def catch_angle(self) -> float:
        """R1, rad: where the joint catches at V3, or R2 where nothing catches."""
        caught = self.catch_angles[2]
        return self.range_angle if caught is None else caught

    @property
    def difference(self) -> float:
        """R2 - R1, rad: large for what depends on the speed, 0 for a contracture."""
        return self.range_angle - self.catch_angle


def tardieu(
    model: JointModel,
    *,
    start_angle: float = math.radians(30.0),
    speeds: tuple[float, float, float] = _SPEEDS,
) -> Tardieu:
    """Stretch a joint at three speeds, and say where it catches.

    The catch is where the phase "catch" begins, a root of the motion: nothing is
    stepped.

    Parameters
    ----------
    model : JointModel
        The joint, one of `MODELS`.
    start_angle : float, optional
        Where each stretch starts, rad.
    speeds : tuple of three floats, optional
        V1 (as slow as possible), V2 (a limb that falls) and V3 (as fast as possible),
        rad/s, each faster than the one before. The defaults, 10, 100 and 150 deg/s,
        are choices of ours: a forearm that falls is faster than a device may be.

    Returns
    -------
    Tardieu
        R1, R2 and the catch at each speed.

    Raises
    ------
    ParameterError
        If the speeds are not above 0 and in order, the stretch starts at or beyond
        the end of range, or the model offers no exact events.

    Examples
    --------
    >>> from math import degrees
    >>> from masrel.lab.elbow import STANDARD_MODELS
    >>> result = tardieu(STANDARD_MODELS["HM1"])
    >>> round(degrees(result.catch_angle), 6), round(degrees(result.difference), 6)
    (77.5, 68.5)
    """
    slow, falling, fast = speeds
    refuse(
        (
            not 0.0 < slow < falling < fast < math.inf,
            "speeds: need three above 0 deg/s, each faster than the one before, got "
            + ", ".join(f"{math.degrees(speed):g}" for speed in speeds),
        ),
        (
            not 0.0 <= start_angle < model.range_end,
            f"start_angle: needs 0 to less than {math.degrees(model.range_end):g} "
            f"degrees, the end of range, got {math.degrees(start_angle):g} degrees",
        ),
    )
    first, second, third = (_caught(model, start_angle, speed) for speed in speeds)
    return Tardieu(
        speeds=speeds,
        catch_angles=(first, second, third),
        range_angle=model.range_end,
    )


def _caught(model: JointModel, start: float, speed: float) -> float | None:
    stretch = ConstantSpeed(start=start, end=model.range_end, speed=speed)
    if isinstance(model, ElbowParameters):
        return events(model, stretch).catch_angle
    if not isinstance(model, ToneModel):
        raise ParameterError(
            f"model: needs one with exact events, got {type(model).__name__}"
        )
    for event in model.events(stretch):
        if event.name == model.catch_event:
            return event.angle
    return None
