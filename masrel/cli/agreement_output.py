"""Where ``masrel agree`` puts what it found: the screen, JSON, and a figure."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import click

from masrel.cli.agreement_figure import check_figure, write_figure
from masrel.cli.agreement_rows import Row, Wanted
from masrel.cli.agreement_table import agreement_table
from masrel.cli.folders import check_folders
from masrel.cli.options import grouped
from masrel.cli.output import print_table, tell, write_json
from masrel.errors import ParameterError
from masrel.estimates import as_document

if TYPE_CHECKING:
    from masrel.ratings import Ratings

__all__ = ["NO_INTERVAL", "Output", "output_options", "put"]

NO_INTERVAL = (
    "no interval: say what a new study would draw anew, with --target raters, items "
    "or both"
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Output:
    """What is written and printed."""

    json_file: Path | None  # where JSON goes; "-" is the screen
    figure: Path | None  # where a figure goes
    # csv, latex: in which form the table is printed; as text when neither
    csv: bool
    latex: bool

    def __post_init__(self) -> None:
        forms = {"--json -": self.prints_json, "--csv": self.csv, "--latex": self.latex}
        printed = [name for name, wanted in forms.items() if wanted]
        if len(printed) > 1:
            both = " and ".join(printed)
            raise ParameterError(f"{both} want the same stdout: choose one")
        check_folders(json=self.json_file, figure=self.figure)

    @property
    def prints_json(self) -> bool:
        """Whether JSON, and nothing else, is printed."""
        return self.json_file == Path("-")

    def check(self, wanted: Wanted) -> None:
        """Refuse a figure that cannot be drawn, before anything is computed."""
        if self.figure is not None:
            check_figure(self.figure, wanted.target)


output_options = grouped(
    "output",
    Output,
    click.option(
        "--json",
        "json_file",
        type=click.Path(path_type=Path, allow_dash=True),
        help="Write the estimates here; - prints them, and nothing else, on stdout.",
    ),
    click.option(
        "--figure",
        type=click.Path(path_type=Path, dir_okay=False),
        help="Draw the intervals into this .png, .svg or .pdf; needs --target.",
    ),
    click.option("--csv", "csv", is_flag=True, help="Print every digit as CSV."),
    click.option("--latex", "latex", is_flag=True, help="Print a LaTeX table."),
)
"""The options of output, given to a command as one argument `output`."""


def put(
    output: Output,
    rows: list[Row],
    ratings: "Ratings",
    wanted: Wanted,
    *,
    file: Path,
    by: str | None,
    about: tuple[str, ...],
) -> None:
    """Write and print estimates."""
    if output.json_file is not None:
        _write_json(rows, by, output.json_file)
    if output.prints_json:
        tell(about)
    else:
        data = "simulated" if ratings.simulated else "foreign"
        table = agreement_table(rows, file, by, wanted, about, data)
        print_table(table, csv=output.csv, latex=output.latex)
    if wanted.target is None:
        click.echo(NO_INTERVAL, err=True)
    elif output.figure is not None:
        write_figure(rows, ratings, by, wanted.target, output.figure)
        click.echo(f"figure: {output.figure}", err=True)


def _write_json(rows: list[Row], by: str | None, file: Path) -> None:
    documents = [
        {**({} if by is None else {by: row.session}), **as_document(row.estimate)}
        for row in rows
    ]
    write_json({"estimates": documents}, file)
