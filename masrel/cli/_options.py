"""Options that several verbs have, each group as one argument of the verb."""

import math
from collections.abc import Callable
from dataclasses import dataclass, fields
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from masrel.errors import ParameterError, RatingsError
from masrel.scales import MODIFIED_ASHWORTH

if TYPE_CHECKING:
    from masrel.protocol import Protocol, StudyPaths
    from masrel.ratings import InPerson, Ratings

Command = Callable[..., None]
Decorator = Callable[[Command], Command]


def grouped(name: str, group: type, *options: Callable[..., Any]) -> Decorator:
    """Return a decorator that gives a command several options as one argument."""
    # the command may have some of the group's options, in any place among its others
    keys = [field.name for field in fields(group)]

    def decorate(command: Command) -> Command:
        @wraps(command)
        def with_group(**args: object) -> None:
            values = {key: args.pop(key) for key in keys if key in args}
            command(**args, **{name: group(**values)})

        decorated: Command = with_group
        for option in reversed(options):
            decorated = option(decorated)
        return decorated

    return decorate


def split_commas(text: str) -> list[str]:
    """Return the parts of an option's value between its commas."""
    return [part.strip() for part in text.split(",")]


@dataclass(frozen=True, slots=True, kw_only=True)
class ColumnOptions:
    """Columns of a file in long format, and its scale; None where it has to tell."""

    # item, rater, grade: names of columns
    item: str | None
    rater: str | None
    grade: str | None
    categories: list[str] | None  # every grade of the scale in order


column_options = grouped(
    "columns",
    ColumnOptions,
    click.option("--item", help="Column of the rated items (long format)."),
    click.option("--rater", help="Column of the raters (long format)."),
    click.option("--grade", help="Column of the grades (long format)."),
    click.option(
        "--categories",
        type=split_commas,
        metavar="TEXT",
        help="Every grade of the scale in order, such as 0,1,1+,2,3,4.",
    ),
)


def scale_notes(ratings: "Ratings", weights: str) -> tuple[str, ...]:
    """Return what to say of a scale that nobody declared, or refuse its weights."""
    scale, grades = ratings.scale, ", ".join(ratings.scale.grades)
    if scale == MODIFIED_ASHWORTH:
        return (
            f"The scale is the Modified Ashworth Scale, {grades}, told by its grade "
            "1+; --categories declares another.",
        )
    if weights == "identity" or scale.name != "observed":
        return ()
    if not all(map(_is_number, scale.grades)):
        raise ParameterError(
            f"--weights {weights}: needs --categories with every grade of the scale in "
            f"order, the grades met are text: {grades}"
        )
    return (f"The scale is the grades met, {grades}; --categories declares another.",)


def _is_number(grade: str) -> bool:
    try:
        return math.isfinite(float(grade))
    except ValueError:
        return False


@dataclass(frozen=True, slots=True, kw_only=True)
class StudyData:
    """A study read from its folder."""

    paths: "StudyPaths"
    protocol: "Protocol"
    ratings: "Ratings"
    # grades given in person; None for simulated ratings, to which they do not belong
    in_person: "InPerson | None"


ratings_option = click.option(
    "--ratings",
    "ratings_file",
    type=click.Path(path_type=Path),
    help="File of ratings; default: the study's ratings.csv, else published.csv.",
)


def read_study(root: Path, ratings_file: Path | None) -> StudyData:
    """Return a study's protocol and its ratings, by default those in its folder."""
    from masrel.protocol import StudyPaths, read_protocol, scale_of
    from masrel.ratings import read_in_person, read_ratings

    paths = StudyPaths(root)
    protocol = read_protocol(paths.protocol)
    source = ratings_file or _default_ratings(paths)
    ratings = read_ratings(source, scale=scale_of(protocol))
    in_person = None
    if paths.in_person_file.is_file() and not ratings.simulated:
        in_person = read_in_person(paths.in_person_file)
    return StudyData(
        paths=paths, protocol=protocol, ratings=ratings, in_person=in_person
    )


def _default_ratings(paths: "StudyPaths") -> Path:
    for path in (paths.ratings_file, paths.published_file):
        if path.is_file():
            return path
    raise RatingsError(
        f"{paths.root}: needs {paths.ratings_file.name} or "
        f"{paths.published_file.name} in {paths.ratings_file.parent}; "
        "`masrel ratings STUDY` makes the first from session logs"
    )
