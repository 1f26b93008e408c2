"""The files of schedules and sheets: drawn once, kept, found stale, counted."""

import json
import os
import shlex
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import chain, groupby, pairwise
from pathlib import Path

from masrel._files import make_folder, write_files
from masrel._input import listed, refuse
from masrel.errors import ScheduleError
from masrel.lab._study_files import MAX_SMALL, read_regular, sha256_of
from masrel.lab.protocol import (
    Protocol,
    StudyPaths,
    presented_content,
    presented_hash,
)
from masrel.lab.protocol.content import _content_differences
from masrel.lab.schedule._orders import WITH_ROWS, order_problem
from masrel.lab.schedule._secret import (
    StudySecret,
    checked_site,
    find_secret,
    new_secret,
    rater_sessions_at,
    site_of,
)
from masrel.lab.schedule.presentation import (
    Schedule,
    _closed,
    _format_problem,
    _read_drawn,
    _require_place,
    _schedule_text,
    _sheet_text,
    check_schedule,
    draw_schedule,
    read_schedule,
)

__all__ = ["concealment_notes", "schedule_problems", "write_schedules"]


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
    return _open_schedule(study, protocol, schedule)


def _open_schedule(
    study: StudyPaths, protocol: Protocol, schedule: Schedule
) -> Schedule:
    """Return a schedule with its models, those of a sealed one by the secret."""
    if not schedule.is_closed:
        return schedule
    secret = find_secret(study)
    file = study.schedule_file(schedule.rater, schedule.session)
    if secret is None or not secret.draws(schedule.site, schedule.commitment):
        raise ScheduleError(
            f"{file}: is sealed: needed the secret that it was drawn from in "
            f"{study.secret_file}, got {'none' if secret is None else 'another'}"
        )
    place = schedule.rater, schedule.session
    drawn = draw_schedule(protocol, *place, secret=secret, row=schedule.row)
    # whatever the protocol says of it now, this one was sealed
    drawn = replace(schedule, presentations=drawn.presentations)
    if _closed(drawn) != schedule:
        raise ScheduleError(
            f"{file}: needed the codes that its secret draws, got others"
        )
    return drawn


def _require_its_own(schedule: Schedule, file: Path, rater: str, session: str) -> None:
    """Refuse a file that has the schedule of somebody else, or of another session."""
    if (schedule.rater, schedule.session) != (rater, session):
        raise ScheduleError(
            f"{file}: needed the schedule of rater {rater} in session {session}, got "
            f"that of {schedule.rater} in {schedule.session}"
        )


_RaterSession = tuple[str, str]  # a rater and a session


