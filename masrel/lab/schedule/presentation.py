"""The schedule of one rater in one session: drawing it, checking it, and its file."""

import re
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import masrel
from masrel._input import not_utf8, refuse
from masrel.errors import ScheduleError
from masrel.lab._study_files import (
    MAX_SMALL,
    check_format,
    csv_format,
    format_problem,
    lines_then,
    once,
    read_regular,
    repeated,
    table_csv,
)
from masrel.lab.protocol import Protocol, StudyPaths, presented_hash, protocol_hash
from masrel.lab.protocol.study import _OPENED
from masrel.lab.schedule._orders import WITH_ROWS, draw_order
from masrel.lab.schedule._secret import Stream, StudySecret, site_of

__all__ = [
    "Presentation",
    "Schedule",
    "check_schedule",
    "draw_schedule",
    "is_sealed",
    "read_schedule",
]

# No letter that reads as a digit (I, O, Q, S, Z), that makes a number of the code
# (E), or that says left or right (L, R).
_CODE_LETTERS = "ABCDFGHJKMNPTUVWXY"


@dataclass(frozen=True, slots=True, kw_only=True)
class Presentation:
    """One model put to one rater once.

    Attributes
    ----------
    position : int
        Place in the session, from 1.
    code : str
        Blinded name, all that the rater sees; unique in the session.
    model : str
        Id of the haptic model.
    repeat : int
        Which of the model's presentations in the session, from 1.
    """

    position: int
    code: str
    model: str
    repeat: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Schedule:
    """What one rater meets in one session, in order, and where it comes from.

    Attributes
    ----------
    study, rater, session : str
        Their ids.
    seed : int
        The protocol's seed at drawing.
    scheme : str
        The protocol's scheme at drawing.
    protocol_sha256 : str
        Hash of the whole protocol at drawing.
    presented_sha256 : str
        Hash of what decides what a rater meets; when it differs from the
        protocol's, the schedule is stale.
    masrel_version : str
        Version that drew it.
    presentations : tuple of Presentation
        In order of presentation.
    commitment : str or None
        Hash of the secret that decided order and codes: when the secret is published,
        it shows that no other was used. None when the seed alone decided.
    site : str or None
        The rater's site, where sites are strata.
    row : int or None
        Which row of a design the rater has, from 1; None where orders have no rows.
    sealed : bool
        Whether its file has no models; until the study is unsealed each is then called
        ``sealed``, and its repeat is its position.
    """

    study: str
    rater: str
    session: str
    seed: int
    scheme: str
    protocol_sha256: str
    presented_sha256: str
    masrel_version: str
    presentations: tuple[Presentation, ...]
    commitment: str | None = None
    site: str | None = None
    row: int | None = None
    sealed: bool = False

    @property
    def is_closed(self) -> bool:
        """Whether nobody says yet which models it has."""
        return any(shown.model == _SEALED for shown in self.presentations)


