"""The files of schedules and raters' sheets: drawn once, kept, found stale."""

import hashlib
import json
import os
import shlex
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from masrel._files import make_folder, write_files
from masrel._input import listed
from masrel.errors import ScheduleError
from masrel.lab._bounded_files import MAX_SMALL, read_regular
from masrel.lab.protocol import (
    Protocol,
    StudyPaths,
    presented_content,
    presented_hash,
)
from masrel.lab.schedule._orders import WITH_ROWS, order_problem
from masrel.lab.schedule._secret import (
    StudySecret,
    checked_site,
    find_secret,
    new_secret,
    site_of,
)
from masrel.lab.schedule.presentation import (
    Schedule,
    _draw_with_key,
    _format_problem,
    _require_place,
    _schedule_text,
    _sheet_text,
    check_schedule,
    read_schedule,
)


@dataclass(frozen=True, slots=True, kw_only=True)
class _ScheduleFiles:
    """One rater in one session, and the files that belong to the two."""

    rater: str
    session: str
    schedule: Path
    sheet: Path
    typed: Path  # there once the sheet has been printed
    log: Path


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
    _require_its_own(schedule, path, rater, session)
    check_schedule(schedule, protocol)
    return schedule


def _require_its_own(schedule: Schedule, file: Path, rater: str, session: str) -> None:
    """Refuse a file that has the schedule of somebody else, or of another session."""
    if (schedule.rater, schedule.session) != (rater, session):
        raise ScheduleError(
            f"{file}: needed the schedule of rater {rater} in session {session}, got "
            f"that of {schedule.rater} in {schedule.session}"
        )


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
        message, drawn_from = fault
        if drawn_from is not None and not redraw:
            stale.append(drawn_from)
        elif (problem := _refusal(files, message, redraw=redraw)) is not None:
            problems.append(problem)
    problems += (
        f"{sentence}; --redraw draws those anew whose sessions have not begun"
        for sentence in _stale_sentences(protocol, study, stale, len(every))
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
    drawn_from = _content_file(study, presented_hash(protocol))
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
        elif fault[1] is None:
            problems.append(fault[0])
        else:
            stale.append(fault[1])
    problems += _stale_sentences(protocol, study, stale, len(every))
    expected = {path for files in every for path in (files.schedule, files.sheet)}
    for path in sorted(study.schedules.glob("*.csv")):
        if path not in expected:
            problems.append(
                f"{path}: needed schedules of the protocol's raters and sessions only, "
                "got a file of neither: put the rater back into the session (masrel "
                "record withdraw keeps the grades of one who left), or move the file "
                "out of the study"
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
    notes = (
        (
            study.published_secret_file.is_file(),
            f"{study.published_secret_file}: the secret is published, so that codes "
            "and orders drawn from it conceal nothing from who has read it",
        ),
        (
            from_seed,
            f"{study.schedules}: {from_seed} of {len(schedules)} schedules were "
            "drawn from the protocol's seed alone: a sheet gives their order away",
        ),
        (
            of_others,
            f"{study.schedules}: {of_others} of {len(schedules)} schedules are of a "
            "secret that is not in the study: they stay good, and cannot be drawn "
            "again for comparison",
        ),
    )
    return (*(note for is_so, note in notes if is_so), *_open_to_others(study))


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


def _fault(files: _ScheduleFiles, protocol: Protocol) -> tuple[str, str | None] | None:
    """Return why the file of a schedule cannot be used as it is, or None.

    With it of a stale one comes the hash of what was presented when it was drawn.
    """
    if not files.schedule.exists():
        return f"{files.schedule}: needed a schedule file, got none", None
    try:
        schedule = read_schedule(files.schedule)
        _require_its_own(schedule, files.schedule, files.rater, files.session)
    except ScheduleError as error:
        return str(error), None
    try:
        check_schedule(schedule, protocol)
    except ScheduleError as error:
        drawn_from = schedule.presented_sha256
        is_stale = drawn_from != presented_hash(protocol)
        return f"{files.schedule}: {error}", drawn_from if is_stale else None
    return None


def _refusal(files: _ScheduleFiles, fault: str, *, redraw: bool) -> str | None:
    # Why a schedule with this fault may not be drawn, or None.
    rules = (
        (
            files.log.exists(),
            f"It was not drawn, because the session has begun: {files.log} was "
            "recorded by the schedule there was. Bring back that schedule and its "
            "protocol, or move the log out of the study",
        ),
        (
            files.sheet.exists() and _is_filled_in(files.sheet),
            f"It was not drawn, because {files.sheet} has grades on it. Move the sheet "
            "out of the study first",
        ),
        (
            files.typed.exists(),
            "It was not drawn, because its sheet was printed, and what is on paper "
            f"could not be entered any more. Move {files.typed} out of the study first",
        ),
        (
            files.schedule.exists() and not redraw,
            "It was kept; --redraw draws it anew",
        ),
    )
    return next((f"{fault}. {why}" for is_so, why in rules if is_so), None)


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


_SHOWN = 4  # keys that are named

_NOT_SET = object()


def _content_file(study: StudyPaths, sha256: str) -> Path:
    """Return the file that keeps what schedules with this hash were drawn from."""
    return study.schedules / f"presented_{sha256[:12]}.json"


def _stale_sentences(
    protocol: Protocol, study: StudyPaths, drawn_from: Iterable[str], n_schedules: int
) -> Iterator[str]:
    """Yield a sentence for all schedules that were drawn from the same protocol."""
    # drawn_from: hash of what was presented at the draw, of each stale schedule
    for sha256, n_stale in Counter(drawn_from).items():
        changes = _changes(protocol, _content_file(study, sha256), sha256)
        are = "is" if n_stale == 1 else "are"
        yield (
            f"{study.protocol}: {changes} since the draw: {n_stale} of {n_schedules} "
            f"schedules {are} stale"
        )


def _changes(protocol: Protocol, file: Path, sha256: str) -> str:
    drawn = file.read_bytes() if file.is_file() else b""
    if hashlib.sha256(drawn).hexdigest() != sha256:
        return (
            "a key of the study id, scale, elbow, models, schedule, stretch, "
            "presentation, occasions or device has changed"
        )
    before, now = (
        dict(_leaves(json.loads(text))) for text in (drawn, presented_content(protocol))
    )
    # of a model that is new or gone its place in the list says all
    gone = {k for k in before.keys() ^ now.keys() if k.startswith("models.")}
    both = {k.split(".")[1] for k in before if k.startswith("models.")} & {
        k.split(".")[1] for k in now if k.startswith("models.")
    }
    keys = [
        key
        for key in [*now, *(key for key in before if key not in now)]
        if before.get(key, _NOT_SET) != now.get(key, _NOT_SET)
        and (key not in gone or key.split(".")[1] in both)
    ]
    shown = [
        f"{key} was {_text(before.get(key, _NOT_SET))} and is "
        f"{_text(now.get(key, _NOT_SET))}"
        for key in keys[:_SHOWN]
    ]
    more = len(keys) - _SHOWN
    return ", ".join(shown) + (f", and {more} more keys differ" if more > 0 else "")


def _leaves(content: Any, place: str = "") -> Iterator[tuple[str, object]]:
    # keys of a document with dots between; models by their ids, and the list of these
    if place == "models":
        yield place, [model["id"] for model in content]
        content = {model["id"]: model for model in content}
    if isinstance(content, dict):
        for key, value in content.items():
            yield from _leaves(value, f"{place}.{key}".lstrip("."))
    else:
        yield place, content


def _text(value: object) -> str:
    return "not set" if value is _NOT_SET else json.dumps(value, ensure_ascii=False)
