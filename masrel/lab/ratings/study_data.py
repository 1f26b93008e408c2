"""A study's ratings: from its logs where it has some, from a file where it has not."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import zip_longest
from pathlib import Path

from masrel.errors import RatingsError
from masrel.lab._bounded_files import (
    MAX_TABLE,
    csv_format,
    format_problem,
    read_regular,
)
from masrel.lab.conduct import excluded_raters
from masrel.lab.protocol import Protocol, StudyPaths, scale_of
from masrel.lab.ratings.answers import GivenAnswer, answers_of
from masrel.lab.ratings.in_person import InPerson, read_in_person
from masrel.lab.ratings.logs import ratings_from_logs
from masrel.lab.ratings.study_file import read_study_ratings
from masrel.lab.ratings.table import _FORMAT, Ratings, _texts


@dataclass(frozen=True, slots=True, kw_only=True)
class StudyData:
    """What the analysis of a study is made from.

    Attributes
    ----------
    paths : StudyPaths
        Where the study is.
    protocol : Protocol
        Its protocol.
    ratings : Ratings
        The ratings.
    in_person : InPerson or None
        Grades given in person; None for simulated ratings, to which they do not belong.
    excluded : tuple of str
        Raters who are left out of the analysis.
    answers : tuple of GivenAnswer
        Answers to questionnaires.
    read : str
        What was read, in words.
    """

    paths: StudyPaths
    protocol: Protocol
    ratings: Ratings
    in_person: InPerson | None
    excluded: tuple[str, ...]
    answers: tuple[GivenAnswer, ...]
    read: str


def read_study_data(
    study: StudyPaths, protocol: Protocol, *, file: Path | None = None
) -> StudyData:
    """Read the ratings of a study.

    Parameters
    ----------
    study : StudyPaths
        Where the study is.
    protocol : Protocol
        The study's protocol.
    file : Path, optional
        A table to use whatever the logs say. Without one it is what the session logs
        say, where there are some, and else ``ratings.csv`` or ``published.csv``.

    Returns
    -------
    StudyData
        Ratings, grades given in person, and what was read.

    Raises
    ------
    RatingsError
        If there are no ratings, a file is not a table of ratings, a log is not of its
        schedule, or ``ratings.csv`` is not what the logs say.
    SessionLogError
        If a log is damaged.
    ScheduleError
        If the schedule of a log is missing, damaged or stale.
    """
    if file is None and study.logs():
        ratings = ratings_from_logs(study, protocol)
        _refuse_other_table(study.ratings_file, ratings)
        read = f"{len(ratings.rows)} ratings from the logs in {study.sessions}"
    else:
        source = file or _file_of(study)
        ratings = read_study_ratings(source, scale_of(protocol))
        read = f"{len(ratings.rows)} ratings from {source}"
    return StudyData(
        paths=study,
        protocol=protocol,
        ratings=ratings,
        in_person=in_person_of(study, ratings),
        excluded=excluded_raters(study),
        answers=answers_of(study, protocol, file=file),
        read=read,
    )


def in_person_of(study: StudyPaths, ratings: Ratings) -> InPerson | None:
    """Read the grades given in person that belong to a study's ratings.

    Parameters
    ----------
    study : StudyPaths
        Where the study is.
    ratings : Ratings
        Its ratings.

    Returns
    -------
    InPerson or None
        None where there are none, and for simulated ratings.

    Raises
    ------
    RatingsError
        If the file is not a table of grades given in person.
    """
    if not study.in_person_file.is_file() or ratings.simulated:
        return None
    return read_in_person(study.in_person_file)


def _file_of(study: StudyPaths) -> Path:
    for path in (study.ratings_file, study.published_file):
        if path.is_file():
            return path
    raise RatingsError(
        f"{study.root}: needs session logs in {study.sessions.name}, which masrel run "
        f"makes, or {study.ratings_file.name} or {study.published_file.name} in "
        f"{study.ratings_file.parent}"
    )


def _refuse_other_table(path: Path, ratings: Ratings) -> None:
    """Refuse a study's ``ratings.csv`` that is not what its logs say."""
    differences = list(_table_differences(path, _texts(ratings), newest=_FORMAT))
    if differences:
        more = f", and {len(differences) - 1} more" if len(differences) > 1 else ""
        raise RatingsError(
            f"{path}: is not what the session logs say: {differences[0]}{more}; masrel "
            f"ratings writes it anew, --ratings {path} uses it as it is"
        )


def _table_differences(
    path: Path, texts: Iterable[str], *, newest: int
) -> Iterator[str]:
    """Yield how a study's table differs, line by line, from what its logs say.

    `texts` are all that a table of these logs has ever been, and `newest` is the
    version of its format. A file that is not there differs in nothing.
    """
    if not path.is_file():
        return
    text = read_regular(path, most=MAX_TABLE).decode("utf-8", errors="replace")
    known = list(texts)
    if text in known:
        return
    problem = format_problem(csv_format(text), newest=newest)
    if problem is not None:
        yield problem
        return
    names = _names(text)
    needed = next((each for each in known if _names(each) == names), known[0])
    lines = zip_longest(text.split("\n"), needed.split("\n"), fillvalue="no line")
    for number, (got, row) in enumerate(lines, start=1):
        if got != row:
            where, pair = f"line {number}", (row, got)
            cells = row.split(","), got.split(",")
            if len(cells[0]) == len(cells[1]) == len(names):
                columns = zip(names, zip(*cells, strict=True), strict=True)
                column, pair = next(
                    each for each in columns if each[1][0] != each[1][1]
                )
                where += f", column {column!r}"
            yield f"{where}: needed {pair[0]!r}, as the logs say, got {pair[1]!r}"


def _names(text: str) -> list[str]:
    # of a table's columns
    line = next((line for line in text.split("\n") if line[:1] != "#"), "")
    return line.split(",")
