"""The files of schedules and raters' sheets: read, drawn once, kept, found stale."""

import os
import re
import shlex
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from masrel._files import make_folder, write_files
from masrel._input import listed, not_utf8
from masrel.errors import ScheduleError
from masrel.lab._bounded_files import (
    MAX_SMALL,
    csv_format,
    format_problem,
    read_regular,
)
from masrel.lab._once import once
from masrel.lab.protocol import (
    Protocol,
    StudyPaths,
    presented_content,
    presented_hash,
)
from masrel.lab.schedule._changes import content_file, stale_sentences
from masrel.lab.schedule._orders import WITH_ROWS, order_problem
from masrel.lab.schedule._secret import StudySecret, find_secret, new_secret
from masrel.lab.schedule._sites import checked_site, site_of
from masrel.lab.schedule.presentation import (
    Presentation,
    Schedule,
    _draw_with_key,
    _require_place,
    check_schedule,
)

_FORMAT = 1
"""Version of the files of schedules and sheets; a file without one is of version 1."""

_HEAD = {
    "study": r"\S+",
    "rater": r"\S+",
    "session": r"\S+",
    "seed": r"[0-9]{1,19}",
    "scheme": r"\S+",
    "protocol_sha256": r"[0-9a-f]{64}",
    "presented_sha256": r"[0-9a-f]{64}",
    "masrel_version": r"\S+",
    "commitment": r"[0-9a-f]{64}",
    "site": r"\S+",
    "row": r"[1-9][0-9]{0,8}",
}
"""Keys of the ``# key: value`` lines, in order, and what their values look like."""

_OPTIONAL = ("commitment", "site", "row")
"""Those that a schedule without a secret, without strata, or without rows has not."""

_COLUMNS = ["position", "code", "model", "repeat"]
_SHEET_COLUMNS = ["position", "code", "grade"]

# A code names a recording's file, so it is letters and digits only.
_CODE = re.compile(r"[0-9A-Za-z]{1,16}")


@dataclass(frozen=True, slots=True, kw_only=True)
class _ScheduleFiles:
    """One rater in one session, and the files that belong to the two."""

    rater: str
    session: str
    schedule: Path
    sheet: Path
    typed: Path  # there once the sheet has been printed
    log: Path


@once
def read_schedule(path: Path) -> Schedule:
    """Read a schedule file.

    Parameters
    ----------
    path : Path
        A file that :func:`masrel.lab.schedule.write_schedules` wrote.

    Returns
    -------
    Schedule
        The schedule; :func:`masrel.lab.schedule.check_schedule` holds it against a
        protocol.

    Raises
    ------
    ScheduleError
        If there is no such file, or it is not a schedule: the message has every
        problem with file and line.
    """
    lines = _read_lines(path)
    n_head = next((i for i, s in enumerate(lines) if not s.startswith("#")), len(lines))
    problem = _format_problem(lines)
    if problem is not None:
        raise ScheduleError(f"{path}: {problem}")
    problems: list[str] = []
    head = _read_head(lines[:n_head], path, problems)
    rows = _read_rows(lines, n_head, path, problems)
    if problems:
        raise ScheduleError("\n".join(problems))
    return Schedule(
        study=head["study"],
        rater=head["rater"],
        session=head["session"],
        seed=int(head["seed"]),
        scheme=head["scheme"],
        protocol_sha256=head["protocol_sha256"],
        presented_sha256=head["presented_sha256"],
        masrel_version=head["masrel_version"],
        commitment=head.get("commitment"),
        site=head.get("site"),
        row=int(head["row"]) if "row" in head else None,
        presentations=tuple(rows),
    )


def _drawn_schedule(
    study: StudyPaths, protocol: Protocol, rater: str, session: str
) -> Schedule:
    """Return the schedule of a rater in a session, checked against the protocol."""
    _require_place(protocol, rater, session)
    path = study.schedule_file(rater, session)
    if not path.exists():
        raise ScheduleError(
            f"{path}: needed a schedule file, got none: masrel schedule draws it"
        )
    schedule = read_schedule(path)
    check_schedule(schedule, protocol)
    if (schedule.rater, schedule.session) != (rater, session):
        raise ScheduleError(
            f"{path}: needed the schedule of rater {rater} in session {session}, got "
            f"that of {schedule.rater} in {schedule.session}"
        )
    return schedule


