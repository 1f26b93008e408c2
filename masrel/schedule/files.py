"""The text of a schedule file and of a rater's sheet, and reading a schedule back."""

import csv
import re
from collections.abc import Iterator, Sequence
from pathlib import Path

from masrel.errors import ScheduleError
from masrel.schedule.presentation import Presentation, Schedule

__all__ = ["read_schedule", "schedule_text", "sheet_text"]

HEAD = {
    "study": r"\S+",
    "rater": r"\S+",
    "session": r"\S+",
    "seed": r"[0-9]+",
    "scheme": r"\S+",
    "protocol_sha256": r"[0-9a-f]{64}",
    "presented_sha256": r"[0-9a-f]{64}",
    "masrel_version": r"\S+",
}
"""Keys of the ``# key: value`` lines, in order, and what their values look like."""

COLUMNS = ["position", "code", "model", "repeat"]
SHEET_COLUMNS = ["position", "code", "grade"]

# A code names a recording's file, so it is letters and digits only.
CODE = re.compile(r"[0-9A-Za-z]{1,16}")


def schedule_text(schedule: Schedule) -> str:
    """Write a schedule as the text of its file."""
    head = [f"# {key}: {getattr(schedule, key)}" for key in HEAD]
    rows = [
        f"{shown.position},{shown.code},{shown.model},{shown.repeat}"
        for shown in schedule.presentations
    ]
    return "\n".join([*head, ",".join(COLUMNS), *rows]) + "\n"


def sheet_text(schedule: Schedule) -> str:
    """Write the blinded sheet on which a rater's grades are noted."""
    rows = [f"{shown.position},{shown.code}," for shown in schedule.presentations]
    return "\n".join([",".join(SHEET_COLUMNS), *rows]) + "\n"


def read_schedule(path: Path) -> Schedule:
    """Read a schedule file.

    Parameters
    ----------
    path : Path
        A file that :func:`masrel.schedule.write_schedules` wrote.

    Returns
    -------
    Schedule
        The schedule; :func:`masrel.schedule.check_schedule` holds it against a
        protocol.

    Raises
    ------
    ScheduleError
        If there is no such file, or it is not a schedule: the message has every
        problem with file and line.
    """
    lines = _read_lines(path)
    n_head = next((i for i, s in enumerate(lines) if not s.startswith("#")), len(lines))
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
        presentations=tuple(rows),
    )


def _read_lines(path: Path) -> list[str]:
    try:
        return path.read_text(encoding="utf-8").splitlines()
    except OSError as error:
        reason = error.strerror or str(error)
        raise ScheduleError(f"{path}: needed a schedule file, got: {reason}") from error
    except UnicodeDecodeError as error:
        raise ScheduleError(f"{path}: needed UTF-8 text, got other bytes") from error


def _read_head(lines: list[str], path: Path, problems: list[str]) -> dict[str, str]:
    head: dict[str, str] = {}
    for number, line in enumerate(lines, start=1):
        key, _, value = line.removeprefix("#").partition(":")
        key, value = key.strip(), value.strip()
        if key not in HEAD or key in head:
            problems.append(
                f"{path}: line {number}: needed '# key: value' with each of "
                f"{', '.join(HEAD)} once, got {line!r}"
            )
        elif not re.fullmatch(HEAD[key], value):
            problems.append(
                f"{path}: line {number}: needed {key} as {HEAD[key]}, got {value!r}"
            )
            head[key] = ""
        else:
            head[key] = value
    missing = [key for key in HEAD if key not in head]
    if missing:
        problems.append(f"{path}: needed a line '# {missing[0]}: ...', got none")
    return head


def _read_rows(
    lines: list[str], n_head: int, path: Path, problems: list[str]
) -> Iterator[Presentation]:
    table = list(csv.reader(lines[n_head:]))
    if not table or table[0] != COLUMNS:
        came = ",".join(table[0]) if table else "nothing"
        problems.append(
            f"{path}: line {n_head + 1}: needed columns {','.join(COLUMNS)}, got {came}"
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
    if len(row) != len(COLUMNS):
        return f"needed {len(COLUMNS)} cells, got {len(row)}"
    position, code, model, repeat = row
    if position != str(place):
        return f"needed position {place}, got {position!r}"
    if not CODE.fullmatch(code):
        return f"needed a code of letters and digits, got {code!r}"
    if code in seen:
        return f"needed codes that differ, got {code!r} again"
    if not model:
        return "needed the id of a model, got none"
    if not re.fullmatch(r"[1-9][0-9]{0,3}", repeat):
        return f"needed repeat as a whole number from 1, got {repeat!r}"
    return None
