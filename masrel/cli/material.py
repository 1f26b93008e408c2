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
    """A study read from its folder.

    Attributes
    ----------
    paths : StudyPaths
        Where its files are.
    protocol : Protocol
        Its protocol.
    ratings : Ratings
        The ratings asked for.
    in_person : InPerson or None
        Grades given in person; None for simulated ratings, to which they do not
        belong.
    """

    paths: StudyPaths
    protocol: Protocol
    ratings: "Ratings"
    in_person: "InPerson | None"


def read_material(root: Path, ratings_file: Path | None) -> StudyMaterial:
    """Read a study's protocol and ratings.

    Parameters
    ----------
    root : Path
        The study's folder.
    ratings_file : Path or None
        A file of ratings; None takes the study's own, or the published ones.

    Returns
    -------
    StudyMaterial
        What was read.

    Raises
    ------
    ProtocolError
        If the protocol is not usable.
    RatingsError
        If there are no ratings or they are not usable.
    """
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
