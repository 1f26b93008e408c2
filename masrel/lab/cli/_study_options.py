"""A study and its ratings, as commands read them, and warnings, as they say them."""

import functools
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import click

from masrel.cli._options import Command, Decorator, echo_notes
from masrel.cli._paths import InputFile, note_inputs
from masrel.errors import MasrelWarning, MissingLettersWarning

if TYPE_CHECKING:
    from masrel.lab.protocol import Protocol
    from masrel.lab.ratings import StudyData
    from masrel.lab.run._grade_sources import GradeSource

study_argument = click.argument("study", type=click.Path(path_type=Path))


def of_study(command: Callable[..., None]) -> Command:
    """Give a command the argument STUDY: where the study is, and its protocol."""

    @functools.wraps(command)
    def with_study(study: Path, **arguments: object) -> None:
        from masrel.lab.protocol import StudyPaths, read_protocol

        paths = StudyPaths(study)
        command(paths, read_protocol(paths.protocol), **arguments)

    return study_argument(with_study)


def several(*options: Decorator) -> Decorator:
    """Return options as one decorator."""

    def decorate(command: Command) -> Command:
        return functools.reduce(
            lambda done, option: option(done), options[::-1], command
        )

    return decorate


id_option = click.option("--rater", required=True, help="Id of the rater.")
session_option = click.option("--session", required=True, help="Id of the session.")
clock_option = click.option(
    "--clock",
    type=click.Choice(["real", "simulated"]),
    help="Clock of the control loop; default: simulated for simulated grades, "
    "otherwise real.",
)


def grades_option(*choices: str, words: str) -> Decorator:
    """Return the option that says who gives the grades, the first one unless told."""
    return click.option(
        "--grades",
        type=click.Choice(choices),
        default=choices[0],
        show_default=True,
        help=words,
    )


def grading(
    protocol: "Protocol",
    grades: str,
    clock: 'Literal["real", "simulated"] | None',
    simulated: "Callable[[Protocol], GradeSource]",
) -> "dict[str, Any]":
    """Return the source of grades, and the clock, that a command runs with."""
    from masrel.lab.protocol import scale_of
    from masrel.lab.run.console import ConsoleGrades, PaperGrades

    persons = {"console": ConsoleGrades, "paper": PaperGrades}
    if grades in persons:
        source: GradeSource = persons[grades](
            scale_of(protocol), anchors=protocol.scale.anchors
        )
        return {"grades": source, "clock": clock or "real"}
    return {"grades": simulated(protocol), "clock": clock or "simulated"}


stamp_option = click.option(
    "--stamp",
    metavar="URL",
    help="Have the file time-stamped by this service (RFC 3161) and keep its reply "
    "beside the file.",
)


def echo_stamp(file: Path, service: str | None) -> None:
    """Have a file stamped if a service is named, and say when it was."""
    from masrel.lab.verification import request_stamp

    if service is not None:
        time = request_stamp(file, service)
        click.echo(f"{file} is stamped: {time.isoformat()}")


ratings_option = click.option(
    "--ratings",
    "ratings_file",
    type=InputFile(path_type=Path),
    help="File of ratings to use instead of the session logs. Default: the session "
    "logs, or without logs the study's ratings.csv, or else its published.csv.",
)


def read_study(
    root: Path, ratings_file: Path | None, *, allows_sealed: bool = False
) -> "StudyData":
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
    return read_study_data(
        paths, protocol, file=ratings_file, allows_sealed=allows_sealed
    )


def echo_remarks(remarks: Sequence[str]) -> None:
    """Print on stderr what a reader of a study's ratings must know beside them."""
    echo_notes(tuple(f"note: {remark}" for remark in remarks))


@contextmanager
def warnings_as_notes() -> Iterator[None]:
    """Show warnings of masrel as notes, each once; leave all others as they are."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            yield
        finally:
            ours = [w.message for w in caught if _is_ours(w)]
            # letters that no font has are said of all figures at once
            letters = {of for each in ours for of in getattr(each, "letters", ())}
            others = [of for of in ours if not isinstance(of, MissingLettersWarning)]
            others += [MissingLettersWarning(letters)] * bool(letters)
            notes = dict.fromkeys(f"note: {message}" for message in others)
            echo_notes(tuple(notes))
    for warning in caught:
        if not _is_ours(warning):
            warnings.warn_explicit(
                warning.message, warning.category, warning.filename, warning.lineno
            )


def _is_ours(warning: warnings.WarningMessage) -> bool:
    return issubclass(warning.category, MasrelWarning)