def draw_schedule(
    protocol: Protocol,
    rater: str,
    session: str,
    *,
    secret: bytes | StudySecret | None = None,
    row: int | None = None,
) -> Schedule:
    """Draw the order and the blinded codes of one rater in one session.

    Parameters
    ----------
    protocol : Protocol
        The study's protocol; its seed, models and repeats decide the draw.
    rater, session : str
        Their ids.
    secret : bytes or StudySecret, optional
        16 random bytes that decide the draw together with the seed, or the secret that
        a study or the copy of a site has. Without it the seed alone decides, and who
        knows it knows every order.
    row : int, optional
        Row of a design, from 1; schemes ``williams`` and ``latin-square`` need one,
        the others have none. :func:`masrel.lab.conduct.allot_schedules` allots them.

    Returns
    -------
    Schedule
        Every model as often as the protocol repeats it, in an order of its scheme.

    Raises
    ------
    ScheduleError
        If the session is not the protocol's or does not have the rater, the secret
        has another length, a row is missing or named for a scheme without rows, or no
        order keeps the limits of the scheme.

    Notes
    -----
    Order and codes come from two streams for each session and rater alone, so
    adding a rater, a session or a repeat of another study moves nobody else's
    schedule; rows come from streams of the session, and of the site where sites are
    strata. With a secret nobody can tell one stream from the other without it: all
    codes of a study say nothing about its orders.
    """
    key = StudySecret.of_study(secret) if isinstance(secret, bytes) else secret
    _require_place(protocol, rater, session)
    site = site_of(protocol, rater)
    drawn_by = None if key is None else key.of(site)
    shown = draw_order(protocol, rater, session, site=site, row=row, secret=drawn_by)
    stream = Stream(protocol.schedule.seed, "codes", session, rater, secret=drawn_by)
    codes = _draw_codes(protocol, len(shown), stream)
    return Schedule(
        study=protocol.study.id,
        rater=rater,
        session=session,
        seed=protocol.schedule.seed,
        scheme=protocol.schedule.scheme,
        protocol_sha256=protocol_hash(protocol),
        presented_sha256=presented_hash(protocol),
        masrel_version=masrel.__version__,
        presentations=tuple(
            Presentation(position=place, code=code, model=model, repeat=repeat)
            for place, (code, (model, repeat)) in enumerate(
                zip(codes, shown, strict=True), start=1
            )
        ),
        commitment=None if key is None else key.commitment,
        site=site,
        row=row,
        sealed=protocol.blinding.sealed,
    )


def _draw_codes(protocol: Protocol, n_codes: int, stream: Stream) -> list[str]:
    # Two digits and a letter, such as 47K: 1800 codes, of which at most 500 are
    # needed and 500 are some model's id, so that the draw always ends.
    taken = {model.id.upper() for model in protocol.models}
    codes: list[str] = []
    while len(codes) < n_codes:
        number, letter = divmod(
            stream.below(100 * len(_CODE_LETTERS)), len(_CODE_LETTERS)
        )
        code = f"{number:02d}{_CODE_LETTERS[letter]}"
        if code not in taken:
            taken.add(code)
            codes.append(code)
    return codes


def check_schedule(schedule: Schedule, protocol: Protocol) -> None:
    """Refuse a schedule that was not drawn from what the protocol presents now.

    Parameters
    ----------
    schedule : Schedule
        A schedule.
    protocol : Protocol
        The study's protocol.

    Raises
    ------
    ScheduleError
        If study, rater or session are not the protocol's, what is presented has
        changed since the draw, the site is not that of the rater, a row is missing,
        or the presentations do not have every model as often as the protocol
        repeats it.

    Notes
    -----
    A protocol may still change in its texts, raters, sessions, plan and report;
    :func:`masrel.lab.protocol.presented_hash` has the rest. The stored order is not
    drawn again for comparison: the file is the schedule, the seed its provenance.
    """
    where = f"schedule of rater {schedule.rater} in session {schedule.session}"
    if schedule.study != protocol.study.id:
        raise ScheduleError(
            f"{where}: needed study {protocol.study.id}, got {schedule.study}"
        )
    _require_place(protocol, schedule.rater, schedule.session)
    expected = Counter(
        (model.id, repeat)
        for model in protocol.models
        for repeat in range(1, protocol.schedule.repeats + 1)
    )
    scheduled = Counter((shown.model, shown.repeat) for shown in schedule.presentations)
    site, row = site_of(protocol, schedule.rater), schedule.row
    rules = (
        (
            schedule.presented_sha256 != presented_hash(protocol),
            "one drawn from the protocol as it is, got one from before a change in "
            "what it presents; masrel check names the keys",
        ),
        (
            schedule.site != site,
            f"one drawn for site {site}, got one for {schedule.site}",
        ),
        (
            (row is None) == (schedule.scheme in WITH_ROWS),
            f"{'a' if row is None else 'no'} row with scheme {schedule.scheme}, got "
            f"{'none' if row is None else row}",
        ),
        # Names of models would tell the rater at the console which ones are missing.
        (
            expected != scheduled and not schedule.is_closed,
            "every model of the protocol once per repeat, got rows with "
            f"{(expected - scheduled).total()} of these missing and "
            f"{(scheduled - expected).total()} others",
        ),
    )
    for is_broken, needs in rules:
        if is_broken:
            raise ScheduleError(f"{where}: needed {needs}")


