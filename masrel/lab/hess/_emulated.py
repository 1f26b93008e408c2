"""An emulated amplifier on a CAN bus: its time, its arm, and faults on demand.

What it says and does is its own; here is what all of them share.
"""

import heapq
import math
from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal, get_args

from masrel._input import refuse
from masrel.errors import FrameError
from masrel.lab.hess._can import BUS_OFF, BUS_RESTARTED, Frame, Link
from masrel.lab.hess._clock import Clock
from masrel.lab.hess._simulated import Plant, PlantParameters
from masrel.lab.hess.hand import Hand

_DUPLICATE_NS = 100_000
_SOON_NS = 10_000_000  # until it is looked whether it is over
_BRAKING_STEP_NS = 500_000
_Event = Callable[[int], None]  # at the time when it was due, ns

_PROTOCOL_ERROR = 0x088  # class of an error frame: protocol violation, bus error

FaultKind = Literal[
    "dropped-requests",  # what the host sends gets lost, torques included
    "dropped-replies",  # the answers get lost
    "dropped-torques",  # torques alone get lost
    "late-replies",  # `size` s later than they should
    "duplicated-replies",  # each a second time, 0.1 ms later
    "short-replies",  # one byte less
    "foreign-frames",  # the safety module, another amplifier, another host
    "error-frames",  # the bus reports a protocol error at every request
    "bus-off",  # the host's controller gives up, and restarts at the end
    "frozen-encoder",  # the count stands still
    "jumping-encoder",  # `size` counts are added
    "wrapping-encoder",  # whole turns of the motor are lost
    "idled",  # somebody else idles it, once
    "reset",  # the supply fails for a moment, once
    "unplugged",  # nothing goes either way
    "scaled-torque",  # the motor gives `size` times what it says
    "dead-motor",  # no current flows
    # of a moteus alone
    "stale-replies",  # the answer before again
    "renumbered-replies",  # under the number of another
    "nan-replies",  # the position is no number
    "other-torques",  # of a second host, each after one of the first
    "board-fault",  # it stops itself, once, with code `size`
    "limited",  # it says that it limits the torque, with code `size`
]

_SIZES: dict[str, float] = {
    "late-replies": 0.0015,
    "jumping-encoder": 2000.0,
    "scaled-torque": -1.0,
    "board-fault": 34.0,
    "limited": 99.0,
}


