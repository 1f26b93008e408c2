"""``masrel schedule``: draw the schedules of a study, once."""

from pathlib import Path

import click

from masrel.cli._options import OutputOptions, output_options, write_output
from masrel.errors import ParameterError
from masrel.lab.protocol import Protocol, StudyPaths, read_protocol


@click.command("schedule")
@click.argument("study", type=click.Path(path_type=Path))
@click.option(
    "--redraw",
    is_flag=True,
    help="Draw schedules anew that no longer fit the protocol.",
)
@click.option("--site", help="Of the raters of this site alone.")
@click.option(
    "--copy-to",
    "destination",
    type=click.Path(path_type=Path),
    help="With --site: draw nothing, but make this folder a copy of the study for the "
    "site, with the site's secret alone.",
)
@click.option(
    "--show",
    is_flag=True,
    help="Draw nothing, but print how even the drawn orders are: places by model, what "
    "follows what, runs. Not for raters.",
)
@output_options(
    json="With --show: write every count as JSON here; - prints it, and nothing else.",
    figure="With --show: heatmaps as .png, .svg or .pdf.",
)
def schedule(
    study: Path,
    redraw: bool,
    site: str | None,
    destination: Path | None,
    show: bool,
    output: OutputOptions,
) -> None:
    """Draw each rater's schedule and blinded sheet for every session of STUDY.

    Schedules are drawn once: those that are there stay as they are. When the
    protocol has changed in what it presents, they are refused; --redraw draws them
    anew, but never those of a session that has begun. In a copy that --copy-to made
    for a site, they are those of its raters.
    """
    paths = StudyPaths(study)
    protocol = read_protocol(paths.protocol)
    _check_options(redraw, destination, show=show, output=output)
    if show:
        _show(paths, protocol, site, output)
    elif destination is not None:
        _copy(paths, protocol, site, destination)
    else:
        _draw(paths, protocol, site, redraw=redraw)


def _check_options(
    redraw: bool, destination: Path | None, *, show: bool, output: OutputOptions
) -> None:
    for option, file in (("--json", output.json_file), ("--figure", output.figure)):
        if file is not None and not show:
            raise ParameterError(f"{option}: needs --show, got it alone")
    for option, is_chosen in (("--redraw", redraw), ("--copy-to", destination)):
        if show and is_chosen:
            raise ParameterError(f"--show: draws nothing, so needs no {option}")


def _show(
    study: StudyPaths, protocol: Protocol, site: str | None, output: OutputOptions
) -> None:
    from masrel.lab.report._figure_data import FIGURES
    from masrel.lab.report._order_tables import (
        count_tables,
        order_document,
        summary_table,
    )
    from masrel.lab.schedule._balance import order_balance
    from masrel.plots._drawn_values import Drawn

    balances = order_balance(protocol, study, site)
    write_output(
        output,
        document=lambda: order_document(balances),
        text=lambda: summary_table(balances),
        figure=lambda: Drawn(FIGURES + "_order_figure:order_pictures", (balances,)),
        stamp="not for raters",
        more=[table for balance in balances for table in count_tables(balance)],
    )


def _copy(
    study: StudyPaths, protocol: Protocol, site: str | None, destination: Path
) -> None:
    from masrel.lab.schedule import copy_for_site

    if site is None:
        raise ParameterError("--copy-to: needs --site, got it alone")
    copy_for_site(protocol, study, site, destination)
    click.echo(f"{destination}: a copy of the study with the secret of {site} alone.")


def _draw(
    paths: StudyPaths, protocol: Protocol, site: str | None, *, redraw: bool
) -> None:
    from masrel.lab.conduct import allot_schedules
    from masrel.lab.schedule import site_of_copy
    from masrel.lab.schedule._secret import site_of

    site = site or site_of_copy(paths)
    written = set(allot_schedules(paths, protocol, site=site, redraw=redraw))
    places = [
        (rater, session.id)
        for session in protocol.sessions
        for rater in session.raters
        if site in (None, site_of(protocol, rater))
    ]
    n_new = sum(paths.schedule_file(*place) in written for place in places)
    click.echo(
        f"{paths.schedules}: {n_new} drawn, {len(places) - n_new} kept. Give raters "
        "the files that end in _sheet.csv; the others name the models."
    )
