"""``masrel unblind``: say which model a code stands for, and record who asked."""

from pathlib import Path

import click

from masrel.lab.protocol import StudyPaths, read_protocol


@click.command("unblind")
@click.argument("study", type=click.Path(path_type=Path))
@click.argument("code", required=False)
@click.option("--all", "every", is_flag=True, help="All codes of all schedules.")
@click.option("--rater", help="Of this rater alone.")
@click.option("--session", help="Of this session alone.")
@click.option("--who", required=True, help="Who is to know.")
@click.option("--why", required=True, help="For what reason.")
def unblind(
    study: Path,
    code: str | None,
    every: bool,
    rater: str | None,
    session: str | None,
    who: str,
    why: str,
) -> None:
    """Print which model CODE of STUDY stands for, once it is recorded who asked.

    It is an event of STUDY/conduct.jsonl, and the report says so.
    """
    from masrel.lab.conduct import record_unblinding

    if (code is None) != every:
        raise click.UsageError("needs either a CODE or --all")
    paths = StudyPaths(study)
    revealed = record_unblinding(
        paths,
        read_protocol(paths.protocol),
        code,
        who=who,
        why=why,
        rater=rater,
        session=session,
    )
    for schedule, shown in revealed:
        click.echo(
            f"{shown.code} of {schedule.rater}, session {schedule.session}, is "
            f"{shown.model} (presentation {shown.position}, repeat {shown.repeat})"
        )
