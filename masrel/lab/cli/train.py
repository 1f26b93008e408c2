"""``masrel train``: teach a rater on models of known grade, until a test is passed."""

from pathlib import Path
from typing import Literal

import click

from masrel._files import write_file
from masrel.cli._commands import STUDY, Commands
from masrel.cli._options import (
    OutputOptions,
    level_option,
    output_options,
    write_output,
)
from masrel.cli._paths import OutputFile
from masrel.lab.cli._study_options import (
    clock_option,
    grades_option,
    grading,
    id_option,
    of_study,
    warnings_as_notes,
)
from masrel.lab.protocol import Protocol, StudyPaths
from masrel.lab.report._training import (
    NOT_RATINGS,
    learning_content,
    outcome,
    training_document,
    training_page,
    training_stamp,
    training_tables,
)
from masrel.lab.training._lessons import Lesson, read_training
from masrel.lab.training._trainer import SimulatedTrainee, train_rater

_WIDTH = 88  # of notes below a table


@click.group("train", cls=Commands)
def train() -> None:
    """Train a rater on models of known grade, or show the progress of a training.

    masrel train STUDY --rater R1 starts the training, or resumes it.
    """


@train.command(STUDY)
@of_study
@id_option
@grades_option("console", "simulated", words="Source of the grades.")
@clock_option
@output_options(quiet="Do not print the closing line.")
def _train(
    paths: StudyPaths,
    protocol: Protocol,
    rater: str,
    grades: Literal["console", "simulated"],
    clock: Literal["real", "simulated"] | None,
    output: OutputOptions,
) -> None:
    """Train one rater of STUDY, or resume the training where it stopped.

    The rater grades models of known grade and is shown the right grade after each one.
    The training is passed once kappa with these grades is high enough, by the test that
    [training] of the protocol sets. No grade of a training becomes a rating of STUDY.
    """
    with warnings_as_notes():
        record = train_rater(
            paths,
            protocol,
            rater,
            **grading(protocol, grades, clock, SimulatedTrainee),
            feedback=_show_grade if grades == "console" else None,
        )
    if not output.quiet:
        label = " (simulated)" if record.simulated else ""
        click.echo(
            f"training of {rater}: {outcome(record)}{label}; log: "
            f"{paths.training_log_file(rater)}\n{NOT_RATINGS}"
        )


def _show_grade(lesson: Lesson) -> None:
    if lesson.grade == lesson.intended:
        click.echo(f"Right: {lesson.intended}.\n")
    else:
        click.echo(f"Not {lesson.grade}: it is {lesson.intended}.\n")


@train.command("show")
@of_study
@id_option
@level_option
@click.option(
    "--html",
    "page",
    type=OutputFile(path_type=Path, dir_okay=False),
    help="Write a page with the learning curve and the tables to this file.",
)
@output_options(
    json='Write JSON to this file; "-" writes it to standard output and prints nothing '
    "else.",
    figure="Save the learning curve as .png, .svg or .pdf.",
    csv="Print the learning curve as CSV with all digits.",
)
def _show(
    paths: StudyPaths,
    protocol: Protocol,
    rater: str,
    level: float,
    page: Path | None,
    output: OutputOptions,
) -> None:
    """Show the training of one rater of STUDY so far, without presenting a model."""
    record = read_training(paths, protocol, rater)
    curve, confusion = training_tables(record, level=level)
    write_output(
        output,
        document=lambda: training_document(record, level=level),
        text=lambda: curve,
        figure=lambda: learning_content(record, level=level),
        stamp=training_stamp(record, protocol.study.id),
        more=() if output.csv else (confusion,),
        width=_WIDTH,
        mode=0o600,
    )
    if page is not None:
        text = training_page(record, protocol, level=level)
        write_file(page, text, mode=0o600)
