"""``masrel schedule``: draw the schedules of a study, once."""

from pathlib import Path

import click

from masrel.cli._commands import STUDY, Commands
from masrel.cli._options import OutputOptions, output_options, write_output
from masrel.lab.cli._study_options import of_study
from masrel.lab.conduct import allot_schedules
from masrel.lab.protocol import Protocol, StudyPaths
from masrel.lab.report._material import FIGURES
from masrel.lab.report._order_tables import count_tables, order_document, summary_table
from masrel.lab.schedule._secret import copy_for_site, rater_sessions_at, site_of_copy
from masrel.lab.schedule.presentation import is_sealed
from masrel.lab.schedule.sheets import _order_balance
from masrel.plots._drawn_values import Drawn


@click.group("schedule", cls=Commands)
def schedule() -> None:
    """Draw the schedules of a study, show their balance, or copy a study for a site.

    masrel schedule STUDY draws them.
    """


@schedule.command("show")
@of_study
@click.option("--site", help="Only raters of this site.")
@output_options(
    json='Write every count as JSON to this file; "-" writes it to standard output and '
    "prints nothing else.",
    figure="Save heatmaps as .png, .svg or .pdf.",
)
def _show(
    paths: StudyPaths, protocol: Protocol, site: str | None, output: OutputOptions
) -> None:
    """Print how balanced the drawn orders of STUDY are. Not for raters.

    Shows the positions of each model, which model follows which, and runs.
    """
    balances = _order_balance(protocol, paths, site)
    write_output(
        output,
        document=lambda: order_document(balances),
        text=lambda: summary_table(balances),
        figure=lambda: Drawn(FIGURES + "_study_figures:order_pictures", (balances,)),
        stamp="not for raters",
        mode=0o600,
        more=[table for balance in balances for table in count_tables(balance)],
    )


@schedule.command("copy")
@of_study
@click.option("--site", required=True, help="Id of the site.")
@click.option(
    "-o",
    "--output",
    "destination",
    type=click.Path(path_type=Path),
    required=True,
    help="Folder for the copy.",
)
def _copy(paths: StudyPaths, protocol: Protocol, site: str, destination: Path) -> None:
    """Copy STUDY for a site, with only that site's secret."""
    copy_for_site(protocol, paths, site, destination)
    click.echo(f"{destination}: a copy of the study with only the secret of {site}.")


@schedule.command(STUDY)
@of_study
@click.option(
    "--redraw",
    is_flag=True,
    help="Redraw schedules that no longer match the protocol.",
)
@click.option("--site", help="Only raters of this site.")
def _draw(
    paths: StudyPaths, protocol: Protocol, redraw: bool, site: str | None
) -> None:
    """Draw each rater's schedule and blinded sheet for every session of STUDY.

    Schedules are drawn once, and existing schedules are kept. If the protocol has
    changed in what it presents, they are refused; --redraw draws them again, except
    those of sessions that have begun. A site's copy has the schedules of its raters.
    """
    site = site or site_of_copy(paths)
    written = set(allot_schedules(paths, protocol, site=site, redraw=redraw))
    places = rater_sessions_at(protocol, site)
    n_new = sum(paths.schedule_file(*place) in written for place in places)
    others = "are sealed" if is_sealed(paths, protocol) else "name the models"
    click.echo(
        f"{paths.schedules}: {n_new} drawn, {len(places) - n_new} kept. Give raters "
        f"the files that end in _sheet.csv; the others {others}."
    )
