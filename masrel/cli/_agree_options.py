"""Options of `masrel agree`: how estimates are made, and what is asked beside them."""

from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING

import click

from masrel.analysis._file_estimates import OF_MEASUREMENTS, USUAL, EstimateOptions
from masrel.cli._options import grouped, split_commas
from masrel.errors import ParameterError

if TYPE_CHECKING:
    from masrel.ratings import RatingsFile


def _list_register(
    context: click.Context, _: click.Parameter, value: list[str] | None
) -> list[str] | None:
    # "list" needs no file: it is seen before the file is missed
    if value == ["list"] and not context.resilient_parsing:
        click.echo(_register())
        context.exit()
    return value


def _plain_weights(name: str) -> str:
    from masrel.agreement._weights import plain_name

    return plain_name(name)


def _level(_: click.Context, __: click.Parameter, value: float) -> float:
    # checked here, since nothing else looks at it where there is no interval
    from masrel.agreement._engine import check_level

    check_level(value)
    return value


estimate_options = grouped(
    "options",
    EstimateOptions,
    click.option(
        "--coefficients",
        metavar="NAMES",
        show_default=f"{','.join(USUAL)}; with --limits-of-agreement "
        f"{','.join(OF_MEASUREMENTS)}",
        type=split_commas,
        is_eager=True,
        callback=_list_register,
        help="Names of coefficients, separated by commas; all that fit (but "
        "lin_ccc, sem and mdc); or list, which prints them and ends.",
    ),
    click.option(
        "--weights",
        default="identity",
        type=_plain_weights,
        metavar="NAME",
        show_default=True,
        help="identity, linear, quadratic, ordinal, radical, ratio, circular or "
        "bipolar.",
    ),
    click.option(
        "--metric",
        type=click.Choice(
            ["nominal", "ordinal", "interval", "ratio", "jaccard", "masi"]
        ),
        help="Krippendorff's alpha by his difference function in place of weights; "
        "jaccard and masi take grades of several labels: a;b, a|b or ['a', 'b'].",
    ),
    click.option(
        "--target",
        type=click.Choice(["items", "raters", "both"]),
        help="What a new study would draw anew; no interval without it.",
    ),
    click.option(
        "--interval",
        type=click.Choice(["auto", "analytic", "jackknife", "bootstrap", "posterior"]),
        default="auto",
        show_default=True,
        help="Kind of interval; auto chooses by target and size.",
    ),
    click.option(
        "--level",
        default=0.95,
        show_default=True,
        callback=_level,
        help="Level of intervals.",
    ),
    click.option("--resamples", "n_resamples", default=10_000, show_default=True),
    click.option("--seed", default=0, show_default=True, help="Seed of resampling."),
    click.option(
        "--words",
        type=click.Choice(["landis_koch", "altman", "fleiss", "cicchetti"]),
        help="Name the best band that the true value reaches with 95 % probability.",
    ),
)


def _register() -> str:
    from masrel.agreement import COEFFICIENTS
    from masrel.tables._tables import aligned

    lines = [("name", "title", "raters", "weights", "also called")]
    for entry in COEFFICIENTS.values():
        fewest, most = entry.n_raters
        raters = str(fewest) if most == fewest else f"{fewest} or more"
        if entry.shape == "pairs":
            raters += ", each twice (--retest)"
        weights = "any" if entry.weighted else "none"
        aliases = ", ".join(entry.aliases)
        lines.append((entry.name, entry.title, raters, weights, aliases))
    return "\n".join(aligned(lines, ["left"] * 5, rule=True))


_PAIRS = ("stratified_kappa", "pooled_kappa")
"""Coefficients of each rater's grades of two sessions."""


