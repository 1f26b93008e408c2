"""``masrel trace``: events, torque and samples of stretches of models."""

import csv
import io
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

import click
from tqdm import tqdm

from masrel._files import new_file, write_file
from masrel.cli._options import (
    OutputOptions,
    check_folder,
    figure_form,
    grouped,
    output_options,
    write_output,
)
from masrel.cli._paths import InputFile, OutputFile
from masrel.cli._tone_traces import (
    end_within,
    joint_of_kind,
    tone_scene,
    write_tardieu,
)
from masrel.errors import ParameterError
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
    from masrel.elbow import ElbowParameters, JointModel, Motion

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
        "--recording", type=InputFile(path_type=Path),
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
    click.option(
        "--csv", "csv_file", type=OutputFile(path_type=Path),
        help="Write the samples here.",
    ),
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


@dataclass(frozen=True, slots=True, kw_only=True)
class _LawOptions:
    """What the command line changes of every joint; None changes nothing."""

    rest: float | None  # θ_rest, deg
    post_catch: str | None  # reading of (5)
    reading: str | None  # reading of Q
    rise: float | None  # how long torque takes to its peak, s
    inertia: float | None  # m of (1) and (5), kg·m²

    def change(self, joint: "JointModel") -> "JointModel":
        """Return a joint with these changes, which only a spastic elbow can have."""
        from masrel.elbow import ElbowParameters

        changes: dict[str, object] = {
            "rest_angle": None if self.rest is None else math.radians(self.rest),
            "post_catch": self.post_catch,
            "residual_reading": self.reading,
            "catch_rise": self.rise,
            "inertia": self.inertia,
        }
        changes = {name: value for name, value in changes.items() if value is not None}
        if not changes:
            return joint
        if not isinstance(joint, ElbowParameters):
            raise ParameterError(
                "--rest-deg, --post-catch, --q-reading, --catch-rise-s, "
                f"--inertia-kg-m2: need a spastic elbow, got {joint.kind}"
            )
        return replace(joint, **changes)  # type: ignore[arg-type]


_law_options = grouped(
    "law",
    _LawOptions,
    click.option("--rest-deg", "rest", type=float, help="θ_rest; default: the start."),
    click.option(
        "--post-catch", type=click.Choice(["continuous", "additive"]),
        help="How (5) is read.",
    ),
    click.option(
        "--q-reading", "reading", type=click.Choice(["residual", "decrease"]),
        help="What Q is a share of the peak for.",
    ),
    click.option(
        "--catch-rise-s", "rise", type=float, help="Smooth the catch's onset."
    ),
    click.option("--inertia-kg-m2", "inertia", type=float, help="m of (1) and (5)."),
)  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class _JointOptions:
    """The joints, however they are named."""

    models: tuple[str, ...]
    study: Path | None
    kinds: tuple[str, ...]
    parameters: tuple[str, ...]  # KEY=VALUE each


_joint_options = grouped(
    "names",
    _JointOptions,
    click.option(
        "--model", "models", multiple=True, type=InputFile(),
        help="HM1 to HM4, a model of --study, or a model file (.toml); may be given "
        "again.",
    ),
    click.option("--study", type=_PATH, help="Take models from this study's protocol."),
    click.option(
        "--kind", "kinds", multiple=True,
        help="Another kind of joint with its defaults, as in a protocol; may be given "
        "again.",
    ),
    click.option(
        "--parameter", "parameters", multiple=True, metavar="KEY=VALUE",
        help="One of its numbers, as in [models.parameters]; may be given again.",
    ),
)  # fmt: skip


