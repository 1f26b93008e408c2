"""Torque traces of many scenes in one array: exact, or as the driver would.

Rows are made block by block, so that what is worked on stays in the processor's cache.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from masrel.elbow.course import end_time
from masrel.elbow.events import events
from masrel.elbow.motion import Floats, Motion
from masrel.elbow.parameters import ElbowParameters
from masrel.elbow.scenes.course import Courses
from masrel.elbow.scenes.effort import Efforts
from masrel.elbow.scenes.exact import ExactRows
from masrel.elbow.scenes.fill import BLOCK, Fill
from masrel.elbow.scenes.kinds import KINDS
from masrel.elbow.scenes.rows import LAWS
from masrel.elbow.scenes.samples import phase_samples
from masrel.elbow.scenes.table import (
    Joints,
    Motions,
    joints_of,
    motions_of,
    paired,
)
from masrel.elbow.torque import torque
from masrel.elbow.trace import trace
from masrel.errors import ParameterError

__all__ = ["Reading", "torque_traces"]

Reading = Literal["exact", "sampled"]
"""Of the law: events at their own times, or at the samples that see them."""

_CHUNK = 4096
# scenes at a time


def torque_traces(
    parameters: ElbowParameters | Sequence[ElbowParameters],
    motions: Motion | Sequence[Motion],
    *,
    rate_hz: float = 1000.0,
    reading: Reading = "exact",
) -> Floats:
    """Give the torque of many scenes at evenly spaced times.

    Parameters
    ----------
    parameters : ElbowParameters or sequence of ElbowParameters
        The joints, one a scene; or one for all.
    motions : Motion or sequence of Motion
        The motions, one a scene; or one for all.
    rate_hz : float, optional
        Samples a second.
    reading : {"exact", "sampled"}, optional
        Of the law: the torque with every event at its exact time, inertia included; or
        what the controller would command, which sees an event at the sample after it,
        and takes three times as long.

    Returns
    -------
    ndarray, shape (n_scenes, n_samples)
        N·m; ``nan`` from the end of a motion on that is shorter than others. Row by
        row the numbers of `torque` to rounding: within 2e-14 of the largest term of (1)
        and (5); or, sampled, the bits of ``trace(...).torque``.

    Raises
    ------
    ParameterError
        If `rate_hz` is not more than 0, `reading` is unknown, the numbers of joints
        and motions do not fit, or a motion starts at or beyond the end of range.

    Examples
    --------
    >>> from math import radians
    >>> from masrel.elbow import STANDARD_MODELS, ConstantSpeed, trace
    >>> stretch = ConstantSpeed(start=radians(30), end=radians(146), speed=radians(92))
    >>> made = torque_traces(list(STANDARD_MODELS.values()), stretch)
    >>> made.shape
    (4, 1261)
    >>> made[:, 700].round(4).tolist()  # after 0.7 s
    [5.5638, 8.4123, 7.6236, 10.2006]

    What the controller would command:

    >>> sampled = torque_traces(STANDARD_MODELS["HM3"], stretch, reading="sampled")
    >>> bool((sampled[0] == trace(STANDARD_MODELS["HM3"], stretch).torque).all())
    True
    """
    if not 0.0 < rate_hz < math.inf:
        raise ParameterError(f"rate_hz: needs more than 0, got {rate_hz}")
    if reading not in ("exact", "sampled"):
        raise ParameterError(f'reading: needs "exact" or "sampled", got {reading!r}')
    scenes = paired(parameters, motions)
    groups = [
        _Group.of(kind, rows, scenes, rate_hz, reading)
        for rows, kind in _groups(*scenes, reading)
    ]
    longest = max(int(group.n_samples.max()) for group in groups)
    out = np.empty((len(scenes[1]), longest))
    for group in groups:
        for i in group.rows[group.fill(out)].tolist():
            row = _alone(scenes[0][i], scenes[1][i], rate_hz, reading)
            out[i, : row.size] = row
            out[i, row.size :] = np.nan
    return out


def _alone(
    joint: ElbowParameters, motion: Motion, rate_hz: float, reading: Reading
) -> Floats:
    if reading == "sampled":
        return trace(joint, motion, rate_hz=rate_hz).torque
    found = events(joint, motion)
    time = np.arange(math.floor(found.end * rate_hz) + 1) / rate_hz
    return torque(joint, motion, np.minimum(time, found.end), found=found)


def _groups(
    joints: Sequence[ElbowParameters], moves: Sequence[Motion], reading: Reading
) -> Iterator[tuple[np.ndarray, type[Motion]]]:
    # rows that one law fits; those of `Motion` go alone
    found: dict[type[Motion], list[int]] = {}
    for i, (joint, motion) in enumerate(zip(joints, moves, strict=True)):
        is_plain = joint.catch_rise == 0.0 and (
            reading == "exact" or joint.post_catch == "continuous"
        )
        found.setdefault(type(motion) if is_plain else Motion, []).append(i)
    for kind, rows in found.items():
        for first in range(0, len(rows), _CHUNK):
            yield np.array(rows[first : first + _CHUNK]), kind


@dataclass(frozen=True, slots=True)
class _Group:
    """Scenes whose motions are of one kind."""

    kind: type[Motion]
    rows: np.ndarray
    n_samples: np.ndarray
    rate_hz: float
    joints: Joints | None = None  # None: each is made alone
    motions: Motions | None = None
    courses: Courses | None = None  # None: events are sampled

    @classmethod
    def of(
        cls,
        kind: type[Motion],
        rows: np.ndarray,
        scenes: tuple[Sequence[ElbowParameters], Sequence[Motion]],
        rate_hz: float,
        reading: Reading,
    ) -> "_Group":
        own, stretches = ([each[i] for i in rows.tolist()] for each in scenes)
        columns, motions, courses = None, None, None
        alone = np.ones(rows.size, dtype=np.bool_)
        ends = np.empty(rows.size)
        if kind in LAWS:
            columns = joints_of(own)
            motions = motions_of(stretches, KINDS[kind].speed)
            if reading == "exact":
                found = KINDS[kind].courses_for_samples
                courses = found(columns, motions, rate_hz)
                ends, alone = courses.end.high.copy(), courses.is_doubtful
            else:
                ends, alone = LAWS[kind].ends(columns, motions)
        for i in np.flatnonzero(alone).tolist():
            ends[i] = end_time(own[i], stretches[i])
        n_samples = np.floor(ends * rate_hz).astype(np.intp) + 1
        return cls(kind, rows, n_samples, rate_hz, columns, motions, courses)

    def fill(self, out: Floats) -> np.ndarray:
        """Write the rows, and return which of them are left."""
        if self.joints is None or self.motions is None:
            return np.ones(self.rows.size, dtype=np.bool_)
        if self.courses is None:
            return self._fill_sampled(out, self.joints, self.motions)
        columns = (self.motions, self.courses)
        with np.errstate(all="ignore"):  # doubtful scenes may hold anything
            path = KINDS[self.kind].path(self.motions)
            efforts = Efforts(self.joints, *columns, path)
            exact = ExactRows(
                self.kind, *columns, efforts, self.n_samples, self.rate_hz
            )
        exact.fill(out, self.rows, np.flatnonzero(~self.courses.is_doubtful))
        return self.courses.is_doubtful

    def _fill_sampled(
        self, out: Floats, joints: Joints, motions: Motions
    ) -> np.ndarray:
        law = LAWS[self.kind](motions)
        found = phase_samples(joints, law.kinematics(), self.n_samples, self.rate_hz)
        time = np.arange(out.shape[1]) / self.rate_hz
        columns = (joints, motions, law, found)
        fill = Fill(*columns, self.n_samples, time, [out[i] for i in self.rows])
        rows = np.flatnonzero(~found.is_doubtful)
        rows = rows[np.argsort(found.catch[rows], kind="stable")]
        for first in range(0, rows.size, BLOCK):
            fill.block(rows[first : first + BLOCK])
        return found.is_doubtful
