"""Angles and speeds of many motions of one kind, in the bits of each alone."""

from dataclasses import dataclass

import numpy as np

from masrel.elbow.motion import Floats, Motion
from masrel.elbow.motions import ConstantSpeed, MinimumJerk
from masrel.elbow.scenes.constant import constant_ends
from masrel.elbow.scenes.quintic import quintic_ends
from masrel.elbow.scenes.samples import Kinematics
from masrel.elbow.scenes.table import Motions

__all__ = ["LAWS", "ConstantRows", "QuinticRows", "Work"]


@dataclass(frozen=True, slots=True)
class Work:
    """Buffers of one block, contiguous: what is worked on lies together."""

    angle: Floats
    share: Floats
    spare: Floats


class ConstantRows:
    """Angles and speeds of `ConstantSpeed`, operation by operation."""

    ends = staticmethod(constant_ends)

    def __init__(self, motions: Motions) -> None:
        self.start, self.speed = motions.start, motions.speed

    def kinematics(self) -> Kinematics:
        """Return angles and speeds at one time a stretch, rad and rad/s."""
        return Kinematics(
            angle=lambda t: self.start + self.speed * t,
            velocity=lambda t: self.speed + 0.0 * t,
            fastest=np.full(self.speed.shape, 1e9),  # s: not before the end
            top_speed=self.speed,
            is_rising=True,  # sums and products of floats keep their order
        )

    def angle(self, rows: np.ndarray, time: Floats, work: Work) -> Floats:
        """Return angles of some rows at times, rad; in the buffers of `work`."""
        out = work.angle
        np.multiply(self.speed[rows, np.newaxis], time, out=out)
        out += self.start[rows, np.newaxis]
        return out

    def damped(self, rows: np.ndarray, damping: Floats, _: Work) -> Floats:
        """Return damping times the speed there, N·m; after `angle`."""
        return damping * self.speed[rows, np.newaxis]


class QuinticRows:
    """Angles and speeds of `MinimumJerk`, operation by operation."""

    ends = staticmethod(quintic_ends)

    def __init__(self, motions: Motions) -> None:
        self.start, self.speed = motions.start, motions.speed
        self.way = motions.end - motions.start
        self.duration = self.way / self.speed

    def kinematics(self) -> Kinematics:
        """Return angles and speeds at one time a stretch, rad and rad/s."""

        def angle(t: Floats) -> Floats:
            s = t / self.duration
            share = s * s * s * (10.0 + s * (6.0 * s - 15.0))
            return np.asarray(self.start + self.way * share)

        def velocity(t: Floats) -> Floats:
            s = t / self.duration
            rest = s * (1.0 - s)
            return np.asarray(30.0 * self.speed * rest * rest)

        return Kinematics(
            angle=angle,
            velocity=velocity,
            fastest=0.5 * self.duration,
            top_speed=1.875 * self.speed,
            is_rising=False,
        )

    def angle(self, rows: np.ndarray, time: Floats, work: Work) -> Floats:
        """Return angles of some rows at times, rad; in the buffers of `work`."""
        s, out, cube = work.share, work.angle, work.spare
        np.divide(time, self.duration[rows, np.newaxis], out=s)
        np.multiply(6.0, s, out=out)
        out -= 15.0
        out *= s
        out += 10.0
        np.multiply(s, s, out=cube)
        cube *= s
        out *= cube
        out *= self.way[rows, np.newaxis]
        out += self.start[rows, np.newaxis]
        return out

    def damped(self, rows: np.ndarray, damping: Floats, work: Work) -> Floats:
        """Return damping times the speed there, N·m; after `angle`."""
        # of the shares that `angle` left
        s, rest = work.share, work.spare
        np.subtract(1.0, s, out=rest)
        rest *= s
        np.multiply((30.0 * self.speed[rows])[:, np.newaxis], rest, out=s)
        s *= rest
        s *= damping
        return s


LAWS: dict[type[Motion], "type[ConstantRows] | type[QuinticRows]"] = {
    ConstantSpeed: ConstantRows,
    MinimumJerk: QuinticRows,
}
