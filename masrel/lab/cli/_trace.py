"""``masrel joint trace``: events, torque and samples of stretches of joints."""

import csv
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path
from typing import Any

import click
import numpy as np
from tqdm import tqdm

from masrel._files import safe_cell
from masrel._input import refuse
from masrel.cli._options import (
    GroupedHelp,
    OutputOptions,
    grouped,
    output_options,
    write_output,
)
from masrel.cli._paths import FileInFolder, InputFile
from masrel.errors import ParameterError
from masrel.lab import elbow
from masrel.lab._study_files import new_file
from masrel.lab.cli.joint import START_DEG, JointOptions, joint_options, joints_of
from masrel.lab.elbow import (
    ElbowParameters,
    Joined,
    JointModel,
    Motion,
    Recorded,
    Reversed,
    interrupted,
)
from masrel.lab.elbow.motions import Interpolation
from masrel.lab.recording import PHASES
from masrel.lab.report._traced_scenes import (
    SCENE_OUTPUTS,
    SCENE_STAMP,
    SCENE_VIEWS,
    Quantities,
    Scene,
    scene_document,
    scene_text,
    scenes_content,
    scenes_text,
)

# Class of each motion of a speed, and what it calls that
_STRETCHES = {
    "constant": ("ConstantSpeed", "speed"),
    "minimum-jerk": ("MinimumJerk", "mean_speed"),
    "trapezoid": ("Trapezoid", "speed"),
}
_KINDS = (*_STRETCHES, "recording")

_END_DEG = 146.0  # where a stretch ends unless it is said
_COLUMNS = ("time_s", "angle_deg", "velocity_deg_s", "torque_nm", "phase")
_MAX_SAMPLES = 5_000_000  # rows of a CSV file: at 1 kHz 83 minutes, and some 400 MB
_MAX_SPEEDS = 100_000
_MAX_REPEATS = 1000  # which take a second to solve


@dataclass(frozen=True, slots=True, kw_only=True)
class _MotionOptions:
    """A motion as the command line has it; degrees and seconds."""

    kind: str  # one of `_KINDS`
    # start, end: deg; None for the usual ones, or those of a recording
    start: float | None
    end: float | None
    acceleration: float | None  # of a trapezoid, deg/s²
    recording: Path | None  # the file of a recording
    interpolation: Interpolation | None  # of a recording
    # stop, pause: when it is stopped and for how long, s
    stop: float | None
    pause: float | None
    repeats: int  # how often it is made, with the way back in between

    def __post_init__(self) -> None:
        of_recording = self.recording is not None
        refuse(
            (
                (self.kind == "recording") != of_recording,
                "--recording: is for --motion recording, which needs a file",
            ),
            (
                (self.kind == "trapezoid") != (self.acceleration is not None),
                "--acceleration-deg-s2: is for --motion trapezoid, which needs it",
            ),
            (
                not of_recording and self.interpolation is not None,
                "--interpolation: is for --motion recording",
            ),
            (
                of_recording and (self.start, self.end) != (None, None),
                "--from-deg, --to-deg: a recording has its own start and end",
            ),
            (
                (self.stop is None) != (self.pause is None),
                "--stop-at-s, --pause-s: each needs the other",
            ),
            (
                self.pause is not None and not 0.0 < self.pause < math.inf,
                f"--pause-s: needs more than 0 and finite, got {self.pause or 0:g} s",
            ),
            (
                not 1 <= self.repeats <= _MAX_REPEATS,
                f"--repeat: needs 1 to {_MAX_REPEATS}, got {self.repeats}",
            ),
        )


_motion_options = grouped(
    "stretch",
    _MotionOptions,
    click.option(
        "--motion", "kind", type=click.Choice(_KINDS), default="constant",
        show_default=True, help="Kind of motion.",
    ),
    click.option(
        "--from-deg", "start", type=float, help="Angle at the start.  [default: 30]"
    ),
    click.option(
        "--to-deg", "end", type=float, help="Angle at the end.  [default: 146]"
    ),
    click.option(
        "--acceleration-deg-s2", "acceleration", type=float,
        help="Acceleration of a trapezoid's ramps.",
    ),
    click.option(
        "--recording", type=InputFile(path_type=Path),
        help="Recorded motion: CSV with time_s and angle_deg, or npz.",
    ),
    click.option(
        "--interpolation", type=click.Choice(["pchip", "linear"]),
        help="Interpolation between the samples of a recording.  [default: pchip]",
    ),
    click.option("--stop-at-s", "stop", type=float, help="Stop the arm at this time."),
    click.option(
        "--pause-s", "pause", type=float,
        help="Hold the stopped arm for this long.",
    ),
    click.option(
        "--repeat", "repeats", type=int, default=1, show_default=True,
        help="Number of stretches; in between the arm is flexed by the reverse motion.",
    ),
)  # fmt: skip


