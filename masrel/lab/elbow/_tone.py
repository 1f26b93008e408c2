"""What the models of tone share: parameters, steppers, and roots along a motion."""

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field, fields
from itertools import pairwise
from typing import Any, ClassVar, Literal

import numpy as np

from masrel.errors import ParameterError
from masrel.lab.elbow._motion import Floats, Motion
from masrel.lab.elbow._polynomials import (
    Number,
    Polynomial,
    derivative,
    shifted,
    split_at_roots,
    value,
)
from masrel.lab.elbow.joint_model import JointModel

Needs = Literal["positive", "not negative", "share", "angle", "frequency"]

_RANGES: dict[Needs, tuple[str, Callable[[float], bool]]] = {
    "positive": ("more than 0", lambda value: value > 0.0),
    "not negative": ("0 or more", lambda value: value >= 0.0),
    "share": ("0 to 1", lambda value: 0.0 <= value <= 1.0),
    "angle": ("0 to 180 degrees", lambda value: 0.0 <= value <= math.pi),
    "frequency": ("more than 0, at most 100", lambda value: 0.0 < value <= 100.0),
}

_SAME_TIME = 1e-12  # s: nearer times are the same but for rounding
_SLACK = 1e-12  # rad, rad/s: by so little less than 0 is 0 but for rounding


@dataclass(frozen=True, slots=True, kw_only=True)
class Quantity:
    """What is known of a parameter besides its value.

    Attributes
    ----------
    unit : str
        Its unit in Python: "rad", "N·m/rad"; "" for a plain number.
    needs : {"positive", "not negative", "share", "angle", "frequency"}
        The range that it has to lie in.
    is_choice : bool
        Whether its default is a choice of ours, not from a source.
    """

    unit: str
    needs: Needs
    is_choice: bool


def quantity(
    default: float | None, unit: str, needs: Needs, *, is_choice: bool = True
) -> Any:
    """Return the field of a parameter with its unit and range."""
    known = Quantity(unit=unit, needs=needs, is_choice=is_choice)
    return field(default=default, metadata={"quantity": known})


@dataclass(frozen=True, slots=True, kw_only=True)
class ToneEvent:
    """Something that happens to a joint along a motion.

    Attributes
    ----------
    name : str
        What, in the words of the model's page.
    time : float
        When, s.
    angle : float
        Where, rad.
    """

    name: str
    time: float
    angle: float


class ToneStepper:
    """A law that sees one sample at a time; one with a memory adds it."""

    __slots__ = ("is_given_up", "model", "phase", "rest")

    def __init__(self, model: Any, start_angle: float) -> None:
        self.model, self.rest = model, model.rest_from(start_angle)
        self.is_given_up = False
        self.phase = 0
        self.begin()

    def begin(self) -> None:
        """Have seen nothing yet."""

    def release(self) -> None:
        """Give up at once what has been triggered; a law says until when."""
        self.is_given_up = True
        self.phase = 0

    def remember(
        self, _time_s: float, _angle: float, _velocity: float, /
    ) -> tuple[float, ...]:
        """Take a sample in -> what the law's torque depends on besides."""
        return ()

    def step(self, time_s: float, angle: float, velocity: float) -> float:
        """Decide the torque of one sample, N·m."""
        memory = self.remember(time_s, angle, velocity)
        torque: float = self.model._law(angle, velocity, self.rest, *memory)
        return torque


