"""``masrel sheet``: sheets to print for raters who grade on paper."""

from pathlib import Path

import click

from masrel.lab.protocol import StudyPaths, read_protocol


@click.command("sheet")
@click.argument("study", type=click.Path(path_type=Path))
@click.option("--rater", "raters", multiple=True, help="Id of a rater; default: all.")
@click.option(
    "--session", "sessions", multiple=True, help="Id of a session; default: all."
)
@click.option("--site", "sites", multiple=True, help="Id of a site; default: all.")
def sheet(
    study: Path,
    raters: tuple[str, ...],
    sessions: tuple[str, ...],
    sites: tuple[str, ...],
) -> None:
    """Make sheets of drawn schedules to print, and files to type them into.

    The sheets are a page to open in a browser and print. They have codes and no models.
    What was written on one is typed into its file, which masrel enter takes in; a
    file in which something has been typed stays as it is.
    """
    from masrel.lab.paper import write_sheets

    paths = StudyPaths(study)
    protocol = read_protocol(paths.protocol)
    made = write_sheets(paths, protocol, raters=raters, sessions=sessions, sites=sites)
    n_typed, n_kept = len(made.typed), len(made.unchanged)
    note = f", {n_kept} of them filled in and kept" if n_kept else ""
    click.echo(
        f"{made.html}: {n_typed} {'sheet' if n_typed == 1 else 'sheets'} to print. "
        f"Type each into its SESSION_RATER.csv beside it{note}; then: masrel enter"
    )
