"""What a device is made from: the clock, a hand, and what its backend asks for."""

import math
from dataclasses import dataclass

from masrel.hess.clock import Clock
from masrel.hess.hand import Hand

__all__ = ["BackendOptions", "DeviceSetup"]


@dataclass(frozen=True, slots=True, kw_only=True)
class BackendOptions:
    """What one backend can be told beyond `DeviceSetup`; each has a subclass."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DeviceSetup:
    """What a backend's `build` makes a device from.

    Attributes
    ----------
    clock : Clock
        The clock of the loop that will use it.
    hand : Hand or None
        The hand that moves a simulated arm.
    range_end : float
        Where the arm meets its end stop, rad.
    options : BackendOptions or None
        The backend's own options; None for its defaults.
    """

    clock: Clock
    hand: Hand | None = None
    range_end: float = math.radians(146.0)
    options: BackendOptions | None = None
