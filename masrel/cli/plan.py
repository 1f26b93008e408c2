"""``masrel plan``: how large a study must be, and what a study can show."""

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from masrel.cli._options import OutputOptions, output_options, write_output
from masrel.cli._paths import InputFile
from masrel.cli._progress import Progress, progress
from masrel.errors import ParameterError

if TYPE_CHECKING:
    from masrel.planning import Plan

_RANGES = ("value", "n_items", "n_raters")
_NOT_OF_STUDIES = (  # what a protocol says
    *("coefficient", "weights", "n_items", "n_raters", "categories", "target"),
    *("pilot", "power", "assurance", "max_cost", "prices", "executor", "scheduler"),
)


class _Numbers(click.ParamType):  # type: ignore[type-arg]
    """Numbers separated by commas, or first:last:step."""

    name = "numbers"

    def __init__(self, number: type, n: int | None = None) -> None:
        self._number, self._n = number, n

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> list[float]:
        try:
            numbers = self._range(value) if ":" in value else value.split(",")
            numbers = [self._number(part) for part in numbers]
        except ValueError:
            self.fail(f"needs numbers as 10,20 or 10:50:10, got {value!r}", param, ctx)
        if self._n not in (None, len(numbers)):
            self.fail(f"needs {self._n} numbers, got {len(numbers)}", param, ctx)
        return numbers

    def _range(self, text: str) -> Any:
        first, last, step = map(self._number, text.split(":"))
        n_steps = int((last - first) / step + 1e-9) if step > 0 else -1
        if n_steps < 0:
            raise ValueError
        return [round(first + k * step, 12) for k in range(n_steps + 1)]


class _Prevalences(_Numbers):
    """Shares of categories, several of them, or the rows of a table."""

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> Any:
        rows = value.split(";")
        shares = [super(_Prevalences, self).convert(row, param, ctx) for row in rows]
        return shares if len(shares) > 1 else shares[0]


_INTERVALS = ("auto", "analytic", "jackknife", "bootstrap", "posterior", "t", "normal")
_METHODS = ("auto", "exact", "simulation", "wald", "goodness-of-fit")
_MODELS = ("mixture", "dirichlet-multinomial", "latent", "table")
_FLOATS, _WHOLE = _Numbers(float), _Numbers(int)

_OPTIONS: tuple[tuple[str, str | None, Mapping[str, Any], str], ...] = (
    # option, field of `Study` where it is called otherwise, what it takes, what it says
    ("--coefficient", None, {}, "Its name.  [default: fleiss_kappa]"),
    (
        "--pilot",
        None,
        {"type": InputFile(path_type=Path), "metavar": "FILE"},
        "Ratings of which value, prevalences and missing share are taken, unless they "
        "are arguments.",
    ),
    ("--value", None, {"type": _FLOATS}, "True coefficient, or several."),
    ("--items", "n_items", {"type": _WHOLE}, "How many, as 30, 20,40 or 20:60:10."),
    (
        "--raters",
        "n_raters",
        {"type": _WHOLE},
        "The same. One of both is solved for where it is left out; with --prices both "
        "are.",
    ),
    ("--categories", None, {"type": int}, "How many, each as frequent."),
    (
        "--prevalences",
        None,
        {"type": _Prevalences(float), "metavar": "SHARES"},
        "Of the categories, as 0.7,0.3; several with ;, or the rows of a table.",
    ),
    ("--weights", None, {}, "[default: identity]"),
    (
        "--model",
        None,
        {"type": click.Choice(_MODELS)},
        "How the ratings of an item come about.",
    ),
    (
        "--target",
        None,
        {"type": click.Choice(["items", "raters", "both"])},
        "What a new study would draw anew.",
    ),
    ("--missing", "p_missing", {"type": float}, "Share of ratings missing."),
    ("--level", None, {"type": float}, "[default: 0.95]"),
    ("--sides", None, {"type": int}, "1 or 2.  [default: 2]"),
    ("--half-width", None, {"type": float}, "Aim: half the interval's width."),
    ("--lower", None, {"type": float}, "Aim: no end below this."),
    ("--upper", None, {"type": float}, "Aim: no end above this."),
    ("--null", None, {"type": float}, "Aim: this is excluded, with --power."),
    ("--power", None, {"type": float}, "Chance to exclude --null."),
    ("--assurance", None, {"type": float}, "Chance to reach the aim."),
    ("--max-cost", None, {"type": float}, "What the study may cost."),
    (
        "--prices",
        None,
        {"type": _Numbers(float, 3)},
        "Of an item, a rater, a rating.  [default: 0,0,1]",
    ),
    (
        "--interval",
        None,
        {"type": click.Choice(_INTERVALS)},
        "What an analysis computes, or estimate ± quantile · standard error (t, "
        "normal).  [default: auto]",
    ),
    ("--method", None, {"type": click.Choice(_METHODS)}, "[default: auto]"),
    ("--seed", "rng", {"type": click.IntRange(min=0)}, "[default: 0]"),
    (
        "--studies",
        "n_studies",
        {"type": click.IntRange(min=1)},
        "How many are simulated.  [default: as many as the error needs]",
    ),
    (
        "--executor",
        None,
        {"type": click.Choice(["dask"])},
        "Who plans a grid, in place of this process.",
    ),
    ("--scheduler", None, {"metavar": "ADDRESS"}, "Of a Dask cluster."),
)


