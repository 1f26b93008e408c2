"""``masrel gstudy``: variance of persons and facets, and the reliability of designs."""

from itertools import product
from pathlib import Path
from typing import Any, Literal
from warnings import catch_warnings

import click

from masrel._input import listed, refuse
from masrel.cli._options import (
    GroupedHelp,
    OutputOptions,
    call_text,
    floats,
    grouped,
    level_option,
    output_options,
    split_commas,
    whole_numbers,
    write_output,
)
from masrel.cli._paths import InputFile
from masrel.cli._reading import options_of
from masrel.errors import MasrelWarning
from masrel.ratings._findings import Reading

# Numbers of levels of each facet whose designs are shown unless some are asked for
_LEVELS = ((1, 2, 3, 4, 6, 8), (1, 2, 4), (1, 2))


@click.command("gstudy", cls=GroupedHelp)
@click.argument("file", type=InputFile(path_type=Path))
@click.option(
    "--facets",
    type=split_commas,
    required=True,
    metavar="COL,…",
    help="Columns of one to three facets, such as rater,occasion.",
)
@click.option(
    "--nested",
    multiple=True,
    metavar="FACET:COL",
    help="A facet nested in another, such as rater:task.",
)
@click.option(
    "--fixed",
    multiple=True,
    metavar="COL",
    help="A fixed facet: its levels are the only ones of interest. Levels of other "
    "facets are a sample.",
)
@click.option(
    "--cut", type=float, help="Cut-off grade that separates persons, for Φ(λ)."
)
@click.option(
    "--for",
    "sizes",
    type=whole_numbers,
    multiple=True,
    metavar="N,…",
    help="A design: number of levels of each facet, in order; repeat the option for "
    "several designs.",
)
@click.option("--aim", type=float, help="Find the cheapest design that reaches this Φ.")
@click.option(
    "--persons",
    type=whole_numbers,
    metavar="N,…",
    help="Number of persons in a future study. Gives the interval to expect with each "
    "design of --for and with the cheapest, and the probability that it lies above "
    "--aim, from 200 simulated studies.",
)
@click.option(
    "--seek",
    type=click.Choice(["dependability", "generalizability"]),
    default="dependability",
    show_default=True,
    help="The coefficient of the aim: Φ, or Eρ² if persons are only compared.",
)
@click.option(
    "--cost",
    "prices",
    type=floats,
    metavar="N,…",
    help="Cost of a level of each facet, in order, and of a rating.  [default: 0,…,1]",
)
@level_option
@click.option("--seed", "rng", default=0, show_default=True, help="Random seed.")
@grouped(
    "reading",
    Reading,
    *options_of("item", "grade", "no_header", "skip", "header", "categories"),
    *options_of("missing_codes", "decimal", "thousands", "units", "delimiter"),
    *options_of("encoding", "sheet"),
)
@output_options(
    json='Write JSON to this file; "-" writes it to standard output and prints '
    "nothing else.",
    figure="Draw reliability against numbers of levels to this .png, .svg or .pdf "
    "file.",
    html="Write a self-contained page.",
    csv="Print the tables as CSV, with all digits.",
    latex="Print the tables as LaTeX.",
)
def gstudy(
    file: Path,
    facets: list[str],
    nested: tuple[str, ...],
    fixed: tuple[str, ...],
    cut: float | None,
    sizes: tuple[list[int], ...],
    aim: float | None,
    persons: list[int] | None,
    seek: Literal["dependability", "generalizability"],
    prices: list[float] | None,
    reading: Reading,
    output: OutputOptions,
    **of_intervals: Any,
) -> None:
    """Estimate the sources of variance of the ratings in FILE, and reliability.

    FILE has one row per rating, with columns for what is measured (--item), for facets
    and for grades. The command gives components of variance with intervals, and the
    reliability of single ratings and of designs with other numbers of levels.
    """
    refuse(
        (
            any(len(n) != len(facets) for n in sizes),
            f"--for: needs one number for each of {listed(facets)}, got {[*sizes]}",
        ),
        (
            prices and aim is None,
            ("--cost: needs --aim, the value to reach at the lowest cost"),
        ),
        (
            persons and aim is None and not sizes,
            "--persons: needs designs, by --for or --aim",
        ),
    )
    # imported here: they load slowly, and a call that is refused needs none of them
    from pandas import DataFrame

    from masrel.agreement import cheapest_design, d_study, design_precision, g_study
    from masrel.analysis._file_estimates import placed
    from masrel.pages._answer_page import study_page
    from masrel.ratings._reader import read_facets
    from masrel.tables._decision_tables import (
        study_curves,
        study_methods,
        study_tables,
    )
    from masrel.tables._tables import SIMULATED

    sheet, columns = read_facets(file, facets, reading)
    of, *_, grade = columns
    with placed(str(file)):
        study = g_study(
            DataFrame(columns),
            of=of,
            facets=facets,
            nested=dict(pair.partition(":")[::2] for pair in nested),
            fixed=fixed,
            grade=grade,
            **of_intervals,
        )
    levels = [
        [study.n_within(name)] if name in fixed else steps
        for name, steps in zip(facets, _LEVELS, strict=False)
    ]
    with catch_warnings(action="ignore", category=MasrelWarning):  # tables say it
        designs = [
            d_study(study, dict(zip(facets, n, strict=True)), cut=cut)
            for n in sizes or product(*levels)
        ]
        if aim is not None:
            designs.append(cheapest_design(study, aim, prices=prices, of=seek))
        plans = [
            design_precision(
                study, of.sizes, n_persons=n, aim=aim, of=seek, rng=of_intervals["rng"]
            )
            for of in designs
            for n in persons or ()
            if sizes or of.cost is not None  # of those that somebody asked for
        ]
        shown, document = study_tables(
            study,
            designs,
            plans,
            file=sheet.name,
            data="simulated" if sheet.is_simulated else "foreign",
        )
        curves = study_curves(study, aim)
    inputs = {"Command": call_text(), f"SHA-256 of {file.name}": sheet.sha256()}
    write_output(
        output,
        document=lambda: {"inputs": inputs, **document},
        text=lambda: shown[0],
        more=shown[1:],
        figure=lambda: curves,
        html=lambda: study_page(shown, curves, inputs, study_methods(study)),
        stamp=SIMULATED if sheet.is_simulated else "",
        notes=(*shown[0].read, *shown[0].notes),
    )