def _require_place(protocol: Protocol, rater: str, session: str) -> None:
    """Refuse a rater and session the protocol does not bring together."""
    raters = {each.id: each.raters for each in protocol.sessions}
    of_session = raters.get(session, ())
    refuse(
        (
            session not in raters,
            f"session: needed one of {', '.join(raters)}, got {session!r}",
        ),
        (
            rater not in of_session,
            f"rater: needed one of {', '.join(of_session)} for session {session}, got "
            f"{rater!r}",
        ),
        error=ScheduleError,
    )


# Version of the files of schedules and sheets; a file without one is of version 1
_FORMAT = 1

# Keys of the ``# key: value`` lines, in order, and what their values look like
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
    "sealed": r"True",
}

_WHOLE = ("seed", "row")  # those whose values are whole numbers

# Those that a schedule without a secret, without strata, or without rows has not
_OPTIONAL = ("commitment", "site", "row", "sealed")

_NO = (None, False)  # values of keys that a schedule has not

_COLUMNS = ["position", "code", "model", "repeat"]
_SHEET_COLUMNS = ["position", "code", "grade"]

_SEALED = "(sealed)"  # no id of a model
"""What replaces the id of a model that nobody may know."""

# A code names a recording's file, so it is letters and digits only.
_CODE = re.compile(r"[0-9A-Za-z]{1,16}")


@once
def read_schedule(path: Path) -> Schedule:
    """Read a schedule file.

    Parameters
    ----------
    path : Path
        A file that `write_schedules` wrote.

    Returns
    -------
    Schedule
        The schedule; `check_schedule` compares it with a protocol.

    Raises
    ------
    ScheduleError
        If there is no such file, or it is not a schedule: the message has every
        problem with file and line.
    """
    try:
        lines = read_regular(path, most=MAX_SMALL).decode("utf-8").splitlines()
    except OSError as error:
        reason = error.strerror or str(error)
        raise ScheduleError(f"{path}: needed a schedule file, got: {reason}") from error
    except UnicodeDecodeError as error:
        raise ScheduleError(f"{path}: {not_utf8(error)}") from error
    text = "\n".join(lines)
    check_format(path, csv_format(text), newest=_FORMAT, error=ScheduleError)
    n_head = next((i for i, s in enumerate(lines) if not s.startswith("#")), len(lines))
    head = [_head_entry(line) for line in lines[:n_head]]
    # a cell longer than csv takes is in no schedule
    table = [line.split(",") if line else [] for line in lines[n_head:]]
    problems = [*_head_problems(lines, head), *_row_problems(table, n_head)]
    if problems:
        raise ScheduleError("\n".join(f"{path}: {each}" for each in problems))
    values: dict[str, Any] = {
        key: int(value) if key in _WHOLE else value
        for key, value in head
        if key in _HEAD
    }
    schedule = Schedule(
        **{**values, "sealed": "sealed" in values},
        presentations=tuple(
            Presentation(position=int(p), code=code, model=model, repeat=int(repeat))
            for p, code, model, repeat in table[1:]
        ),
    )
    opened_file = path.parent / _OPENED / path.name
    is_opened = opened_file.exists() and lines_then(path) is None
    if not (schedule.is_closed and is_opened):
        return schedule
    opened = read_schedule(opened_file)
    if _closed(opened) != schedule:
        raise ScheduleError(f"{opened_file}: needed what is sealed in {path.name}")
    return opened


def _closed(schedule: Schedule) -> Schedule:
    """Return a schedule without its models."""
    hidden = tuple(map(_hidden, schedule.presentations))
    return replace(schedule, presentations=hidden)


def _hidden(shown: Presentation) -> Presentation:
    """Return a presentation without its model."""
    return replace(shown, model=_SEALED, repeat=shown.position)


def _head_entry(line: str) -> tuple[str, str]:
    key, _, value = line.removeprefix("#").partition(":")
    return key.strip(), value.strip()


