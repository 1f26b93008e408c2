"""What `analyze` and `report` start from: a study's protocol and its ratings."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from masrel.errors import RatingsError
from masrel.protocol import Protocol, StudyPaths, read_protocol, scale_of

if TYPE_CHECKING:
    from masrel.ratings import InPerson, Ratings

__all__ = ["StudyMaterial", "read_material"]


@dataclass(frozen=True, slots=True, kw_only=True)
class StudyMaterial:
    """A study read from its folder."""

    paths: StudyPaths  # where its files are
    protocol: Protocol  # its protocol
    ratings: "Ratings"  # the ratings asked for
    # grades given in person; None for simulated ratings, to which they do not belong
    in_person: "InPerson | None"


def read_material(root: Path, ratings_file: Path | None) -> StudyMaterial:
    """Read a study's protocol and ratings."""
    from masrel.ratings import read_in_person, read_ratings

    paths = StudyPaths(root)
    protocol = read_protocol(paths.protocol)
    source = ratings_file or _default_ratings(paths)
    ratings = read_ratings(source, scale=scale_of(protocol))
    in_person = None
    if paths.in_person_file.is_file() and not ratings.simulated:
        in_person = read_in_person(paths.in_person_file)
    return StudyMaterial(
        paths=paths, protocol=protocol, ratings=ratings, in_person=in_person
    )


def _default_ratings(paths: StudyPaths) -> Path:
    for path in (paths.ratings_file, paths.published_file):
        if path.is_file():
            return path
    raise RatingsError(
        f"{paths.root}: needs {paths.ratings_file.name} or "
        f"{paths.published_file.name} in {paths.ratings_file.parent}; "
        "`masrel ratings STUDY` makes the first from session logs"
    )
