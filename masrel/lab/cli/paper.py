"""``masrel paper``: sheets to print, and those that were filled in, into logs."""

from pathlib import Path

import click

from masrel.cli._commands import Commands
from masrel.cli._paths import InputFile
from masrel.lab.cli._study_options import (
    id_option,
    of_study,
    session_option,
    several,
    warnings_as_notes,
)
from masrel.lab.paper._entry import compare_sheet, enter_sheet
from masrel.lab.paper._printing import write_sheets
from masrel.lab.protocol import Protocol, StudyPaths
from masrel.lab.run._state import NO_DEVICE, SheetDifference


@click.group("paper", cls=Commands)
def paper() -> None:
    """Print sheets for grading on paper, and enter completed sheets."""


@paper.command("print")
@of_study
@click.option("--rater", "raters", multiple=True, help="Id of a rater; default: all.")
@click.option(
    "--session", "sessions", multiple=True, help="Id of a session; default: all."
)
@click.option("--site", "sites", multiple=True, help="Id of a site; default: all.")
def _print(
    paths: StudyPaths,
    protocol: Protocol,
    raters: tuple[str, ...],
    sessions: tuple[str, ...],
    sites: tuple[str, ...],
) -> None:
    """Make printable sheets of drawn schedules, and files to type them into.

    The sheets are one page to open in a browser and print. They show codes but not
    models. Type each completed sheet into its file, then run masrel paper enter. A file
    that already has entries is not changed.
    """
    made = write_sheets(paths, protocol, raters=raters, sessions=sessions, sites=sites)
    n_typed, n_kept = len(made.typed), len(made.unchanged)
    note = f", {n_kept} of them filled in and kept" if n_kept else ""
    click.echo(
        f"{made.html}: {n_typed} {'sheet' if n_typed == 1 else 'sheets'} to print. "
        f"Type each into its SESSION_RATER.csv beside it{note}. Next: masrel paper "
        "enter"
    )


_sheet_options = several(
    of_study,
    click.argument("file", type=InputFile(path_type=Path)),
    id_option,
    session_option,
    click.option("--who", required=True, help="Who typed in the sheet."),
)


@paper.command("enter")
@_sheet_options
@click.option(
    "--on",
    metavar="DATE",
    help="Date of the session, as on the sheet.",
)
@click.option("--device", help="Device that presented the models; default: none.")
def _enter(
    paths: StudyPaths,
    protocol: Protocol,
    file: Path,
    rater: str,
    session: str,
    who: str,
    on: str | None,
    device: str | None,
) -> None:
    """Enter a completed paper sheet of STUDY that was typed into FILE.

    The whole sheet is added to the session's log; if any row is wrong, nothing is.
    """
    with warnings_as_notes():
        entered = enter_sheet(
            paths,
            protocol,
            file,
            rater,
            session,
            who=who,
            on=on,
            device=device or NO_DEVICE,
        )
    n_graded = len(entered.grades)
    n_missing = len(entered.presented) - n_graded
    without = f", {n_missing} missing," if n_missing else ""
    click.echo(
        f"session {session} of {rater} is entered: {n_graded} grades from paper"
        f"{without} in {paths.log_file(rater, session)}. Next: masrel ratings"
    )


@paper.command("again")
@_sheet_options
def _again(
    paths: StudyPaths,
    protocol: Protocol,
    file: Path,
    rater: str,
    session: str,
    who: str,
) -> None:
    """Compare FILE, a sheet typed by a second person, with the first entry.

    Nothing is entered. If the two entries differ, the differences are listed and the
    exit code is 1.
    """
    differences = compare_sheet(paths, protocol, file, rater, session, who=who)
    for each in differences:
        click.echo(_in_words(each))
    if differences:
        click.echo(
            "Look at the paper. If the first entry is wrong: masrel record correct "
            "--code CODE --grade GRADE, or masrel record answer --question QUESTION "
            "--answer ANSWER, --who WHO --why TEXT. If the second entry is wrong: "
            "correct FILE and compare it again."
        )
        click.get_current_context().exit(1)
    click.echo(f"session {session} of {rater}: both entries agree")


def _in_words(each: SheetDifference) -> str:
    where = "" if each.code is None else f"code {each.code}: "
    return (
        f"{each.file}: row {each.row}: {where}{each.column}: first {each.first}, "
        f"second {each.second}"
    )
