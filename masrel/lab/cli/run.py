"""``masrel run``: present a schedule's models and record every grade."""

from pathlib import Path
from typing import TYPE_CHECKING, Literal, TypedDict

import click
from tqdm import tqdm

from masrel.cli._options import OutputOptions, output_options
from masrel.lab.cli._study_options import warnings_as_notes
from masrel.lab.protocol import Protocol, StudyPaths, read_protocol, scale_of

if TYPE_CHECKING:
    from masrel.lab.run import GradeSource, SessionSummary


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
@click.option(
    "--question",
    metavar="QUESTION",
    help="Correct the answer to this question, named as QUESTIONNAIRE.QUESTION.",
)
@click.option(
    "--answer",
    help="With --question: what the answer should have been, NA for missing.",
)
@click.option("--code", help="With --question: which presentation it is about.")
@click.option("--who", help="With --correct, --skip and --question: who says so.")
@click.option("--why", help="With --correct, --skip and --question: why.")
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
    question: str | None,
    answer: str | None,
    code: str | None,
    who: str | None,
    why: str | None,
) -> None:
    """Run one rater's session of STUDY, or go on with it where it stopped.

    The rater is shown blinded codes only. With --rehearse the order and the codes are
    other ones, and log and recordings are kept in STUDY/rehearsals. With --correct,
    --skip or --question no model is presented: what is said is added to the session's
    log, where the first grade and answer stay.
    """
    paths = StudyPaths(study)
    protocol = read_protocol(paths.protocol)
    acts = {"--correct": correct, "--skip": skip, "--question": question}
    chosen = [act for act, value in acts.items() if value is not None]
    options = {"--grade": grade, "--answer": answer, "--code": code}
    if len(chosen) > 1:
        raise click.UsageError(f"{' and '.join(chosen)} are said one at a time")
    if rehearse and chosen:
        raise click.UsageError(f"--rehearse presents models, and {chosen[0]} none")
    _check_options({**options, "--who": who, "--why": why}, *chosen)
    if not chosen:
        flags = {"rehearse": rehearse, "quiet": output.quiet}
        _run(paths, protocol, rater, session, grades, clock, **flags)
        return
    reasons = _Reasons(who=str(who), why=str(why))
    if correct is not None:
        message = _correct(
            paths, protocol, rater, session, correct, str(grade), reasons
        )
    elif skip is not None:
        message = _skip(paths, rater, session, skip, reasons)
    else:
        message = _correct_answer(
            paths, protocol, rater, session, str(question), str(answer), code, reasons
        )
    if not output.quiet:
        click.echo(f"{message}. Then: masrel ratings")


class _Reasons(TypedDict):
    who: str
    why: str


# What corrects or skips, with the options that it needs and those that it may have.
_ACTS = {
    "--correct": (("--grade", "--who", "--why"), ()),
    "--skip": (("--who", "--why"), ()),
    "--question": (("--answer", "--who", "--why"), ("--code",)),
}


def _check_options(options: dict[str, str | None], chosen: str = "") -> None:
    needed, possible = _ACTS.get(chosen, ((), ()))
    for name, value in options.items():
        if value is not None and name not in (*needed, *possible):
            act = next(act for act, names in _ACTS.items() if name in sum(names, ()))
            of = "QUESTION" if act == "--question" else "CODE"
            but = f", not {chosen}" if chosen else " too"
            raise click.UsageError(f"{name} needs {act} {of}{but}")
    if any(options[name] is None for name in needed):
        *first, last = needed
        raise click.UsageError(f"{chosen} needs {', '.join(first)} and {last} too")


def _correct(
    paths: StudyPaths,
    protocol: Protocol,
    rater: str,
    session: str,
    code: str,
    grade: str,
    reasons: _Reasons,
) -> str:
    from masrel.lab.run import record_correction

    corrected = None if grade == "NA" else grade  # no scale has such a grade
    record_correction(
        paths, protocol, rater, session, code=code, grade=corrected, **reasons
    )
    what = "missing" if corrected is None else grade
    now = f"{code} of {rater}, session {session}, is now {what}"
    return f"{now}; what it was before stays in {paths.log_file(rater, session)}"


def _skip(
    paths: StudyPaths, rater: str, session: str, code: str, reasons: _Reasons
) -> str:
    from masrel.lab.run import record_skip

    record_skip(paths, rater, session, code=code, **reasons)
    log = paths.log_file(rater, session)
    return f"{code} of {rater}, session {session}, is skipped, as is said in {log}"


def _correct_answer(
    paths: StudyPaths,
    protocol: Protocol,
    rater: str,
    session: str,
    question: str,
    answer: str,
    code: str | None,
    reasons: _Reasons,
) -> str:
    from masrel.lab.run import record_answer

    log = record_answer(
        paths,
        protocol,
        rater,
        session,
        question=question,
        answer=None if answer == "NA" else answer,
        code=code,
        **reasons,
    )
    what = "missing" if answer == "NA" else answer
    of = f"{question} of {code}" if code is not None else question
    now = f"the answer of {rater} to {of} is now {what}"
    return f"{now}; what it was before stays in {log}"


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
    from masrel.lab.run import run_session

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
        click.echo(_completed(done, grades))


def _completed(done: "SessionSummary", grades: Literal["console", "simulated"]) -> str:
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
        text += "; none is a rating of the study"
    if done.n_set_aside:
        text += f"; {done.n_set_aside} from before count no more"
    return text


def _source(
    grades: Literal["console", "simulated"], protocol: Protocol
) -> "GradeSource":
    from masrel.lab.run import ConsoleGrades, SimulatedGrades

    if grades == "console":
        return ConsoleGrades(scale_of(protocol))
    return SimulatedGrades(protocol)
