"""Where ``masrel latent`` puts what it found: the screen, JSON, and a figure."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import click

from masrel.cli.folders import check_folders
from masrel.cli.latent_table import latent_document, latent_table
from masrel.cli.options import grouped
from masrel.cli.output import figure_form, print_table, tell, write_json
from masrel.errors import ParameterError

if TYPE_CHECKING:
    from masrel.intervals import LatentTrait, Quantity
    from masrel.ratings import Ratings
    from masrel.report.figures import ScaleRow

__all__ = ["Output", "output_options", "put"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Output:
    """What is written and printed."""

    json_file: Path | None  # where JSON goes; "-" is the screen
    figure: Path | None  # where a figure goes
    csv: bool  # whether the table is printed as CSV

    def __post_init__(self) -> None:
        if self.csv and self.prints_json:
            raise ParameterError("--json - and --csv want the same stdout: choose one")
        if self.figure is not None:
            figure_form(self.figure)
        check_folders(json=self.json_file, figure=self.figure)

    @property
    def prints_json(self) -> bool:
        """Whether JSON, and nothing else, is printed."""
        return self.json_file == Path("-")


output_options = grouped(
    "output",
    Output,
    click.option(
        "--json",
        "json_file",
        type=click.Path(path_type=Path, allow_dash=True),
        help="Write the result here; - prints it, and nothing else, on stdout.",
    ),
    click.option(
        "--figure",
        type=click.Path(path_type=Path, dir_okay=False),
        help="Draw the scale into this .png, .svg or .pdf.",
    ),
    click.option("--csv", "csv", is_flag=True, help="Print every digit as CSV."),
)
"""The options of output, given to a command as one argument `output`."""


def put(
    output: Output,
    found: "LatentTrait",
    ratings: "Ratings",
    *,
    file: Path,
    about: tuple[str, ...],
) -> None:
    """Write and print a result."""
    if output.json_file is not None:
        write_json(latent_document(found), output.json_file)
    if output.prints_json:
        tell(about)
    else:
        data = "simulated" if ratings.simulated else "foreign"
        print_table(latent_table(found, file, about, data), csv=output.csv)
    if output.figure is not None:
        _draw(found, ratings, output.figure)
        click.echo(f"figure: {output.figure}", err=True)


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
            form=figure_form(file),
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