def _study_options(command: Any) -> Any:
    """Give a command every option that a study is declared by."""
    for name, field, takes, text in reversed(_OPTIONS):
        names = (name,) if field is None else (name, field)
        command = click.option(*names, help=text, **takes)(command)
    return command


@click.command("plan")
@click.argument("study", required=False, type=InputFile(path_type=Path))
@_study_options
@click.option("--toml", is_flag=True, help="Print lines for a protocol instead.")
@output_options(
    json="Write every number here; - prints them, and nothing else, on stdout.",
    figure="Draw the curve of a grid into this .png, .svg or .pdf.",
    csv="Print every digit as CSV.",
    latex="Print a LaTeX table.",
    sentence="Print a sentence for a protocol instead of the table.",
    quiet="No progress.",
)
def plan(study: Path | None, toml: bool, output: OutputOptions, **options: Any) -> None:
    """Say how large a study must be, or what STUDY can show.

    With --items or --raters alone, the other is solved for; with both, a study of that
    size is described; with --prices and neither, the cheapest is solved for. Ranges
    make a grid. STUDY is a folder with a protocol: each line of its plan is described
    at its size.
    """
    arguments = {key: value for key, value in options.items() if value is not None}
    labels, plans = _plans(study, {"rng": 0, **arguments}, is_quiet=output.quiet)
    if toml and len(set(labels)) < len(labels):
        raise ParameterError("--toml: needs one --value for each line of a study")
    sizes = ({one.n_items for one in plans}, {one.n_raters for one in plans})
    if output.figure is not None and max(map(len, sizes)) < 2:
        raise ParameterError("--figure: needs several --items or --raters, as 20:60:10")
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


def _plans(
    folder: Path | None, arguments: dict[str, Any], *, is_quiet: bool
) -> "tuple[tuple[str, ...], tuple[Plan, ...]]":
    # with the lines of a study's plan that they are of
    with progress("planning", "steps", is_quiet=is_quiet) as bar:
        if folder is None:
            return (), _of_options(_with_pilot(arguments), bar)
        from masrel.lab.cli._study_plans import study_plans

        _refuse(arguments, _NOT_OF_STUDIES, "is not of a study, whose protocol says it")
        return study_plans(folder, arguments, bar.reach)


def _of_options(arguments: dict[str, Any], bar: Progress) -> "tuple[Plan, ...]":
    from masrel.planning import Study, plan_grid, precision, sample_size

    ranges = {name: arguments.pop(name) for name in _RANGES if name in arguments}
    if _is_grid(arguments, ranges):
        _refuse(arguments, ("max_cost",), "is not of a grid, whose rows have costs")
        if arguments.pop("method", "auto") != "auto":
            raise ParameterError("--method: a grid is by auto, exact where it can be")
        names = ("prevalences", "executor", "scheduler")
        ranges |= {name: arguments.pop(name) for name in names if name in arguments}
        return plan_grid(Study(**arguments), **ranges, progress=bar.reach)
    _refuse(arguments, ("scheduler",), "is of grids")
    study = Study(**arguments, **{name: several[0] for name, several in ranges.items()})
    if study.n_items is None or study.n_raters is None:
        return (sample_size(study, progress=bar.reach),)
    _refuse(arguments, ("max_cost",), "needs --items or --raters to be left out")
    return (precision(study, progress=bar.reach),)


def _is_grid(arguments: dict[str, Any], ranges: dict[str, Any]) -> bool:
    # several sizes or truths, or an aim at a known size
    several = any(len(values) > 1 for values in ranges.values())
    is_known = {"n_items", "n_raters"} <= ranges.keys()
    has_chance = "power" in arguments or "assurance" in arguments
    shares = (
        [0.0]
        if arguments.get("model") == "table"
        else arguments.get("prevalences", [0.0])
    )
    is_rows = isinstance(shares[0], list)
    return several or is_rows or (is_known and has_chance) or "executor" in arguments


def _refuse(arguments: dict[str, Any], names: Iterable[str], why: str) -> None:
    """Refuse options that were given where they mean nothing."""
    for name in names:
        if name in arguments:
            option = name.removeprefix("n_").replace("_", "-")
            raise ParameterError(f"--{option}: {why}")


def _with_pilot(arguments: dict[str, Any]) -> dict[str, Any]:
    # what nobody gave is what a pilot had
    if "target" not in arguments:
        raise ParameterError(
            "--target: needs items, raters or both: what a new study draws anew"
        )
    arguments = {"coefficient": "fleiss_kappa", **arguments}
    if (path := arguments.pop("pilot", None)) is None:
        return arguments
    from masrel.planning import pilot
    from masrel.ratings import read_ratings

    parts = read_ratings(path).parts
    if len(parts) != 1:
        raise ParameterError(
            f"--pilot: needs the ratings of one group and session, {path} has "
            f"{len(parts)}"
        )
    names = ("coefficient", "target", "weights", "level")
    of_pilot = {name: arguments[name] for name in names if name in arguments}
    made = pilot(ratings=parts[0].ratings, **of_pilot)
    click.echo(f"pilot {path}: {made.estimate}", err=True)
    had: dict[str, Any] = {
        "categories": made.categories,
        "prevalences": [*made.prevalences],
        "p_missing": made.p_missing,
    }
    if of_pilot["coefficient"].startswith("icc"):
        had = {}
    return {"value": [made.estimate.value], **had, **arguments}
