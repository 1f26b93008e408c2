"""``masrel plan``: how large a study must be, and what a study can show."""

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any, get_args

import click

from masrel._input import refuse
from masrel.cli._options import (
    GroupedHelp,
    OutputOptions,
    Report,
    floats,
    output_options,
    progress,
    whole_numbers,
    write_output,
)
from masrel.cli._paths import InputFile
from masrel.cli._reading import weights_of_option
from masrel.estimates import IntervalMethod

if TYPE_CHECKING:
    from masrel.planning import Plan

_RANGES = ("value", "n_items", "n_raters")
_NOT_OF_STUDIES = (  # what a protocol says
    *("coefficient", "weights", "n_items", "n_raters", "categories", "target"),
    *("pilot", "power", "assurance", "max_cost", "prices", "executor", "scheduler"),
)
_OF_UNITS = {"error", "n_items", "half_width", "level"}


def _prevalences(text: str) -> list[Any]:
    """Return shares of categories, several of them, or the rows of a table."""
    rows = [floats(row) for row in text.split(";")]
    return rows if len(rows) > 1 else rows[0]


_INTERVALS = (*get_args(IntervalMethod), "t", "normal")
_METHODS = ("auto", "exact", "simulation", "wald", "goodness-of-fit")
_MODELS = ("mixture", "dirichlet-multinomial", "latent", "table")


@click.command("plan", cls=GroupedHelp)
@click.argument("study", required=False, type=InputFile(path_type=Path))
@click.option("--coefficient", help="Name of the coefficient.  [default: fleiss_kappa]")
@click.option(
    "--pilot",
    type=InputFile(path_type=Path),
    metavar="FILE",
    help="File of ratings from which value, prevalences and missing share are "
    "estimated, unless you give them.",
)
@click.option(
    "--value",
    type=floats,
    metavar="NUMBERS",
    help="True value of the coefficient, or several values.",
)
@click.option(
    "--items",
    "n_items",
    type=whole_numbers,
    metavar="NUMBERS",
    help="Number of items, as 30, 20,40 or 20:60:10.",
)
@click.option(
    "--raters",
    "n_raters",
    type=whole_numbers,
    metavar="NUMBERS",
    help="Number of raters. If either number is left out, it is solved for; with "
    "--prices both are.",
)
@click.option(
    "--categories", type=int, help="Number of categories, all equally frequent."
)
@click.option(
    "--prevalences",
    type=_prevalences,
    metavar="SHARES",
    help="Prevalences of the categories, as 0.7,0.3; separate several with ;, or the "
    "rows of a table.",
)
@click.option(
    "--weights",
    type=weights_of_option,
    metavar="NAME|FILE",
    help="A name, or a file that holds a matrix in the order of the categories, such "
    "as w.csv.  [default: identity]",
)
@click.option(
    "--model", type=click.Choice(_MODELS), help="Model of the ratings of an item."
)
@click.option(
    "--target",
    type=click.Choice(["items", "raters", "both"]),
    help="Generalise to other items, raters, or both?",
)
@click.option("--missing", "p_missing", type=float, help="Share of missing ratings.")
@click.option("--level", type=float, help="Level of the interval.  [default: 0.95]")
@click.option("--sides", type=int, help="One-sided (1) or two-sided (2).  [default: 2]")
@click.option("--half-width", type=float, help="Aim: half-width of the interval.")
@click.option("--lower", type=float, help="Aim: lower limit not below this.")
@click.option("--upper", type=float, help="Aim: upper limit not above this.")
@click.option(
    "--null", type=float, help="Aim: the interval excludes this value, with --power."
)
@click.option("--power", type=float, help="Probability of excluding --null.")
@click.option("--assurance", type=float, help="Probability of reaching the aim.")
@click.option("--max-cost", type=float, help="Highest cost of the study.")
@click.option(
    "--prices",
    type=floats,
    metavar="NUMBERS",
    help="Cost of an item, a rater and a rating.  [default: 0,0,1]",
)
@click.option(
    "--interval",
    type=click.Choice(_INTERVALS),
    help="Interval that an analysis would compute, or estimate ± quantile · standard "
    "error (t, normal).  [default: auto]",
)
@click.option(
    "--method",
    type=click.Choice(_METHODS),
    help="Method of computation.  [default: auto]",
)
@click.option(
    "--seed", "rng", type=click.IntRange(min=0), help="Random seed.  [default: 0]"
)
@click.option(
    "--studies",
    "n_studies",
    type=click.IntRange(min=1),
    help="Number of simulated studies.  [default: as many as the error needs]",
)
@click.option(
    "--error",
    type=float,
    help="Standard error of any estimate from a study with --items; gives the number "
    "of items, documents or clusters for an interval of ± --half-width.",
)
@click.option(
    "--executor",
    type=click.Choice(["dask"]),
    help="Plan a grid with this executor, instead of in this process.",
)
@click.option("--scheduler", metavar="ADDRESS", help="Address of a Dask cluster.")
@click.option(
    "--toml", is_flag=True, help="Print lines for a protocol instead of the table."
)
@output_options(
    json='Write JSON to this file; "-" writes it to standard output and prints '
    "nothing else.",
    figure="Draw the curve of a grid to this .png, .svg or .pdf file.",
    csv="Print the table as CSV, with all digits.",
    latex="Print the table as LaTeX.",
    sentence="Print a sentence for a protocol instead of the table.",
    quiet="Do not show progress.",
)
def plan(study: Path | None, toml: bool, output: OutputOptions, **options: Any) -> None:
    """Find how large a study must be, or what STUDY can show.

    If only --items or --raters is given, the other is solved for. If both are given, a
    study of that size is described. With --prices and neither, the cheapest study is
    found. Ranges make a grid. STUDY is a folder with a protocol: each line of its plan
    is described at its size. For a judge, such as a model: masrel plan --judge --help.
    """
    arguments = {key: value for key, value in options.items() if value is not None}
    if "error" in arguments:
        _plan_units(arguments, output)
        return
    labels, plans = _plans(study, {"rng": 0, **arguments}, is_quiet=output.quiet)
    sizes = ({one.n_items for one in plans}, {one.n_raters for one in plans})
    refuse(
        (
            toml and len(set(labels)) < len(labels),
            "--toml: needs one --value for each line of a study",
        ),
        (
            output.figure is not None and max(map(len, sizes)) < 2,
            "--figure: needs several --items or --raters, such as 20:60:10",
        ),
        (
            toml and isinstance(arguments.get("weights"), Path),
            "--toml: a protocol needs a name of weights, got a file",
        ),
    )
    from masrel.tables import _planning_tables as tables

    printed = zip(plans, labels or (None,) * len(plans), strict=True)
    write_output(
        output,
        document=lambda: tables.planning_document(plans),
        text=lambda: (
            "\n\n".join(tables.planning_toml(one, line=line) for one, line in printed)
            if toml
            else "\n".join(map(tables.planning_sentence, plans))
            if output.sentence
            else tables.planning_table(plans, labels=labels)
        ),
        figure=lambda: tables.planning_curves(plans, arguments),
    )