def _read_lines(path: Path) -> list[str]:
    try:
        return read_regular(path, most=MAX_SMALL).decode("utf-8").splitlines()
    except OSError as error:
        reason = error.strerror or str(error)
        raise ScheduleError(f"{path}: needed a schedule file, got: {reason}") from error
    except UnicodeDecodeError as error:
        raise ScheduleError(f"{path}: {not_utf8(error)}") from error


def _format_problem(lines: Sequence[str]) -> str | None:
    return format_problem(csv_format("\n".join(lines)), newest=_FORMAT)


def _read_head(lines: list[str], path: Path, problems: list[str]) -> dict[str, str]:
    head: dict[str, str] = {}
    for number, line in enumerate(lines, start=1):
        key, _, value = line.removeprefix("#").partition(":")
        key, value = key.strip(), value.strip()
        if key == "format":
            continue  # it is known
        if key not in _HEAD or key in head:
            problems.append(
                f"{path}: line {number}: needed '# key: value' with each of "
                f"{', '.join(_HEAD)} once, got {line!r}"
            )
        elif not re.fullmatch(_HEAD[key], value):
            problems.append(
                f"{path}: line {number}: needed {key} as {_HEAD[key]}, got {value!r}"
            )
            head[key] = ""
        else:
            head[key] = value
    absent = [key for key in _HEAD if key not in head and key not in _OPTIONAL]
    if absent:
        problems.append(f"{path}: needed a line '# {absent[0]}: ...', got none")
    return head


def _read_rows(
    lines: list[str], n_head: int, path: Path, problems: list[str]
) -> Iterator[Presentation]:
    # a cell longer than csv takes is in no schedule
    table = [line.split(",") if line else [] for line in lines[n_head:]]
    if not table or table[0] != _COLUMNS:
        header = ",".join(table[0]) if table else "nothing"
        problems.append(
            f"{path}: line {n_head + 1}: needed columns {','.join(_COLUMNS)}, "
            f"got {header}"
        )
        return iter(())
    if len(table) == 1:
        problems.append(f"{path}: needed at least one presentation, got none")
    seen: set[str] = set()
    for place, row in enumerate(table[1:], start=1):
        problem = _row_problem(row, place, seen)
        if problem:
            problems.append(f"{path}: line {n_head + 1 + place}: {problem}")
        seen.update(row[1:2])
    return (
        Presentation(position=int(p), code=code, model=model, repeat=int(repeat))
        for p, code, model, repeat in table[1:]
    )


def _row_problem(row: Sequence[str], place: int, seen: set[str]) -> str | None:
    if len(row) != len(_COLUMNS):
        return f"needed {len(_COLUMNS)} cells, got {len(row)}"
    position, code, model, repeat = row
    if position != str(place):
        return f"needed position {place}, got {position!r}"
    if not _CODE.fullmatch(code):
        return f"needed a code of letters and digits, got {code!r}"
    if code in seen:
        return f"needed codes that differ, got {code!r} again"
    if not model:
        return "needed the id of a model, got none"
    if not re.fullmatch(r"[1-9][0-9]{0,3}", repeat):
        return f"needed repeat as a whole number from 1, got {repeat!r}"
    return None


_Places = Sequence[tuple[str, str]]
"""Raters, each with a session."""


