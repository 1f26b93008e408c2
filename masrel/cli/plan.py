"""``masrel plan``: how large a study must be, and what a study can show."""

import itertools
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import click

from masrel.cli._options import OutputOptions, grouped, output_options, write_output
from masrel.cli._paths import InputFile, OutputFile
from masrel.cli._progress import progress
from masrel.errors import ParameterError

if TYPE_CHECKING:
    from masrel.planning import Plan
    from masrel.protocol import EstimatePlan, Protocol

_USUAL_VALUES = [0.4, 0.6, 0.8]


class _Range(click.ParamType):  # type: ignore[type-arg]
    """Numbers separated by commas, or first:last:step."""

    def __init__(self, number: type) -> None:
        self._number = number
        self.name = "numbers"

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> list[float]:
        if isinstance(value, list):
            return value
        try:
            return self._numbers(value)
        except ValueError:
            self.fail(f"needs numbers as 10,20 or 10:50:10, got {value!r}", param, ctx)

    def _numbers(self, text: str) -> list[float]:
        if ":" not in text:
            return [self._number(part) for part in text.split(",")]
        first, last, step = (self._number(part) for part in text.split(":"))
        n_steps = int((last - first) / step + 1e-9) if step > 0 else -1
        if n_steps < 0:
            raise ValueError
        return [self._number(round(first + k * step, 12)) for k in range(n_steps + 1)]


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanningOptions:
    """What is planned."""

    coefficient: str
    pilot: Path | None
    value: list[float] | None
    items: list[int] | None
    raters: list[int] | None
    categories: int | None
    prevalences: str | None
    weights: str
    model: str | None
    target: Literal["items", "raters", "both"] | None
    p_missing: float
    level: float
    sides: int
    half_width: float | None
    lower: float | None
    upper: float | None
    null: float | None
    power: float | None
    assurance: float | None
    max_cost: float | None
    prices: list[float]
    interval: str
    method: str
    seed: int
    n_studies: int
    executor: Literal["processes", "dask"] | None
    scheduler: str | None
    resume: Path | None

    @property
    def shares(self) -> object:
        """Prevalences: of the categories, several, or a table of two raters."""
        if self.prevalences is None:
            return None
        try:
            rows = [
                [float(part) for part in row.split(",")]
                for row in self.prevalences.split(";")
            ]
        except ValueError:
            raise ParameterError(
                "--prevalences: needs numbers as 0.7,0.3, rows of them separated by "
                f'";", got {self.prevalences!r}'
            ) from None
        return rows if len(rows) > 1 else rows[0]

    def common(self) -> dict[str, Any]:
        """Return the arguments that every plan takes."""
        if self.target is None:
            raise ParameterError(
                "--target: needs items, raters or both: what a new study draws anew"
            )
        if len(self.prices) != 3:
            raise ParameterError(
                f"--prices: needs three, of an item, a rater and a rating, got "
                f"{len(self.prices)}"
            )
        return {
            "weights": self.weights,
            "categories": self.categories,
            "prevalences": self.shares,
            "model": self.model,
            "target": self.target,
            "p_missing": self.p_missing,
            "level": self.level,
            "sides": self.sides,
            "half_width": self.half_width,
            "lower": self.lower,
            "upper": self.upper,
            "null": self.null,
            "prices": tuple(self.prices),
            "interval": self.interval,
            "rng": self.seed,
        }


_NUMBERS, _WHOLE = _Range(float), _Range(int)

