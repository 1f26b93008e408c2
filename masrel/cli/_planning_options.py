"""What is planned, as options say it."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import click

from masrel.cli._options import grouped
from masrel.cli._paths import InputFile, OutputFile
from masrel.errors import ParameterError

if TYPE_CHECKING:
    from masrel.agreement import Label


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

    coefficient: str | None
    pilot: Path | None
    value: list[float] | None
    items: list[int] | None
    raters: list[int] | None
    categories: "Sequence[Label] | int | None"
    prevalences: str | None
    weights: str | None
    model: str | None
    target: Literal["items", "raters", "both"] | None
    p_missing: float
    level: float | None
    sides: int | None
    half_width: float | None
    lower: float | None
    upper: float | None
    null: float | None
    power: float | None
    assurance: float | None
    max_cost: float | None
    prices: list[float] | None
    interval: str | None
    method: str
    seed: int
    n_studies: int | None
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

    @property
    def what(self) -> str:
        """The coefficient that is planned for."""
        return self.coefficient or "fleiss_kappa"

    @property
    def is_grid(self) -> bool:
        """Whether there are several sizes or truths, or an aim at a known size."""
        sizes = (self.items, self.raters)
        several = any(len(values) > 1 for values in (*sizes, self.value) if values)
        has_both = self.items is not None and self.raters is not None
        has_aim = self.power is not None or self.assurance is not None
        shares = self.shares if self.model != "table" else None
        is_rows = isinstance(shares, list) and isinstance(shares[0], list)
        return several or is_rows or (has_both and has_aim) or self.executor is not None

    def common(self) -> dict[str, Any]:
        """Return the arguments that every plan takes."""
        if self.target is None:
            raise ParameterError(
                "--target: needs items, raters or both: what a new study draws anew"
            )
        return {
            "weights": self.weights or "identity",
            "categories": self.categories,
            "prevalences": self.shares,
            "model": self.model,
            "target": self.target,
            "p_missing": self.p_missing,
            "level": 0.95 if self.level is None else self.level,
            "sides": 2 if self.sides is None else self.sides,
            "interval": self.interval or "auto",
            "rng": self.seed,
            **self.aim(),
            **self.prices_of(),
        }

    def aim(self) -> dict[str, float | None]:
        """Return half-width, limits and null value."""
        names = ("half_width", "lower", "upper", "null")
        return {name: getattr(self, name) for name in names}

    def prices_of(self) -> dict[str, tuple[float, ...]]:
        """Return the prices, where there are some."""
        if self.prices is None:
            return {}
        if len(self.prices) != 3:
            raise ParameterError(
                f"--prices: needs three, of an item, a rater and a rating, got "
                f"{len(self.prices)}"
            )
        return {"prices": tuple(self.prices)}

    def refuse(self, names: Iterable[str], why: str) -> None:
        """Refuse options that were given where they mean nothing."""
        for name in names:
            if getattr(self, name) not in (None, ()):
                renamed = {"p_missing": "missing", "n_studies": "studies"}
                option = renamed.get(name, name.replace("_", "-"))
                raise ParameterError(f"--{option}: {why}")


_INTERVALS = ("auto", "analytic", "jackknife", "bootstrap", "posterior", "t", "normal")
_NUMBERS, _WHOLE = _Range(float), _Range(int)

planning_options = grouped(
    "options",
    PlanningOptions,
    click.option("--coefficient", help="Its name.  [default: fleiss_kappa]"),
    click.option(
        "--pilot",
        metavar="FILE",
        type=InputFile(path_type=Path),
        help="Ratings of which value, prevalences and missing share are taken, unless "
        "they are given.",
    ),
    click.option("--value", type=_NUMBERS, help="True coefficient, or several."),
    click.option("--items", type=_WHOLE, help="How many, as 30, 20,40 or 20:60:10."),
    click.option(
        "--raters",
        type=_WHOLE,
        help="The same. One of both is solved for where it is left out; with --prices "
        "both are.",
    ),
    click.option("--categories", type=int, help="How many, each as frequent."),
    click.option(
        "--prevalences",
        metavar="SHARES",
        help="Of the categories, as 0.7,0.3; several with ;, or the rows of a table.",
    ),
    click.option("--weights", help="[default: identity]"),
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
    click.option("--level", type=float, help="[default: 0.95]"),
    click.option("--sides", type=int, help="1 or 2.  [default: 2]"),
    click.option("--half-width", type=float, help="Aim: half the interval's width."),
    click.option("--lower", type=float, help="Aim: no end below this."),
    click.option("--upper", type=float, help="Aim: no end above this."),
    click.option("--null", type=float, help="Aim: this is excluded, with --power."),
    click.option("--power", type=float, help="Chance to exclude --null."),
    click.option("--assurance", type=float, help="Chance to reach the aim."),
    click.option("--max-cost", type=float, help="What the study may cost."),
    click.option(
        "--prices",
        type=_NUMBERS,
        help="Of an item, a rater, a rating.  [default: 0,0,1]",
    ),
    click.option(
        "--interval",
        type=click.Choice(_INTERVALS),
        help="What an analysis computes, or estimate ± quantile · standard error (t, "
        "normal).  [default: auto]",
    ),
    click.option(
        "--method",
        type=click.Choice(["auto", "exact", "simulation", "wald", "goodness-of-fit"]),
        default="auto",
        show_default=True,
    ),
    click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True),
    click.option(
        "--studies",
        "n_studies",
        type=click.IntRange(min=1),
        help="Of each cell of a grid that is simulated.  [default: 20000]",
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
