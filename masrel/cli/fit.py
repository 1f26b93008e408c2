"""``masrel fit``: identify a joint, or a device's friction, from recordings."""

import math
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import click

from masrel.cli.fit_figures import draw_friction_fit, draw_joint_fit
from masrel.cli.notes import notes
from masrel.cli.output import write_json
from masrel.errors import ParameterError

if TYPE_CHECKING:
    from masrel.elbow.identification import ElbowFit, FrictionFit, Movement
    from masrel.elbow.parameters import PostCatch

__all__ = ["command"]

Inertia = Literal["zero", "fitted"]


@click.command("fit")
@click.argument("recordings", nargs=-1, required=True, type=click.Path(path_type=Path))
@click.option(
    "-o",
    "--output",
    "model_file",
    type=click.Path(path_type=Path),
    help="Write the model file here, for a protocol to name.",
)
@click.option(
    "--friction",
    "of_device",
    is_flag=True,
    help="Fit (7) to recordings of backdriving.",
)
@click.option(
    "--unit",
    "units",
    help="Unit of a column whose name has none: time=ms, angle=deg, torque=nm.",
    metavar="QUANTITY=TEXT",
    multiple=True,
)
@click.option(
    "--column",
    "columns",
    help="Name of a column that is called otherwise: torque='Moment'.",
    metavar="QUANTITY=TEXT",
    multiple=True,
)
@click.option(
    "--slow-below",
    "slow_below",
    type=float,
    help="Stretches below this speed are slow, deg/s; default: 20, the threshold.",
)
@click.option(
    "--inertia",
    type=click.Choice(["zero", "fitted"]),
    default="zero",
    show_default=True,
    help="Whether m of (1) is fitted.",
)
@click.option(
    "--post-catch",
    type=click.Choice(["continuous", "additive"]),
    default="continuous",
    show_default=True,
    help="How (5) is read.",
)
@click.option("--level", type=float, default=0.95, show_default=True)
@click.option(
    "--figures",
    "folder",
    type=click.Path(path_type=Path, file_okay=False),
    help="Draw the fit as PNG and SVG files in this folder.",
)
@click.option(
    "--json",
    "json_file",
    type=click.Path(path_type=Path, allow_dash=True),
    help="Write everything as JSON here; - prints it, and nothing else, on stdout.",
)
@click.option("--quiet", is_flag=True, help="Show no progress.")
def command(
    recordings: tuple[Path, ...],
    model_file: Path | None,
    of_device: bool,
    units: tuple[str, ...],
    columns: tuple[str, ...],
    slow_below: float | None,
    inertia: Inertia,
    post_catch: "PostCatch",
    level: float,
    folder: Path | None,
    json_file: Path | None,
    quiet: bool,
) -> None:
    """Identify the joint behind RECORDINGS of slow and fast stretches.

    A recording is a CSV file or an npz archive with time, angle and torque, the unit
    in each column's name (time_s, angle_deg, torque_nm). Prints every parameter with
    its confidence interval, clustered by trial, and what these trials do not
    determine.
    """
    if of_device:
        _check_device_options(model_file, slow_below, inertia, post_catch)
    if slow_below is not None and not slow_below > 0.0:
        raise ParameterError(
            f"--slow-below: needs more than 0 deg/s, got {slow_below:g}"
        )
    named = _pairs("--column", columns), _pairs("--unit", units)
    with notes():
        movements = [_read(path, *named) for path in _shown(recordings, quiet=quiet)]
        if of_device:
            _friction(movements, level, folder, json_file)
            return
        found = _joint(movements, slow_below, inertia, post_catch, level)
    if folder is not None:
        draw_joint_fit(found, folder)
    _say(found, json_file)
    if model_file is not None:
        _write_model(found, model_file)


def _check_device_options(
    model_file: Path | None,
    slow_below: float | None,
    inertia: Inertia,
    post_catch: "PostCatch",
) -> None:
    if model_file is not None:
        raise ParameterError("--output: a model file is of a joint, not of a device")
    given = {
        "--slow-below": slow_below is not None,
        "--inertia": inertia != "zero",
        "--post-catch": post_catch != "continuous",
    }
    idle = [option for option, is_given in given.items() if is_given]
    if idle:
        raise ParameterError(
            f"{idle[0]}: says something of a joint, not of a device (--friction)"
        )


def _pairs(option: str, given: tuple[str, ...]) -> dict[str, str]:
    made = {}
    for entry in given:
        key, sign, value = entry.partition("=")
        if not sign or not value:
            raise ParameterError(f"{option}: needs QUANTITY=TEXT, got {entry!r}")
        made[key] = value
    return made


def _shown(paths: tuple[Path, ...], *, quiet: bool) -> "Iterator[Path]":
    from tqdm import tqdm

    hidden = quiet or None  # None: shown at a terminal alone
    yield from tqdm(paths, desc="reading", unit="file", disable=hidden, delay=1.0)


def _read(path: Path, columns: dict[str, str], units: dict[str, str]) -> "Movement":
    from masrel.elbow.identification import read_movement

    return read_movement(path, columns=columns, units=units)


def _joint(
    movements: "list[Movement]",
    slow_below: float | None,
    inertia: Inertia,
    post_catch: "PostCatch",
    level: float,
) -> "ElbowFit":
    from dataclasses import replace

    from masrel.elbow import STANDARD_MODELS
    from masrel.elbow.identification import fit

    return fit(
        movements,
        constants=replace(STANDARD_MODELS["HM1"], post_catch=post_catch),
        inertia=inertia,
        slow_below=None if slow_below is None else math.radians(slow_below),
        level=level,
    )


def _friction(
    movements: "list[Movement]",
    level: float,
    folder: Path | None,
    json_file: Path | None,
) -> None:
    from masrel.elbow.identification import fit_friction

    found = fit_friction(movements, level=level)
    if folder is not None:
        draw_friction_fit(found, folder)
    _say(found, json_file)


def _write_model(found: "ElbowFit", path: Path) -> None:
    import masrel
    from masrel.elbow.identification import as_toml, model_document

    document = model_document(
        found.joint(),
        simulated=found.simulated,
        made_from=f"masrel fit {masrel.__version__}, {len(found.trials)} trials",
        fit=found,
    )
    path.write_text(as_toml(document), encoding="utf-8")
    click.echo(f"model: {path}", err=True)


def _say(found: "ElbowFit | FrictionFit", json_file: Path | None) -> None:
    if json_file is not None:
        from masrel.cli.fit_document import fit_document

        write_json(fit_document(found), json_file)
    if json_file == Path("-"):
        return
    from masrel.elbow.identification import ElbowFit
    from masrel.report._tables import as_text
    from masrel.report.fit_table import fit_table, friction_table

    table = fit_table(found) if isinstance(found, ElbowFit) else friction_table(found)
    click.echo(as_text(table))
