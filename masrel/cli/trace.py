"""``masrel trace``: events, torque and samples of stretches of models."""

import csv
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

import click
from tqdm import tqdm

from masrel.cli._joint_options import (
    JointOptions,
    LawOptions,
    joint_options,
    joints_of,
    law_options,
)
from masrel.cli._options import (
    OutputOptions,
    check_folder,
    figure_form,
    grouped,
    output_options,
    write_output,
)
from masrel.errors import ParameterError
from masrel.report._tone_scenes import (
    ToneScene,
    stepped,
    tardieu_document,
    tardieu_text,
    tone_document,
)
from masrel.report._traced_scenes import (
    SCENE_OUTPUTS,
    SCENE_VIEWS,
    AnyScene,
    Scene,
    check_view,
    scene_document,
    scene_text,
    scenes_figure,
    scenes_text,
)

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from masrel.elbow import JointModel, Motion

_KINDS = ("constant", "minimum-jerk", "trapezoid", "recording")
_COLUMNS = ("time_s", "angle_deg", "velocity_deg_s", "torque_nm", "phase")
_PATH = click.Path(path_type=Path)

_MAX_SPEEDS = 100_000
_MAX_REPEATS = 1000  # which take a second to solve
_MAX_SAMPLES = 5_000_000  # rows of a CSV file: at 1 kHz 83 minutes, and some 400 MB
_N_AT_ONCE = 10_000  # rows between two signs of progress


@dataclass(frozen=True, slots=True, kw_only=True)
class _MotionOptions:
    """A motion as the command line has it; degrees and seconds."""

    kind: str  # one of `_KINDS`
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
        if not 1 <= self.repeats <= _MAX_REPEATS:
            raise ParameterError(
                f"--repeat: needs 1 to {_MAX_REPEATS}, got {self.repeats}"
            )

    @property
    def ends_deg(self) -> tuple[float, float]:
        """Where it starts and ends unless it is a recording, deg."""
        start = 30.0 if self.start is None else self.start
        return start, 146.0 if self.end is None else self.end

    def within(self, range_end: float) -> "_MotionOptions":
        """Return the same, by default ended where the range of a joint is (rad)."""
        limit = math.degrees(range_end)
        if self.recording is not None:
            return self
        if self.end is None:
            return replace(self, end=min(146.0, limit))
        if self.end > limit + 1e-9:
            raise ParameterError(
                f"--to-deg: needs at most the end of range of every model, {limit:g} "
                f"deg, got {self.end:g}"
            )
        return self


