"""Options of `masrel agree`: how estimates are made, and what is asked beside them."""

import click

from masrel.analysis._file_estimates import (
    OF_MEASUREMENTS,
    USUAL,
    EstimateOptions,
    Questions,
)
from masrel.cli._options import grouped, split_commas


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


question_options = grouped(
    "questions",
    Questions,
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
