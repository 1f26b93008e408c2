"""``masrel trace``: events, torque and samples of stretches of models."""

import json
import math
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import click
from tqdm import tqdm

from masrel.cli.trace_figure import VIEWS, check_figure, write_figure
from masrel.cli.trace_motion import KINDS, Asked, motion_of
from masrel.cli.trace_scene import OUTPUTS, Scene, document, samples, summary, table
from masrel.errors import ParameterError

if TYPE_CHECKING:
    from masrel.elbow import ElbowParameters

__all__ = ["command"]

_PATH = click.Path(path_type=Path)
_N_SILENT = 500  # scenes: fewer take less than two seconds


@click.command("trace")
@click.option(
    "--model", "models", required=True, multiple=True,
    help="HM1 to HM4, or a model of --study; may be given again.",
)  # fmt: skip
@click.option(
    "--speed-deg-s", "speeds", type=float, multiple=True,
    help="Mean speed, deg/s; of a trapezoid that of its level. May be given again.",
)  # fmt: skip
@click.option(
    "--speeds-deg-s", "speed_range", type=(float, float, click.IntRange(min=2)),
    metavar="LOW HIGH N", help="N speeds from LOW to HIGH.",
)  # fmt: skip
@click.option(
    "--motion", "kind", type=click.Choice(KINDS), default="constant", show_default=True
)
@click.option("--from-deg", "start", type=float, default=30.0, show_default=True)
@click.option("--to-deg", "end", type=float, default=146.0, show_default=True)
@click.option(
    "--acceleration-deg-s2", "acceleration", type=float, help="Of a trapezoid's ramps."
)
@click.option("--recording", type=_PATH, help="CSV with time_s and angle_deg, or npz.")
@click.option(
    "--interpolation", type=click.Choice(["pchip", "linear"]), default="pchip",
    show_default=True, help="Between the samples of a recording.",
)  # fmt: skip
@click.option("--stop-at-s", "stop", type=float, help="Stop the arm at this time.")
@click.option("--pause-s", "pause", type=float, help="And hold it for as long as this.")
@click.option(
    "--repeat", "repeats", type=int, default=1, show_default=True,
    help="Stretch so often, flexing in between as the stretch was made.",
)  # fmt: skip
@click.option("--study", type=_PATH, help="Take models from this study's protocol.")
@click.option("--rest-deg", "rest", type=float, help="θ_rest; default: the start.")
@click.option(
    "--post-catch",
    type=click.Choice(["continuous", "additive"]),
    help="How (5) is read.",
)
@click.option(
    "--q-reading", "reading", type=click.Choice(["residual", "decrease"]),
    help="What Q is a share of the peak for.",
)  # fmt: skip
@click.option("--catch-rise-s", "rise", type=float, help="Smooth the catch's onset.")
@click.option("--inertia-kg-m2", "inertia", type=float, help="m of (1) and (5).")
@click.option(
    "--output", "outputs", type=click.Choice(tuple(OUTPUTS)), multiple=True,
    help="What to compute beside events and peak; may be given again.",
)  # fmt: skip
@click.option("--at-s", "times", type=float, multiple=True, help="Torque at this time.")
@click.option(
    "--at-deg", "angles", type=float, multiple=True,
    help="Torque where this angle is first reached.",
)  # fmt: skip
@click.option(
    "--rate-hz", type=click.FloatRange(min=0.0, min_open=True), default=1000.0,
    show_default=True, help="Samples a second of --csv.",
)  # fmt: skip
@click.option("--csv", "csv_file", type=_PATH, help="Write the samples here.")
@click.option(
    "--json",
    "json_file",
    help="Write events and outputs as JSON here; - for the screen.",
)
@click.option("--figure", type=_PATH, help="Draw this file: .png, .svg or .pdf.")
@click.option(
    "--view", type=click.Choice(VIEWS), default="angle", show_default=True,
    help="What --figure shows: torque by angle or time, the catches, or one of them.",
)  # fmt: skip
@click.option("--quiet", is_flag=True, help="Show no progress.")
def command(
    models: tuple[str, ...],
    speeds: tuple[float, ...],
    speed_range: tuple[float, float, int] | None,
    kind: str,
    start: float,
    end: float,
    acceleration: float | None,
    recording: Path | None,
    interpolation: str,
    stop: float | None,
    pause: float | None,
    repeats: int,
    study: Path | None,
    rest: float | None,
    post_catch: str | None,
    reading: str | None,
    rise: float | None,
    inertia: float | None,
    outputs: tuple[str, ...],
    times: tuple[float, ...],
    angles: tuple[float, ...],
    rate_hz: float,
    csv_file: Path | None,
    json_file: str | None,
    figure: Path | None,
    view: str,
    quiet: bool,
) -> None:
    """Phases, peak torque and samples of stretches of models.

    Events and outputs are exact; the samples of --csv are what the controller commands
    at --rate-hz for that motion. Several models or speeds make one scene of each pair.
    """
    asked = Asked(
        kind=kind,
        start=start,
        end=end,
        acceleration=acceleration,
        recording=recording,
        interpolation=interpolation,
        stop=stop,
        pause=pause,
        repeats=repeats,
    )
    changes: dict[str, object] = {
        "rest_angle": None if rest is None else math.radians(rest),
        "post_catch": post_catch,
        "residual_reading": reading,
        "catch_rise": rise,
        "inertia": inertia,
    }
    joints = {model: _changed(_parameters(model, study), changes) for model in models}
    wanted: list[float | None] = [*speeds, *_spread(speed_range)]
    motions = {speed: motion_of(asked, speed) for speed in wanted or [None]}
    scenes = [
        Scene(
            model=model,
            kind=kind,
            speed_deg_s=speed,
            start_deg=start if recording is None else math.degrees(motion.start),
            end_deg=end if recording is None else math.degrees(motion.end),
            parameters=joint,
            motion=motion,
        )
        for model, joint in joints.items()
        for speed, motion in motions.items()
    ]
    if figure is not None:
        check_figure(figure, view, scenes)
    silent = quiet or len(scenes) < _N_SILENT
    documents = [
        document(scene, outputs, times, angles)
        for scene in tqdm(scenes, desc="scenes", disable=silent)
    ]
    if csv_file is not None:
        csv_file.write_text(samples(scenes, rate_hz), encoding="utf-8")
    if figure is not None:
        write_figure(scenes, view, figure)
    whole = documents[0] if len(scenes) == 1 else {"scenes": documents}
    if json_file == "-":
        click.echo(json.dumps(whole, indent=1))
        return
    if json_file is not None:
        Path(json_file).write_text(json.dumps(whole, indent=1) + "\n", "utf-8")
    if len(scenes) == 1:
        click.echo(summary(documents[0], scenes[0].title))
    else:
        click.echo(table(documents))


def _spread(speed_range: tuple[float, float, int] | None) -> list[float]:
    if speed_range is None:
        return []
    low, high, n = speed_range
    return [low + (high - low) * i / (n - 1) for i in range(n)]


def _parameters(model: str, study: Path | None) -> "ElbowParameters":
    from masrel.elbow import STANDARD_MODELS

    if study is not None:
        from masrel.protocol import StudyPaths, elbow_parameters, read_protocol

        return elbow_parameters(read_protocol(StudyPaths(study).protocol), model)
    if model not in STANDARD_MODELS:
        raise ParameterError(
            f"--model: needs one of {', '.join(STANDARD_MODELS)}, or --study to name "
            f"a study's own, got {model!r}"
        )
    return STANDARD_MODELS[model]


def _changed(
    parameters: "ElbowParameters", changes: dict[str, object]
) -> "ElbowParameters":
    asked = {name: value for name, value in changes.items() if value is not None}
    return replace(parameters, **asked)  # type: ignore[arg-type]