_quantity_options = grouped(
    "quantities",
    Quantities,
    click.option(
        "--output", "outputs", type=click.Choice(tuple(SCENE_OUTPUTS)), multiple=True,
        help="Compute this in addition to events and peak. Repeatable.",
    ),
    click.option(
        "--at-s", "times", type=float, multiple=True,
        help="Compute the torque at this time.",
    ),
    click.option(
        "--at-deg", "angles", type=float, multiple=True,
        help="Compute the torque where this angle is first reached.",
    ),
)  # fmt: skip


@click.command("trace", cls=GroupedHelp)
@joint_options
@click.option(
    "--speed-deg-s", "speeds", type=float, multiple=True,
    help="Mean speed in deg/s, or the speed of the plateau of a trapezoid. Repeatable.",
)  # fmt: skip
@click.option(
    "--speeds-deg-s", "speed_range",
    type=(float, float, click.IntRange(min=2, max=_MAX_SPEEDS)),
    metavar="LOW HIGH N", help="N speeds from LOW to HIGH.",
)  # fmt: skip
@_motion_options
@_quantity_options
@click.option(
    "--rate-hz", type=click.FloatRange(min=0.0, min_open=True),
    help="Samples per second of --csv.  [default: 1000]",
)  # fmt: skip
@click.option(
    "--csv",
    "csv_file",
    type=FileInFolder(path_type=Path),
    help="Write the samples to this file.",
)
@output_options(
    json='Write JSON to this file; "-" writes it to standard output and prints nothing '
    "else.",
    figure="Save a figure as .png, .svg or .pdf.",
)
@click.option(
    "--view", type=click.Choice(SCENE_VIEWS),
    help="What --figure shows: torque by angle or by time, the catches, or a schematic "
    "of one catch.  [default: angle]",
)  # fmt: skip
@click.option("--quiet", is_flag=True, help="Do not show progress.")  # of the output
def trace(
    joints: JointOptions,
    speeds: tuple[float, ...],
    speed_range: tuple[float, float, int] | None,
    stretch: _MotionOptions,
    quantities: Quantities,
    rate_hz: float | None,
    csv_file: Path | None,
    output: OutputOptions,
    view: str | None,
) -> None:
    """Compute phases, peak torque and samples of stretches of models.

    Events and outputs are exact; the samples of --csv are what the controller commands
    at --rate-hz for this motion. With several models or speeds, every combination is
    one scene.
    """
    refuse(
        (
            rate_hz is not None and csv_file is None,
            "--rate-hz: needs --csv, because it is the rate of its samples",
        ),
        (
            rate_hz is not None and not math.isfinite(rate_hz),
            f"--rate-hz: needs a finite rate, got {rate_hz}",
        ),
        (csv_file == Path("-"), "--csv: needs the name of a file, got -"),
        (
            view is not None and output.figure is None,
            "--view: needs --figure, because it chooses what that shows",
        ),
    )
    if speed_range is not None:
        low, high, n = speed_range
        speeds += tuple(low + (high - low) * i / (n - 1) for i in range(n))
    scenes = _scenes(joints_of(joints), stretch, speeds)
    content = cache(partial(scenes_content, scenes, view or SCENE_VIEWS[0]))
    if output.figure is not None:
        content()  # which refuses what cannot be drawn before anything is written
    documents = _documents(scenes, quantities, quiet=output.quiet)
    if csv_file is not None:
        rate = 1000.0 if rate_hz is None else rate_hz
        _write_samples(csv_file, rate, scenes, documents, quiet=output.quiet)
    one = len(scenes) == 1
    write_output(
        output,
        document=lambda: documents[0] if one else {"scenes": documents},
        text=lambda: (
            scene_text(documents[0], scenes[0].title) if one else scenes_text(documents)
        ),
        figure=content,
        stamp=SCENE_STAMP,
    )


def _documents(
    scenes: Sequence[Scene], quantities: Quantities, *, quiet: bool
) -> list[dict[str, object]]:
    documents = []
    for scene in tqdm(scenes, desc="scenes", delay=1.0, disable=quiet or None):
        try:
            documents.append(scene_document(scene, quantities))
        except ParameterError as error:
            if len(scenes) == 1:
                raise
            raise ParameterError(f"{scene.title}: {error}") from error
    return documents


def _scenes(
    joints: dict[str, JointModel],
    stretch: _MotionOptions,
    speeds: Sequence[float],
) -> list[Scene]:
    # one of each model and speed, however often an option repeats it
    scenes: list[Scene] = []
    motion_of = cache(partial(_motion_of, stretch))  # a recording is read once
    start = START_DEG if stretch.start is None else stretch.start
    for name, joint in joints.items():
        end = _end_of(stretch, joint)
        for speed in dict.fromkeys(speeds or (None,)):
            motion, ends = motion_of(speed, start, end), (start, end)
            if stretch.recording is not None:
                ends = math.degrees(motion.start), math.degrees(motion.end)
            called = (
                stretch.kind if speed is None else f"{stretch.kind} {speed:g} deg/s"
            )
            scenes.append(
                Scene(
                    title=f"{name}, {called}",
                    model=name,
                    kind=stretch.kind,
                    speed_deg_s=speed,
                    start_deg=ends[0],
                    end_deg=ends[1],
                    joint=joint,
                    motion=motion,
                )
            )
    return scenes