def write_schedules(
    protocol: Protocol,
    study: StudyPaths,
    *,
    redraw: bool = False,
    site: str | None = None,
    allot: Callable[[_Places], Mapping[tuple[str, str], int]] | None = None,
) -> tuple[Path, ...]:
    """Draw every schedule that is not there yet, with its blinded sheet.

    Order and codes come from the study's secret, which is drawn when the first
    schedule needs it. A schedule that is there holds its order, so that it stays good
    when the secret is lost; it can then not be drawn again for comparison.

    Parameters
    ----------
    protocol : Protocol
        The study's protocol.
    study : StudyPaths
        Where the study is; its schedules folder is made when needed. Schedules name
        the models: a new folder is readable for its owner alone.
    redraw : bool
        Draw stale or damaged schedules anew. Schedules that still fit stay as they
        are, byte for byte, with or without it.
    site : str, optional
        Of the raters of this site alone; sites must be strata.
    allot : callable, optional
        Takes the raters and sessions whose schedules are about to be drawn, and
        returns their rows; for schemes with rows. It is called when nothing stands
        against the draw. :func:`masrel.lab.conduct.allot_schedules` allots by the log.

    Returns
    -------
    tuple of Path
        The files written; empty when all were there.

    Raises
    ------
    ScheduleError
        If a schedule is stale or damaged and `redraw` is false; or a schedule that
        has to be drawn belongs to a session that has begun (it has a log, or
        grades on its sheet); or the file of the secret is damaged, or has the secret
        of another site; or there is no such site. Nothing is written then.
    OSError
        If the system refuses a folder or file.
    """
    every = _every_schedule(protocol, study, checked_site(protocol, site))
    problems: list[str] = []
    texts: dict[Path, str | bytes] = {}
    to_draw: list[_ScheduleFiles] = []
    stale: list[str] = []
    for files in every:
        fault = _fault(files, protocol)
        if fault is None:
            if not files.sheet.exists():
                texts[files.sheet] = _sheet_text(read_schedule(files.schedule))
            continue
        to_draw.append(files)
        if fault.drawn_from is not None and not redraw:
            stale.append(fault.drawn_from)
            continue
        problem = _refusal(files, fault.message, redraw=redraw)
        if problem is not None:
            problems.append(problem)
    problems += (
        f"{sentence}; --redraw draws those anew whose sessions have not begun"
        for sentence in stale_sentences(protocol, study, stale, len(every))
    )
    if problems:
        raise ScheduleError("\n".join(problems))
    if to_draw:
        texts |= _drawn_texts(protocol, study, to_draw, allot)
    make_folder(study.schedules, mode=0o700)
    write_files(texts, within=study.root)
    return tuple(texts)