def write_schedules(
    protocol: Protocol,
    study: StudyPaths,
    *,
    redraw: bool = False,
    site: str | None = None,
    allot: Callable[[Sequence[_RaterSession]], Mapping[_RaterSession, int]]
    | None = None,
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
        Draw stale or damaged schedules again. Schedules that still fit stay as they
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
    every = rater_sessions_at(protocol, checked_site(protocol, site))
    faults = {place: _fault(study, place, protocol) for place in every}
    problems: list[str] = []
    texts: dict[Path, str | bytes] = {}
    stale: list[str] = []
    for place, fault in faults.items():
        if fault is None:
            if not study.sheet_file(*place).exists():
                schedule = read_schedule(study.schedule_file(*place))
                texts[study.sheet_file(*place)] = _sheet_text(schedule)
        elif fault[1] is not None and not redraw:
            stale.append(fault[1])
        elif (problem := _refusal(study, place, fault[0], redraw=redraw)) is not None:
            problems.append(problem)
    problems += (
        f"{sentence}; --redraw draws again those whose sessions have not begun"
        for sentence in _stale_sentences(protocol, study, stale, len(every))
    )
    if problems:
        raise ScheduleError("\n".join(problems))
    if to_draw := [place for place, fault in faults.items() if fault is not None]:
        texts |= _drawn_texts(protocol, study, to_draw, allot)
    make_folder(study.schedules, mode=0o700)
    write_files(texts, within=study.root)
    return tuple(texts)


def _drawn_texts(
    protocol: Protocol,
    study: StudyPaths,
    to_draw: Sequence[_RaterSession],
    allot: Callable[[Sequence[_RaterSession]], Mapping[_RaterSession, int]] | None,
) -> dict[Path, str | bytes]:
    problem = order_problem(protocol)
    refuse(
        (
            protocol.schedule.scheme in WITH_ROWS and allot is None,
            f"allot: needed with scheme {protocol.schedule.scheme}, whose rows are "
            "allotted by the study's log (masrel.lab.conduct.allot_schedules), got "
            "none",
        ),
        (problem is not None, f"{study.protocol}: {problem}"),
        error=ScheduleError,
    )
    key = find_secret(study)
    there = [*_read_drawn(study, protocol.rater_sessions, skips_damaged=True)]
    if key is not None:
        for rater, _ in to_draw:  # refused before a row is allotted
            key.of(site_of(protocol, rater))
        for file, drawn in there:
            is_kept = (drawn.rater, drawn.session) not in to_draw
            if is_kept and drawn.commitment not in (None, key.commitment):
                raise ScheduleError(
                    f"{study.secret_file}: needed the secret of {file.name}, whose "
                    f"commitment is {drawn.commitment}, got another"
                )
    texts: dict[Path, str | bytes] = {}
    drawn_from = _content_file(study, presented_hash(protocol))
    if not drawn_from.exists():
        texts[drawn_from] = presented_content(protocol)
    # whatever the protocol says now, what was sealed at the first draw stays so
    is_sealed = protocol.blinding.sealed or any(each.sealed for _, each in there)
    rows = {} if allot is None else allot(to_draw)
    key = key or new_secret(study)
    for place in to_draw:
        drawn = draw_schedule(protocol, *place, secret=key, row=rows.get(place))
        if is_sealed:
            drawn = _closed(replace(drawn, sealed=True))
        # The sheet gets its name first: one without its schedule is drawn anew.
        texts[study.sheet_file(*place)] = _sheet_text(drawn)
        texts[study.schedule_file(*place)] = _schedule_text(drawn)
        study.opened_file(*place).unlink(missing_ok=True)  # of what was drawn before
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
        no rater and session. A schedule that is not drawn yet does not count.
    """
    try:
        secret = find_secret(study)
    except ScheduleError as error:
        return (str(error),)
    if (problem := order_problem(protocol)) is not None:
        return (f"{study.protocol}: {problem}",)
    every = protocol.rater_sessions
    problems: list[str] = []
    stale: list[str] = []
    for place in every:
        if not study.schedule_file(*place).exists():
            continue
        fault = _fault(study, place, protocol)
        if fault is None:
            schedule = read_schedule(study.schedule_file(*place))
            problem = _sheet_fault(study.sheet_file(*place), schedule)
            problem = problem or _draw_fault(study, schedule, protocol, secret)
            problems += filter(None, [problem])
        elif fault[1] is None:
            problems.append(fault[0])
        else:
            stale.append(fault[1])
    problems += _stale_sentences(protocol, study, stale, len(every))
    expected = {study.schedule_file(*place) for place in every}
    expected |= {study.sheet_file(*place) for place in every}
    problems += (
        f"{path}: needed schedules of the protocol's raters and sessions only, got a "
        "file of neither: put the rater back into the session (masrel record withdraw "
        "keeps the grades of one who left), or move the file out of the study"
        for path in sorted(study.schedules.glob("*.csv"))
        if path not in expected
    )
    return tuple(problems)


def concealment_notes(protocol: Protocol, study: StudyPaths) -> tuple[str, ...]:
    """Name the schedules whose order is not concealed or cannot be drawn again.

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
    fitting = [p for p in protocol.rater_sessions if _fault(study, p, protocol) is None]
    schedules = [schedule for _, schedule in _read_drawn(study, fitting)]
    from_seed = sum(each.commitment is None for each in schedules)
    secret = find_secret(study)
    of_others = sum(_is_of_another(secret, each) for each in schedules)
    notes = (
        (
            study.published_secret_file.is_file(),
            f"{study.published_secret_file}: the secret is published, so that codes "
            "and orders drawn from it are concealed no longer",
        ),
        (
            from_seed,
            f"{study.schedules}: {from_seed} of {len(schedules)} schedules were "
            "drawn from the protocol's seed alone: a sheet gives their order away",
        ),
        (
            of_others,
            f"{study.schedules}: {of_others} of {len(schedules)} schedules were "
            "drawn from a secret that is not in the study: they stay valid, but cannot "
            "be drawn again for comparison",
        ),
    )
    return (*(note for is_so, note in notes if is_so), *_open_to_others(study))


def _of_another_secret(
    protocol: Protocol, study: StudyPaths
) -> Iterator[tuple[Path, str]]:
    """Yield schedules that were not drawn from the secret that the study has."""
    with suppress(ScheduleError):  # which `schedule_problems` has
        secret = find_secret(study)
        for path, each in _read_drawn(study, protocol.rater_sessions):
            if secret is not None and _is_of_another(secret, each):
                yield path, "was drawn from another secret than the study has now"


def _is_of_another(secret: StudySecret | None, schedule: Schedule) -> bool:
    return schedule.commitment is not None and (
        secret is None or not secret.draws(schedule.site, schedule.commitment)
    )


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
                f"{folder}: other users of this computer can read which models were "
                f"presented; chmod 700 {shlex.quote(str(folder))} prevents it"
            )
    logs = [f"{log}" for log in study.conduct_logs() if log.stat().st_mode & 0o077]
    if logs:
        yield (
            f"{listed(logs)}: other users of this computer can read who did what and "
            f"why; chmod 600 {shlex.join(logs)} prevents it"
        )