def _end_of(stretch: _MotionOptions, joint: JointModel) -> float:
    # deg; a stretch of a spastic elbow is cut at the end of range, no other goes beyond
    if isinstance(joint, ElbowParameters) or stretch.recording is not None:
        return _END_DEG if stretch.end is None else stretch.end
    limit = math.degrees(joint.range_end)
    end = min(_END_DEG, limit) if stretch.end is None else stretch.end
    if end > limit + 1e-9:
        raise ParameterError(
            f"--to-deg: needs at most the end of range of every model, {limit:g} deg, "
            f"got {end:g}"
        )
    return end


def _motion_of(
    stretch: _MotionOptions, speed_deg_s: float | None, start_deg: float, end_deg: float
) -> Motion:
    if stretch.recording is not None:
        once = _recorded(stretch.recording, stretch.interpolation, speed_deg_s)
    elif speed_deg_s is None:
        raise ParameterError(
            f"--speed-deg-s: needs a speed for --motion {stretch.kind}"
        )
    else:
        kind, speed = _STRETCHES[stretch.kind]
        degrees = {"start": start_deg, "end": end_deg, speed: speed_deg_s}
        if stretch.acceleration is not None:
            degrees["acceleration_rate"] = stretch.acceleration
        values = {name: math.radians(value) for name, value in degrees.items()}
        once = getattr(elbow, kind)(**values)
    return _stopped_and_repeated(stretch, once)


def _recorded(
    file: Path, interpolation: Interpolation | None, speed_deg_s: float | None
) -> Motion:
    from masrel.lab.elbow.identification._reading import read_angles

    if speed_deg_s is not None:
        raise ParameterError("--speed-deg-s: a recording has its own speed")
    if file.suffix.lower() == ".json":  # beside the columns
        file = file.with_suffix(".npz")
    time, angle = read_angles(file)
    try:
        return Recorded(time=time, angle=angle, interpolation=interpolation or "pchip")
    except ParameterError as error:
        raise ParameterError(f"{file}: {error}") from error


def _stopped_and_repeated(stretch: _MotionOptions, once: Motion) -> Motion:
    motion = once
    if stretch.stop is not None and stretch.pause is not None:
        if not 0.0 < stretch.stop < once.duration:
            raise ParameterError(
                f"--stop-at-s: needs a time within the motion, 0 to {once.duration:g} "
                f"s, got {stretch.stop:g} s"
            )
        motion = interrupted(once, at=stretch.stop, pause=stretch.pause)
    if stretch.repeats == 1:
        return motion
    parts: list[Motion] = [motion]
    for _ in range(stretch.repeats - 1):
        parts += [Reversed(motion=once), motion]
    return Joined(parts)


def _write_samples(
    csv_file: Path,
    rate_hz: float,
    scenes: Sequence[Scene],
    documents: Sequence[dict[str, Any]],
    *,
    quiet: bool,
) -> None:
    # columns name the scene where there are several
    durations = [document["phases"][-1]["end_s"] for document in documents]
    n_samples = sum(durations) * rate_hz + len(durations)
    if not n_samples <= _MAX_SAMPLES:
        raise ParameterError(
            f"--csv: needs at most {_MAX_SAMPLES} samples, got {n_samples:.4g}: "
            f"{sum(durations):.4g} s at {rate_hz:g} Hz; --rate-hz makes them fewer"
        )
    several = len(scenes) > 1
    rows = tqdm(
        _sample_rows(scenes, rate_hz, several=several),
        total=int(n_samples), desc="samples", delay=1.0, disable=quiet or None,
    )  # fmt: skip
    with new_file(csv_file) as out:
        out.write("# simulated: true\n")
        writer = csv.writer(out, lineterminator="\n")
        writer.writerow((*(("model", "speed_deg_s") if several else ()), *_COLUMNS))
        writer.writerows(rows)


def _sample_rows(
    scenes: Sequence[Scene], rate_hz: float, *, several: bool
) -> Iterator[tuple[Any, ...]]:
    for scene in scenes:
        made = elbow.trace(scene.joint, scene.motion, rate_hz=rate_hz)
        degrees = map(np.degrees, (made.angle, made.velocity))
        names = (safe_cell(scene.model), scene.speed_deg_s) if several else ()
        for *numbers, code in zip(
            made.time, *degrees, made.torque, made.phase, strict=True
        ):
            yield (*names, *numbers, PHASES[code])
