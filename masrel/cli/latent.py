"""``masrel latent``: raters' biases and noises, items and thresholds on one scale."""

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import click

from masrel._input import refuse
from masrel.cli._options import (
    GroupedHelp,
    OutputOptions,
    call_text,
    echo_notes,
    grouped,
    level_option,
    output_options,
    progress,
    write_output,
)
from masrel.cli._paths import InputFile
from masrel.cli._reading import read_file, reading_options
from masrel.errors import RatingsError
from masrel.ratings._findings import Reading

if TYPE_CHECKING:
    from masrel.ratings import RatingsFile, RatingsPart


@click.command("latent", cls=GroupedHelp)
@click.argument("file", type=InputFile(path_type=Path))
@click.option(
    "--items",
    type=click.Choice(["fixed", "random"]),
    required=True,
    help="Give kappa for these items, or for new items like them.",
)
@grouped("reading", Reading, *reading_options)
@click.option(
    "--only", metavar="SESSION", help="Session to analyse, if there are several."
)
@level_option
@click.option(
    "--seed", default=0, show_default=True, help="Random seed of the sampler."
)
@click.option(
    "--one-prior",
    is_flag=True,
    help="Do not compare with a second prior; takes half the time, but does not show "
    "the influence of the prior.",
)
@output_options(
    json='Write JSON to this file; "-" writes it to standard output and prints '
    "nothing else.",
    figure="Draw the scale to this .png, .svg or .pdf file.",
    html="Write a self-contained page.",
    csv="Print the tables as CSV, with all digits.",
    quiet="Do not show progress.",
)
def latent(
    file: Path,
    items: Literal["fixed", "random"],
    reading: Reading,
    only: str | None,
    level: float,
    seed: int,
    one_prior: bool,
    output: OutputOptions,
) -> None:
    """Place the raters and items in FILE on one scale.

    FILE can be any file that masrel agree reads; its grades must be in order. An
    ordinal latent-trait model gives kappa for new raters, each rater's bias and noise,
    each item's severity, and the thresholds between grades. This takes seconds to
    minutes.
    """
    refuse((seed < 0, f"--seed: needs at least 0, got {seed}"))
    ratings = read_file(file, replace(reading, stream=False))
    from masrel.analysis._file_estimates import check_order

    check_order(ratings, "a latent-trait model")
    from masrel.tables._first_screen import what_was_read

    read = tuple(what_was_read(ratings))
    part = _part(ratings, file, only)
    # imported here: they load slowly, and a call that is refused needs none of them
    import numpy as np
    import pandas as pd

    from masrel.agreement import code_ratings
    from masrel.intervals import latent_trait
    from masrel.pages._answer_page import latent_page
    from masrel.plots._drawn_values import Drawn
    from masrel.tables._latent_trait import latent_document, latent_table
    from masrel.tables._tables import SIMULATED

    grades, simulated = ratings.scale.grades, ratings.simulated
    cells = np.array([*grades, None], dtype=object)[code_ratings(part.ratings).codes]
    table = pd.DataFrame(
        cells, index=part.items or None, columns=part.raters, dtype=object
    )
    with progress("sampling", " steps", is_quiet=output.quiet) as report:
        result = latent_trait(
            table,
            items=items,
            categories=list(grades),
            level=level,
            compare=not one_prior,
            progress=report,
            rng=seed,
        )
    shown = latent_table(
        result, read=read, data="simulated" if simulated else "foreign"
    )
    write_output(
        output,
        document=lambda: latent_document(result),
        text=lambda: shown,
        figure=lambda: Drawn(
            "masrel.plots._latent_scale:latent_picture", (result, grades)
        ),
        html=lambda: latent_page(ratings, result, shown, call=call_text()),
        stamp=SIMULATED if simulated else "",
        notes=read,
    )
    echo_notes([f"warning: {text}" for text in ratings.warnings])


def _part(ratings: "RatingsFile", file: Path, session: str | None) -> "RatingsPart":
    parts = {str(part.session): part for part in ratings.parts}
    if session is None and len(parts) == 1:
        return ratings.parts[0]
    known = ", ".join(parts)
    needed = f"{file}: has {len(parts)} sessions ({known}); choose one with --only"
    absent = f"{file}: --only: holds no session {session}, but {known}"
    refuse(
        (session is None, needed), (session not in parts, absent), error=RatingsError
    )
    return parts[str(session)]
