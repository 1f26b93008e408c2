"""``masrel schedule``: draw the schedules of a study, once."""

from pathlib import Path

import click

from masrel.protocol import StudyPaths, read_protocol
from masrel.schedule import write_schedules


@click.command("schedule")
@click.argument("study", type=click.Path(path_type=Path))
@click.option(
    "--redraw",
    is_flag=True,
    help="Draw schedules anew that no longer fit the protocol.",
)
def schedule(study: Path, redraw: bool) -> None:
    """Draw each rater's schedule and blinded sheet for every session of STUDY.

    Schedules are drawn once: those that are there stay as they are. When the
    protocol has changed in what it presents, they are refused; --redraw draws them
    anew, but never those of a session that has begun.
    """
    paths = StudyPaths(study)
    protocol = read_protocol(paths.protocol)
    written = set(write_schedules(protocol, paths, redraw=redraw))
    places = [(rater, s.id) for s in protocol.sessions for rater in s.raters]
    n_new = sum(paths.schedule_file(*place) in written for place in places)
    click.echo(
        f"{paths.schedules}: {n_new} drawn, {len(places) - n_new} kept. Give raters "
        "the files that end in _sheet.csv; the others name the models."
    )
