"""Draw the schedules of a study once, keep them, and find those that went stale."""

from dataclasses import dataclass
from pathlib import Path

from masrel.errors import ScheduleError
from masrel.protocol import Protocol, StudyPaths
from masrel.schedule.files import read_schedule, schedule_text, sheet_text
from masrel.schedule.presentation import Schedule, check_schedule
from masrel.schedule.randomize import draw_schedule

__all__ = ["schedule_problems", "write_schedules"]


@dataclass(frozen=True, slots=True, kw_only=True)
class _Place:
    """One rater in one session, and the files that belong to the two."""

    rater: str
    session: str
    schedule: Path
    sheet: Path
    log: Path


def write_schedules(
    protocol: Protocol, study: StudyPaths, *, redraw: bool = False
) -> tuple[Path, ...]:
    """Draw every schedule that is not there yet, with its blinded sheet.

    Parameters
    ----------
    protocol : Protocol
        The study's protocol.
    study : StudyPaths
        Where the study is; its schedules folder is made when needed.
    redraw : bool
        Draw stale or damaged schedules anew. Schedules that still fit stay as they
        are, byte for byte, with or without it.

    Returns
    -------
    tuple of Path
        The files written; empty when all were there.

    Raises
    ------
    ScheduleError
        If a schedule is stale or damaged and `redraw` is false; or a schedule that
        has to be drawn belongs to a session that has begun (it has a log, or
        grades on its sheet). Nothing is written then.
    OSError
        If the system refuses a folder or file.
    """
    places = _places(protocol, study)
    problems: list[str] = []
    texts: dict[Path, str] = {}
    for place in places:
        fault = _fault(place, protocol)
        if fault is None:
            kept = read_schedule(place.schedule)
            if not place.sheet.exists():
                texts[place.sheet] = sheet_text(kept)
            continue
        problem = _refusal(place, fault, redraw=redraw)
        if problem is not None:
            problems.append(problem)
        drawn = draw_schedule(protocol, place.rater, place.session)
        texts[place.schedule] = schedule_text(drawn)
        texts[place.sheet] = sheet_text(drawn)
    if problems:
        raise ScheduleError("\n".join(problems))
    study.schedules.mkdir(parents=True, exist_ok=True)
    for path, text in texts.items():
        path.write_bytes(text.encode("utf-8"))  # the same bytes on every system
    return tuple(texts)


def schedule_problems(protocol: Protocol, study: StudyPaths) -> tuple[str, ...]:
    """Find what is wrong with the schedules of a study that are there.

    Parameters
    ----------
    protocol : Protocol
        The study's protocol.
    study : StudyPaths
        Where the study is.

    Returns
    -------
    tuple of str
        Each problem with its file: damaged, stale, a sheet with other codes, or a
        file that belongs to no rater and session. A schedule not drawn yet is none.
    """
    places = _places(protocol, study)
    problems: list[str] = []
    for place in places:
        if place.schedule.exists():
            fault = _fault(place, protocol)
            found = fault or _sheet_fault(place, read_schedule(place.schedule))
            problems.extend([found] if found else [])
    expected = {path for place in places for path in (place.schedule, place.sheet)}
    for path in sorted(study.schedules.glob("*.csv")):
        if path not in expected:
            problems.append(
                f"{path}: needed schedules of the protocol's raters and sessions only, "
                "got a file of neither"
            )
    return tuple(problems)


def _places(protocol: Protocol, study: StudyPaths) -> list[_Place]:
    return [
        _Place(
            rater=rater,
            session=session.id,
            schedule=study.schedule_file(rater, session.id),
            sheet=study.sheet_file(rater, session.id),
            log=study.log_file(rater, session.id),
        )
        for session in protocol.sessions
        for rater in session.raters
    ]


def _fault(place: _Place, protocol: Protocol) -> str | None:
    # Why the schedule's file cannot be used as it is, or None.
    if not place.schedule.exists():
        return f"{place.schedule}: needed a schedule file, got none"
    try:
        schedule = read_schedule(place.schedule)
    except ScheduleError as error:
        return str(error)
    if (schedule.rater, schedule.session) != (place.rater, place.session):
        return (
            f"{place.schedule}: needed the schedule of rater {place.rater} in session "
            f"{place.session}, got that of {schedule.rater} in {schedule.session}"
        )
    try:
        check_schedule(schedule, protocol)
    except ScheduleError as error:
        return f"{place.schedule}: {error}"
    return None


def _refusal(place: _Place, fault: str, *, redraw: bool) -> str | None:
    # Why a schedule with this fault may not be drawn, or None.
    if place.log.exists():
        return (
            f"{fault}. It was not drawn, because the session has begun: {place.log} "
            "was recorded by the schedule there was. Bring back that schedule and its "
            "protocol, or move the log out of the study"
        )
    if place.sheet.exists() and _is_filled_in(place.sheet):
        return (
            f"{fault}. It was not drawn, because {place.sheet} has grades on it. Move "
            "the sheet out of the study first"
        )
    if place.schedule.exists() and not redraw:
        return f"{fault}. It was kept; --redraw draws it anew"
    return None


def _is_filled_in(sheet: Path) -> bool:
    # A blank sheet's rows, and none but they, end at the comma before the grade.
    rows = sheet.read_text(encoding="utf-8", errors="replace").splitlines()[1:]
    return any(not row.endswith(",") for row in rows if row)


def _sheet_fault(place: _Place, schedule: Schedule) -> str | None:
    # The sheet may be missing or have grades, but its codes are the schedule's.
    if not place.sheet.exists():
        return None
    text = place.sheet.read_text(encoding="utf-8", errors="replace").splitlines()[1:]
    found = [tuple(row.split(",")[:2]) for row in text if row]
    asked = [(str(s.position), s.code) for s in schedule.presentations]
    if found == asked:
        return None
    return (
        f"{place.sheet}: needed the positions and codes of {place.schedule.name}, "
        "got others"
    )