def _plan_units(arguments: dict[str, Any], output: OutputOptions) -> None:
    """Say how many units make the interval of an estimate narrow enough."""
    absent = {"n_items", "half_width"} - arguments.keys()
    refuse((absent, "--error: needs the --items of its study, and --half-width"))
    _refuse(arguments, arguments.keys() - _OF_UNITS, "cannot be combined with --error")
    from masrel.planning import units_needed

    (n_items, *_), half = arguments["n_items"], arguments["half_width"]
    level = arguments.get("level", 0.95)
    n = units_needed(arguments["error"], n_items, half_width=half, level=level)
    write_output(
        output,
        document=lambda: {**arguments, "level": level, "n_needed": n},
        text=lambda: (
            f"{n} are needed for an expected half-width of {half:g}, if {n_items} "
            f"give a standard error of {arguments['error']:g}."
        ),
    )


def _plans(
    folder: Path | None, arguments: dict[str, Any], *, is_quiet: bool
) -> "tuple[tuple[str, ...], tuple[Plan, ...]]":
    # with the lines of a study's plan that they are of
    with progress("planning", "steps", is_quiet=is_quiet) as report:
        if folder is None:
            return (), _of_options(_with_pilot(arguments), report)
        from masrel.lab.cli._study_plans import study_plans

        _refuse(
            arguments,
            _NOT_OF_STUDIES,
            ("is not allowed for a study, because its protocol gives it"),
        )
        return study_plans(folder, arguments, report)


def _of_options(arguments: dict[str, Any], report: Report) -> "tuple[Plan, ...]":
    from masrel.planning import Study, plan_grid, precision, sample_size

    ranges = {name: arguments.pop(name) for name in _RANGES if name in arguments}
    if _is_grid(arguments, ranges):
        _refuse(
            arguments,
            ("max_cost",),
            ("is not allowed for a grid, whose rows have costs"),
        )
        names = ("prevalences", "executor", "scheduler")
        ranges |= {name: arguments.pop(name) for name in names if name in arguments}
        return plan_grid(Study(**arguments), **ranges, progress=report)
    study = Study(**arguments, **{name: several[0] for name, several in ranges.items()})
    if study.n_items is None or study.n_raters is None:
        return (sample_size(study, progress=report),)
    _refuse(arguments, ("max_cost",), "needs either --items or --raters to be left out")
    return (precision(study, progress=report),)


def _is_grid(arguments: dict[str, Any], ranges: dict[str, Any]) -> bool:
    # several sizes or truths
    several = any(len(values) > 1 for values in ranges.values())
    is_table = arguments.get("model") == "table"
    is_rows = isinstance(arguments.get("prevalences", [0.0])[0], list) and not is_table
    is_shared = not arguments.keys().isdisjoint({"executor", "scheduler"})
    return several or is_rows or is_shared


def _refuse(arguments: dict[str, Any], names: Iterable[str], why: str) -> None:
    """Refuse options that were given where they mean nothing."""
    options = {name: name.removeprefix("n_").replace("_", "-") for name in names}
    refuse(*((name in arguments, f"--{options[name]}: {why}") for name in options))


def _with_pilot(arguments: dict[str, Any]) -> dict[str, Any]:
    # what nobody gave is what a pilot had
    arguments = {"coefficient": "fleiss_kappa", "target": None, **arguments}
    if isinstance(weights := arguments.get("weights"), Path):
        from masrel.ratings._reader import read_weights

        arguments["weights"] = read_weights(weights)
    if (path := arguments.pop("pilot", None)) is None:
        return arguments
    from masrel.planning import pilot
    from masrel.ratings import read_ratings

    parts = read_ratings(path).parts
    refuse(
        (
            len(parts) != 1,
            f"--pilot: needs the ratings of one group and session, {path} has "
            f"{len(parts)}",
        )
    )
    names = ("coefficient", "target", "weights", "level")
    of_pilot = {name: arguments[name] for name in names if name in arguments}
    made = pilot(ratings=parts[0].ratings, **of_pilot)
    click.echo(f"pilot {path}: {made.estimate}", err=True)
    had: dict[str, Any] = {"value": [made.estimate.value]}
    if not arguments["coefficient"].startswith("icc"):
        had |= {
            "categories": made.categories,
            "prevalences": [*made.prevalences],
            "p_missing": made.p_missing,
        }
    return {**had, **arguments}