@dataclass(frozen=True, slots=True, kw_only=True)
class InjectedFault:
    """One fault of an emulated amplifier or its bus.

    Attributes
    ----------
    kind : str
        What fails: "dropped-requests", "dropped-replies", "dropped-torques",
        "late-replies", "duplicated-replies", "short-replies", "foreign-frames",
        "error-frames", "bus-off", "frozen-encoder", "jumping-encoder",
        "wrapping-encoder", "idled", "reset", "unplugged", "scaled-torque" or
        "dead-motor"; of a moteus also "stale-replies", "renumbered-replies",
        "nan-replies", "other-torques", "board-fault" or "limited".
    start_s : float
        When, s after it was first in torque mode.
    end_s : float
        Until when, s.
    every : int
        How many frames there are to one that is affected.
    size : float or None
        How late, s, how far, counts, how many times the torque, or which code of a
        moteus; None for 1.5 ms, 2000 counts, -1, and the codes 34 and 99.

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
        kinds = get_args(FaultKind)
        refuse(
            (
                self.kind not in kinds,
                f"kind: needs one of {', '.join(kinds)}, got {self.kind}",
            ),
            (
                not 0.0 <= self.start_s < self.end_s,
                "start_s, end_s: need 0 <= start_s < end_s, "
                f"got {self.start_s} and {self.end_s}",
            ),
            (self.every < 1, f"every: needs 1 or more, got {self.every}"),
        )

    @property
    def amount(self) -> float:
        """Its size, or that of its kind; 0 if it has none."""
        return _SIZES.get(self.kind, 0.0) if self.size is None else self.size


class Motor:
    """A simulated arm, driven by a torque or resisted by what an idle motor does."""

    def __init__(self, hand: Hand, range_end: float, arm: PlantParameters) -> None:
        # The quantum is that of the bus
        self.plant = Plant(hand, replace(arm, range_end=range_end, torque_step=0.0))
        self._damping, self._most = 0.0, math.inf  # idle: N·m·s/rad, and N·m
        self._has_moved = self._is_driven = False

    def angle(self, now_ns: int) -> float:
        """Return where the arm is, rad."""
        self.advance(now_ns)
        return self.plant.angle_at(now_ns)

    def drive(self, torque_nm: float, now_ns: int) -> None:
        """Turn with a torque until the next command."""
        if not self._has_moved:
            self._has_moved = True
            self.plant.begin(now_ns)
        self.advance(now_ns)
        self._is_driven = True
        self.plant.command(torque_nm, now_ns)

    def brake(self, now_ns: int, damping: float, most: float = math.inf) -> None:
        """Stop driving: from now on the motor damps the arm, with so much at most."""
        self.advance(now_ns)
        self._is_driven = False
        self._damping, self._most = damping, most

    def advance(self, now_ns: int) -> None:
        """Let the arm move up to a time; it does not before it is first driven."""
        plant = self.plant
        if self._is_driven:
            plant.advance(now_ns)
        elif self._has_moved:
            while plant.now_ns + _BRAKING_STEP_NS <= now_ns:
                torque = self._damping * plant.velocity
                torque = max(-self._most, min(self._most, torque))
                plant.command(torque, plant.now_ns)
                plant.advance(plant.now_ns + _BRAKING_STEP_NS)


class Faults:
    """The faults of one emulated amplifier, from when it is first in torque mode."""

    def __init__(self, faults: tuple[InjectedFault, ...]) -> None:
        self.all = faults
        self._n_hit: Counter[FaultKind] = Counter()
        self.started_ns: int | None = None

    def active(self, kind: FaultKind, now_ns: int) -> InjectedFault | None:
        """Return the fault of a kind that is on."""
        if self.started_ns is None or not self.all:
            return None
        since_s = (now_ns - self.started_ns) * 1e-9
        for fault in self.all:
            if fault.kind == kind and fault.start_s <= since_s < fault.end_s:
                return fault
        return None

    def hit(self, kind: FaultKind, now_ns: int) -> InjectedFault | None:
        """Count a frame, and return the fault that affects it."""
        fault = self.active(kind, now_ns)
        if fault is None:
            return None
        self._n_hit[kind] += 1
        return fault if (self._n_hit[kind] - 1) % fault.every == 0 else None

    def amount(self, kind: FaultKind, now_ns: int) -> float:
        """Count a frame, and return how much of a fault affects it."""
        fault = self.hit(kind, now_ns)
        return 0.0 if fault is None else fault.amount

    def torque(self, torque_nm: float, now_ns: int) -> float:
        """Return what the motor gives where it is to give a torque."""
        if self.active("dead-motor", now_ns):
            return 0.0
        fault = self.active("scaled-torque", now_ns)
        return torque_nm if fault is None else torque_nm * fault.amount


class EmulatedAmplifier(ABC):
    """An amplifier, served by whoever waits for it."""

    def __init__(
        self,
        *,
        link: Link,
        clock: Clock,
        faults: tuple[InjectedFault, ...],
        motor: Motor,
        counts_per_turn: int,
        address: int,
    ) -> None:
        self.link = link
        self._address = address
        self._clock = clock
        self.faults = Faults(faults)
        self.motor = motor
        self._counts_per_turn = counts_per_turn
        self._frozen_counts: int | None = None  # at which its encoder stands still
        self._last_reply_ns = 0
        self._events: list[tuple[int, int, _Event]] = []
        self._n_events = 0

    # What is its own

    _torn_bytes = 1  # of a frame that is cut short
    _address_mask = -1  # of the bits of an identifier that say for whom it is

    @abstractmethod
    def _obey(self, frame: Frame, now_ns: int) -> None:
        """Do what a frame says; raise `FrameError` where it means nothing."""

    @abstractmethod
    def _foreign_frames(self) -> tuple[Frame, ...]:
        """Return what others may say on its bus."""

    @abstractmethod
    def _idle(self, now_ns: int) -> None:
        """Let the arm go, as somebody else has it do."""

    @abstractmethod
    def _reset(self, now_ns: int) -> None:
        """Lose what is not in permanent memory."""

    # Time: events wait for theirs, and those of one time keep their order

    def next_due_ns(self) -> int | None:
        """Return when it will act next."""
        return self._events[0][0] if self._events else None

    def serve(self) -> None:
        """Do what is due by now, and take in the frames that wait."""
        self._act(self._clock.now_ns())  # before them: they come now
        while (frame := self.link.receive(0)) is not None:
            self._take_in(frame, self._clock.now_ns())
        self._act(self._clock.now_ns())

    def run(self, is_over: Callable[[], bool]) -> None:
        """Serve a bus that other processes are on, in real time."""
        while not is_over():
            soon_ns = self._clock.now_ns() + _SOON_NS
            frame = self.link.receive(min(self.next_due_ns() or soon_ns, soon_ns))
            if frame is not None:
                self._take_in(frame, self._clock.now_ns())
            self._act(self._clock.now_ns())

    def close(self) -> None:
        """Leave the bus."""
        self.link.close()

    def _at(self, due_ns: int, event: Callable[[int], None]) -> None:
        # The event is called with the time at which it was due
        self._n_events += 1
        heapq.heappush(self._events, (due_ns, self._n_events, event))

    def _act(self, now_ns: int) -> None:
        while self._events and self._events[0][0] <= now_ns:
            due_ns, _, event = heapq.heappop(self._events)
            event(due_ns)
        self.motor.advance(now_ns)

    # What comes from the bus, and goes to it

    def _take_in(self, frame: Frame, now_ns: int) -> None:
        is_addressed = frame.identifier & self._address_mask == self._address
        if frame.is_error or not is_addressed or self._is_cut_off(now_ns):
            return
        if not self.faults.hit("dropped-requests", now_ns):
            try:
                self._obey(frame, now_ns)
            except FrameError:
                return  # it does not answer what it does not understand

    def _is_cut_off(self, now_ns: int) -> bool:
        # Whether no frame comes or goes
        active = self.faults.active
        return bool(active("unplugged", now_ns) or active("bus-off", now_ns))

    def _report_error(self, error_class: int) -> None:
        # As the host's adapter would
        self.link.send(Frame(error_class, bytes(8), is_error=True))

    def _interfere(self, now_ns: int) -> None:
        # What else is on the bus when a position is requested
        if self.faults.hit("foreign-frames", now_ns):
            for frame in self._foreign_frames():
                self.link.send(frame)
        if self.faults.hit("error-frames", now_ns):
            self._report_error(_PROTOCOL_ERROR)

    def _answer(self, frame: Frame, due_ns: int) -> None:
        if self.faults.hit("dropped-replies", due_ns):
            return
        if self.faults.hit("short-replies", due_ns):
            frame = frame._replace(data=frame.data[: -self._torn_bytes])
        due_ns += round(self.faults.amount("late-replies", due_ns) * 1e9)
        # It answers requests in their order.
        self._last_reply_ns = due_ns = max(due_ns, self._last_reply_ns + 1)
        self._at(due_ns, lambda due: self._send(frame, due))
        if self.faults.hit("duplicated-replies", due_ns):
            self._at(due_ns + _DUPLICATE_NS, lambda due: self._send(frame, due))

    def _send(self, frame: Frame, now_ns: int) -> None:
        if not self._is_cut_off(now_ns):
            self.link.send(frame)

    # What goes wrong

    def _begin_faults(self, now_ns: int) -> None:
        # Their time begins with the first torque mode
        if self.faults.started_ns is not None:
            return
        self.faults.started_ns = now_ns
        for fault in self.faults.all:
            begins, ends = self._events_of(fault)
            if begins is not None:
                self._at(now_ns + round(fault.start_s * 1e9), begins)
            if ends is not None and fault.end_s < math.inf:
                self._at(now_ns + round(fault.end_s * 1e9), ends)

    def _events_of(self, fault: InjectedFault) -> tuple[_Event | None, _Event | None]:
        # What happens once, where a fault begins, and where it ends
        events: dict[str, tuple[_Event, _Event | None]] = {
            "idled": (self._idle, None),
            "reset": (self._reset, None),
            "bus-off": (
                lambda _due: self._report_error(BUS_OFF),
                lambda _due: self._report_error(BUS_RESTARTED),
            ),
        }
        return events.get(fault.kind, (None, None))

    def _encoder_counts(self, counts: int, now_ns: int) -> int:
        # What a faulty encoder makes of a count
        if not self.faults.hit("frozen-encoder", now_ns):
            self._frozen_counts = None
        elif self._frozen_counts is None:
            self._frozen_counts = counts
        if self._frozen_counts is not None:
            counts = self._frozen_counts
        if self.faults.hit("wrapping-encoder", now_ns):
            counts %= self._counts_per_turn
        return counts + round(self.faults.amount("jumping-encoder", now_ns))
