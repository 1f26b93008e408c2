"""``masrel latent``: raters' biases and noises, items and thresholds on one scale."""

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import click

from masrel.cli._options import (
    ColumnOptions,
    OutputOptions,
    column_options,
    output_options,
    scale_notes,
    write_output,
)
from masrel.errors import ParameterError, RatingsError

if TYPE_CHECKING:
    from masrel.intervals import LatentTrait
    from masrel.ratings import Ratings


@click.command("latent")
@click.argument("file", type=click.Path(path_type=Path))
@click.option(
    "--items",
    type=click.Choice(["fixed", "random"]),
    required=True,
    help="Whether kappa is for these items, or for new ones like them.",
)
@column_options
@click.option("--session", help="Which session, if the file holds more than one.")
@click.option("--level", default=0.95, show_default=True, help="Level of intervals.")
@click.option("--seed", default=0, show_default=True, help="Seed of the sampler.")
@click.option(
    "--one-prior",
    is_flag=True,
    help="Leave out the other prior: half the time, and its influence unseen.",
)
@output_options(
    json="Write the result here; - prints it, and nothing else, on stdout.",
    figure="Draw the scale into this .png, .svg or .pdf.",
    csv="Print every digit as CSV.",
    quiet="No progress bar.",
)
def latent(
    file: Path,
    items: Literal["fixed", "random"],
    columns: ColumnOptions,
    session: str | None,
    level: float,
    seed: int,
    one_prior: bool,
    output: OutputOptions,
) -> None:
    """Place the raters and items in FILE on one scale.

    FILE is a CSV table of grades on an ordered scale, as for agree. An ordinal
    latent-trait model gives kappa for new raters, each rater's bias and noise, each
    item's severity, and the thresholds between grades. It takes seconds to minutes.
    """
    output.check_files()
    if seed < 0:
        raise ParameterError(f"--seed: needs at least 0, got {seed}")
    from masrel.ratings import read_ratings

    ratings = read_ratings(file, **asdict(columns))
    notes = _scale_notes(ratings)
    result = _sample(
        ratings,
        _only_session(ratings, file, session),
        items=items,
        level=level,
        seed=seed,
        compare=not one_prior,
        hides_progress=output.hides_progress,
    )
    from masrel.report._latent_trait import (
        latent_document,
        latent_scale,
        latent_table,
    )
    from masrel.report._tables import SIMULATED

    grades, simulated = ratings.scale.grades, ratings.simulated
    write_output(
        output,
        document=lambda: latent_document(result),
        text=lambda: latent_table(
            result,
            caption=f"Latent-trait model of the ratings in {file}",
            notes=notes,
            data="simulated" if simulated else "foreign",
        ),
        figure=lambda: latent_scale(result, grades),
        stamp=SIMULATED if simulated else "",
        notes=notes,
    )


def _scale_notes(ratings: "Ratings") -> tuple[str, ...]:
    # as of agree, but that the model needs an order whatever the weights
    try:
        return scale_notes(ratings, "linear")
    except ParameterError as error:
        raise ParameterError(
            "--categories: the model needs every grade of the scale in order, the "
            f"grades met are text: {', '.join(ratings.scale.grades)}"
        ) from error


def _only_session(ratings: "Ratings", file: Path, session: str | None) -> str:
    sessions = list(dict.fromkeys(ratings.table["session"]))
    if session is None and len(sessions) == 1:
        return str(sessions[0])
    if session in sessions:
        return str(session)
    known = ", ".join(sessions)
    if session is None:
        raise RatingsError(
            f"{file}: holds {len(sessions)} sessions ({known}); --session chooses one"
        )
    raise RatingsError(f"{file}: holds no session {session}, but {known}")


def _sample(
    ratings: "Ratings",
    session: str,
    *,
    items: Literal["fixed", "random"],
    level: float,
    seed: int,
    compare: bool,
    hides_progress: bool | None,
) -> "LatentTrait":
    import pandas as pd
    from tqdm import tqdm

    from masrel.intervals import latent_trait
    from masrel.ratings import rating_matrix

    matrix = rating_matrix(ratings, session=session)
    table = pd.DataFrame(matrix.grades, index=matrix.items, columns=matrix.raters)
    # nothing is shown of a call that is refused at once
    with tqdm(
        desc="sampling", unit=" steps", delay=0.01, disable=hides_progress
    ) as bar:
        return latent_trait(
            table,
            items=items,
            categories=list(ratings.scale.grades),
            level=level,
            compare=compare,
            progress=bar.update,
            rng=seed,
        )
