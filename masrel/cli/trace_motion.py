"""Which motions ``masrel trace`` is asked for."""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import click

from masrel.cli.options import grouped
from masrel.errors import ParameterError

if TYPE_CHECKING:
    from masrel.elbow import Motion

__all__ = ["KINDS", "Asked", "motion_of", "motion_options"]

KINDS = ("constant", "minimum-jerk", "trapezoid", "recording")

MOST_REPEATS = 1000  # which take a second to solve


@dataclass(frozen=True, slots=True, kw_only=True)
class Asked:
    """A motion as the command line has it; degrees and seconds."""

    kind: str  # one of `KINDS`
    # start, end: deg; None for the usual ones, or those of a recording
    start: float | None
    end: float | None
    acceleration: float | None  # of a trapezoid, deg/s²
    recording: Path | None  # the file of a recording
    interpolation: str | None  # of a recording
    # stop, pause: when it is stopped and for how long, s
    stop: float | None
    pause: float | None
    repeats: int  # how often it is made, with the way back in between

    def __post_init__(self) -> None:
        if (self.kind == "recording") != (self.recording is not None):
            raise ParameterError(
                "--recording: goes with --motion recording, and that needs a file"
            )
        if (self.kind == "trapezoid") != (self.acceleration is not None):
            raise ParameterError(
                "--acceleration-deg-s2: goes with --motion trapezoid, and that needs it"
            )
        if self.recording is None and self.interpolation is not None:
            raise ParameterError("--interpolation: goes with --motion recording")
        if self.recording is not None and (self.start, self.end) != (None, None):
            raise ParameterError(
                "--from-deg, --to-deg: a recording starts and ends where it does"
            )
        if (self.stop is None) != (self.pause is None):
            raise ParameterError("--stop-at-s, --pause-s: each needs the other")
        if self.pause is not None and not 0.0 < self.pause < math.inf:
            raise ParameterError(
                f"--pause-s: needs more than 0 and finite, got {self.pause:g} s"
            )
        if not 1 <= self.repeats <= MOST_REPEATS:
            raise ParameterError(
                f"--repeat: needs 1 to {MOST_REPEATS}, got {self.repeats}"
            )

    @property
    def start_deg(self) -> float:
        """Where it starts unless it is a recording, deg."""
        return 30.0 if self.start is None else self.start

    @property
    def end_deg(self) -> float:
        """Where it ends unless it is a recording, deg."""
        return 146.0 if self.end is None else self.end

    def ends(self, motion: "Motion") -> tuple[float, float]:
        """Return where a motion made of this starts and ends, deg, as it was asked."""
        if self.recording is not None:
            return math.degrees(motion.start), math.degrees(motion.end)
        return self.start_deg, self.end_deg


motion_options = grouped(
    "asked",
    Asked,
    click.option(
        "--motion", "kind", type=click.Choice(KINDS), default="constant",
        show_default=True,
    ),
    click.option("--from-deg", "start", type=float, help="[default: 30]"),
    click.option("--to-deg", "end", type=float, help="[default: 146]"),
    click.option(
        "--acceleration-deg-s2", "acceleration", type=float,
        help="Of a trapezoid's ramps.",
    ),
    click.option(
        "--recording", type=click.Path(path_type=Path),
        help="CSV with time_s and angle_deg, or npz.",
    ),
    click.option(
        "--interpolation", type=click.Choice(["pchip", "linear"]),
        help="Between the samples of a recording.  [default: pchip]",
    ),
    click.option("--stop-at-s", "stop", type=float, help="Stop the arm at this time."),
    click.option(
        "--pause-s", "pause", type=float, help="And hold it for as long as this."
    ),
    click.option(
        "--repeat", "repeats", type=int, default=1, show_default=True,
        help="Stretch so often, flexing in between as the stretch was made.",
    ),
)  # fmt: skip
"""The options of a motion, given to a command as one argument `asked`."""


def motion_of(asked: Asked, speed_deg_s: float | None) -> "Motion":
    """Make a motion."""
    from masrel.elbow import Joined, Reversed, interrupted

    once = _plain(asked, speed_deg_s)
    motion = once
    if asked.stop is not None and asked.pause is not None:
        if not 0.0 < asked.stop < once.duration:
            raise ParameterError(
                f"--stop-at-s: needs a time within the motion, 0 to {once.duration:g} "
                f"s, got {asked.stop:g} s"
            )
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
    start, end = math.radians(asked.start_deg), math.radians(asked.end_deg)
    speed = math.radians(speed_deg_s)
    if asked.kind == "constant":
        return ConstantSpeed(start=start, end=end, speed=speed)
    if asked.acceleration is not None:
        rate = math.radians(asked.acceleration)
        return Trapezoid(start=start, end=end, speed=speed, acceleration_rate=rate)
    return MinimumJerk(start=start, end=end, mean_speed=speed)
