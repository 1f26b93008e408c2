"""What a joint offers to whoever presents it, and what the laws of tone share.

A controller steps it at samples, a figure draws it, and the limits of a device are
compared with the largest torque and slope that it can ask for.
"""

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Sequence
from copy import deepcopy
from dataclasses import dataclass, field, fields
from operator import itemgetter
from types import SimpleNamespace
from typing import Any, ClassVar, Literal, Protocol

import numpy as np

from masrel._input import check_option
from masrel.errors import ParameterError
from masrel.lab.elbow._polynomials import Number
from masrel.lab.elbow.motions import _SAME_TIME, Floats, Motion

__all__ = ["Law", "Quantity", "Stepper", "ToneEvent", "ToneModel"]


class Stepper(Protocol):
    """A joint as a state machine that sees one sample at a time.

    Attributes
    ----------
    phase : int
        Position in `masrel.lab.recording.PHASES`: "pre-catch" while nothing has been
        triggered, "catch" after a trigger, "post-catch" once it has given way. A
        joint without triggers stays in "pre-catch".
    """

    phase: int

    def step(self, time_s: float, angle: float, velocity: float) -> float:
        """Decide the torque of one sample.

        Parameters
        ----------
        time_s : float
            Time of the sample, s; later than that of the one before.
        angle : float
            Angle, rad.
        velocity : float
            Angular velocity, rad/s.

        Returns
        -------
        float
            Torque that resists extension, N·m.
        """

    def release(self) -> None:
        """Give up at once what has been triggered, as when the grip is lost."""


Needs = Literal[
    "positive",
    "not negative",
    "share",
    "share below 1",
    "angle",
    "angle above 0",
    "frequency",
    "finite",
]