@click.command("trace")
@_joint_options
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
@_law_options
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
    names: _JointOptions,
    speeds: tuple[float, ...],
    speed_range: tuple[float, float, int] | None,
    stretch: _MotionOptions,
    law: _LawOptions,
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
    joints = _joints_of(names, law)
    speeds = (*speeds, *_spaced(speed_range))
    if tardieu:
        plain = (
            (stretch.kind, stretch.repeats) == ("constant", 1),
            (stretch.end, stretch.stop, samples.csv_file) == (None, None, None),
            not (quantities.outputs or quantities.times or quantities.angles),
        )
        write_tardieu(joints, stretch.ends_deg[0], speeds, output, plain=all(plain))
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
        scene_document(
            scene,
            outputs=quantities.outputs,
            times=quantities.times,
            angles=quantities.angles,
        )
        for scene in tqdm(
            scenes, desc="scenes", delay=1.0, disable=output.hides_progress
        )
    ]
    if samples.csv_file is not None:
        _write_samples(samples, scenes, documents, output.hides_progress)
    if output.figure is not None:
        form = figure_form(output.figure)
        write_file(output.figure, scenes_figure(scenes, view, form=form))
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
    from masrel.elbow import ElbowParameters

    scenes: list[AnyScene] = []
    motions: dict[tuple[float | None, float], Motion] = {}  # by speed and end
    for name, joint in joints.items():
        start, end = stretch.ends_deg
        if stretch.recording is None and not isinstance(joint, ElbowParameters):
            end = end_within(joint, stretch.end)
        for speed in dict.fromkeys(speeds or (None,)):
            motion = motions.get((speed, end)) or _motion_of(stretch, speed, end)
            motions[speed, end] = motion
            if stretch.recording is not None:
                start, end = math.degrees(motion.start), math.degrees(motion.end)
            scenes.append(_scene(name, joint, stretch.kind, speed, start, end, motion))
    return scenes


def _scene(
    name: str,
    joint: "JointModel",
    kind: str,
    speed: float | None,
    start: float,
    end: float,
    motion: "Motion",
) -> AnyScene:
    from masrel.elbow import ElbowParameters

    if not isinstance(joint, ElbowParameters):
        return tone_scene(name, joint, kind, speed, start, end, motion)
    return Scene(
        model=name,
        kind=kind,
        speed_deg_s=speed,
        start_deg=start,
        end_deg=end,
        parameters=joint,
        motion=motion,
    )


def _joints_of(names: _JointOptions, law: _LawOptions) -> dict[str, "JointModel"]:
    if not names.models and not names.kinds:
        raise click.UsageError("Missing option '--model' or '--kind'.")
    if names.parameters and len(names.kinds) != 1:
        raise ParameterError("--parameter: goes with one --kind, whose it is")
    joints: dict[str, JointModel] = {}
    for model in dict.fromkeys(names.models):
        is_file = model.endswith(".toml")
        name = Path(model).stem if is_file else model
        if name in joints:
            raise ParameterError(
                f"--model: needs models whose names differ, got two called {name}"
            )
        joints[name] = law.change(
            _joint_in_file(model, names.study)
            if is_file
            else _named_joint(model, names.study)
        )
    for kind in dict.fromkeys(names.kinds):
        joints[kind] = law.change(joint_of_kind(kind, names.parameters))
    return joints


def _joint_in_file(model: str, study: Path | None) -> "ElbowParameters":
    from masrel.protocol import read_model_file

    if study is not None:
        raise ParameterError(
            f"--model: needs a model of --study, got the file {model}; without --study "
            "it is read with the usual constants"
        )
    return read_model_file(Path(model))


def _named_joint(model: str, study: Path | None) -> "JointModel":
    from masrel.elbow import STANDARD_MODELS

    if study is not None:
        from masrel.protocol import StudyPaths, joint_model, read_protocol

        return joint_model(read_protocol(StudyPaths(study).protocol), model)
    if model not in STANDARD_MODELS:
        raise ParameterError(
            f"--model: needs one of {', '.join(STANDARD_MODELS)}, or a model file "
            f"(.toml), or --study to name a study's own, got {model!r}"
        )
    return STANDARD_MODELS[model]


def _motion_of(
    stretch: _MotionOptions, speed_deg_s: float | None, end_deg: float
) -> "Motion":
    from masrel.elbow import Joined, Reversed, interrupted

    once = _plain_motion(stretch, speed_deg_s, end_deg)
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


def _plain_motion(
    stretch: _MotionOptions, speed_deg_s: float | None, end_deg: float
) -> "Motion":
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
    start, end = math.radians(stretch.ends_deg[0]), math.radians(end_deg)
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
        new_file(samples.csv_file) as file,
        io.TextIOWrapper(file, encoding="utf-8", newline="") as out,
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

    from masrel import elbow
    from masrel.recording import PHASES

    joint = scene.parameters if isinstance(scene, Scene) else scene.joint
    samples = elbow.trace(joint, scene.motion, rate_hz=rate_hz)
    columns = (
        samples.time,
        np.degrees(samples.angle),
        np.degrees(samples.velocity),
        samples.torque,
    )
    for start in range(0, samples.time.size, _N_AT_ONCE):
        block = slice(start, start + _N_AT_ONCE)
        phases = [PHASES[code] for code in samples.phase[block].tolist()]
        yield from zip(*(c[block].tolist() for c in columns), phases, strict=True)