# What is asked for as a coefficient and is a table of its own
_NO_COEFFICIENTS = {
    **dict.fromkeys(("mcnemar", "bowker", "stuart_maxwell", "bhapkar"), "--symmetry"),
    "bland_altman": "--limits-of-agreement",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class FurtherOptions:
    """Which tables are printed beside that of agreement."""

    retest: bool
    each_category: bool
    symmetry: bool
    indices: bool
    compare: bool
    diagnose: bool
    reference: str | None
    limits_of_agreement: bool
    unit: str | None

    @property
    def has_figure(self) -> bool:
        """Whether a table has a figure of its own."""
        return self.diagnose or self.limits_of_agreement

    def record(self) -> dict[str, object]:
        """Return the tables that were chosen, the reference and the unit."""
        values = {field.name: getattr(self, field.name) for field in fields(self)}
        return {name: value for name, value in values.items() if value}

    def checked(
        self, options: EstimateOptions, by: str | None, clusters: str | None
    ) -> EstimateOptions:
        """Return what is estimated between raters, with the defaults of its tables."""
        self._check_own(options)
        if clusters is not None:
            if others := [name for name in self.record() if name != "compare"]:
                raise ParameterError(
                    f"--clusters: --{others[0].replace('_', '-')} takes every item by "
                    "itself, so needs one of them, got both"
                )
            why = "what is left out is a cluster of items"
            options = self._of_items(options, "--clusters", why)
        if self.compare and by is None:
            raise ParameterError(
                "--compare: needs --by with the column that tells the groups apart"
            )
        if self.compare:
            why = "a difference generalises to other items"
            return self._of_items(options, "--compare", why)
        if self.limits_of_agreement and options.weights == "identity":
            # weights are those of a kappa
            return replace(options, usual=OF_MEASUREMENTS)
        return options

    def _check_own(self, options: EstimateOptions) -> None:
        for name in options.names:
            option = _NO_COEFFICIENTS.get(name.lower().replace("-", "_"))
            if option is not None:
                raise ParameterError(
                    f"--coefficients: needed coefficients, got {name!r}: {option} has "
                    "that table"
                )
        for option, value, other, is_there in (
            ("--reference", self.reference, "--diagnose", self.diagnose),
            ("--unit", self.unit, "--limits-of-agreement", self.limits_of_agreement),
        ):
            if value is not None and not is_there:
                raise ParameterError(f"{option}: belongs to {other}, got it alone")
        if self.diagnose and self.limits_of_agreement:
            raise ParameterError(
                "--diagnose and --limits-of-agreement: each has a figure, so needs one "
                "of them, got both"
            )
        if self.diagnose and options.target in ("raters", "both"):
            raise ParameterError(
                "--diagnose: is of these raters, so its intervals generalise to other "
                f"items: --target items or none, got --target {options.target}"
            )

    def _of_items(
        self, options: EstimateOptions, option: str, why: str
    ) -> EstimateOptions:
        # the options for other items, which `option` takes alone
        if options.target not in (None, "items"):
            raise ParameterError(
                f"{option}: {why}, so it takes --target items, got --target "
                f"{options.target}"
            )
        return replace(options, target="items")

    def between_raters(
        self, file: "RatingsFile", options: EstimateOptions
    ) -> EstimateOptions | None:
        """Return what is estimated between raters; None where that is nothing."""
        if not self.retest:
            return options
        if all(len(part.raters) == 1 for part in file.parts):
            return None
        if options.coefficients is None:
            return options
        rest = [name for name in options.coefficients if name not in _PAIRS]
        return replace(options, coefficients=rest) if rest else None


further_options = grouped(
    "further",
    FurtherOptions,
    click.option(
        "--retest",
        is_flag=True,
        help="Agreement of each rater with him- or herself in the two sessions of "
        "--session, and of all; stratified_kappa, and pooled_kappa if named.",
    ),
    click.option(
        "--each-category",
        is_flag=True,
        help="Kappa of each category against all others.",
    ),
    click.option(
        "--symmetry",
        is_flag=True,
        help="Tests of change of two raters: McNemar, Bowker, Stuart-Maxwell, Bhapkar.",
    ),
    click.option(
        "--indices",
        is_flag=True,
        help="Of two raters and two categories: PABAK, prevalence, bias, largest "
        "kappa, positive and negative agreement.",
    ),
    click.option(
        "--compare",
        is_flag=True,
        help="Differences between the groups of --by, with p and Holm's adjustment, "
        "and the test that three or more are equal.",
    ),
    click.option(
        "--diagnose",
        is_flag=True,
        help="Which rater, which pair, which category: every pair, all without each "
        "rater, each category, confusions; --figure draws them.",
    ),
    click.option(
        "--reference",
        metavar="RATER",
        help="With --diagnose, the rater that the others are held against, and that is "
        "in no estimate between raters.",
    ),
    click.option(
        "--limits-of-agreement",
        is_flag=True,
        help="Of two raters, the mean of their differences and Bland and Altman's "
        "limits, with exact intervals; --figure draws them.",
    ),
    click.option(
        "--unit",
        metavar="UNIT",
        help="With --limits-of-agreement, the unit of the ratings, such as deg.",
    ),
)
