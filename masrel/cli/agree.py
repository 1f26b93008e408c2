"""``masrel agree``: agreement of any file of ratings, no study needed."""

from pathlib import Path
from typing import TYPE_CHECKING

import click

from masrel.analysis._file_estimates import (
    OF_MEASUREMENTS,
    USUAL,
    EstimateOptions,
    estimate_rows,
)
from masrel.cli._agreement_output import FileAgreement, WithArguments, write_agreement
from masrel.cli._further import FurtherOptions, further_options, further_tables
from masrel.cli._options import OutputOptions, grouped, output_options, split_commas
from masrel.cli._paths import InputFile
from masrel.cli._reading import (
    ReadingOptions,
    read_file,
    reading_options,
    table_options,
)
from masrel.errors import ParameterError, RatingsError

if TYPE_CHECKING:
    from masrel.analysis._file_estimates import AgreementRow
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


_estimate_options = grouped(
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


@click.command("agree", cls=WithArguments)
@click.argument("file", type=InputFile(path_type=Path, allow_dash=True))
@grouped(
    "reading",
    ReadingOptions,
    *reading_options,
    *table_options,
    click.option("--by", metavar="COL", help="Estimate each group of this column."),
    click.option(
        "--stream/--no-stream",
        default=None,
        help="Read batch by batch, as files larger than memory are (Parquet, text); by "
        "size unless given.",
    ),
    click.option(
        "--clusters",
        metavar="COL",
        help="Column of the clusters that items come in, such as patients with several "
        "sites: they are left out as a whole.",
    ),
)
@_estimate_options
@further_options
@click.option(
    "--explain", is_flag=True, help="Say in notes what every interval promises."
)
@output_options(
    json="Write a record of all here; - prints it, and nothing else, on stdout.",
    figure="Draw the intervals into this .png, .svg or .pdf; needs --target, "
    "--diagnose or --limits-of-agreement.",
    csv="Print every digit as CSV.",
    latex="Print a LaTeX table.",
    sentence="Print a sentence for a paper instead of the table, one an estimate.",
)
def agree(
    file: Path,
    reading: ReadingOptions,
    options: EstimateOptions,
    further: FurtherOptions,
    explain: bool,
    output: OutputOptions,
) -> None:
    """Estimate the agreement of the raters in FILE.

    FILE is a table in whatever shape a program left it: text, a workbook, Parquet,
    JSON, SPSS, Stata, SAS, packed or not; one row an item and a column a rater, or
    one row a rating. "-" reads standard input. What was read is shown; what could be
    read in two ways is refused with the option that decides.
    """
    options = further.checked(options, reading.by, reading.clusters)
    if output.figure is not None and options.target is None and not further.has_figure:
        raise ParameterError(
            "--figure: shows intervals, so it needs --target raters, items or both"
        )
    ratings = read_file(file, reading)
    by, groups = _groups(ratings, further, file)
    others = further.other_raters(ratings)
    # what does not fit these tables is said first: it says most
    tables = further_tables(ratings, others, further, options, explain=explain)
    agreement = FileAgreement(
        ratings=others,
        reading=reading,
        options=options,
        by=by,
        rows=_estimate(others, groups, further.between_raters(others, options)),
        further=tables,
        explain=explain,
    )
    write_agreement(agreement, output)


def _groups(
    ratings: "RatingsFile", further: FurtherOptions, file: Path
) -> tuple[str | None, list[str]]:
    # what tells parts apart, and what each is called
    if further.retest:
        return further.part_labels(ratings)
    sessions = list(dict.fromkeys(str(part.session) for part in ratings.parts))
    if len(sessions) > 1:
        raise RatingsError(
            f"{file}: holds {len(sessions)} sessions ({', '.join(sessions)}), so that "
            "raters graded the same item more than once; "
            f"--by {ratings.read['session']} estimates each"
        )
    return ratings.read["by"], [part.group or "" for part in ratings.parts]


def _estimate(
    ratings: "RatingsFile", groups: list[str], options: EstimateOptions | None
) -> "list[AgreementRow]":
    if options is None:
        return []
    return [
        row
        for part, group in zip(ratings.parts, groups, strict=True)
        for row in estimate_rows(
            part,
            group=group,
            n_raters=len(part.raters) or ratings.read["n_raters"],
            scale=ratings.scale,
            is_ordered=ratings.is_ordered,
            options=options,
        )
    ]
