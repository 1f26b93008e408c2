"""What an emulated puck is like."""

import math
from dataclasses import dataclass
from typing import Literal

from masrel.errors import ParameterError
from masrel.hess.puck.faults import InjectedFault
from masrel.hess.puck.properties import PropertyTable
from masrel.hess.puck.transmission import GEAR_RATIO

__all__ = ["EmulatorOptions"]


@dataclass(frozen=True, slots=True, kw_only=True)
class EmulatorOptions:
    """What an emulated puck is like.

    Attributes
    ----------
    firmware : int
        What it answers for VERS.
    role : int
        What it answers for ROLE; the lowest five bits are 0 for a motor.
    has_error : bool
        Whether it reports an error, STAT 1.
    awake : bool
        Whether it is awake from the beginning, its position set.
    wake_s : float
        How long it is off the bus while it wakes, s.
    counts_per_turn, units_per_nm : int
        Its CTS and IPNM.
    gear_ratio : float
        Turns of its motor for one of the elbow.
    direction : {1, -1}
        Whether its counts grow with extension.
    reply_bytes : {6, 4}
        Size of an answer that fits in either.
    is_flagged : bool
        Whether bit 7 of a position is set.
    has_secondary : bool
        Whether positions carry that of a second encoder.
    is_noisy : bool
        Whether others speak on the bus, too.
    braking : float
        Damping by the windings while it is idle, N·m·s/rad at the elbow; chosen.
    properties : PropertyTable or None
        Numbers of its properties; None for those of its firmware.
    faults : tuple of InjectedFault
        What fails, and when.

    Raises
    ------
    ParameterError
        If a value is outside its range.
    """

    firmware: int = 148
    role: int = 0
    has_error: bool = False
    awake: bool = False
    wake_s: float = 1.0
    counts_per_turn: int = 4096
    units_per_nm: int = 2700
    gear_ratio: float = GEAR_RATIO
    direction: Literal[1, -1] = 1
    reply_bytes: Literal[6, 4] = 6
    is_flagged: bool = False
    has_secondary: bool = False
    is_noisy: bool = False
    braking: float = 1.0
    properties: PropertyTable | None = None
    faults: tuple[InjectedFault, ...] = ()

    def __post_init__(self) -> None:
        for name in ("wake_s", "braking"):
            if not 0.0 <= getattr(self, name) < math.inf:
                raise ParameterError(
                    f"{name}: needs 0 or more, got {getattr(self, name)}"
                )
        if self.reply_bytes not in (4, 6):
            raise ParameterError(f"reply_bytes: needs 4 or 6, got {self.reply_bytes}")
