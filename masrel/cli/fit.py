"""``masrel fit``: identify a joint, or a device's friction, from recordings."""

import math
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import click

from masrel.cli._options import (
    OutputOptions,
    output_options,
    warnings_as_notes,
    write_output,
)
from masrel.errors import ParameterError

if TYPE_CHECKING:
    from masrel.elbow.identification import ElbowFit, FrictionFit, Movement
    from masrel.elbow.parameters import PostCatch

_Inertia = Literal["zero", "fitted"]


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
@output_options(
    json="Write everything as JSON here; - prints it, and nothing else, on stdout.",
    quiet="Show no progress.",
)
def fit(
    recordings: tuple[Path, ...],
    model_file: Path | None,
    of_device: bool,
    units: tuple[str, ...],
    columns: tuple[str, ...],
    slow_below: float | None,
    inertia: _Inertia,
    post_catch: "PostCatch",
    level: float,
    folder: Path | None,
    output: OutputOptions,
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
    names = _pairs("--column", columns), _pairs("--unit", units)
    fitted: ElbowFit | FrictionFit
    with warnings_as_notes():
        movements = _read(recordings, *names, hides_progress=output.hides_progress)
        if of_device:
            from masrel.elbow.identification import fit_friction

            fitted = fit_friction(movements, level=level)
        else:
            fitted = _fit_joint(movements, slow_below, inertia, post_catch, level)
    _write(fitted, folder, output)
    if model_file is not None:
        _write_model(fitted, model_file)


def _check_device_options(
    model_file: Path | None,
    slow_below: float | None,
    inertia: _Inertia,
    post_catch: "PostCatch",
) -> None:
    if model_file is not None:
        raise ParameterError("--output: a model file is of a joint, not of a device")
    joint_options = {
        "--slow-below": slow_below is not None,
        "--inertia": inertia != "zero",
        "--post-catch": post_catch != "continuous",
    }
    idle = [option for option, is_used in joint_options.items() if is_used]
    if idle:
        raise ParameterError(
            f"{idle[0]}: says something of a joint, not of a device (--friction)"
        )


def _pairs(option: str, entries: tuple[str, ...]) -> dict[str, str]:
    pairs = {}
    for entry in entries:
        key, sign, value = entry.partition("=")
        if not sign or not value:
            raise ParameterError(f"{option}: needs QUANTITY=TEXT, got {entry!r}")
        pairs[key] = value
    return pairs


def _read(
    paths: tuple[Path, ...],
    columns: dict[str, str],
    units: dict[str, str],
    *,
    hides_progress: bool | None,
) -> "list[Movement]":
    from tqdm import tqdm

    from masrel.elbow.identification import read_movement

    with tqdm(
        paths, desc="reading", unit="file", disable=hides_progress, delay=1.0
    ) as bar:
        return [read_movement(path, columns=columns, units=units) for path in bar]


def _fit_joint(
    movements: "list[Movement]",
    slow_below: float | None,
    inertia: _Inertia,
    post_catch: "PostCatch",
    level: float,
) -> "ElbowFit":
    from dataclasses import replace

    from masrel.elbow import STANDARD_MODELS, identification

    return identification.fit(
        movements,
        constants=replace(STANDARD_MODELS["HM1"], post_catch=post_catch),
        inertia=inertia,
        slow_below=None if slow_below is None else math.radians(slow_below),
        level=level,
    )


def _write(
    fitted: "ElbowFit | FrictionFit", folder: Path | None, output: OutputOptions
) -> None:
    from masrel.report._fits import fit_document, fit_figures, fit_table

    if folder is not None:
        folder.mkdir(parents=True, exist_ok=True)
        for name, forms in fit_figures(fitted).items():
            for form, picture in forms.items():
                (folder / f"{name}.{form}").write_bytes(picture)
        click.echo(f"figures: {folder}", err=True)
    write_output(
        output,
        document=lambda: fit_document(fitted),
        text=lambda: fit_table(fitted),
    )


def _write_model(fitted: "ElbowFit | FrictionFit", path: Path) -> None:
    import masrel
    from masrel.elbow.identification import ElbowFit, as_toml, model_document

    if not isinstance(fitted, ElbowFit):
        raise ParameterError("--output: a model file is of a joint, not of a device")
    document = model_document(
        fitted.joint(),
        simulated=fitted.simulated,
        made_from=f"masrel fit {masrel.__version__}, {len(fitted.trials)} trials",
        fit=fitted,
    )
    path.write_text(as_toml(document), encoding="utf-8")
    click.echo(f"model: {path}", err=True)
