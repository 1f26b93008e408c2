"""A study's ratings: from its logs where it has some, from a file where it has not."""

import math
import statistics
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from itertools import zip_longest
from pathlib import Path
from typing import Any

from masrel.errors import RatingsError
from masrel.lab._event_log import Event
from masrel.lab._study_files import (
    MAX_RECORDING,
    MAX_SMALL,
    MAX_TABLE,
    csv_format,
    format_problem,
    read_once,
    read_regular,
    sha256_of,
)
from masrel.lab.conduct import PlanChange, excluded_raters, plan_changes
from masrel.lab.conduct._plan_versions import is_of_earlier
from masrel.lab.progress import raters_csv
from masrel.lab.protocol import Protocol, StudyPaths, scale_of
from masrel.lab.ratings.answers import (
    _COLUMNS,
    GivenAnswer,
    answers_csv,
    answers_from_logs,
    answers_of,
)
from masrel.lab.ratings.study_file import InPerson, read_in_person, read_study_ratings
from masrel.lab.ratings.table import (
    _FORMAT,
    _NEEDED_TIME,
    RATING_COLUMNS,
    Ratings,
    _is_utc,
    _texts,
    ratings_from_rows,
)
from masrel.lab.run._state import FROM_PAPER, FROM_PERSONS, SessionState, read_session
from masrel.lab.schedule.presentation import Schedule, check_schedule, read_schedule


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
    changes : tuple of PlanChange
        What has changed in the plan since the first draw.
    read : str
        What was read, in words.
    """

    paths: StudyPaths
    protocol: Protocol
    ratings: Ratings
    in_person: InPerson | None
    excluded: tuple[str, ...]
    answers: tuple[GivenAnswer, ...]
    changes: tuple[PlanChange, ...]
    read: str


@read_once()
def read_study_data(
    study: StudyPaths,
    protocol: Protocol,
    *,
    file: Path | None = None,
    allows_sealed: bool = False,
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
    allows_sealed : bool, optional
        Whether to return ratings that say no models, too.

    Returns
    -------
    StudyData
        Ratings, grades given in person, and what was read.

    Raises
    ------
    RatingsError
        If there are no ratings, they are sealed, a file is not a table of ratings, a
        log is not of its schedule, or ``ratings.csv`` is not what the logs say.
    SessionLogError
        If a log is damaged.
    ScheduleError
        If the schedule of a log is missing, damaged or stale.
    """
    if file is None and study.logs():
        ratings = ratings_from_logs(study, protocol)
        is_stale, problem = _table_problem(study, protocol)
        if problem and not is_stale:
            raise RatingsError(problem)
        read = f"{len(ratings.rows)} ratings from the logs in {study.sessions}" + (
            f"; {problem}" if problem else ""
        )
    else:
        source = file or _file_of(study)
        ratings = read_study_ratings(source, scale_of(protocol))
        read = f"{len(ratings.rows)} ratings from {source}"
    if ratings.is_sealed and not allows_sealed:
        raise RatingsError(
            f"{study.schedules}: the models presented are sealed: masrel record "
            "unblind --all opens them once every session is over"
        )
    return StudyData(
        paths=study,
        protocol=protocol,
        ratings=ratings,
        in_person=in_person_of(study, ratings),
        excluded=excluded_raters(study),
        answers=answers_of(study, protocol, file=file),
        changes=plan_changes(study, protocol),
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
        None without such grades, and for simulated ratings.

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


def _table_problem(study: StudyPaths, protocol: Protocol) -> tuple[bool, str]:
    """Return whether ``ratings.csv`` is out of date, and what is wrong with it."""
    path = study.ratings_file
    is_stale, differences = _table_differences(study, protocol, path)
    if not differences:
        return False, ""
    more = f", and {len(differences) - 1} more" if len(differences) > 1 else ""
    return is_stale, (
        f"{path}: is {'out of date' if is_stale else 'not what the session logs say'}: "
        f"{differences[0]}{more}; masrel ratings writes it again, --ratings {path} "
        "uses it as it is"
    )


def _table_differences(
    study: StudyPaths, protocol: Protocol, path: Path
) -> tuple[bool, list[str]]:
    """Return whether a table is what logs said once, and how it differs from them now.

    It is that of ratings, of answers or of raters; one that is not there differs in
    nothing.
    """
    texts, place, steps = _tables(study)[path]
    if not path.is_file():
        return False, []
    text = read_regular(path, most=MAX_TABLE).decode("utf-8", errors="replace")

    def amount(text: str) -> int:
        # every step that a cell of the column has come to
        rows = (row.split(",") for row in text.split("\n"))
        cells = [row[place] for row in rows if len(row) > place]
        return sum(cell not in step for step in steps for cell in cells)

    def compare(then: Protocol) -> tuple[bool, int]:
        known = [*texts(then)]
        return text not in known, amount(known[0])

    if text in texts(protocol):
        return False, []
    if is_of_earlier(study, protocol, compare, amount(text)):
        return True, ["needed what the logs say, got what they said earlier"]
    newest = _FORMAT if path == study.ratings_file else 1
    return False, [*_line_differences(text, [*texts(protocol)], newest)]


def _tables(
    study: StudyPaths,
) -> dict[Path, tuple[Callable[[Protocol], Iterable[str]], int, list[list[str]]]]:
    # of each table: all that one of the same logs has ever been; which column is filled
    # as a study goes on, with what it has before each step
    return {
        study.ratings_file: (
            lambda then: _texts(ratings_from_logs(study, then, check_recordings=False)),
            RATING_COLUMNS.index("grade"),
            [["NA"]],
        ),
        study.answers_file: (
            lambda then: [answers_csv(answers_from_logs(study, then))],
            _COLUMNS.index("answer"),
            [[""]],
        ),
        study.raters_file: (
            lambda then: [raters_csv(study, then)],
            2,
            [["planned"], ["planned", "begun"]],
        ),
    }


def _line_differences(text: str, known: list[str], newest: int) -> Iterator[str]:
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


def ratings_from_logs(
    study: StudyPaths, protocol: Protocol, *, check_recordings: bool = True
) -> Ratings:
    """Collect the ratings of a study from its session logs.

    Parameters
    ----------
    study : StudyPaths
        Where the study is.
    protocol : Protocol
        The study's protocol.
    check_recordings : bool, optional
        Whether recordings are checked against the checksums of the logs.

    Returns
    -------
    Ratings
        Sessions and raters in the protocol's order, models in the schedule's. A
        session that has begun has a row for every presentation, without a grade if
        it is not graded yet; one that has no log has no rows. Corrections replace
        the grades they correct; stretches are those of the last
        presentation before the grade, and the speed is the mean of theirs.

    Raises
    ------
    RatingsError
        If no session has begun, a log is of another schedule, a grade is not of
        the scale, or a recording is not the one its log has the checksum of.
        Recordings that are not there are not checked.
    SessionLogError
        If a log is damaged.
    ScheduleError
        If a schedule is missing, damaged or stale.
    """
    rows = [
        row
        for rater, session in protocol.rater_sessions
        if study.log_file(rater, session).exists()
        for row in _rows(
            study, protocol, rater, session, check_recordings=check_recordings
        )
    ]
    if not rows:
        raise RatingsError(
            f"{study.sessions}: needed a session log, got none; masrel run makes them"
        )
    return ratings_from_rows(rows, scale_of(protocol))


def _rows(
    study: StudyPaths,
    protocol: Protocol,
    rater: str,
    session: str,
    *,
    check_recordings: bool,
) -> Iterator[dict[str, object]]:
    log = study.log_file(rater, session)
    _, state = read_session(log)
    if not state.header:
        return
    if state.header.get("rehearsal"):
        raise RatingsError(
            f"{log}: needed the log of a session, got that of a rehearsal, whose "
            "grades are not ratings of the study: move it away"
        )
    schedule = _schedule(study, protocol, state, log)
    presented = [event for events in state.presented.values() for event in events]
    for event in presented if check_recordings else ():
        _check_recording(study, log, event)
    is_simulated = any(event.fields["simulated"] for event in presented)
    device = str(state.header["device"])
    if device != "simulated" and is_simulated:
        device = f"simulated {device}"  # such as an amplifier that is emulated
    of_session = {
        "session": session,
        "rater": rater,
        "source": "simulated"
        if state.header["simulated"] or is_simulated
        else "recorded",
        "device": device,
    }
    is_on_paper = state.header["grades"] == FROM_PAPER
    for shown in schedule.presentations:
        grade = state.grades.get(shown.code)
        if grade is not None and grade not in protocol.scale.grades:
            raise RatingsError(
                f"{log}: grade of {shown.code}: needed one of "
                f"{', '.join(protocol.scale.grades)}, got {grade!r}"
            )
        yield {
            **of_session,
            "grades_from": state.graded_from.get(shown.code, state.source),
            "model": shown.model,
            "repeat": shown.repeat,
            "grade": grade,
            "graded_stretch": state.graded_stretches.get(shown.code),
            "position": shown.position,
            "code": shown.code,
            # how often a device presented it; of a sheet nobody knows
            "n_attempts": None
            if is_on_paper and not state.presented.get(shown.code)
            else len(state.presented.get(shown.code, [])),
            "first_grade": state.first_grades.get(shown.code),
            "graded_at": _graded_at(state, shown.code, log),
            **_of_stretches(state.presented.get(shown.code, [])),
        }


def _graded_at(state: SessionState, code: str, log: Path) -> str | None:
    # of a simulated grade it is when a computer came to it: it differs from run to run
    time = state.graded_at.get(code)
    if time is None or state.graded_from[code] not in FROM_PERSONS:
        return None
    if not _is_utc(time):
        raise RatingsError(f"{log}: grade of {code}: {_NEEDED_TIME}, got {time!r}")
    return time


def _schedule(
    study: StudyPaths, protocol: Protocol, state: SessionState, log: Path
) -> Schedule:
    rater, session = str(state.header["rater"]), str(state.header["session"])
    if log != study.log_file(rater, session):
        raise RatingsError(
            f"{log}: is the log of rater {rater} in session {session} by its first "
            "event: needed the one its name says"
        )
    path = study.schedule_file(rater, session)
    schedule = read_schedule(path)
    check_schedule(schedule, protocol)
    data = read_regular(path, most=MAX_SMALL)
    if state.header["schedule_sha256"] != sha256_of(data):
        raise RatingsError(f"{log}: was recorded with another schedule than {path}")
    codes = {shown.code for shown in schedule.presentations}
    for code, events in state.presented.items():
        if code not in codes:
            line = f"line {events[0].line}: " if events else ""
            raise RatingsError(
                f"{log}: {line}needed a code of the schedule, got {code!r}"
            )
    return schedule


def _check_recording(study: StudyPaths, log: Path, event: Event) -> None:
    path = study.sessions / str(event.fields["recording"])
    if not path.is_file():
        return
    data = read_regular(path, most=MAX_RECORDING)
    if sha256_of(data) != event.fields["sha256"]:
        raise RatingsError(
            f"{log}: line {event.line}: {path} is not the recording whose checksum "
            "this line holds"
        )


def _of_stretches(presented: list[Event]) -> dict[str, object]:
    # what the table says of the stretches of the last presentation
    if not presented:
        return {}
    fields = presented[-1].fields
    one = [{"mean_speed_deg_s": fields["mean_speed_deg_s"]}]
    listed = fields.get("stretches")
    made: Any = one if listed is None else listed  # there once was one, and no list
    speeds = tuple(stretch["mean_speed_deg_s"] for stretch in made)
    moved = [speed for speed in speeds if speed is not None]
    return {
        "n_stretches": len(speeds),
        "mean_speed_deg_s": statistics.fmean(moved) if moved else math.nan,
        "min_speed_deg_s": min(moved, default=math.nan),
        "max_speed_deg_s": max(moved, default=math.nan),
        "speeds_deg_s": speeds,
        "felt": fields.get("felt"),
        "grip_lost": fields.get("grip_lost"),
    }