def _read_drawn(
    study: StudyPaths, pairs: Iterable[tuple[str, str]], *, skips_damaged: bool = False
) -> Iterator[tuple[Path, Schedule]]:
    """Yield files and schedules of raters in sessions, of those that are there."""
    for pair in pairs:
        file = study.schedule_file(*pair)
        if file.exists():
            try:
                yield file, read_schedule(file)
            except ScheduleError:  # which `schedule_problems` has
                if not skips_damaged:
                    raise


def is_sealed(study: StudyPaths, protocol: Protocol) -> bool:
    """Say whether any drawn schedule of a study is sealed still.

    Parameters
    ----------
    study : StudyPaths
        Where the study is.
    protocol : Protocol
        The study's protocol; what it says of sealing is for schedules to come.

    Returns
    -------
    bool
        Whether there is one; one that is damaged does not count.
    """
    drawn = _read_drawn(study, protocol.rater_sessions, skips_damaged=True)
    return any(schedule.is_closed for _, schedule in drawn)


def _format_problem(lines: Sequence[str]) -> str | None:
    return format_problem(csv_format("\n".join(lines)), newest=_FORMAT)


def _head_problems(
    lines: Sequence[str], head: Sequence[tuple[str, str]]
) -> Iterator[str]:
    keys = [key for key, _ in head]
    again = repeated(keys)
    for place, (key, value) in enumerate(head):
        where = f"line {place + 1}"
        if key == "format":
            continue  # it is known
        if key not in _HEAD or again[place]:
            yield (
                f"{where}: needed '# key: value' with each of {', '.join(_HEAD)} once, "
                f"got {lines[place]!r}"
            )
        elif not re.fullmatch(_HEAD[key], value):
            yield f"{where}: needed {key} as {_HEAD[key]}, got {value!r}"
    absent = [key for key in _HEAD if key not in (*keys, *_OPTIONAL)]
    if absent:
        yield f"needed a line '# {absent[0]}: ...', got none"


def _row_problems(table: Sequence[Sequence[str]], n_head: int) -> Iterator[str]:
    if not table or table[0] != _COLUMNS:
        header = ",".join(table[0]) if table else "nothing"
        yield f"line {n_head + 1}: needed columns {','.join(_COLUMNS)}, got {header}"
        return
    if len(table) == 1:
        yield "needed at least one presentation, got none"
    seen: set[str] = set()
    for place, row in enumerate(table[1:], start=1):
        problem = _row_problem(row, place, seen)
        if problem:
            yield f"line {n_head + 1 + place}: {problem}"
        seen.update(row[1:2])


def _row_problem(row: Sequence[str], place: int, seen: set[str]) -> str | None:
    if len(row) != len(_COLUMNS):
        return f"needed {len(_COLUMNS)} cells, got {len(row)}"
    position, code, model, repeat = row
    rules = (
        (position != str(place), f"needed position {place}, got {position!r}"),
        (
            not _CODE.fullmatch(code),
            f"needed a code of letters and digits, got {code!r}",
        ),
        (code in seen, f"needed codes that differ, got {code!r} again"),
        (not model, "needed the id of a model, got none"),
        (
            not re.fullmatch(r"[1-9][0-9]{0,3}", repeat),
            f"needed repeat as a whole number from 1, got {repeat!r}",
        ),
    )
    return next((needs for is_broken, needs in rules if is_broken), None)


def _schedule_text(schedule: Schedule) -> str:
    """Write a schedule as the text of its file."""
    values = {key: getattr(schedule, key) for key in _HEAD}
    head = [f"{key}: {value}" for key, value in values.items() if value not in _NO]
    rows = (
        (shown.position, shown.code, shown.model, shown.repeat)
        for shown in schedule.presentations
    )
    return table_csv(_COLUMNS, rows, head=[f"format: {_FORMAT}", *head])


def _sheet_text(schedule: Schedule) -> str:
    """Write the blinded sheet on which a rater's grades are noted."""
    rows = ((shown.position, shown.code, "") for shown in schedule.presentations)
    return table_csv(_SHEET_COLUMNS, rows, head=[f"format: {_FORMAT}"])