def _drawn_texts(
    protocol: Protocol,
    study: StudyPaths,
    to_draw: Sequence[_ScheduleFiles],
    allot: Callable[[_Places], Mapping[tuple[str, str], int]] | None,
) -> dict[Path, str | bytes]:
    if protocol.schedule.scheme in WITH_ROWS and allot is None:
        raise ScheduleError(
            f"allot: needed with scheme {protocol.schedule.scheme}, whose rows are "
            "allotted by the study's log (masrel.lab.conduct.allot_schedules), got none"
        )
    if (problem := order_problem(protocol)) is not None:
        raise ScheduleError(f"{study.protocol}: {problem}")
    key = find_secret(study)
    if key is not None:
        for files in to_draw:  # refused before a row is allotted
            key.of(site_of(protocol, files.rater))
    texts: dict[Path, str | bytes] = {}
    drawn_from = content_file(study, presented_hash(protocol))
    if not drawn_from.exists():
        texts[drawn_from] = presented_content(protocol)
    rows = {} if allot is None else allot([(f.rater, f.session) for f in to_draw])
    key = key or new_secret(study)
    for files in to_draw:
        place = (files.rater, files.session)
        drawn = _draw_with_key(protocol, *place, key=key, row=rows.get(place))
        # The sheet gets its name first: one without its schedule is drawn anew.
        texts[files.sheet] = _sheet_text(drawn)
        texts[files.schedule] = _schedule_text(drawn)
    return texts


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
        Each problem with its file: damaged, stale, not what its secret draws where
        the study has that secret, a sheet with other codes, or a file that belongs to
        no rater and session. A schedule not drawn yet is none.
    """
    try:
        secret = find_secret(study)
    except ScheduleError as error:
        return (str(error),)
    if (problem := order_problem(protocol)) is not None:
        return (f"{study.protocol}: {problem}",)
    every = _every_schedule(protocol, study)
    problems: list[str] = []
    stale: list[str] = []
    for files in every:
        if not files.schedule.exists():
            continue
        fault = _fault(files, protocol)
        if fault is None:
            schedule = read_schedule(files.schedule)
            problem = _sheet_fault(files, schedule)
            problem = problem or _draw_fault(files, schedule, protocol, secret)
            problems += filter(None, [problem])
        elif fault.drawn_from is None:
            problems.append(fault.message)
        else:
            stale.append(fault.drawn_from)
    problems += stale_sentences(protocol, study, stale, len(every))
    expected = {path for files in every for path in (files.schedule, files.sheet)}
    for path in sorted(study.schedules.glob("*.csv")):
        if path not in expected:
            problems.append(
                f"{path}: needed schedules of the protocol's raters and sessions only, "
                "got a file of neither: put the rater back into the session (masrel "
                "withdraw keeps the grades of one who left), or move the file out of "
                "the study"
            )
    return tuple(problems)


def concealment_notes(protocol: Protocol, study: StudyPaths) -> tuple[str, ...]:
    """Say of which schedules the order is not concealed, or cannot be drawn again.

    Parameters
    ----------
    protocol : Protocol
        The study's protocol.
    study : StudyPaths
        Where the study is; files that :func:`schedule_problems` finds damaged are
        left out.

    Returns
    -------
    tuple of str
        A sentence each for a published secret, schedules drawn from the seed alone,
        schedules of another secret, folders that others may read, and logs of conduct
        that they may.
    """
    secret = find_secret(study)
    schedules = [
        read_schedule(files.schedule)
        for files in _every_schedule(protocol, study)
        if files.schedule.exists() and _fault(files, protocol) is None
    ]
    from_seed = sum(each.commitment is None for each in schedules)
    of_others = sum(
        each.commitment is not None
        and (secret is None or not secret.draws(each.site, each.commitment))
        for each in schedules
    )
    notes = []
    if study.published_secret_file.is_file():
        notes.append(
            f"{study.published_secret_file}: the secret is published, so that codes "
            "and orders drawn from it conceal nothing from who has read it"
        )
    if from_seed:
        notes.append(
            f"{study.schedules}: {from_seed} of {len(schedules)} schedules were "
            "drawn from the protocol's seed alone: a sheet gives their order away"
        )
    if of_others:
        notes.append(
            f"{study.schedules}: {of_others} of {len(schedules)} schedules are of a "
            "secret that is not in the study: they stay good, and cannot be drawn "
            "again for comparison"
        )
    return (*notes, *_open_to_others(study))


def _open_to_others(study: StudyPaths) -> Iterator[str]:
    if os.name != "posix":
        return
    for folder in (
        study.secret_file.parent,
        study.schedules,
        study.sessions,
        study.training,
        study.rehearsals,
    ):
        if folder.is_dir() and folder.stat().st_mode & 0o077:
            yield (
                f"{folder}: other users of this computer may read what names the "
                f"models; chmod 700 {shlex.quote(str(folder))} forbids it"
            )
    logs = [f"{log}" for log in study.conduct_logs() if log.stat().st_mode & 0o077]
    if logs:
        yield (
            f"{listed(logs)}: other users of this computer may read who did what and "
            f"why; chmod 600 {shlex.join(logs)} forbids it"
        )


def _every_schedule(
    protocol: Protocol, study: StudyPaths, site: str | None = None
) -> list[_ScheduleFiles]:
    return [
        _ScheduleFiles(
            rater=rater,
            session=session.id,
            schedule=study.schedule_file(rater, session.id),
            sheet=study.sheet_file(rater, session.id),
            typed=study.typed_file(rater, session.id),
            log=study.log_file(rater, session.id),
        )
        for session in protocol.sessions
        for rater in session.raters
        if site in (None, site_of(protocol, rater))
    ]


@dataclass(frozen=True, slots=True, kw_only=True)
class _Fault:
    """Why the file of a schedule cannot be used as it is."""

    message: str
    # of a stale one the hash of what was presented when it was drawn
    drawn_from: str | None = None


def _fault(files: _ScheduleFiles, protocol: Protocol) -> _Fault | None:
    if not files.schedule.exists():
        return _Fault(message=f"{files.schedule}: needed a schedule file, got none")
    try:
        schedule = read_schedule(files.schedule)
    except ScheduleError as error:
        return _Fault(message=str(error))
    if (schedule.rater, schedule.session) != (files.rater, files.session):
        return _Fault(
            message=f"{files.schedule}: needed the schedule of rater {files.rater} in "
            f"session {files.session}, got that of {schedule.rater} in "
            f"{schedule.session}"
        )
    try:
        check_schedule(schedule, protocol)
    except ScheduleError as error:
        is_stale = schedule.presented_sha256 != presented_hash(protocol)
        return _Fault(
            message=f"{files.schedule}: {error}",
            drawn_from=schedule.presented_sha256 if is_stale else None,
        )
    return None


def _refusal(files: _ScheduleFiles, fault: str, *, redraw: bool) -> str | None:
    # Why a schedule with this fault may not be drawn, or None.
    if files.log.exists():
        return (
            f"{fault}. It was not drawn, because the session has begun: {files.log} "
            "was recorded by the schedule there was. Bring back that schedule and its "
            "protocol, or move the log out of the study"
        )
    if files.sheet.exists() and _is_filled_in(files.sheet):
        return (
            f"{fault}. It was not drawn, because {files.sheet} has grades on it. Move "
            "the sheet out of the study first"
        )
    if files.typed.exists():
        return (
            f"{fault}. It was not drawn, because its sheet was printed, and what is on "
            f"paper could not be entered any more. Move {files.typed} out of the study "
            "first"
        )
    if files.schedule.exists() and not redraw:
        return f"{fault}. It was kept; --redraw draws it anew"
    return None


def _is_filled_in(sheet: Path) -> bool:
    # A blank sheet's rows, and none but they, end at the comma before the grade.
    rows = [row for row in _sheet_lines(sheet) if not row.startswith("#")][1:]
    return any(not row.endswith(",") for row in rows if row)


def _sheet_lines(sheet: Path) -> list[str]:
    data = read_regular(sheet, most=MAX_SMALL)
    return data.decode("utf-8", errors="replace").splitlines()


def _sheet_fault(files: _ScheduleFiles, schedule: Schedule) -> str | None:
    # The sheet may be missing or have grades, but its codes are the schedule's.
    if not files.sheet.exists():
        return None
    lines = _sheet_lines(files.sheet)
    problem = _format_problem(lines)
    if problem is not None:
        return f"{files.sheet}: {problem}"
    below = [line for line in lines if line and not line.startswith("#")][1:]
    rows = [tuple(row.split(",")[:2]) for row in below]
    expected = [(str(s.position), s.code) for s in schedule.presentations]
    if rows == expected:
        return None
    return (
        f"{files.sheet}: needed the positions and codes of {files.schedule.name}, "
        "got others"
    )


def _draw_fault(
    files: _ScheduleFiles,
    schedule: Schedule,
    protocol: Protocol,
    secret: StudySecret | None,
) -> str | None:
    # Whether the study's secret draws another order or other codes than are there.
    if secret is None or not secret.draws(schedule.site, schedule.commitment):
        return None
    drawn = _draw_with_key(
        protocol, files.rater, files.session, key=secret, row=schedule.row
    )
    if drawn.presentations == schedule.presentations:
        return None
    return (
        f"{files.schedule}: needed the order and codes that the study's secret draws, "
        "got others"
    )


def _schedule_text(schedule: Schedule) -> str:
    """Write a schedule as the text of its file."""
    values = {key: getattr(schedule, key) for key in _HEAD}
    head = [f"# format: {_FORMAT}"]
    head += [f"# {key}: {value}" for key, value in values.items() if value is not None]
    rows = [
        f"{shown.position},{shown.code},{shown.model},{shown.repeat}"
        for shown in schedule.presentations
    ]
    return "\n".join([*head, ",".join(_COLUMNS), *rows]) + "\n"


def _sheet_text(schedule: Schedule) -> str:
    """Write the blinded sheet on which a rater's grades are noted."""
    rows = [f"{shown.position},{shown.code}," for shown in schedule.presentations]
    head = f"# format: {_FORMAT}"
    return "\n".join([head, ",".join(_SHEET_COLUMNS), *rows]) + "\n"