_RANGES: dict[Needs, tuple[str, Callable[[float], bool]]] = {
    "positive": ("more than 0", lambda value: value > 0.0),
    "not negative": ("0 or more", lambda value: value >= 0.0),
    "share": ("0 to 1", lambda value: 0.0 <= value <= 1.0),
    "share below 1": ("[0, 1)", lambda value: 0.0 <= value < 1.0),
    "angle": ("0 to 180 degrees", lambda value: 0.0 <= value <= math.pi),
    "angle above 0": ("(0, 180] degrees", lambda value: 0.0 < value <= math.pi),
    "frequency": ("more than 0, at most 100", lambda value: 0.0 < value <= 100.0),
    "finite": ("a finite number", math.isfinite),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Quantity:
    """What is known of a parameter besides its value.

    Attributes
    ----------
    unit : str
        Its unit in Python: "rad", "N·m/rad"; "" for a plain number.
    needs : {"positive", "not negative", "share", "angle", "frequency", ...}
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
    return field(default=default, metadata=known(unit, needs, is_choice=is_choice))


def known(unit: str, needs: Needs, *, is_choice: bool = False) -> dict[str, Quantity]:
    """Return the metadata of such a field."""
    return {"quantity": Quantity(unit=unit, needs=needs, is_choice=is_choice)}


@dataclass(frozen=True, slots=True, kw_only=True)
class Law(ABC):
    """A law of the joint with its parameters, in SI units.

    Parameters are checked where they are made: a law that exists is valid.

    Attributes
    ----------
    kind : str
        Name of the law in `MODELS`, as a protocol file spells it.
    is_passive : bool
        Whether it never gives back more than it took, whatever the motion. A joint with
        a delay, a trigger or a change in time is not passive in this sense, and is
        presented behind a guard only.
    """

    kind: ClassVar[str]
    is_passive: ClassVar[bool] = False

    def __post_init__(self) -> None:
        for entry in fields(self):
            name, parameter = entry.name, entry.metadata.get("quantity")
            value = getattr(self, name)
            if parameter is None or (value is None and entry.default is None):
                continue
            is_number = isinstance(value, int | float) and not isinstance(value, bool)
            if not is_number or not math.isfinite(value):
                raise ParameterError(f"{name}: needs a finite number, got {value!r}")
            needed, is_met = _RANGES[parameter.needs]
            if not is_met(value):
                raise ParameterError(
                    f"{name}: needs {needed}, got {value:g} {parameter.unit}".rstrip()
                )
        self._check_together()

    def _check_together(self) -> None:
        # A model whose parameters have to go together refuses here those that do not.
        return

    def rest_from(self, start_angle: float) -> float:
        """Return where the spring has no torque, rad: where it starts unless set."""
        rest: float | None = getattr(self, "rest_angle", None)
        return start_angle if rest is None else rest

    @abstractmethod
    def stepper(self, start_angle: float) -> Stepper:
        """Return a joint that has not seen a sample yet.

        Parameters
        ----------
        start_angle : float
            Where the stretch starts, rad.

        Returns
        -------
        Stepper
            The state machine of one presentation.
        """

    @abstractmethod
    def largest_torque(self, *, start_angle: float, speed: float) -> float:
        """Return the largest torque of a stretch and the way back.

        Parameters
        ----------
        start_angle : float
            Where the stretch starts, rad; it goes to `range_end` at most.
        speed : float
            The largest speed, either way, rad/s.

        Returns
        -------
        float
            A bound of the torque's size, N·m, that no such motion passes.
        """

    @abstractmethod
    def largest_slope(self, *, speed: float) -> tuple[float, float]:
        """Return the largest slopes of the torque where it does not jump.

        Parameters
        ----------
        speed : float
            The largest speed, either way, rad/s.

        Returns
        -------
        tuple of two floats
            Over angle, N·m/rad, and over angular velocity, N·m·s/rad.
        """


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
    """A law that sees one sample at a time."""

    def __init__(self, model: "ToneModel", start_angle: float) -> None:
        self.model, self.rest = model, model.rest_from(start_angle)
        self.phase, self.is_given_up = 0, False
        self.kept = SimpleNamespace(**deepcopy(model._kept))

    def release(self) -> None:
        """Give up at once what has been triggered; a law says until when."""
        self.phase, self.is_given_up = 0, True

    def step(self, time_s: float, angle: float, velocity: float) -> float:
        """Decide the torque of one sample, N·m."""
        memory = self.model._sampled(self, time_s, angle, velocity)
        return float(self.model._law(angle, velocity, self.rest, *memory))


@dataclass(frozen=True, slots=True, kw_only=True)
class ToneModel(Law):
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

    catch_event: ClassVar[str | None] = None
    _kept: ClassVar[dict[str, Any]] = {}  # by a stepper, before the first sample
    _phases: ClassVar[dict[str, int]] = {}  # that begin with an event, by its name

    range_end: float = quantity(math.radians(146.0), "rad", "angle", is_choice=False)
    speed_threshold: float = quantity(
        math.radians(20.0), "rad/s", "positive", is_choice=False
    )

    @classmethod
    def quantities(cls) -> dict[str, Quantity]:
        """Return unit, range and origin of every parameter, by name."""
        return {entry.name: entry.metadata["quantity"] for entry in fields(cls)}

    def stepper(self, start_angle: float) -> ToneStepper:
        """Return the joint as a state machine that has not seen a sample yet."""
        return ToneStepper(self, start_angle)

    def events(self, motion: Motion) -> tuple[ToneEvent, ...]:
        """Return what happens along a motion, as roots of it: nothing is stepped.

        Parameters
        ----------
        motion : Motion
            A movement, SI units; it may hold and return.

        Returns
        -------
        tuple of ToneEvent
            In order of their times. What would begin at the very end of the motion, or
            later, does not count.
        """
        last = motion.duration - _SAME_TIME
        inside = sorted(
            (e for e in self._events(motion) if e[1] < last), key=itemgetter(1)
        )
        angles = motion.angle(np.array([time for _, time in inside])).tolist()
        return tuple(
            ToneEvent(name=name, time=time, angle=angle)
            for (name, time), angle in zip(inside, angles, strict=True)
        )

    def torque(self, motion: Motion, times: Sequence[float] | Floats) -> Floats:
        """Return the torque along a motion, its events at their own times.

        Parameters
        ----------
        motion : Motion
            A movement, SI units; it may hold and return.
        times : array_like of float, shape (n,)
            Times, s; after the end of the motion, the values are those at its end.

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
        rest, memory = self.rest_from(motion.start), self._memory(motion, moments)
        return np.asarray(self._law(angle, velocity, rest, *memory))

    @abstractmethod
    def _law(
        self, angle: Number, velocity: Number, rest: float, /, *memory: Number
    ) -> Number:
        """Return the torque of one sample, or of columns of them, N·m."""

    @abstractmethod
    def _events(self, motion: Motion, /) -> Iterator[tuple[str, float]]:
        """Yield the events of a motion in any order: name and time, s."""

    def _sampled(
        self, _joint: ToneStepper, _time_s: float, _angle: float, _velocity: float, /
    ) -> tuple[float, ...]:
        """Take a sample in -> what `_law` depends on besides."""
        return ()

    def _memory(self, _motion: Motion, _times: Floats, /) -> list[Floats]:
        """Return what `_law` depends on besides, at times of a motion (n,) each."""
        return []


def grade_of(table: dict[str, Any], grade: object, name: str) -> Any:
    """Return the row of a grade, refusing one that the table does not have."""
    check_option(name, str(grade), table)
    return table[str(grade)]
