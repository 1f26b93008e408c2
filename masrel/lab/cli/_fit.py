"""``masrel joint fit``: a joint of recordings; ``friction``: a device's friction."""

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import click

from masrel._files import write_file
from masrel.cli._options import (
    Decorator,
    GroupedHelp,
    OutputOptions,
    grouped,
    level_option,
    output_options,
    progress,
    write_output,
)
from masrel.cli._paths import InputFile, OutputFile
from masrel.errors import ParameterError
from masrel.lab.cli._study_options import warnings_as_notes

if TYPE_CHECKING:
    from masrel.lab.elbow.identification import (
        ComparedFit,
        ElbowFit,
        FrictionFit,
        LawComparison,
        Movement,
    )

    _Results = tuple[ElbowFit | None, tuple[ComparedFit, ...], LawComparison | None]


@dataclass(frozen=True, slots=True, kw_only=True)
class _Recordings:
    """Files of recordings, and what their columns are called."""

    files: tuple[Path, ...]
    # units, columns: QUANTITY=TEXT each
    units: tuple[str, ...]
    columns: tuple[str, ...]

    def read(self, *, of_device: bool, quiet: bool) -> "list[Movement]":
        """Return what they hold, with a bar."""
        from tqdm import tqdm

        from masrel.lab.elbow.identification import read_movement

        columns = _pairs("--column", self.columns)
        units = _pairs("--unit", self.units)
        with tqdm(
            self.files, desc="reading", unit="file", disable=quiet or None, delay=1.0
        ) as bar:
            return [
                read_movement(path, columns=columns, units=units, of_device=of_device)
                for path in bar
            ]


def _pairs(option: str, entries: tuple[str, ...]) -> dict[str, str]:
    pairs = {}
    for entry in entries:
        key, sign, value = entry.partition("=")
        if not sign or not value:
            raise ParameterError(f"{option}: needs QUANTITY=TEXT, got {entry!r}")
        pairs[key] = value
    return pairs


_Term = float | Literal["off", "fitted"]


class _TermType(click.ParamType):  # type: ignore[type-arg]
    name = "off|fitted|number"

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> _Term:
        if value in ("off", "fitted"):
            return "off" if value == "off" else "fitted"
        try:
            return float(value)
        except ValueError:
            self.fail(f"needs off, fitted or a number, got {value!r}", param, ctx)


def _term(option: str, text: str, default: str = "off") -> Decorator:
    return click.option(
        option, type=_TermType(), default=default, show_default=True, help=text
    )


_recordings = grouped(
    "recordings",
    _Recordings,
    click.argument(
        "files",
        metavar="RECORDINGS...",
        nargs=-1,
        required=True,
        type=InputFile(path_type=Path),
    ),
    click.option(
        "--unit",
        "units",
        help="Unit of a column whose name does not give one: time=ms, angle=deg, "
        "torque=nm.",
        metavar="QUANTITY=TEXT",
        multiple=True,
    ),
    click.option(
        "--column",
        "columns",
        help="Column that holds a quantity, if its name differs: torque='Moment'.",
        metavar="QUANTITY=TEXT",
        multiple=True,
    ),
)
_figures = click.option(
    "--figures",
    "folder",
    type=click.Path(path_type=Path, file_okay=False),
    help="Save figures of the fit as PNG and SVG files in this folder.",
)
_output = output_options(
    json='Write JSON to this file; "-" writes it to standard output and prints nothing '
    "else.",
    quiet="Do not show progress.",
    makes_folder=True,
)


@click.command("friction", cls=GroupedHelp)
@_recordings
@level_option
@_figures
@_output
def friction(
    recordings: _Recordings, level: float, folder: Path | None, output: OutputOptions
) -> None:
    """Fit the friction of a device, equation (7), to RECORDINGS of backdriving.

    Recordings have the same format as for masrel joint fit.
    """
    from masrel.lab.elbow.identification import fit_friction

    with warnings_as_notes():
        movements = recordings.read(of_device=True, quiet=output.quiet)
        fitted = fit_friction(movements, level=level)
    _write(fitted, (), None, folder, output)


