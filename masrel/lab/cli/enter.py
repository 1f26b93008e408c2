"""``masrel enter``: sheets that were filled in on paper, into session logs."""

from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING

import click

from masrel.cli._paths import InputFile
from masrel.lab.cli._study_options import warnings_as_notes
from masrel.lab.protocol import Protocol, StudyPaths, read_protocol

if TYPE_CHECKING:
    from masrel.lab.paper import SheetDifference


@click.command("enter")
@click.argument("study", type=click.Path(path_type=Path))
@click.argument("file", type=InputFile(path_type=Path))
@click.option("--rater", required=True, help="Id of the rater who filled it in.")
@click.option("--session", required=True, help="Id of the session.")
@click.option("--who", required=True, help="Who typed it.")
@click.option(
    "--on",
    type=click.DateTime(["%Y-%m-%d"]),
    help="Day of the session, as on the sheet.",
)
@click.option("--device", help="What presented the models; default: none.")
@click.option(
    "--second",
    is_flag=True,
    help="Compare FILE, typed by somebody else, with what was entered first.",
)
@click.pass_context
def enter(
    context: click.Context,
    study: Path,
    file: Path,
    rater: str,
    session: str,
    who: str,
    on: datetime | None,
    device: str | None,
    second: bool,
) -> None:
    """Enter a sheet of STUDY that was filled in on paper and typed into FILE.

    All of it enters the session's log, or nothing where a row is wrong. With --second
    nothing is entered: where the two entries differ is listed, and the exit code is 1.
    """
    from masrel.lab.paper import enter_sheet
    from masrel.lab.paper._entry import NO_DEVICE

    paths = StudyPaths(study)
    protocol = read_protocol(paths.protocol)
    if second:
        if on is not None or device is not None:
            raise click.UsageError("--on and --device are said with the first entry")
        context.exit(_compare(paths, protocol, file, rater, session, who))
    with warnings_as_notes():
        entered = enter_sheet(
            paths,
            protocol,
            file,
            rater,
            session,
            who=who,
            on=None if on is None else on.date(),
            device=device or NO_DEVICE,
        )
    n_missing = entered.n_presentations - entered.n_graded
    without = f", {n_missing} missing," if n_missing else ""
    click.echo(
        f"session {session} of {rater} is entered: {entered.n_graded} grades from "
        f"paper{without} in {entered.log_file}. Then: masrel ratings"
    )


def _compare(
    paths: StudyPaths,
    protocol: Protocol,
    file: Path,
    rater: str,
    session: str,
    who: str,
) -> int:
    # -> exit code
    from masrel.lab.paper import compare_sheet

    differences = compare_sheet(paths, protocol, file, rater, session, who=who)
    for each in differences:
        click.echo(_in_words(each))
    if differences:
        click.echo(
            "Look at the paper. Where the first entry is wrong: masrel run --correct "
            "CODE --grade GRADE, or --question QUESTION --answer ANSWER, --who WHO "
            "--why TEXT; where the second is: mend FILE and compare it again"
        )
        return 1
    click.echo(f"session {session} of {rater}: both entries agree")
    return 0


def _in_words(each: "SheetDifference") -> str:
    where = "" if each.code is None else f"code {each.code}: "
    return (
        f"{each.file}: row {each.row}: {where}{each.column}: first {each.first}, "
        f"second {each.second}"
    )
