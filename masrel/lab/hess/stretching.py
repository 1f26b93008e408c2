"""How many stretches a presentation has, when it is over, and how it stands."""

import math
from dataclasses import dataclass

from masrel.errors import ParameterError


@dataclass(frozen=True, slots=True, kw_only=True)
class StretchRules:
    """How often an arm may be stretched in one presentation, and for how long.

    With one stretch the presentation is over when the arm has arrived; the times below
    do not matter then. With several, a stretch is over when the arm has arrived or was
    brought back, and the next one is armed by flexing it faster than ν_th, as the law
    arms its next catch; where nothing was caught, by bringing it back at any speed. The
    last one can be held like every other: all is over when the arm is brought back.

    Attributes
    ----------
    n : int or None, optional
        Stretches of a presentation; None for as many as wanted, until
        `PresentationStatus.done`.
    time_limit : float, optional
        How long after the first stretch began another one may begin, s. Then the
        presentation is over as soon as no stretch goes on.
    stretch_limit : float, optional
        How long a stretch may take, s; a longer one is a fault of the kind
        ``"stretch-limit"``.

    Raises
    ------
    ParameterError
        If `n` is not 1 or more, or a time is not finite and above 0.

    Examples
    --------
    >>> StretchRules(n=None).time_limit
    60.0
    """

    n: int | None = 1
    time_limit: float = 60.0
    stretch_limit: float = 20.0

    def __post_init__(self) -> None:
        if self.n is not None and self.n < 1:
            raise ParameterError(f"n: needs 1 stretch or more, got {self.n}")
        for name in ("time_limit", "stretch_limit"):
            value = getattr(self, name)
            if not 0.0 < value < math.inf:
                raise ParameterError(f"{name}: needs more than 0 s, got {value}")


class PresentationStatus:
    """What the loop and whoever is with the rater tell each other, while it runs.

    Either side writes its own attributes and reads the other's; nobody waits.

    Attributes
    ----------
    is_done : bool
        Whether the rater has said so; written by `done`.
    is_armed : bool
        Whether the next extension begins a stretch; written by the loop.
    n_stretches : int
        Stretches that are over; written by the loop.

    Examples
    --------
    >>> status = PresentationStatus()
    >>> status.done()
    >>> status.is_done
    True
    """

    __slots__ = ("is_armed", "is_done", "n_stretches")

    def __init__(self) -> None:
        self.is_done = False
        self.is_armed = False
        self.n_stretches = 0

    def done(self) -> None:
        """Say that the rater needs no more: the presentation ends where the arm is."""
        self.is_done = True