_options = grouped(
    "options",
    PlanningOptions,
    click.option("--coefficient", default="fleiss_kappa", show_default=True),
    click.option(
        "--pilot",
        metavar="FILE",
        type=InputFile(path_type=Path),
        help="Ratings of which value, prevalences and missing share are taken, unless "
        "they are given.",
    ),
    click.option("--value", type=_NUMBERS, help="True coefficient, or several."),
    click.option("--items", type=_WHOLE, help="How many, as 30, 20,40 or 20:60:10."),
    click.option("--raters", type=_WHOLE, help="The same; one of both is solved for."),
    click.option("--categories", type=int, help="How many, each as frequent."),
    click.option(
        "--prevalences",
        metavar="SHARES",
        help="Of the categories, as 0.7,0.3; several with ;, or the rows of a table.",
    ),
    click.option("--weights", default="identity", show_default=True),
    click.option(
        "--model",
        type=click.Choice(["mixture", "dirichlet-multinomial", "latent", "table"]),
        help="How the ratings of an item come about.",
    ),
    click.option(
        "--target",
        type=click.Choice(["items", "raters", "both"]),
        help="What a new study would draw anew.",
    ),
    click.option(
        "--missing", "p_missing", default=0.0, help="Share of ratings missing."
    ),
    click.option("--level", default=0.95, show_default=True),
    click.option("--sides", default=2, show_default=True),
    click.option("--half-width", type=float, help="Aim: half the interval's width."),
    click.option("--lower", type=float, help="Aim: no end below this."),
    click.option("--upper", type=float, help="Aim: no end above this."),
    click.option("--null", type=float, help="Aim: this is excluded, with --power."),
    click.option("--power", type=float),
    click.option("--assurance", type=float, help="Chance to reach the aim."),
    click.option("--max-cost", type=float),
    click.option(
        "--prices",
        type=_NUMBERS,
        default="0,0,1",
        show_default=True,
        help="Of an item, a rater, a rating.",
    ),
    click.option(
        "--interval",
        type=click.Choice(["auto", "t", "normal"]),
        default="auto",
        show_default=True,
    ),
    click.option(
        "--method",
        type=click.Choice(["auto", "exact", "simulation", "wald", "goodness-of-fit"]),
        default="auto",
        show_default=True,
    ),
    click.option("--seed", default=0, show_default=True),
    click.option(
        "--studies",
        "n_studies",
        default=20_000,
        show_default=True,
        help="Of each cell of a grid that is simulated.",
    ),
    click.option(
        "--executor",
        type=click.Choice(["processes", "dask"]),
        help="Who runs a grid, in place of this process.",
    ),
    click.option("--scheduler", metavar="ADDRESS", help="Of a Dask cluster."),
    click.option(
        "--resume",
        type=OutputFile(path_type=Path, dir_okay=False),
        help="File of the tasks of a grid that are done: they are not run again.",
    ),
)


@click.command("plan")
@click.argument("study", required=False, type=InputFile(path_type=Path))
@_options
@click.option("--toml", is_flag=True, help="Print lines for a protocol instead.")
@output_options(
    json="Write every number here; - prints them, and nothing else, on stdout.",
    figure="Draw the curve of a grid into this .png, .svg or .pdf.",
    csv="Print every digit as CSV.",
    latex="Print a LaTeX table.",
    sentence="Print a sentence for a protocol instead of the table.",
    quiet="No progress.",
)
def plan(
    study: Path | None, options: PlanningOptions, toml: bool, output: OutputOptions
) -> None:
    """Say how large a study must be, or what STUDY can show.

    With --items or --raters alone, the other is solved for; with both, a study of that
    size is described; ranges make a grid. STUDY is a folder with a protocol: each line
    of its plan is described at its size.
    """
    output.check_files()
    options = _with_pilot(options)
    labels: tuple[str, ...] = ()
    if study is not None:
        labels, plans = _of_study(study, options, is_quiet=output.quiet)
    elif _is_grid(options):
        plans = _grid(options, is_quiet=output.quiet)
    else:
        plans = (_single(options),)
    if output.figure is not None and len({p.n_items for p in plans}) < 2:
        raise ParameterError("--figure: needs several --items, as 20:60:10")
    from masrel.report._planning_tables import (
        planning_curves,
        planning_document,
        planning_sentence,
        planning_table,
        planning_toml,
    )

    write_output(
        output,
        document=lambda: planning_document(plans),
        text=lambda: (
            "\n\n".join(map(planning_toml, plans))
            if toml
            else "\n".join(map(planning_sentence, plans))
            if output.sentence
            else planning_table(plans, labels=labels)
        ),
        figure=lambda: planning_curves(plans),
    )