def _fault(
    study: StudyPaths, place: _RaterSession, protocol: Protocol
) -> tuple[str, str | None] | None:
    """Return why the file of a schedule cannot be used as it is, or None.

    With it of a stale one comes the hash of what was presented when it was drawn.
    """
    file = study.schedule_file(*place)
    if not file.exists():
        return f"{file}: needed a schedule file, got none", None
    try:
        schedule = read_schedule(file)
        _require_its_own(schedule, file, *place)
    except ScheduleError as error:
        return str(error), None
    try:
        check_schedule(schedule, protocol)
    except ScheduleError as error:
        drawn_from = schedule.presented_sha256
        is_stale = drawn_from != presented_hash(protocol)
        return f"{file}: {error}", drawn_from if is_stale else None
    return None


def _refusal(
    study: StudyPaths, place: _RaterSession, fault: str, *, redraw: bool
) -> str | None:
    # Why a schedule with this fault may not be drawn, or None.
    log, sheet = study.log_file(*place), study.sheet_file(*place)
    typed = study.typed_file(*place)  # there once the sheet has been printed
    rules = (
        (
            log.exists(),
            f"It was not drawn, because the session has begun: {log} was "
            "recorded with the earlier schedule. Restore that schedule and its "
            "protocol, or move the log out of the study",
        ),
        (
            sheet.exists() and _is_filled_in(sheet),
            f"It was not drawn, because {sheet} has grades on it. Move the sheet out "
            "of the study first",
        ),
        (
            typed.exists(),
            "It was not drawn, because its sheet was printed and could then no "
            f"longer be entered. Move {typed} out of the study first",
        ),
        (
            study.schedule_file(*place).exists() and not redraw,
            "It was kept; --redraw draws it again",
        ),
    )
    return next((f"{fault}. {why}" for is_so, why in rules if is_so), None)


def _is_filled_in(sheet: Path) -> bool:
    # A blank sheet's rows, and none but they, end at the comma before the grade.
    _, rows = _read_sheet(sheet)
    return any(not row.endswith(",") for row in rows)


def _read_sheet(sheet: Path) -> tuple[list[str], list[str]]:
    # every line, and those below the names of the columns
    data = read_regular(sheet, most=MAX_SMALL)
    lines = data.decode("utf-8", errors="replace").splitlines()
    return lines, [line for line in lines if line and not line.startswith("#")][1:]


def _sheet_fault(sheet: Path, schedule: Schedule) -> str | None:
    # The sheet may be missing or have grades, but its codes are the schedule's.
    if not sheet.exists():
        return None
    lines, rows = _read_sheet(sheet)
    if (problem := _format_problem(lines)) is not None:
        return f"{sheet}: {problem}"
    expected = [[str(s.position), s.code] for s in schedule.presentations]
    if [row.split(",")[:2] for row in rows] == expected:
        return None
    of_schedule = f"{schedule.session}_{schedule.rater}.csv"
    return f"{sheet}: needed the positions and codes of {of_schedule}, got others"


def _draw_fault(
    study: StudyPaths,
    schedule: Schedule,
    protocol: Protocol,
    secret: StudySecret | None,
) -> str | None:
    # Whether the study's secret draws another order or other codes than are there.
    if secret is None or not secret.draws(schedule.site, schedule.commitment):
        return None
    place = schedule.rater, schedule.session
    drawn = draw_schedule(protocol, *place, secret=secret, row=schedule.row)
    drawn = _closed(drawn) if schedule.is_closed else drawn
    if drawn.presentations == schedule.presentations:
        return None
    return (
        f"{study.schedule_file(*place)}: needed the order and codes that the study's "
        "secret draws, got others"
    )