@dataclass(frozen=True, slots=True, kw_only=True)
class ToneModel(JointModel, ABC):
    """A law of tone: what every model in `masrel.lab.elbow.tone` is.

    Attributes
    ----------
    kind : str
        Name of the law in `masrel.lab.elbow.MODELS`.
    is_passive : bool
        Whether it never gives back more than it took, whatever the motion.
    catch_event : str or None
        Name of the event where the phase "catch" begins; None if nothing catches.
    range_end : float
        End of the range of motion, rad.
    speed_threshold : float
        Speed from which the arm counts as moving, rad/s.

    Raises
    ------
    ParameterError
        If a parameter is not finite or outside its range; the message names it.
    """

    kind: ClassVar[str]
    is_passive: ClassVar[bool] = False
    catch_event: ClassVar[str | None] = None
    _stepper: ClassVar[type[ToneStepper]] = ToneStepper

    range_end: float = quantity(math.radians(146.0), "rad", "angle", is_choice=False)
    speed_threshold: float = quantity(
        math.radians(20.0), "rad/s", "positive", is_choice=False
    )

    def __post_init__(self) -> None:
        for name, known in self.quantities().items():
            value = getattr(self, name)
            if value is None and name in self._may_be_none():
                continue
            is_number = isinstance(value, int | float) and not isinstance(value, bool)
            if not is_number or not math.isfinite(value):
                raise ParameterError(f"{name}: needs a finite number, got {value!r}")
            needed, is_met = _RANGES[known.needs]
            if not is_met(value):
                raise ParameterError(
                    f"{name}: needs {needed}, got {value:g} {known.unit}".rstrip()
                )
        self._check_together()

    def _check_together(self) -> None:
        # A model whose parameters have to go together refuses here those that do not.
        return

    @classmethod
    def quantities(cls) -> dict[str, Quantity]:
        """Return unit, range and origin of every parameter, by name."""
        return {entry.name: entry.metadata["quantity"] for entry in fields(cls)}

    @classmethod
    def _may_be_none(cls) -> frozenset[str]:
        return frozenset(entry.name for entry in fields(cls) if entry.default is None)

    def stepper(self, start_angle: float) -> ToneStepper:
        """Return the joint as a state machine that has not seen a sample yet."""
        return self._stepper(self, start_angle)

    def rest_from(self, start_angle: float) -> float:
        """Return where the spring has no torque, rad: where it starts unless set."""
        rest: float | None = getattr(self, "rest_angle", None)
        return start_angle if rest is None else rest

    @abstractmethod
    def events(self, motion: Motion) -> tuple[ToneEvent, ...]:
        """Return what happens along a motion, as roots of it: nothing is stepped.

        Parameters
        ----------
        motion : Motion
            A movement, SI units; it may hold and return.

        Returns
        -------
        tuple of ToneEvent
            In order of their times.
        """

    def torque(self, motion: Motion, times: Sequence[float] | Floats) -> Floats:
        """Return the torque along a motion, its events at their own times.

        Parameters
        ----------
        motion : Motion
            A movement, SI units; it may hold and return.
        times : array_like of float, shape (n,)
            Times, s; from the end of the motion on, those of its end.

        Returns
        -------
        ndarray, shape (n,)
            Torque that resists extension, N·m.

        Raises
        ------
        ParameterError
            If a time is before 0 or nan.
        """
        moments = np.asarray(times, dtype=np.float64)
        if moments.size and not 0.0 <= moments.min() <= moments.max():
            raise ParameterError("times: needs 0 s or later, got an earlier one or nan")
        moments = np.minimum(moments, motion.duration)
        angle, velocity = motion.angle(moments), motion.velocity(moments)
        columns = (angle, velocity, *self._memory(motion, moments))
        rest = self.rest_from(motion.start)
        rows = zip(*columns, strict=True)
        return np.array([self._law(a, v, rest, *memory) for a, v, *memory in rows])

    @abstractmethod
    def _law(
        self, angle: float, velocity: float, rest: float, /, *memory: float
    ) -> float:
        """Return the torque, N·m."""

    def _memory(self, _motion: Motion, _times: Floats, /) -> list[Floats]:
        """Return what `_law` depends on besides, at times of a motion (n,) each."""
        return []


def events_at(
    motion: Motion, times: Iterable[tuple[str, float]]
) -> tuple[ToneEvent, ...]:
    """Return events of these names and times, in order.

    What would begin at the very end of the motion, or later, is none.
    """
    last = motion.duration - _SAME_TIME
    inside = sorted((e for e in times if e[1] < last), key=lambda event: event[1])
    angles = motion.angle(np.array([time for _, time in inside])).tolist()
    return tuple(
        ToneEvent(name=name, time=time, angle=angle)
        for (name, time), angle in zip(inside, angles, strict=True)
    )


def grade_of(table: dict[str, Any], grade: object, name: str) -> Any:
    """Return the row of a grade, refusing one that the table does not have."""
    row = table.get(str(grade))
    if row is None or isinstance(grade, bool):
        *others, last = table
        raise ParameterError(
            f"{name}: needs {', '.join(others)} or {last}, got {grade!r}"
        )
    return row