def _with_pilot(options: PlanningOptions) -> PlanningOptions:
    # what nobody gave is what a pilot had
    if options.pilot is None:
        return options
    from masrel.planning import pilot
    from masrel.ratings import read_ratings

    target = options.common()["target"]
    file = read_ratings(options.pilot)
    if len(file.parts) != 1:
        raise ParameterError(
            f"--pilot: needs the ratings of one group and session, {options.pilot} has "
            f"{len(file.parts)}"
        )
    made = pilot(
        options.coefficient,
        file.parts[0].ratings,
        target=target,
        weights=options.weights,
        level=options.level,
    )
    click.echo(f"pilot {options.pilot}: {made.estimate}", err=True)
    shares = ",".join(map(repr, made.prevalences))
    is_normal = options.coefficient.startswith("icc")
    return replace(
        options,
        value=options.value or [made.estimate.value],
        prevalences=options.prevalences or (None if is_normal else shares),
        p_missing=options.p_missing or made.p_missing,
    )


def _is_grid(options: PlanningOptions) -> bool:
    sizes = (options.items, options.raters)
    several = any(values is not None and len(values) > 1 for values in sizes)
    is_many = options.value is not None and len(options.value) > 1
    if (several or is_many) and None in sizes:
        raise ParameterError(
            "--items, --raters: a grid needs both, since none is solved for"
        )
    return several or is_many or options.executor is not None


def _value(options: PlanningOptions) -> float | None:
    return None if options.value is None else options.value[0]


def _single(options: PlanningOptions) -> "Plan":
    from masrel.planning import precision, sample_size

    common = {
        **options.common(),
        "value": _value(options),
        "method": options.method,
        "n_items": None if options.items is None else options.items[0],
        "n_raters": None if options.raters is None else options.raters[0],
    }
    if options.items is not None and options.raters is not None:
        for name in ("power", "assurance", "max_cost"):
            if getattr(options, name) is not None:
                raise ParameterError(
                    f"--{name.replace('_', '-')}: needs --items or --raters to be left "
                    "out, to be solved for"
                )
        return precision(options.coefficient, **common)
    return sample_size(
        options.coefficient,
        **common,
        power=options.power,
        assurance=options.assurance,
        max_cost=options.max_cost,
    )


def _grid(options: PlanningOptions, *, is_quiet: bool) -> "tuple[Plan, ...]":
    from masrel.planning import plan_grid

    with progress("planning", "tasks", is_quiet=is_quiet) as bar:

        def step(_done: int, n_tasks: int) -> None:
            bar.expect(n_tasks)
            bar.update(1)

        return plan_grid(
            options.coefficient,
            **options.common(),
            value=options.value,
            n_items=options.items or [],
            n_raters=options.raters or [],
            n_studies=options.n_studies,
            executor=options.executor,
            scheduler=options.scheduler,
            file=options.resume,
            progress=step,
        )


def _of_study(
    study: Path, options: PlanningOptions, *, is_quiet: bool
) -> "tuple[tuple[str, ...], tuple[Plan, ...]]":
    # every line of a protocol's plan, at its size
    from masrel.protocol import StudyPaths, read_protocol

    protocol = read_protocol(StudyPaths(study).protocol)
    lines, values = protocol.analysis.estimates, options.value or _USUAL_VALUES
    labels: list[str] = []
    plans: list[Plan] = []
    with progress("planning", "plans", is_quiet=is_quiet) as bar:
        bar.expect(len(lines) * len(values))
        for line, value in itertools.product(lines, values):
            try:
                plans.append(_of_line(protocol, line, value, options))
            except ParameterError as error:
                click.echo(f"note: {line.id}: {error}", err=True)
            else:
                labels.append(line.id)
            bar.update(1)
    if not plans:
        raise ParameterError(
            f"{study}: needs a line of [[analysis.estimates]] that can be planned for"
        )
    return tuple(labels), tuple(plans)


def _of_line(
    protocol: "Protocol", line: "EstimatePlan", value: float, options: PlanningOptions
) -> "Plan":
    from masrel.planning import precision

    models = [m for m in protocol.models if line.models in ("all", m.role)]
    is_normal = line.coefficient.startswith("icc")
    return precision(
        line.coefficient,
        n_items=len(models),
        n_raters=len(protocol.raters),
        value=value,
        weights=line.weights,
        categories=len(protocol.scale.grades) if options.shares is None else None,
        prevalences=options.shares,
        model=None if is_normal else options.model or "dirichlet-multinomial",
        target=line.target,
        level=protocol.analysis.level,
        half_width=options.half_width,
        null=options.null,
        rng=options.seed,
    )
