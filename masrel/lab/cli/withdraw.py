"""``masrel withdraw``: a rater has left the study."""

from pathlib import Path

import click

from masrel.lab.protocol import StudyPaths, read_protocol


@click.command("withdraw")
@click.argument("study", type=click.Path(path_type=Path))
@click.option("--rater", required=True, help="Id of the rater who has left.")
@click.option("--who", required=True, help="Who says so.")
@click.option("--why", required=True, help="For what reason.")
def withdraw(study: Path, rater: str, who: str, why: str) -> None:
    """Record that a rater has left STUDY.

    The rater stays in the protocol, the grades given before stay in the study and are
    counted, and the report says so. No session of the rater goes on.
    """
    from masrel.lab.conduct import record_standing

    paths = StudyPaths(study)
    record_standing(
        paths, read_protocol(paths.protocol), rater, "withdrawn", who=who, why=why
    )
    click.echo(
        f"{rater} is withdrawn; the grades given before are kept: {paths.conduct_file}"
    )
