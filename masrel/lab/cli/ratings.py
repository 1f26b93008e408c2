"""``masrel ratings``: turn session logs into the table of ratings."""

from pathlib import Path

import click

from masrel._files import write_file
from masrel.cli._paths import OutputFile, note_inputs
from masrel.lab._study_files import read_once
from masrel.lab.cli._study_options import echo_remarks, of_study
from masrel.lab.protocol import Protocol, StudyPaths


@click.command("ratings")
@read_once()
@of_study
@click.option(
    "-o",
    "--output",
    type=OutputFile(path_type=Path),
    help="File to write; default: STUDY/ratings/ratings.csv.",
)
def ratings(paths: StudyPaths, protocol: Protocol, output: Path | None) -> None:
    """Collect the ratings of STUDY from its session logs.

    Every chain of hashes is verified, and every recording present is compared with its
    checksum. Corrected grades replace the original ones. The table of raters,
    raters.csv, is written beside STUDY/ratings/ratings.csv.
    """
    from masrel.lab.progress import raters_csv
    from masrel.lab.ratings import (
        answers_from_logs,
        ratings_from_logs,
        study_remarks,
        write_answers,
        write_ratings,
    )

    note_inputs(*(paths.root / model.file for model in protocol.models if model.file))
    echo_remarks(study_remarks(paths, protocol))
    ratings = ratings_from_logs(paths, protocol)
    destination = output or paths.ratings_file
    write_ratings(ratings, destination, within=None if output else paths.root)
    if output is None:
        raters = raters_csv(paths, protocol)  # also with fields that are not public
        write_file(paths.raters_file, raters, within=paths.root)
    n_rows, n_missing = len(ratings.rows), ratings.n_missing
    label = " (simulated)" if ratings.simulated else ""
    if label and not ratings.n_by_programs:
        label = " (simulated device)"
    click.echo(
        f"{n_rows - n_missing} ratings{label}, {n_missing} missing: {destination}"
    )
    if protocol.questionnaires:
        answers = answers_from_logs(paths, protocol)
        beside = paths.answers_file
        if output is not None:
            beside = output.with_name(f"{output.stem}_answers.csv")
        write_answers(answers, beside, within=None if output else paths.root)
        n_open = sum(each.answer is None for each in answers)
        click.echo(f"{len(answers) - n_open} answers, {n_open} missing: {beside}")
    n_slow = sum(row.felt in ("below-threshold", "no-catch") for row in ratings.rows)
    if n_slow:
        click.echo(
            f"{n_slow} ratings followed stretches too slow to feel the catch: column "
            "felt"
        )
    n_lost = sum(row.grip_lost is True for row in ratings.rows)
    if n_lost:
        click.echo(f"{n_lost} ratings followed a lost grip: column grip_lost")
