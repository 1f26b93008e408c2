"""``masrel latent``: raters' biases and noises, items and thresholds on one scale."""

import json
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import click

from masrel.cli.agreement_rows import scale_notes
from masrel.cli.folders import check_folders
from masrel.cli.latent_table import latent_document, latent_table
from masrel.errors import ParameterError, RatingsError

if TYPE_CHECKING:
    from masrel.intervals.latent.result import LatentTrait
    from masrel.intervals.quantity import Quantity
    from masrel.ratings import Ratings
    from masrel.report.figures import Form, ScaleRow
    from masrel.report.tables import Table

__all__ = ["command"]

_FORMS: dict[str, "Form"] = {".png": "png", ".svg": "svg", ".pdf": "pdf"}


@click.command("latent")
@click.argument("file", type=click.Path(path_type=Path))
@click.option(
    "--items",
    type=click.Choice(["fixed", "random"]),
    required=True,
    help="Whether kappa speaks of these items, or of new ones like them.",
)
@click.option("--item", help="Column of the rated items (long format).")
@click.option("--rater", help="Column of the raters (long format).")
@click.option("--grade", help="Column of the grades (long format).")
@click.option(
    "--categories", help="Every grade of the scale in order, such as 0,1,1+,2,3,4."
)
@click.option("--session", help="Which session, if the file holds more than one.")
@click.option("--level", default=0.95, show_default=True, help="Level of intervals.")
@click.option("--seed", default=0, show_default=True, help="Seed of the sampler.")
@click.option(
    "--one-prior",
    is_flag=True,
    help="Leave out the other prior: half the time, and its influence unseen.",
)
@click.option(
    "--json",
    "json_file",
    type=click.Path(path_type=Path, allow_dash=True),
    help="Write the result here; - prints it, and nothing else, on stdout.",
)
@click.option(
    "--figure",
    type=click.Path(path_type=Path, dir_okay=False),
    help="Draw the scale into this .png, .svg or .pdf.",
)
@click.option("--csv", "csv", is_flag=True, help="Print every digit as CSV.")
@click.option("--quiet", is_flag=True, help="No progress bar.")
def command(
    file: Path,
    items: Literal["fixed", "random"],
    item: str | None,
    rater: str | None,
    grade: str | None,
    categories: str | None,
    session: str | None,
    level: float,
    seed: int,
    one_prior: bool,
    json_file: Path | None,
    figure: Path | None,
    csv: bool,
    quiet: bool,
) -> None:
    """Place the raters and items in FILE on one scale.

    FILE is a CSV table of grades on an ordered scale, as for agree. An ordinal
    latent-trait model gives kappa for new raters, each rater's bias and noise, each
    item's severity, and the thresholds between grades. It takes seconds to minutes.
    """
    if csv and json_file == Path("-"):
        raise ParameterError("--json - and --csv want the same stdout: choose one")
    if figure is not None and figure.suffix.lower() not in _FORMS:
        raise ParameterError(
            f"--figure: needs a name that ends in .png, .svg or .pdf, got {figure}"
        )
    if seed < 0:
        raise ParameterError(f"--seed: needs at least 0, got {seed}")
    check_folders(json=json_file, figure=figure)
    from masrel.ratings import read_ratings

    ratings = read_ratings(
        file,
        item=item,
        rater=rater,
        grade=grade,
        categories=None if categories is None else _listed(categories),
    )
    about = _about(ratings)
    found = _sample(
        ratings,
        _only_session(ratings, file, session),
        items=items,
        level=level,
        seed=seed,
        compare=not one_prior,
        quiet=quiet,
    )
    if json_file is not None:
        _write_json(found, json_file)
    if json_file == Path("-"):
        _tell(about)
    else:
        data = "simulated" if ratings.simulated else "foreign"
        _print(latent_table(found, file, about, data), csv=csv)
    if figure is not None:
        _draw(found, ratings, figure)
        click.echo(f"figure: {figure}", err=True)


def _listed(text: str) -> list[str]:
    return [part.strip() for part in text.split(",")]


def _about(ratings: "Ratings") -> tuple[str, ...]:
    # which scale was taken, where none was declared
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
    held = ", ".join(sessions)
    if session is None:
        raise RatingsError(
            f"{file}: holds {len(sessions)} sessions ({held}); --session chooses one"
        )
    raise RatingsError(f"{file}: holds no session {session}, but {held}")


def _sample(
    ratings: "Ratings",
    session: str,
    *,
    items: Literal["fixed", "random"],
    level: float,
    seed: int,
    compare: bool,
    quiet: bool,
) -> "LatentTrait":
    import pandas as pd
    from tqdm import tqdm

    from masrel.intervals import latent_trait
    from masrel.ratings import rating_matrix

    matrix = rating_matrix(ratings, session=session)
    table = pd.DataFrame(matrix.grades, index=matrix.items, columns=matrix.raters)
    # nothing is shown of a call that is refused at once
    with tqdm(desc="sampling", unit=" steps", delay=0.01, disable=quiet) as bar:
        return latent_trait(
            table,
            items=items,
            categories=list(ratings.scale.grades),
            level=level,
            compare=compare,
            progress=bar.update,
            rng=seed,
        )


def _write_json(found: "LatentTrait", file: Path) -> None:
    text = json.dumps(
        latent_document(found), indent=1, ensure_ascii=False, allow_nan=False
    )
    if file == Path("-"):
        click.echo(text)
    else:
        file.write_text(text + "\n", encoding="utf-8", newline="\n")


def _print(table: "Table", *, csv: bool) -> None:
    from masrel.report.tables import as_csv, as_text

    click.echo((as_csv if csv else as_text)(table).rstrip("\n"))
    if csv:  # which has no place for notes
        _tell(table.notes)


def _tell(notes: tuple[str, ...]) -> None:
    click.echo("".join(f"{note}\n" for note in notes), err=True, nl=False)


def _draw(found: "LatentTrait", ratings: "Ratings", file: Path) -> None:
    # Imported here: a table loads nothing that draws.
    from masrel.report.figures import LatentScale, latent_file

    scale = LatentScale(
        items=tuple(map(_row, found.items)),
        thresholds=tuple(map(_row, found.thresholds)),
        raters=tuple(
            _row(bias, noise.value)
            for bias, noise in zip(found.raters, found.noises, strict=True)
        ),
        grades=ratings.scale.grades,
        level=found.items[0].interval.level,
    )
    file.write_bytes(
        latent_file(
            scale,
            stamp="SIMULATED DATA" if ratings.simulated else "",
            form=_FORMS[file.suffix.lower()],
        )
    )


def _row(of: "Quantity", noise: float | None = None) -> "ScaleRow":
    from masrel.report.figures import ScaleRow

    return ScaleRow(
        label=of.name,
        value=of.value,
        low=of.interval.low,
        high=of.interval.high,
        noise=noise,
    )