@click.command("fit", cls=GroupedHelp)
@_recordings
@click.option(
    "-o",
    "--output",
    "model_file",
    type=OutputFile(path_type=Path),
    help="Write a model file for use in a protocol.",
)
@click.option(
    "--slow-below",
    "slow_below",
    type=float,
    help="Speed in deg/s below which a stretch is slow; default: 20, the catch "
    "threshold.",
)
@click.option(
    "--inertia",
    type=click.Choice(["zero", "fitted"]),
    default="zero",
    show_default=True,
    help="Whether the inertia, m in equation (1), is fixed at zero or fitted.",
)
@click.option(
    "--post-catch",
    type=click.Choice(["continuous", "additive"]),
    default="continuous",
    show_default=True,
    help="Reading of equation (5), the torque after the catch.",
)
@_term("--gravity", "Torque of the arm's weight, m·g·l in N·m; adds m·g·l·sin(angle).")
@click.option(
    "--gravity-angle",
    type=float,
    default=0.0,
    show_default=True,
    help="Angle in deg at which the weight exerts no torque.",
)
@_term("--arm-inertia", "Inertia of the arm in every phase, kg·m².")
@_term(
    "--offset",
    "Constant torque in each trial, N·m: the sensor's zero offset.",
    "fitted",
)
@_term("--drift", "Drift of the offset, N·m/s; fitted for each trial.")
@_term("--lag", "Time constant of the torque sensor, s; below 0, delay of the angle.")
@_term("--rise", "Time that a catch takes to reach its peak, s.")
@click.option(
    "--compare",
    is_flag=True,
    help="Also fit with each further term of the arm, and compare by leaving trials "
    "out.",
)
@click.option(
    "--laws",
    metavar="all|NAME,...",
    help="Also fit these laws of tone, and compare all laws by leaving recordings out.",
)
@level_option
@_figures
@_output
def fit(
    recordings: _Recordings,
    model_file: Path | None,
    compare: bool,
    laws: str | None,
    level: float,
    folder: Path | None,
    output: OutputOptions,
    **of_joint: Any,
) -> None:
    """Estimate a joint's parameters from RECORDINGS of slow and fast stretches.

    A recording is a CSV file or an npz archive with time, angle and torque, and with
    the unit in each column's name (time_s, angle_deg, torque_nm). It may also be a
    recording of masrel run: the measured torque is used, or the model's if none was
    measured. Prints every parameter with its confidence interval (clustered by trial),
    the parameters that these trials do not determine, and whether the law fits.
    """
    slow_below = of_joint["slow_below"]
    if slow_below is not None and not 0.0 < slow_below < math.inf:
        raise ParameterError(
            f"--slow-below: needs more than 0 deg/s and finite, got {slow_below:g}"
        )
    if compare and laws is not None:
        raise ParameterError(
            "--compare, --laws: the first compares terms of the arm, the second laws; "
            "needs one of them, got both"
        )
    with warnings_as_notes():
        movements = recordings.read(of_device=False, quiet=output.quiet)
        options = _options(of_joint, level)
        results = _fit_joint(movements, options, compare, laws, quiet=output.quiet)
    _write(*results, folder, output)
    if model_file is not None:
        _write_model(results[0], model_file)


def _options(of_joint: "dict[str, Any]", level: float) -> "dict[str, Any]":
    # as `identification.fit` takes them
    from masrel.lab.elbow import STANDARD_MODELS

    post_catch = of_joint.pop("post_catch")
    slow_below = of_joint.pop("slow_below")
    return {
        **of_joint,
        "gravity_angle": math.radians(of_joint["gravity_angle"]),
        "constants": replace(STANDARD_MODELS["HM1"], post_catch=post_catch),
        "slow_below": None if slow_below is None else math.radians(slow_below),
        "level": level,
    }


def _fit_joint(
    movements: "list[Movement]",
    options: "dict[str, Any]",
    compare: bool,
    laws: str | None,
    *,
    quiet: bool,
) -> "_Results":
    # the elbow's fit, which is None where only other laws can be fitted, and what it
    # is compared with
    from masrel.lab.elbow import identification

    if laws is not None:
        names = None if laws == "all" else laws.split(",")
        with progress("fitting laws", " laws", is_quiet=quiet) as report:
            compared_laws = identification.compare_laws(
                movements, laws=names, progress=report, **options
            )
        return compared_laws.elbow, (), compared_laws
    if not compare:
        return identification.fit(movements, **options), (), None
    compared = identification.compare_fits(movements, **options)
    first = compared[0].fit
    if first is None:  # refused, which was said
        raise ParameterError("--compare: there is no fit to compare with")
    return first, compared, None


def _write(
    fitted: "ElbowFit | FrictionFit | None",
    compared: "tuple[ComparedFit, ...]",
    laws: "LawComparison | None",
    folder: Path | None,
    output: OutputOptions,
) -> None:
    from masrel.lab.report._fits import (
        comparison_document,
        comparison_tables,
        fit_document,
        fit_figures,
        fit_table,
        law_document,
        law_tables,
        residual_tables,
    )

    of_fit = [] if fitted is None else [fit_table(fitted), *residual_tables(fitted)]
    first, *more = [*of_fit, *comparison_tables(compared), *law_tables(laws)]
    if folder is not None and fitted is not None:
        for name, forms in fit_figures(fitted).items():
            for form, picture in forms.items():
                write_file(folder / f"{name}.{form}", picture)
        click.echo(f"figures: {folder}", err=True)
    write_output(
        output,
        document=lambda: (
            ({} if fitted is None else fit_document(fitted))
            | comparison_document(compared)
            | law_document(laws)
        ),
        text=lambda: first,
        more=more,
    )


def _write_model(fitted: "ElbowFit | None", path: Path) -> None:
    import masrel
    from masrel.lab.elbow._model_file import as_toml, model_document

    if fitted is None:
        raise ParameterError(
            "--output: a model file needs a fit of the elbow's law, which was refused"
        )
    document = model_document(
        fitted.joint(),
        simulated=fitted.simulated,
        made_from=f"masrel joint fit {masrel.__version__}, {len(fitted.trials)} trials",
        fit=fitted,
    )
    write_file(path, as_toml(document))
    click.echo(f"model: {path}", err=True)
