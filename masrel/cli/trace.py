"""``masrel trace``: events, torque and samples of stretches of models."""

from collections.abc import Sequence
from pathlib import Path

import click
from tqdm import tqdm

from masrel.cli.trace_files import Files, file_options, write_files
from masrel.cli.trace_joint import Law, joints_of, law_options
from masrel.cli.trace_motion import Asked, motion_of, motion_options
from masrel.cli.trace_scene import Scene, Wanted, document, output_options
from masrel.cli.trace_text import summary, table

__all__ = ["command"]

MOST_SPEEDS = 100_000


@click.command("trace")
@click.option(
    "--model", "models", required=True, multiple=True,
    help="HM1 to HM4, a model of --study, or a model file (.toml); may be given again.",
)  # fmt: skip
@click.option(
    "--speed-deg-s", "speeds", type=float, multiple=True,
    help="Mean speed, deg/s; of a trapezoid that of its level. May be given again.",
)  # fmt: skip
@click.option(
    "--speeds-deg-s", "speed_range",
    type=(float, float, click.IntRange(min=2, max=MOST_SPEEDS)),
    metavar="LOW HIGH N", help="N speeds from LOW to HIGH.",
)  # fmt: skip
@motion_options
@click.option(
    "--study",
    type=click.Path(path_type=Path),
    help="Take models from this study's protocol.",
)
@law_options
@output_options
@file_options
@click.option("--quiet", is_flag=True, help="Show no progress.")
def command(
    models: tuple[str, ...],
    speeds: tuple[float, ...],
    speed_range: tuple[float, float, int] | None,
    asked: Asked,
    study: Path | None,
    law: Law,
    wanted: Wanted,
    files: Files,
    quiet: bool,
) -> None:
    """Phases, peak torque and samples of stretches of models.

    Events and outputs are exact; the samples of --csv are what the controller commands
    at --rate-hz for that motion. Several models or speeds make one scene of each pair.
    """
    scenes = _scenes(models, study, law, asked, [*speeds, *_spread(speed_range)])
    files.check(scenes)
    documents = [
        document(scene, wanted)
        for scene in tqdm(scenes, desc="scenes", delay=1.0, disable=quiet or None)
    ]
    write_files(files, scenes, documents, quiet=quiet)
    if files.json_file == "-":
        return
    if len(scenes) == 1:
        click.echo(summary(documents[0], scenes[0].title))
    else:
        click.echo(table(documents))


def _spread(speed_range: tuple[float, float, int] | None) -> list[float]:
    if speed_range is None:
        return []
    low, high, n = speed_range
    return [low + (high - low) * i / (n - 1) for i in range(n)]


def _scenes(
    models: Sequence[str],
    study: Path | None,
    law: Law,
    asked: Asked,
    speeds: Sequence[float],
) -> list[Scene]:
    # one of each model and speed, whatever is given twice
    joints = joints_of(models, study, law)
    motions = {speed: motion_of(asked, speed) for speed in speeds or (None,)}
    return [
        Scene(
            model=model,
            kind=asked.kind,
            speed_deg_s=speed,
            start_deg=asked.ends(motion)[0],
            end_deg=asked.ends(motion)[1],
            parameters=joint,
            motion=motion,
        )
        for model, joint in joints.items()
        for speed, motion in motions.items()
    ]
