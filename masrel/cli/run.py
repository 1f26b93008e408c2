"""``masrel run``: present a schedule's models and record every grade."""

from pathlib import Path
from typing import TYPE_CHECKING, Literal

import click
from tqdm import tqdm

from masrel.cli._options import OutputOptions, output_options, warnings_as_notes
from masrel.protocol import Protocol, StudyPaths, read_protocol, scale_of

if TYPE_CHECKING:
    from masrel.run import GradeSource


@click.command("run")
@click.argument("study", type=click.Path(path_type=Path))
@click.option("--rater", required=True, help="Id of the rater.")
@click.option("--session", required=True, help="Id of the session.")
@click.option(
    "--grades",
    type=click.Choice(["console", "simulated"]),
    default="console",
    show_default=True,
    help="Who gives the grades.",
)
@click.option(
    "--clock",
    type=click.Choice(["real", "simulated"]),
    help="Clock of the control loop; default: real, for simulated grades simulated.",
)
@output_options(quiet="No progress bar and no closing line.")
@click.option(
    "--rehearse",
    is_flag=True,
    help="Only rehearse: nothing of it enters the ratings of STUDY.",
)
@click.option("--correct", metavar="CODE", help="Correct the grade of this code.")
@click.option(
    "--grade", help="With --correct: what the grade should have been, NA for missing."
)
@click.option(
    "--skip", metavar="CODE", help="Leave this code, after a fault, without a grade."
)
@click.option("--who", help="With --correct and --skip: who says so.")
@click.option("--why", help="With --correct and --skip: for what reason.")
def run(
    study: Path,
    rater: str,
    session: str,
    grades: Literal["console", "simulated"],
    clock: Literal["real", "simulated"] | None,
    output: OutputOptions,
    rehearse: bool,
    correct: str | None,
    grade: str | None,
    skip: str | None,
    who: str | None,
    why: str | None,
) -> None:
    """Run one rater's session of STUDY, or go on with it where it stopped.

    The rater is shown blinded codes only. With --rehearse the order and the codes are
    other ones, and log and recordings are kept in STUDY/rehearsals. With --correct or
    --skip no model is presented: what is said is added to the session's log, where the
    first grade stays.
    """
    paths = StudyPaths(study)
    protocol = read_protocol(paths.protocol)
    options = {"--grade": grade, "--who": who, "--why": why}
    if correct is None and skip is None:
        _refuse_strays(options)
        flags = {"rehearse": rehearse, "quiet": output.quiet}
        _run(paths, protocol, rater, session, grades, clock, **flags)
        return
    if rehearse:
        verb = "--skip" if correct is None else "--correct"
        raise click.UsageError(f"--rehearse presents models, and {verb} none")
    if correct is not None and skip is not None:
        raise click.UsageError("--correct and --skip are said one at a time")
    message = (
        _correct(paths, protocol, rater, session, correct, grade, who, why)
        if correct is not None
        else _skip(paths, rater, session, str(skip), grade, who, why)
    )
    if not output.quiet:
        click.echo(f"{message} {paths.log_file(rater, session)}. Then: masrel ratings")


def _correct(
    paths: StudyPaths,
    protocol: Protocol,
    rater: str,
    session: str,
    code: str,
    grade: str | None,
    who: str | None,
    why: str | None,
) -> str:
    from masrel.run import record_correction

    if grade is None or who is None or why is None:
        raise click.UsageError("--correct needs --grade, --who and --why too")
    corrected = None if grade == "NA" else grade  # no scale has such a grade
    record_correction(
        paths, protocol, rater, session, code=code, grade=corrected, who=who, why=why
    )
    what = "missing" if corrected is None else grade
    now = f"{code} of {rater}, session {session}, is now {what}"
    return f"{now}; what it was before stays in"


def _skip(
    paths: StudyPaths,
    rater: str,
    session: str,
    code: str,
    grade: str | None,
    who: str | None,
    why: str | None,
) -> str:
    from masrel.run import record_skip

    if grade is not None:
        raise click.UsageError("--grade needs --correct CODE, not --skip")
    if who is None or why is None:
        raise click.UsageError("--skip needs --who and --why too")
    record_skip(paths, rater, session, code=code, who=who, why=why)
    return f"{code} of {rater}, session {session}, is skipped, as is said in"


def _refuse_strays(options: dict[str, str | None]) -> None:
    strays = [name for name, value in options.items() if value is not None]
    if strays:
        raise click.UsageError(f"{', '.join(strays)} needs --correct CODE too")


def _run(
    paths: StudyPaths,
    protocol: Protocol,
    rater: str,
    session: str,
    grades: Literal["console", "simulated"],
    clock: Literal["real", "simulated"] | None,
    *,
    rehearse: bool,
    quiet: bool,
) -> None:
    from masrel.run import run_session

    n_presentations = len(protocol.models) * protocol.schedule.repeats
    # A person's prompts count the presentations themselves.
    hidden = quiet or grades == "console"
    if rehearse and not quiet:
        click.echo("REHEARSAL: nothing of it enters the ratings of the study", err=True)
    with (
        warnings_as_notes(),
        tqdm(total=n_presentations, unit="", desc=rater, disable=hidden or None) as bar,
    ):
        done = run_session(
            paths,
            protocol,
            rater,
            session,
            grades=_source(grades, protocol),
            clock=clock or ("simulated" if grades == "simulated" else "real"),
            rehearsal=rehearse,
            progress=lambda _: bar.update(),
        )
    if not quiet:
        what = "simulated" if grades == "simulated" else "simulated device"
        label = f" ({what})" if done.simulated else ""
        n_missing = done.n_presentations - done.n_graded
        without = f", {n_missing} missing," if n_missing else ""
        what = "the rehearsal of session" if done.rehearsal else "session"
        click.echo(
            f"{what} {done.session} of {done.rater} is complete: "
            f"{done.n_graded} grades{label}{without} in {done.log_file}"
            + ("; none is a rating of the study" if done.rehearsal else "")
        )


def _source(
    grades: Literal["console", "simulated"], protocol: Protocol
) -> "GradeSource":
    from masrel.run import ConsoleGrades, SimulatedGrades

    if grades == "console":
        return ConsoleGrades(scale_of(protocol))
    return SimulatedGrades(protocol)
