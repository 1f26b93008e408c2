"""``masrel joint trace`` and ``tardieu``: events, torque and samples of stretches."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import click
from tqdm import tqdm

from masrel.cli._options import (
    OutputOptions,
    grouped,
    output_options,
    write_output,
)
from masrel.cli._paths import FileInFolder, InputFile, note_inputs
from masrel.errors import ParameterError
from masrel.lab.cli._tone_traces import (
    END_DEG,
    START_DEG,
    end_within,
    joint_of_kind,
    write_tardieu,
)
from masrel.lab.cli._trace_samples import check_samples, write_samples
from masrel.lab.report._traced_scenes import (
    SCENE_OUTPUTS,
    SCENE_STAMP,
    SCENE_VIEWS,
    Quantities,
    Scene,
    check_view,
    scene_document,
    scene_text,
    scenes_content,
    scenes_text,
)

if TYPE_CHECKING:
    from masrel.lab.elbow import JointModel, Motion
    from masrel.lab.elbow.motions import Interpolation

_KINDS = ("constant", "minimum-jerk", "trapezoid", "recording")
_PATH = click.Path(path_type=Path)

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


_quantity_options = grouped(
    "quantities",
    Quantities,
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

    rest: float | None = None  # θ_rest, deg
    post_catch: str | None = None  # reading of (5)
    reading: str | None = None  # reading of Q
    rise: float | None = None  # how long torque takes to its peak, s
    inertia: float | None = None  # m of (1) and (5), kg·m²

    def change(self, joint: "JointModel") -> "JointModel":
        """Return a joint with these changes, which only a spastic elbow can have."""
        from masrel.lab.elbow import ElbowParameters

        if not isinstance(joint, ElbowParameters):
            raise ParameterError(
                "--rest-deg, --post-catch, --q-reading, --catch-rise-s, "
                f"--inertia-kg-m2: need a spastic elbow, got {joint.kind}"
            )
        changes: dict[str, object] = {
            "rest_angle": None if self.rest is None else math.radians(self.rest),
            "post_catch": self.post_catch,
            "residual_reading": self.reading,
            "catch_rise": self.rise,
            "inertia": self.inertia,
        }
        changes = {name: value for name, value in changes.items() if value is not None}
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
        "--model", "models", multiple=True,
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
@click.option(
    "--rate-hz", type=click.FloatRange(min=0.0, min_open=True),
    help="Samples a second of --csv.  [default: 1000]",
)  # fmt: skip
@click.option(
    "--csv",
    "csv_file",
    type=FileInFolder(path_type=Path),
    help="Write the samples here.",
)
@output_options(
    json="Write events and outputs as JSON here; - for the screen.",
    figure="Draw this file: .png, .svg or .pdf.",
)
@click.option(
    "--view", type=click.Choice(SCENE_VIEWS),
    help="What --figure shows: torque by angle or time, the catches, or one of "
    "them.  [default: angle]",
)  # fmt: skip
@click.option("--quiet", is_flag=True, help="Show no progress.")  # of the output
def trace(
    names: _JointOptions,
    speeds: tuple[float, ...],
    speed_range: tuple[float, float, int] | None,
    stretch: _MotionOptions,
    law: _LawOptions,
    quantities: Quantities,
    rate_hz: float | None,
    csv_file: Path | None,
    output: OutputOptions,
    view: str | None,
) -> None:
    """Phases, peak torque and samples of stretches of models.

    Events and outputs are exact; the samples of --csv are what the controller commands
    at --rate-hz for that motion. Several models or speeds make one scene of each pair.
    """
    if csv_file is not None or rate_hz is not None:
        check_samples(csv_file, rate_hz)
    joints = _joints_of(names, law)
    if speed_range is not None:
        speeds = (*speeds, *_spaced(*speed_range))
    if view is not None and output.figure is None:
        raise ParameterError("--view: goes with --figure, whose contents it chooses")
    scenes = _scenes(joints, stretch, speeds)
    if output.figure is not None:
        check_view(scenes, view or SCENE_VIEWS[0])
    documents = _documents(scenes, quantities, quiet=output.quiet)
    if csv_file is not None:
        rate = 1000.0 if rate_hz is None else rate_hz
        write_samples(csv_file, rate, scenes, documents, quiet=output.quiet)
    one = len(scenes) == 1
    write_output(
        output,
        document=lambda: documents[0] if one else {"scenes": documents},
        text=lambda: (
            scene_text(documents[0], scenes[0].title) if one else scenes_text(documents)
        ),
        figure=lambda: scenes_content(scenes, view or SCENE_VIEWS[0]),
        stamp=SCENE_STAMP,
    )


@click.command("tardieu")
@_joint_options
@_law_options
@click.option("--from-deg", "start", type=float, default=START_DEG, show_default=True)
@click.option(
    "--speed-deg-s", "speeds", type=(float, float, float), metavar="V1 V2 V3",
    help="Speeds of the stretches.  [default: 10 100 150]",
)  # fmt: skip
@output_options(json="Write them as JSON here; - for the screen.")
def tardieu(
    names: _JointOptions,
    law: _LawOptions,
    start: float,
    speeds: tuple[float, float, float] | None,
    output: OutputOptions,
) -> None:
    """R2, R1 and their difference, by stretches to the end of range at three speeds."""
    write_tardieu(_joints_of(names, law), start, speeds or (), output)


def _spaced(low: float, high: float, n: int) -> tuple[float, ...]:
    return tuple(low + (high - low) * i / (n - 1) for i in range(n))


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
    joints: "dict[str, JointModel]",
    stretch: _MotionOptions,
    speeds: Sequence[float],
) -> list[Scene]:
    # one of each model and speed, however often an option repeats it
    from masrel.lab.elbow import ElbowParameters

    scenes: list[Scene] = []
    motions: dict[tuple[float | None, float], Motion] = {}  # by speed and end
    start = START_DEG if stretch.start is None else stretch.start
    for name, joint in joints.items():
        end = END_DEG if stretch.end is None else stretch.end
        if stretch.recording is None and not isinstance(joint, ElbowParameters):
            end = end_within(joint, stretch.end)
        for speed in dict.fromkeys(speeds or (None,)):
            if (speed, end) not in motions:
                motions[speed, end] = _motion_of(stretch, speed, start, end)
            motion, ends = motions[speed, end], (start, end)
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


def _joints_of(names: _JointOptions, law: _LawOptions) -> dict[str, "JointModel"]:
    from masrel.lab.elbow import STANDARD_MODELS

    if not names.models and not names.kinds:
        raise click.UsageError("Missing option '--model' or '--kind'.")
    if names.parameters and len(names.kinds) != 1:
        raise ParameterError("--parameter: goes with one --kind, whose it is")
    joints: dict[str, JointModel] = {}
    for model in dict.fromkeys(names.models):
        name = Path(model).stem if model.endswith(".toml") else model
        if name in joints:
            raise ParameterError(
                f"--model: needs models whose names differ, got two called {name}"
            )
        if names.study is None and model in STANDARD_MODELS:
            joints[name] = STANDARD_MODELS[model]
        else:
            joints[name] = _joint_of_file(model, names.study)
    for kind in dict.fromkeys(names.kinds):
        joints[kind] = joint_of_kind(kind, names.parameters)
    if law != _LawOptions():
        joints = {name: law.change(joint) for name, joint in joints.items()}
    return joints


def _joint_of_file(model: str, study: Path | None) -> "JointModel":
    # a model file, or a model of a study's protocol
    from masrel.lab.elbow import STANDARD_MODELS
    from masrel.lab.protocol import (
        StudyPaths,
        joint_model,
        read_model_file,
        read_protocol,
    )

    if study is not None and model.endswith(".toml"):
        raise ParameterError(
            f"--model: needs a model of --study, got the file {model}; without "
            "--study it is read with the usual constants"
        )
    if study is not None:
        return joint_model(read_protocol(StudyPaths(study).protocol), model)
    if not model.endswith(".toml"):
        raise ParameterError(
            f"--model: needs one of {', '.join(STANDARD_MODELS)}, or a model file "
            f"(.toml), or --study to name a study's own, got {model!r}"
        )
    note_inputs(Path(model))
    return read_model_file(Path(model))


def _motion_of(
    stretch: _MotionOptions, speed_deg_s: float | None, start_deg: float, end_deg: float
) -> "Motion":
    from masrel.lab.elbow import ConstantSpeed, MinimumJerk, Trapezoid

    start, end = math.radians(start_deg), math.radians(end_deg)
    speed = math.radians(speed_deg_s or 0.0)
    motion: Motion
    if stretch.recording is not None:
        motion = _recorded(stretch.recording, stretch.interpolation, speed_deg_s)
    elif speed_deg_s is None:
        raise ParameterError(
            f"--speed-deg-s: needs a speed for --motion {stretch.kind}"
        )
    elif stretch.kind == "constant":
        motion = ConstantSpeed(start=start, end=end, speed=speed)
    elif stretch.acceleration is not None:
        rate = math.radians(stretch.acceleration)
        motion = Trapezoid(start=start, end=end, speed=speed, acceleration_rate=rate)
    else:
        motion = MinimumJerk(start=start, end=end, mean_speed=speed)
    if stretch.stop is None and stretch.repeats == 1:
        return motion
    return _stopped_and_repeated(stretch, motion)


def _recorded(
    file: Path, interpolation: str | None, speed_deg_s: float | None
) -> "Motion":
    from masrel.lab.elbow import Recorded
    from masrel.lab.elbow.identification._reading import read_angles

    if speed_deg_s is not None:
        raise ParameterError("--speed-deg-s: a recording has its own speed")
    if file.suffix.lower() == ".json":  # beside the columns
        file = file.with_suffix(".npz")
    time, angle = read_angles(file)
    between: Interpolation = "linear" if interpolation == "linear" else "pchip"
    try:
        return Recorded(time=time, angle=angle, interpolation=between)
    except ParameterError as error:
        raise ParameterError(f"{file}: {error}") from error


def _stopped_and_repeated(stretch: _MotionOptions, once: "Motion") -> "Motion":
    from masrel.lab.elbow import Joined, Reversed, interrupted

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
