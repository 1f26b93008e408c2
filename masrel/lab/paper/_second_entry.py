"""A sheet typed a second time by somebody else, compared with what was entered."""

from collections.abc import Callable, Sequence
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING

from masrel.errors import ParameterError, RatingsError, SessionLogError
from masrel.lab._event_log import Event, SessionLog, utc_now
from masrel.lab.conduct._study_answers import study_answers
from masrel.lab.conduct._study_log import stated
from masrel.lab.paper._differences import GRADE, SheetDifference, sheet_differences
from masrel.lab.paper._entry import filled_sheet, typed_fields
from masrel.lab.paper._filled_form import FilledRow
from masrel.lab.paper._typed import TypedSheet
from masrel.lab.protocol import Protocol, StudyPaths
from masrel.lab.run._state import FROM_PAPER, SessionState, replay

if TYPE_CHECKING:
    from masrel.lab.recording import _Fact  # loads numpy


def compare_sheet(
    study: StudyPaths,
    protocol: Protocol,
    file: Path,
    rater: str,
    session: str,
    *,
    who: str,
    now: Callable[[], datetime] = utc_now,
) -> tuple[SheetDifference, ...]:
    """Compare a sheet that somebody else typed again with what was entered of it.

    Every cell of the second entry is added to the session's log, and no grade changes.
    A difference lasts until the first entry is corrected, or a second file agrees.

    Parameters
    ----------
    study : StudyPaths
        Where the study is.
    protocol : Protocol
        The study's protocol.
    file : Path
        The CSV file into which the sheet was typed again.
    rater, session : str
        Whose sheet, which was entered before.
    who : str
        Who typed it this time.
    now : callable, optional
        Gives the time of day for the log, aware.

    Returns
    -------
    tuple of SheetDifference
        In the order of the second file; empty when both entries agree.

    Raises
    ------
    RatingsError
        If the file is no such sheet, as for :func:`enter_sheet`, or the very file that
        was entered.
    ScheduleError
        If the schedule is missing, damaged, or stale.
    SessionLogError
        If the sheet was not entered before, or the log is damaged.
    ParameterError
        If `who` is blank, or typed the first entry.
    OSError
        If the log cannot be written.
    """
    reasons = stated(who=who)
    sheet, rows, _ = filled_sheet(study, protocol, file, rater, session)
    log_file = study.log_file(rater, session)
    if not log_file.is_file():
        raise SessionLogError(
            f"{log_file}: needed a first entry of the sheet, got none"
        )
    with SessionLog.open(log_file, now=now) as log:
        state = replay(log.path, log.events)
        if not state.is_complete or state.header["grades"] != FROM_PAPER:
            raise SessionLogError(
                f"{log.path}: needed a session that was entered from a sheet, got one "
                f"with grades = {state.header.get('grades', 'none')}"
                + ("" if state.is_complete else " that is not complete")
            )
        _refuse_first(sheet, reasons["who"], log.events)
        for row in rows:
            _reenter(row, sheet, reasons, state, log)
        of_study = study_answers(study).get(rater, {})
        return sheet_differences(replay(log.path, log.events), of_study)


def _refuse_first(sheet: TypedSheet, who: str, events: Sequence[Event]) -> None:
    for event in events:
        if event.kind != "entered":
            continue
        if event.fields["file_sha256"] == sheet.sha256:
            raise RatingsError(
                f"{sheet.path}: needed the sheet as it was typed again, got the file "
                f"that was entered as {event.fields['file']}"
            )
        if str(event.fields["who"]).casefold() == who.casefold():
            raise ParameterError(
                f"who: needed somebody else than who typed the first entry, got {who}"
            )


def _reenter(
    row: FilledRow,
    sheet: TypedSheet,
    reasons: dict[str, str],
    state: SessionState,
    log: SessionLog,
) -> None:
    values: dict[str, _Fact] = {GRADE: row.grade} if row.code is not None else {}
    values |= {column.column: answer for column, answer in row.answers}
    for column, value in values.items():
        cell = {
            "code": row.code,
            **typed_fields(row, sheet),
            "column": column,
            "value": value,
            **reasons,
        }
        before = state.reentered.get((row.code, column))
        if before is None or dict(before.fields) != cell:
            log.append("reentered", cell)
