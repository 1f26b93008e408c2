"""Which motions ``masrel trace`` is asked for."""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from masrel.errors import ParameterError

if TYPE_CHECKING:
    from masrel.elbow import Motion

__all__ = ["KINDS", "Asked", "motion_of"]

KINDS = ("constant", "minimum-jerk", "trapezoid", "recording")


@dataclass(frozen=True, slots=True, kw_only=True)
class Asked:
    """A motion as the command line has it; degrees and seconds.

    Attributes
    ----------
    kind : str
        One of `KINDS`.
    start, end : float
        deg.
    acceleration : float or None
        Of a trapezoid, deg/s².
    recording : Path or None
        The file of a recording.
    interpolation : {"pchip", "linear"}
        Of a recording.
    stop, pause : float or None
        When it is stopped and for how long, s.
    repeats : int
        How often it is made, with the way back in between.
    """

    kind: str
    start: float
    end: float
    acceleration: float | None
    recording: Path | None
    interpolation: str
    stop: float | None
    pause: float | None
    repeats: int

    def __post_init__(self) -> None:
        if (self.kind == "recording") != (self.recording is not None):
            raise ParameterError(
                "--recording: goes with --motion recording, and that needs a file"
            )
        if (self.kind == "trapezoid") != (self.acceleration is not None):
            raise ParameterError(
                "--acceleration-deg-s2: goes with --motion trapezoid, and that needs it"
            )
        if (self.stop is None) != (self.pause is None):
            raise ParameterError("--stop-at-s, --pause-s: each needs the other")
        if self.repeats < 1:
            raise ParameterError(f"--repeat: needs 1 or more, got {self.repeats}")


def motion_of(asked: Asked, speed_deg_s: float | None) -> "Motion":
    """Make a motion.

    Parameters
    ----------
    asked : Asked
        What it is like.
    speed_deg_s : float or None
        Its speed: mean, or that of the level of a trapezoid; None of a recording.

    Returns
    -------
    Motion
        The motion.

    Raises
    ------
    ParameterError
        If a number is outside its range.
    RecordingError
        If the recording cannot be read.
    """
    from masrel.elbow import Joined, Reversed, interrupted

    once = _plain(asked, speed_deg_s)
    motion = once
    if asked.stop is not None and asked.pause is not None:
        motion = interrupted(once, at=asked.stop, pause=asked.pause)
    if asked.repeats == 1:
        return motion
    parts: list[Motion] = [motion]
    for _ in range(asked.repeats - 1):
        parts += [Reversed(motion=once), motion]
    return Joined(parts)


def _plain(asked: Asked, speed_deg_s: float | None) -> "Motion":
    from masrel.elbow import ConstantSpeed, MinimumJerk, Trapezoid
    from masrel.elbow.motions.file import read_motion

    if asked.recording is not None:
        if speed_deg_s is not None:
            raise ParameterError("--speed-deg-s: a recording has its own speed")
        return read_motion(
            asked.recording,
            interpolation="linear" if asked.interpolation == "linear" else "pchip",
        )
    if speed_deg_s is None:
        raise ParameterError(f"--speed-deg-s: needs a speed for --motion {asked.kind}")
    start, end = math.radians(asked.start), math.radians(asked.end)
    speed = math.radians(speed_deg_s)
    if asked.kind == "constant":
        return ConstantSpeed(start=start, end=end, speed=speed)
    if asked.acceleration is not None:
        rate = math.radians(asked.acceleration)
        return Trapezoid(start=start, end=end, speed=speed, acceleration_rate=rate)
    return MinimumJerk(start=start, end=end, mean_speed=speed)
