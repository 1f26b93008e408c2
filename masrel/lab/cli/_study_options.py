"""The ratings of a study, as commands read them."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from masrel.cli._options import echo_notes
from masrel.cli._paths import InputFile, note_inputs

if TYPE_CHECKING:
    from masrel.lab.ratings import StudyData

ratings_option = click.option(
    "--ratings",
    "ratings_file",
    type=InputFile(path_type=Path),
    help="File of ratings to use whatever the session logs say; default: what they "
    "say, and without logs the study's ratings.csv, else published.csv.",
)


def read_study(root: Path, ratings_file: Path | None) -> "StudyData":
    """Return a study's protocol and its ratings; say what must be known beside."""
    from masrel.lab.protocol import StudyPaths, read_protocol
    from masrel.lab.ratings import read_study_data, study_remarks

    paths = StudyPaths(root)
    protocol = read_protocol(paths.protocol)
    models = [paths.root / model.file for model in protocol.models if model.file]
    tables = (paths.ratings_file, paths.published_file, paths.in_person_file)
    note_inputs(*tables, *models)
    # Said first: it may be why the ratings are refused.
    echo_remarks(study_remarks(paths, protocol, file=ratings_file))
    return read_study_data(paths, protocol, file=ratings_file)


def echo_remarks(remarks: Sequence[str]) -> None:
    """Print on stderr what a reader of a study's ratings must know beside them."""
    echo_notes(tuple(f"note: {remark}" for remark in remarks))
