"""Faults that an emulated puck and its bus can be given."""

import math
from dataclasses import dataclass
from typing import Literal, get_args

from masrel.errors import ParameterError

__all__ = ["ActiveFaults", "FaultKind", "InjectedFault"]

FaultKind = Literal[
    "dropped-requests",  # what the host sends gets lost, torques included
    "dropped-replies",  # the puck's answers get lost
    "dropped-torques",  # torques alone get lost
    "late-replies",  # `size` s later than they should
    "duplicated-replies",  # each a second time, 0.1 ms later
    "short-replies",  # one byte less
    "foreign-frames",  # the safety module, another puck, another host
    "error-frames",  # the bus reports a protocol error at every request
    "bus-off",  # the host's controller gives up, and restarts at the end
    "frozen-encoder",  # the count stands still
    "jumping-encoder",  # `size` counts are added
    "wrapping-encoder",  # whole turns of the motor are lost
    "idled",  # somebody else sets MODE to idle, once
    "reset",  # the supply fails for a moment, once
    "unplugged",  # nothing goes either way
]

_SIZES: dict[str, float] = {"late-replies": 0.0015, "jumping-encoder": 2000.0}


@dataclass(frozen=True, slots=True, kw_only=True)
class InjectedFault:
    """One fault of an emulated puck or its bus.

    Attributes
    ----------
    kind : str
        What fails; one of `FaultKind`.
    start_s : float
        When, s after the puck was first put into torque mode.
    end_s : float
        Until when, s.
    every : int
        How many frames there are to one that is affected.
    size : float or None
        How late, s, or how far, counts; None for 1.5 ms and for 2000 counts, 9.3 deg.

    Raises
    ------
    ParameterError
        If there is no such kind, or a value is outside its range.
    """

    kind: FaultKind
    start_s: float
    end_s: float = math.inf
    every: int = 1
    size: float | None = None

    def __post_init__(self) -> None:
        if self.kind not in get_args(FaultKind):
            raise ParameterError(
                f"kind: needs one of {', '.join(get_args(FaultKind))}, got {self.kind}"
            )
        if not 0.0 <= self.start_s < self.end_s:
            raise ParameterError(
                "start_s, end_s: need 0 <= start_s < end_s, "
                f"got {self.start_s} and {self.end_s}"
            )
        if self.every < 1:
            raise ParameterError(f"every: needs 1 or more, got {self.every}")

    @property
    def amount(self) -> float:
        """How late, s, or how far, counts; 0 where nothing is."""
        return _SIZES.get(self.kind, 0.0) if self.size is None else self.size


class ActiveFaults:
    """The faults of one emulated puck, on its time."""

    __slots__ = ("_faults", "_n_hit", "started_ns")

    def __init__(self, faults: tuple[InjectedFault, ...]) -> None:
        self._faults = faults
        self.started_ns: int | None = None
        self._n_hit: dict[FaultKind, int] = {}

    def start(self, now_ns: int) -> bool:
        """Let their time begin."""
        if self.started_ns is not None:
            return False
        self.started_ns = now_ns
        return True

    def active(self, kind: FaultKind, now_ns: int) -> InjectedFault | None:
        """Return the fault of a kind that is on."""
        if self.started_ns is None or not self._faults:
            return None
        since_s = (now_ns - self.started_ns) * 1e-9
        for fault in self._faults:
            if fault.kind == kind and fault.start_s <= since_s < fault.end_s:
                return fault
        return None

    def hit(self, kind: FaultKind, now_ns: int) -> InjectedFault | None:
        """Count a frame, and return the fault that affects it."""
        fault = self.active(kind, now_ns)
        if fault is None:
            return None
        self._n_hit[kind] = n_hit = self._n_hit.get(kind, 0) + 1
        return fault if (n_hit - 1) % fault.every == 0 else None

    def amount(self, kind: FaultKind, now_ns: int) -> float:
        """Count a frame, and return how much of a fault affects it."""
        fault = self.hit(kind, now_ns)
        return 0.0 if fault is None else fault.amount
