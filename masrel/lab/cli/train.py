"""``masrel train``: teach a rater on models of known grade, until a test is passed."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import click

from masrel._files import write_file
from masrel.cli._options import OutputOptions, output_options, write_output
from masrel.cli._paths import OutputFile
from masrel.lab.cli._study_options import warnings_as_notes
from masrel.lab.protocol import Protocol, StudyPaths, read_protocol, scale_of

if TYPE_CHECKING:
    from masrel.lab.run import GradeSource
    from masrel.lab.training import Lesson, TrainingRecord

_WIDTH = 88  # of notes below a table


@click.command("train")
@click.argument("study", type=click.Path(path_type=Path))
@click.option("--rater", required=True, help="Id of the rater.")
@click.option(
    "--grades",
    type=click.Choice(["console", "simulated"]),
    help="Who gives the grades; default: console.",
)
@click.option(
    "--clock",
    type=click.Choice(["real", "simulated"]),
    help="Clock of the control loop; default: real, for simulated grades simulated.",
)
@click.option(
    "--report", is_flag=True, help="Present nothing: show the training so far."
)
@click.option(
    "--level",
    type=float,
    help="With --report: level of the intervals; default: 0.95.",
)
@click.option(
    "--html",
    "page",
    type=OutputFile(path_type=Path, dir_okay=False),
    help="With --report: write a page with the curve and the tables here.",
)
@output_options(
    json="With --report: write it here; - prints it, and nothing else, on stdout.",
    figure="With --report: draw the learning curve, as .png, .svg or .pdf.",
    csv="With --report: the learning curve as CSV, every digit kept.",
    quiet="No closing line.",
)
def train(
    study: Path,
    rater: str,
    grades: Literal["console", "simulated"] | None,
    clock: Literal["real", "simulated"] | None,
    report: bool,
    level: float | None,
    page: Path | None,
    output: OutputOptions,
) -> None:
    """Train one rater of STUDY, or go on with the training where it stopped.

    Models whose grade is known are presented, and the rater is shown the right grade
    after each; the training is passed once kappa with these grades is high enough, by
    the test that [training] of the protocol sets. Nothing of a training enters the
    ratings of the study.
    """
    paths = StudyPaths(study)
    protocol = read_protocol(paths.protocol)
    if report:
        _refuse("without --report", {"--grades": grades, "--clock": clock})
        level = 0.95 if level is None else level
        record = _report(paths, protocol, rater, level, output)
        if page is not None:
            # Imported here: the tables alone load nothing that draws.
            from masrel.lab.report._training_page import training_page

            write_file(page, training_page(record, protocol, level=level))
        return
    strays = {
        "--level": level,
        "--html": page,
        "--json": output.json_file,
        "--figure": output.figure,
        "--csv": output.csv or None,
    }
    _refuse("with --report", strays)
    _train(paths, protocol, rater, grades or "console", clock, quiet=output.quiet)


def _refuse(where: str, options: Mapping[str, object]) -> None:
    strays = [name for name, value in options.items() if value is not None]
    if strays:
        raise click.UsageError(f"{', '.join(strays)}: needed {where} only")


def _train(
    paths: StudyPaths,
    protocol: Protocol,
    rater: str,
    grades: Literal["console", "simulated"],
    clock: Literal["real", "simulated"] | None,
    *,
    quiet: bool,
) -> None:
    from masrel.lab.report._training_tables import NOT_RATINGS, outcome
    from masrel.lab.training import train_rater

    with warnings_as_notes():
        record = train_rater(
            paths,
            protocol,
            rater,
            grades=_source(grades, protocol),
            clock=clock or ("simulated" if grades == "simulated" else "real"),
            feedback=_show_grade if grades == "console" else None,
        )
    if not quiet:
        label = " (simulated)" if record.simulated else ""
        click.echo(
            f"training of {rater}: {outcome(record)}{label}; log: "
            f"{paths.training_log_file(rater)}\n{NOT_RATINGS}"
        )


def _show_grade(lesson: "Lesson") -> None:
    if lesson.grade == lesson.intended:
        click.echo(f"Right: {lesson.intended}.\n")
    else:
        click.echo(f"Not {lesson.grade}: it is {lesson.intended}.\n")


def _source(
    grades: Literal["console", "simulated"], protocol: Protocol
) -> "GradeSource":
    if grades == "console":
        from masrel.lab.run import ConsoleGrades

        return ConsoleGrades(scale_of(protocol))
    from masrel.lab.training import SimulatedTrainee

    return SimulatedTrainee(protocol)


def _report(
    paths: StudyPaths,
    protocol: Protocol,
    rater: str,
    level: float,
    output: OutputOptions,
) -> "TrainingRecord":
    from masrel.lab.report._training_tables import (
        learning_view,
        training_document,
        training_stamp,
        training_tables,
    )
    from masrel.lab.training import read_training

    record = read_training(paths, protocol, rater)
    curve, confusion = training_tables(record, level=level)
    write_output(
        output,
        document=lambda: training_document(record, level=level),
        text=lambda: curve,
        figure=lambda: learning_view(record, level=level),
        stamp=training_stamp(record, protocol.study.id),
        more=() if output.csv else (confusion,),
        width=_WIDTH,
    )
    return record
