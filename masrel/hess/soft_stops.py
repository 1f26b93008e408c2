"""Soft stops: springs that push back before the range of angles ends."""

from masrel.hess.limits import DeviceLimits

__all__ = ["SoftStops"]


class SoftStops:
    """A spring over the last bit of the range at each of its ends."""

    __slots__ = ("_lower", "_slope", "_upper")

    def __init__(self, limits: DeviceLimits) -> None:
        self._slope = limits.soft_stop_torque / limits.soft_stop_width
        self._upper = limits.highest_angle - limits.soft_stop_width
        self._lower = limits.lowest_angle + limits.soft_stop_width

    def torque(self, angle: float) -> float:
        """Return what they push back with."""
        # Torque to add to the command, N·m: positive near the highest angle, negative
        # near the lowest, 0 between.
        if angle > self._upper:
            return self._slope * (angle - self._upper)
        return self._slope * (angle - self._lower) if angle < self._lower else 0.0