_SHOWN = 4  # keys that are named


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
    if sha256_of(drawn) != sha256:
        return (
            "a key of the study id, scale, elbow, models, schedule, stretch, "
            "presentation, occasions or device has changed"
        )
    changed = _content_differences(
        json.loads(drawn), json.loads(presented_content(protocol))
    )
    shown = [
        f"{key} was {_as_json(was)} and is {_as_json(now)}" for key, was, now in changed
    ]
    more = len(shown) - _SHOWN
    others = f", and {more} more keys differ" if more > 0 else ""
    return ", ".join(shown[:_SHOWN]) + others


@dataclass(frozen=True, slots=True, kw_only=True)
class _OrderBalance:
    """Counts over the schedules of a session, and of a site where sites are strata."""

    session: str
    site: str | None
    models: tuple[str, ...]
    n_schedules: int
    # how often a model stands in a place, a row each
    places: tuple[tuple[int, ...], ...]
    # how often a model, a row each, is followed by another at once
    pairs: tuple[tuple[int, ...], ...]
    # of each schedule, the longest run of a model, of an intended grade, of standards
    model_runs: tuple[int, ...]
    grade_runs: tuple[int, ...]
    standard_runs: tuple[int, ...]

    @property
    def n_places(self) -> int:
        """Presentations of one schedule."""
        return len(self.places[0])

    @property
    def of_others(self) -> tuple[int, ...]:
        """Counts of ordered pairs of two models."""
        return tuple(
            freq
            for i, row in enumerate(self.pairs)
            for j, freq in enumerate(row)
            if i != j
        )


def _order_balance(
    protocol: Protocol, study: StudyPaths, site: str | None = None
) -> tuple[_OrderBalance, ...]:
    """Count the drawn schedules of a study, or of one of its sites."""
    pairs = rater_sessions_at(protocol, checked_site(protocol, site))
    drawn: dict[tuple[str, str | None], list[Schedule]] = {}
    for _, schedule in _read_drawn(study, pairs):
        check_schedule(schedule, protocol)
        if schedule.is_closed:
            raise ScheduleError(
                f"{study.schedules}: needed schedules that say their models, got "
                "sealed ones: masrel record unblind --all opens them once every "
                "session is over"
            )
        group = schedule.session, site_of(protocol, schedule.rater)
        drawn.setdefault(group, []).append(schedule)
    if not drawn:
        raise ScheduleError(f"{study.schedules}: needed drawn schedules, got none")
    return tuple(
        _balance(protocol, schedules, *group) for group, schedules in drawn.items()
    )


def _balance(
    protocol: Protocol, schedules: Sequence[Schedule], session: str, site: str | None
) -> _OrderBalance:
    orders = [[shown.model for shown in each.presentations] for each in schedules]
    models = [model.id for model in protocol.models]
    places = Counter(chain.from_iterable(map(enumerate, orders)))
    pairs = Counter(chain.from_iterable(map(pairwise, orders)))
    grades = {model.id: model.intended_grade for model in protocol.models}
    standards = {
        model.id: model.role if model.role == "standard" else None
        for model in protocol.models
    }
    runs = [
        tuple(_longest(order, kinds) for order in orders)
        for kinds in ({model: model for model in models}, grades, standards)
    ]
    return _OrderBalance(
        session=session,
        site=site,
        models=tuple(models),
        n_schedules=len(orders),
        places=tuple(
            tuple(places[place, model] for place in range(len(orders[0])))
            for model in models
        ),
        pairs=tuple(
            tuple(pairs[model, following] for following in models) for model in models
        ),
        model_runs=runs[0],
        grade_runs=runs[1],
        standard_runs=runs[2],
    )


def _longest(order: Sequence[str], kinds: Mapping[str, str | None]) -> int:
    """Return the longest run of models of one kind; those of None are of no kind."""
    runs = groupby(order, key=kinds.__getitem__)
    return max((len(list(run)) for kind, run in runs if kind is not None), default=0)


def _as_json(value: object) -> str:
    return "not set" if value is None else json.dumps(value, ensure_ascii=False)