@dataclass(frozen=True, slots=True)
class OneWay:
    """A part of a motion in which the arm extends (1), flexes (-1) or rests (0)."""

    start: float  # s
    length: float  # s
    angle: Polynomial  # rad, over s since its start
    direction: int

    @property
    def end(self) -> float:
        """When it ends, s."""
        return self.start + self.length

    def angle_at(self, time: Number) -> Number:
        """Return the angle at one or many times of the part, rad."""
        return value(self.angle, time - self.start)

    def beyond(self, angle: float, lead: float = 0.0) -> Polynomial:
        """Return θ + lead·ω less an angle, rad."""
        over = [self.angle[0] - angle, *self.angle[1:]]
        for i, speed in enumerate(derivative(self.angle) if lead else ()):
            over[i] += lead * speed
        return over

    def faster(self, speed: float, way: int) -> Polynomial:
        """Return ω one way less a speed, rad/s."""
        over = [way * c for c in derivative(self.angle)]
        over[0] -= speed
        return over

    def reached(self, *levels: Polynomial, after: float = -math.inf) -> float | None:
        """Return when all polynomials are first 0 or more; None if never.

        Not before the time `after`, which counts itself.
        """
        first = max(0.0, after - self.start)
        places = {
            place for level in levels for place in split_at_roots(level, self.length)
        }
        for place in sorted({first, *places}):
            if place >= first and all(_is_met(level, place) for level in levels):
                return self.start + place
        return None


def one_way(motion: Motion) -> Iterator[OneWay]:
    """Give the parts of a motion that go one way, in order."""
    for piece in motion.pieces():
        angle = [motion.origin + piece.angle[0], *piece.angle[1:]]
        for low, high in pairwise(split_at_roots(derivative(angle), piece.length)):
            part = shifted(angle, low) if low else angle
            travel = value(part, high - low) - part[0]
            direction = 0 if abs(travel) < _SLACK else (1 if travel > 0.0 else -1)
            yield OneWay(piece.start + low, high - low, part, direction)


def spans(
    motion: Motion, level: Callable[[OneWay], Polynomial]
) -> list[tuple[float, float]]:
    """Return between which times a polynomial of each part is 0 or more, s."""
    result: list[tuple[float, float]] = []
    for part in one_way(motion):
        values = level(part)
        for low, high in pairwise(split_at_roots(values, part.length)):
            if not _is_met(values, 0.5 * (low + high)):
                continue
            begun, until = part.start + low, part.start + high
            if result and begun - result[-1][1] < _SAME_TIME:
                result[-1] = (result[-1][0], until)
            else:
                result.append((begun, until))
    return result


def movements(motion: Motion, speed: float) -> list[tuple[float, float]]:
    """Return between which times the arm goes one way at least so fast, s."""
    extends = spans(motion, lambda part: part.faster(speed, 1))
    return sorted(extends + spans(motion, lambda part: part.faster(speed, -1)))


def latched(
    motion: Motion,
    closes: Callable[[OneWay], Sequence[Polynomial]],
    opens: Callable[[float], float],
) -> list[tuple[float, float]]:
    """Return between which times a latch is closed, s; the last may never open.

    It closes where all polynomials of a part are 0 or more, and opens where the arm is
    back at an angle, of the farthest that it has been since, rad.
    """
    result: list[tuple[float, float]] = []
    closed: float | None = None
    farthest = -math.inf
    for part in one_way(motion):
        since = part.start
        if closed is not None and part.direction < 0:
            opened = part.reached([-c for c in part.beyond(opens(farthest))])
            if opened is not None:
                result.append((closed, opened))
                closed, since, farthest = None, opened, -math.inf
        if closed is None:
            closed = part.reached(*closes(part), after=since)
        if closed is not None and part.direction > 0:
            farthest = max(farthest, float(part.angle_at(part.end)))
    return result if closed is None else [*result, (closed, math.inf)]


def _is_met(level: Polynomial, place: float) -> bool:
    # 0 or more, but for rounding
    return bool(value(level, place) >= -_SLACK)
