"""A fault: what it was, when it was noticed, and what it left of the torque."""

from dataclasses import dataclass

__all__ = ["Fault"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Fault:
    """What stopped a presentation.

    Attributes
    ----------
    kind : str
        One word: a limit such as ``"torque"``, ``"frozen"`` or ``"overrun"``,
        ``"no-answer"``, ``"device"``, ``"controller"`` or ``"emergency-stop"``.
    words : str
        What was needed and what came.
    time_s : float
        When it was noticed, s since the presentation began.
    torque_nm : float
        The torque that the device held then, N·m.
    """

    kind: str
    words: str
    time_s: float
    torque_nm: float
