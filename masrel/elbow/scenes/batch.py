"""Thousands of scenes at once: one array, a column an output.

In: joints and motions. Out: the outputs asked for, of every scene.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np

from masrel.elbow.course import course
from masrel.elbow.effort import effort
from masrel.elbow.events import events_of
from masrel.elbow.motion import Floats, Motion
from masrel.elbow.parameters import ElbowParameters
from masrel.elbow.scenes.course import Courses, nearest
from masrel.elbow.scenes.effort import Efforts
from masrel.elbow.scenes.kinds import KINDS
from masrel.elbow.scenes.table import Joints, joints_of, motions_of, paired
from masrel.errors import ParameterError

__all__ = [
    "EFFORTS",
    "EVENTS",
    "SceneTable",
    "evaluate",
]

EVENTS = (
    "onset",
    "catch",
    "catch_angle",
    "catch_speed",
    "mean_speed",
    "peak_end",
    "catch_end",
    "post_catch_end",
    "end",
)
"""Outputs that are attributes of `Events`."""

EFFORTS = ("peak_torque", "residual_torque", "work", "impulse")
"""Outputs that are functions of `masrel.elbow`."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SceneTable:
    """Outputs of many scenes.

    Attributes
    ----------
    outputs : tuple of str
        Their names.
    values : ndarray, shape (n_scenes, n_outputs)
        SI units; ``nan`` for what a scene does not reach. Read-only.
    n_alone : int
        How many scenes were led through piece by piece, because their motion is not a
        single stretch or something in them is nearly a tie.
    """

    outputs: tuple[str, ...]
    values: Floats = field(compare=False, repr=False)
    n_alone: int

    def column(self, output: str) -> Floats:
        """Return one output of every scene.

        Parameters
        ----------
        output : str
            Its name.

        Returns
        -------
        ndarray, shape (n_scenes,)
            SI units.

        Raises
        ------
        ParameterError
            If it was not asked for.
        """
        if output not in self.outputs:
            raise ParameterError(
                f"output: needs one of {', '.join(self.outputs)}, got {output!r}"
            )
        return np.asarray(self.values[:, self.outputs.index(output)])


def evaluate(
    parameters: ElbowParameters | Sequence[ElbowParameters],
    motions: Motion | Sequence[Motion],
    outputs: Sequence[str] = ("catch_angle", "peak_torque"),
    *,
    chunk: int = 8192,
) -> SceneTable:
    """Compute outputs of many scenes.

    Parameters
    ----------
    parameters : ElbowParameters or sequence of ElbowParameters
        The joints, one a scene; or one for all.
    motions : Motion or sequence of Motion
        The motions, one a scene; or one for all.
    outputs : sequence of str, optional
        What is asked for, of `EVENTS` and `EFFORTS`; nothing else is computed.
    chunk : int, optional
        Scenes at a time: what is needed beside the result does not grow with their
        number.

    Returns
    -------
    SceneTable
        The outputs. Events are those of `events` to the last bit; torques, work and
        impulse agree with the functions of these names to rounding.

    Raises
    ------
    ParameterError
        If an output is unknown, the numbers of joints and motions do not fit, `chunk`
        is not 1 or more, or a motion starts at or beyond the end of range; the
        message says which scene.

    Examples
    --------
    The standard models, stretched at 92 deg/s: catch angles in degrees, and N·m.

    >>> from math import radians
    >>> from masrel.elbow import STANDARD_MODELS, ConstantSpeed
    >>> stretch = ConstantSpeed(start=radians(30), end=radians(146), speed=radians(92))
    >>> table = evaluate(list(STANDARD_MODELS.values()), stretch)
    >>> np.degrees(table.column("catch_angle")).round(1).tolist()
    [97.8, 87.8, 82.8, 77.8]
    >>> table.column("peak_torque").round(3).tolist()
    [7.999, 8.412, 10.984, 15.424]
    """
    unknown = [name for name in outputs if name not in EVENTS + EFFORTS]
    if unknown or not outputs:
        raise ParameterError(
            f"outputs: needs some of {', '.join(EVENTS + EFFORTS)}, "
            f"got {', '.join(map(repr, unknown)) or 'none'}"
        )
    if chunk < 1:
        raise ParameterError(f"chunk: needs 1 or more, got {chunk}")
    joints, moves = paired(parameters, motions)
    asked = tuple(outputs)
    values = np.empty((len(moves), len(asked)))
    n_alone = 0
    for rows, kind in _groups(moves, chunk):
        own = [joints[i] for i in rows.tolist()]
        stretches = [moves[i] for i in rows.tolist()]
        alone = np.ones(rows.size, dtype=np.bool_)
        if kind in KINDS:
            values[rows], alone = _together(kind, own, stretches, asked)
        for i in np.flatnonzero(alone).tolist():
            values[rows[i]] = _alone(own[i], stretches[i], asked)
        n_alone += int(alone.sum())
    values.setflags(write=False)
    return SceneTable(outputs=asked, values=values, n_alone=n_alone)


def _groups(
    moves: Sequence[Motion], chunk: int
) -> Iterator[tuple[np.ndarray, type[Motion]]]:
    # rows of motions of one kind, not too many at a time
    places: dict[type[Motion], list[int]] = {}
    for i, motion in enumerate(moves):
        places.setdefault(type(motion), []).append(i)
    for kind, own in places.items():
        rows = np.array(own)
        for first in range(0, rows.size, chunk):
            yield rows[first : first + chunk], kind


def _together(
    kind: type[Motion],
    own: Sequence[ElbowParameters],
    stretches: Sequence[Motion],
    outputs: tuple[str, ...],
) -> tuple[Floats, np.ndarray]:
    # the outputs, and in which scenes they are not to be had so
    joints = joints_of(own)
    motions = motions_of(stretches, KINDS[kind].speed)
    courses = KINDS[kind].courses(joints, motions)
    alone = courses.is_doubtful.copy()
    values = np.empty((len(own), len(outputs)))
    efforts = None
    for i, name in enumerate(outputs):
        if name in EVENTS:
            values[:, i] = _event(name, joints, courses)
            continue
        if efforts is None:
            efforts = Efforts(joints, motions, courses, KINDS[kind].path(motions))
        with np.errstate(all="ignore"):  # doubtful scenes may hold anything
            values[:, i] = getattr(efforts, name)
            alone |= efforts.unknown(name)
    return values, alone


def _event(name: str, joints: Joints, courses: Courses) -> Floats:
    c = courses
    if name == "peak_end":
        last = c.catch_end.where(c.leaves, c.end)
        peak = c.catch + joints.peak_duration
        return nearest(peak.where((last - peak).high > 0.0, last), c.catches)
    columns = {
        "onset": (c.onset, c.moves),
        "catch": (c.catch, c.catches),
        "catch_angle": (c.catch_angle, c.catches),
        "catch_speed": (c.catch_speed, c.catches),
        "mean_speed": (c.mean_speed, c.catches),
        "catch_end": (c.catch_end, c.leaves),
        "post_catch_end": (c.post_end, c.slows),
        "end": (c.end, np.ones_like(c.moves)),
    }
    return nearest(*columns[name])


def _alone(
    joint: ElbowParameters, motion: Motion, outputs: tuple[str, ...]
) -> list[float]:
    found = course(joint, motion)
    named = events_of(joint, found) if set(outputs) & set(EVENTS) else None
    row = []
    for name in outputs:
        value = (
            effort(name, joint, motion, found)
            if name in EFFORTS
            else getattr(named, name)
        )
        row.append(np.nan if value is None else value)
    return row
