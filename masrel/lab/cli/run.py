"""``masrel run``: present a schedule's models and record every grade."""

from typing import Literal

import click
from tqdm import tqdm

from masrel.cli._options import OutputOptions, output_options
from masrel.lab.cli._study_options import (
    clock_option,
    grades_option,
    grading,
    id_option,
    of_study,
    session_option,
    warnings_as_notes,
)
from masrel.lab.protocol import Protocol, StudyPaths
from masrel.lab.run._simulated_raters import SimulatedGrades
from masrel.lab.run.session import SessionSummary, run_session


@click.command("run")
@of_study
@id_option
@session_option
@grades_option(
    *("console", "paper", "simulated"),
    words="Source of the grades. With paper, models are presented by their codes and a "
    "completed sheet is entered afterwards.",
)
@clock_option
@output_options(quiet="Show neither a progress bar nor a closing line.")
@click.option(
    "--rehearse",
    is_flag=True,
    help="Rehearse only; no grade becomes a rating of STUDY.",
)
def run(
    paths: StudyPaths,
    protocol: Protocol,
    rater: str,
    session: str,
    grades: Literal["console", "paper", "simulated"],
    clock: Literal["real", "simulated"] | None,
    output: OutputOptions,
    rehearse: bool,
) -> None:
    """Run a session for one rater, or resume it where it stopped.

    The rater sees only blinded codes. A rehearsal (--rehearse) has a different order
    and different codes; its log and recordings are kept in STUDY/rehearsals.
    """
    n_presentations = len(protocol.models) * protocol.schedule.repeats
    # A person's prompts count the presentations themselves.
    hidden = output.quiet or grades != "simulated"
    if rehearse and not output.quiet:
        click.echo("REHEARSAL: no grade becomes a rating of the study", err=True)
    with (
        warnings_as_notes(),
        tqdm(total=n_presentations, unit="", desc=rater, disable=hidden or None) as bar,
    ):
        done = run_session(
            paths,
            protocol,
            rater,
            session,
            **grading(protocol, grades, clock, SimulatedGrades),
            rehearsal=rehearse,
            progress=lambda _: bar.update(),
        )
    if not output.quiet and grades == "paper":
        typed = paths.typed_file(rater, session)
        click.echo(
            f"session {session} of {rater} has been presented. Next: masrel paper "
            f"enter {paths.root} {typed if typed.exists() else 'FILE'} --rater {rater} "
            f"--session {session} --who WHO"
        )
    elif not output.quiet:
        click.echo(_completed(done, grades))


def _completed(done: SessionSummary, grades: str) -> str:
    made = "simulated" if grades == "simulated" else "simulated device"
    label = f" ({made})" if done.simulated else ""
    n_missing = done.n_presentations - done.n_graded
    without = f", {n_missing} missing," if n_missing else ""
    what = "the rehearsal of session" if done.rehearsal else "session"
    text = (
        f"{what} {done.session} of {done.rater} is complete: "
        f"{done.n_graded} grades{label}{without} in {done.log_file}"
    )
    if done.rehearsal:
        text += "; none of them is a rating of the study"
    if done.n_set_aside:
        text += f"; {done.n_set_aside} earlier grades no longer count"
    return text