_motion_options = grouped(
    "stretch",
    _MotionOptions,
    click.option(
        "--motion", "kind", type=click.Choice(_KINDS), default="constant",
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


@dataclass(frozen=True, slots=True, kw_only=True)
class _SampleOptions:
    """The file of samples."""

    rate_hz: float | None  # samples a second; None for 1000
    csv_file: Path | None

    def __post_init__(self) -> None:
        if self.rate_hz is not None and self.csv_file is None:
            raise ParameterError("--rate-hz: goes with --csv, whose samples it spaces")
        if self.rate_hz is not None and not math.isfinite(self.rate_hz):
            raise ParameterError(f"--rate-hz: needs a finite rate, got {self.rate_hz}")
        if self.csv_file == Path("-"):
            raise ParameterError("--csv: needs the name of a file, got -")


_sample_options = grouped(
    "samples",
    _SampleOptions,
    click.option(
        "--rate-hz", type=click.FloatRange(min=0.0, min_open=True),
        help="Samples a second of --csv.  [default: 1000]",
    ),
    click.option("--csv", "csv_file", type=_PATH, help="Write the samples here."),
)  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class _QuantityOptions:
    """What is computed of every scene beside events and peak."""

    outputs: tuple[str, ...]  # of `SCENE_OUTPUTS`
    times: tuple[float, ...]  # where torque is computed, s
    angles: tuple[float, ...]  # where it is computed, deg


_quantity_options = grouped(
    "quantities",
    _QuantityOptions,
    click.option(
        "--output", "outputs", type=click.Choice(tuple(SCENE_OUTPUTS)), multiple=True,
        help="What to compute beside events and peak; may be given again.",
    ),
    click.option(
        "--at-s", "times", type=float, multiple=True, help="Torque at this time."
    ),
    click.option(
        "--at-deg", "angles", type=float, multiple=True,
        help="Torque where this angle is first reached.",
    ),
)  # fmt: skip


@click.command("trace")
@joint_options
@click.option(
    "--speed-deg-s", "speeds", type=float, multiple=True,
    help="Mean speed, deg/s; of a trapezoid that of its level. May be given again.",
)  # fmt: skip
@click.option(
    "--speeds-deg-s", "speed_range",
    type=(float, float, click.IntRange(min=2, max=_MAX_SPEEDS)),
    metavar="LOW HIGH N", help="N speeds from LOW to HIGH.",
)  # fmt: skip
@_motion_options
@law_options
@_quantity_options
@_sample_options
@output_options(
    json="Write events and outputs as JSON here; - for the screen.",
    figure="Draw this file: .png, .svg or .pdf.",
)
@click.option(
    "--view", type=click.Choice(SCENE_VIEWS),
    help="What --figure shows: torque by angle or time, the catches, or one of "
    "them.  [default: angle]",
)  # fmt: skip
@click.option(
    "--tardieu", is_flag=True,
    help="Say R2, R1 and their difference instead, at --speed-deg-s V1, V2 and V3 or "
    "10, 100 and 150.",
)  # fmt: skip
@click.option("--quiet", is_flag=True, help="Show no progress.")  # of the output
def trace(
    names: JointOptions,
    speeds: tuple[float, ...],
    speed_range: tuple[float, float, int] | None,
    stretch: _MotionOptions,
    law: LawOptions,
    quantities: _QuantityOptions,
    samples: _SampleOptions,
    output: OutputOptions,
    view: str | None,
    tardieu: bool,
) -> None:
    """Phases, peak torque and samples of stretches of models.

    Events and outputs are exact; the samples of --csv are what the controller commands
    at --rate-hz for that motion. Several models or speeds make one scene of each pair.
    """
    joints = joints_of(names, law)
    speeds = (*speeds, *_spaced(speed_range))
    if tardieu:
        _refuse_more(stretch, quantities, samples, output)
        _write_tardieu(joints, stretch.ends_deg[0], speeds, output)
        return
    if view is not None and output.figure is None:
        raise ParameterError("--view: goes with --figure, whose contents it chooses")
    scenes = _scenes(joints, stretch, speeds)
    if samples.csv_file is not None:
        check_folder("--csv", samples.csv_file)
    output.check_files()
    view = view or SCENE_VIEWS[0]
    if output.figure is not None:
        check_view(scenes, view)
    documents = [
        _document(scene, quantities)
        for scene in tqdm(
            scenes, desc="scenes", delay=1.0, disable=output.hides_progress
        )
    ]
    if samples.csv_file is not None:
        _write_samples(samples, scenes, documents, output.hides_progress)
    if output.figure is not None:
        form = figure_form(output.figure)
        output.figure.write_bytes(scenes_figure(scenes, view, form=form))
    only = documents[0] if len(documents) == 1 else None
    write_output(
        output,
        document=lambda: {"scenes": documents} if only is None else only,
        text=lambda: (
            scenes_text(documents)
            if only is None
            else scene_text(only, scenes[0].title)
        ),
    )


def _refuse_more(
    stretch: _MotionOptions,
    quantities: _QuantityOptions,
    samples: _SampleOptions,
    output: OutputOptions,
) -> None:
    # what --tardieu says nothing of
    plain = (
        stretch.kind == "constant" and stretch.repeats == 1,
        (stretch.end, stretch.stop) == (None, None),
        not (quantities.outputs or quantities.times or quantities.angles),
        samples.csv_file is None and output.figure is None,
    )
    if not all(plain):
        raise ParameterError(
            "--tardieu: stretches at constant speed to the end of range and says "
            "angles alone; it goes with --from-deg, --speed-deg-s and --json"
        )


def _write_tardieu(
    joints: "dict[str, JointModel]",
    start_deg: float,
    speeds: Sequence[float],
    output: OutputOptions,
) -> None:
    if speeds and len(speeds) != 3:
        raise ParameterError(
            f"--speed-deg-s: needs V1, V2 and V3 with --tardieu, got {len(speeds)}"
        )
    output.check_files()
    documents = [
        tardieu_document(name, joint, start_deg, speeds)
        for name, joint in joints.items()
    ]
    write_output(
        output,
        document=lambda: (
            documents[0] if len(documents) == 1 else {"tardieu": documents}
        ),
        text=lambda: tardieu_text(documents),
    )


def _document(scene: AnyScene, quantities: _QuantityOptions) -> dict[str, Any]:
    if isinstance(scene, ToneScene):
        if quantities.outputs:
            raise ParameterError(
                f"--output: needs spastic elbows, got {scene.joint.kind}"
            )
        return tone_document(scene, times=quantities.times, angles=quantities.angles)
    return scene_document(
        scene,
        outputs=quantities.outputs,
        times=quantities.times,
        angles=quantities.angles,
    )


def _spaced(speed_range: tuple[float, float, int] | None) -> list[float]:
    if speed_range is None:
        return []
    low, high, n = speed_range
    return [low + (high - low) * i / (n - 1) for i in range(n)]


def _scenes(
    joints: "dict[str, JointModel]",
    stretch: _MotionOptions,
    speeds: Sequence[float],
) -> list[AnyScene]:
    # one of each model and speed, however often an option repeats it
    from masrel.elbow.tone import ToneModel

    scenes: list[AnyScene] = []
    motions: dict[tuple[float | None, float], Motion] = {}  # by speed and end
    for name, joint in joints.items():
        made = stretch
        if isinstance(joint, ToneModel):
            made = stretch.within(joint.range_end)
        for speed in dict.fromkeys(speeds or (None,)):
            key = (speed, made.ends_deg[1])
            if key not in motions:
                motions[key] = _motion_of(made, speed)
            scenes.append(_scene(name, joint, made, speed, motions[key]))
    return scenes


def _scene(
    name: str,
    joint: "JointModel",
    stretch: _MotionOptions,
    speed: float | None,
    motion: "Motion",
) -> AnyScene:
    from masrel.elbow import ElbowParameters
    from masrel.elbow.tone import ToneModel

    start, end = stretch.ends_deg
    if stretch.recording is not None:
        start, end = math.degrees(motion.start), math.degrees(motion.end)
    if isinstance(joint, ToneModel):
        return ToneScene(
            model=name,
            kind=stretch.kind,
            speed_deg_s=speed,
            start_deg=start,
            end_deg=end,
            joint=joint,
            motion=motion,
        )
    if not isinstance(joint, ElbowParameters):
        raise ParameterError(f"--model: needs a kind with exact events, got {name}")
    return Scene(
        model=name,
        kind=stretch.kind,
        speed_deg_s=speed,
        start_deg=start,
        end_deg=end,
        parameters=joint,
        motion=motion,
    )


def _motion_of(stretch: _MotionOptions, speed_deg_s: float | None) -> "Motion":
    from masrel.elbow import Joined, Reversed, interrupted

    once = _plain_motion(stretch, speed_deg_s)
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


def _plain_motion(stretch: _MotionOptions, speed_deg_s: float | None) -> "Motion":
    from masrel.elbow import ConstantSpeed, MinimumJerk, Trapezoid
    from masrel.elbow.motions.file import read_motion

    if stretch.recording is not None:
        if speed_deg_s is not None:
            raise ParameterError("--speed-deg-s: a recording has its own speed")
        return read_motion(
            stretch.recording,
            interpolation="linear" if stretch.interpolation == "linear" else "pchip",
        )
    if speed_deg_s is None:
        raise ParameterError(
            f"--speed-deg-s: needs a speed for --motion {stretch.kind}"
        )
    start, end = map(math.radians, stretch.ends_deg)
    speed = math.radians(speed_deg_s)
    if stretch.kind == "constant":
        return ConstantSpeed(start=start, end=end, speed=speed)
    if stretch.acceleration is not None:
        rate = math.radians(stretch.acceleration)
        return Trapezoid(start=start, end=end, speed=speed, acceleration_rate=rate)
    return MinimumJerk(start=start, end=end, mean_speed=speed)


def _write_samples(
    samples: _SampleOptions,
    scenes: Sequence[AnyScene],
    documents: Sequence[dict[str, Any]],
    hides_progress: bool | None,
) -> None:
    if samples.csv_file is None:
        return
    rate_hz = 1000.0 if samples.rate_hz is None else samples.rate_hz
    n_rows = _n_samples(documents, rate_hz)
    with (
        samples.csv_file.open("w", encoding="utf-8", newline="") as out,
        tqdm(total=n_rows, desc="samples", delay=1.0, disable=hides_progress) as bar,
    ):
        _write_rows(out, scenes, rate_hz, bar)


def _n_samples(documents: Sequence[dict[str, Any]], rate_hz: float) -> int:
    durations = [document["phases"][-1]["end_s"] for document in documents]
    n_samples = sum(durations) * rate_hz + len(durations)
    if not n_samples <= _MAX_SAMPLES:
        raise ParameterError(
            f"--csv: needs at most {_MAX_SAMPLES} samples, got {n_samples:.4g}: "
            f"{sum(durations):.4g} s at {rate_hz:g} Hz; --rate-hz makes them fewer"
        )
    return int(n_samples)


def _write_rows(
    out: TextIO, scenes: Sequence[AnyScene], rate_hz: float, bar: "tqdm[Any]"
) -> None:
    # what the controller commands; columns name the scene where there are several
    several = len(scenes) > 1
    out.write("# simulated: true\n")
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow((*(("model", "speed_deg_s") if several else ()), *_COLUMNS))
    for scene in scenes:
        names = (scene.model, scene.speed_deg_s) if several else ()
        rows = _rows(scene, rate_hz)
        while block := list(islice(rows, _N_AT_ONCE)):
            writer.writerows((*names, *row) for row in block)
            bar.update(len(block))


def _rows(scene: AnyScene, rate_hz: float) -> Iterator[tuple[object, ...]]:
    import numpy as np

    from masrel.recording import PHASES

    time, angle, velocity, torque, codes = _sampled(scene, rate_hz)
    columns = (time, np.degrees(angle), np.degrees(velocity), torque)
    for start in range(0, time.size, _N_AT_ONCE):
        block = slice(start, start + _N_AT_ONCE)
        phases = [PHASES[code] for code in codes[block].tolist()]
        yield from zip(*(c[block].tolist() for c in columns), phases, strict=True)


def _sampled(scene: AnyScene, rate_hz: float) -> "tuple[NDArray[Any], ...]":
    # time, angle, velocity, torque and phase of every sample, SI units
    import numpy as np

    from masrel import elbow

    if isinstance(scene, Scene):
        made = elbow.trace(scene.parameters, scene.motion, rate_hz=rate_hz)
        return made.time, made.angle, made.velocity, made.torque, made.phase
    motion = scene.motion
    time = np.arange(math.floor(motion.duration * rate_hz) + 1) / rate_hz
    torque, phase = stepped(scene.joint, motion, time)
    return time, motion.angle(time), motion.velocity(time), torque, phase
