"""Sheets that were filled in, brought into session logs, and second entries."""

import re
from collections.abc import Callable, Iterator, Sequence
from datetime import datetime
from pathlib import Path

import masrel
from masrel._files import check_inside
from masrel.errors import ParameterError, RatingsError, SessionLogError
from masrel.lab._event_log import Event, SessionLog, utc_now
from masrel.lab._study_files import Fact, sha256_of
from masrel.lab.conduct._study_log import (
    append_event,
    past_day,
    recover_conduct,
    stated,
    study_answers,
)
from masrel.lab.paper._form import (
    FilledRow,
    Form,
    TypedSheet,
    fill_form,
    form_of,
    read_typed,
)
from masrel.lab.protocol import Protocol, StudyPaths, presented_hash, protocol_hash
from masrel.lab.run._days import log_interval
from masrel.lab.run._presenter import check_same
from masrel.lab.run._state import (
    FORMAT,
    FROM_PAPER,
    NO_DEVICE,
    SessionState,
    SheetDifference,
    replay,
    sheet_differences,
)
from masrel.lab.schedule.sheets import _drawn_schedule

_DEVICE = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,31}")


def enter_sheet(
    study: StudyPaths,
    protocol: Protocol,
    file: Path,
    rater: str,
    session: str,
    *,
    who: str,
    on: str | None = None,
    device: str = NO_DEVICE,
    now: Callable[[], datetime] = utc_now,
) -> SessionState:
    """Bring a sheet that was filled in on paper into a session log.

    The whole sheet is entered or nothing of it: a process that dies in between goes on
    when it is called again with the same file.

    Parameters
    ----------
    study : StudyPaths
        Where the study is; its schedules are drawn.
    protocol : Protocol
        The study's protocol.
    file : Path
        The CSV file into which the sheet was typed.
    rater, session : str
        Whose sheet.
    who : str
        Who typed it.
    on : str, optional
        Day of the session, ISO 8601, as on the sheet: from it the days between sessions
        are counted.
    device : str, optional
        What presented the models, where another program ran it; "none" unless given.
    now : callable, optional
        Gives the time of day for the log, aware.

    Returns
    -------
    SessionState
        Where the session stands, complete.

    Raises
    ------
    RatingsError
        If the file is not such a sheet, or is another rater's, a code, grade or answer
        on it is wrong, or a presentation is missing or occurs twice. The message lists
        up to 20 problems, each with file and row.
    ScheduleError
        If the schedule is missing, damaged, or stale.
    SessionLogError
        If the session was begun with a device, or entered before, or its log is
        damaged.
    ParameterError
        If `who` is blank, `on` is not a date or in the future, or `device` is not a
        name or is simulated.
    OSError
        If the log cannot be written.

    Warns
    -----
    MasrelWarning
        If the session was out of the order, or the interval, of the protocol.
    """
    reasons = stated(who=who)
    day = None if on is None else past_day("on", on, now)
    _check_device(device)
    recover_conduct(study)
    sheet, rows, form = filled_sheet(study, protocol, file, rater, session)
    _refuse_answered(study, sheet, rows, rater)
    log_file = study.log_file(rater, session)
    check_inside(log_file.parent, study.root)
    with SessionLog.open(log_file, now=now) as log:
        state = replay(log.path, log.events)
        _begin(study, protocol, form, device, state, log)
        _refuse_entered(sheet, log)
        if day is not None:
            if state.held_on is None:
                log.append("held", {"on": day})
            log_interval(study, protocol, rater, session, log)
        for row in rows:
            if row.place == "study":
                _answer_about_study(study, protocol, row, form.rater, now)
            else:
                _enter(row, sheet, reasons, state, log)
        log.append("complete", {"n_presentations": len(form.codes)})
        return replay(log.path, log.events)


def filled_sheet(
    study: StudyPaths, protocol: Protocol, file: Path, rater: str, session: str
) -> tuple[TypedSheet, tuple[FilledRow, ...], Form]:
    """Return a file that a sheet was typed into, its rows, and what it asks for."""
    schedule = _drawn_schedule(study, protocol, rater, session)
    form, sheet = form_of(protocol, schedule), read_typed(file)
    others = _other_forms(study, protocol, form)
    return sheet, fill_form(sheet, form, protocol.scale.grades, others), form


def _other_forms(study: StudyPaths, protocol: Protocol, form: Form) -> Iterator[Form]:
    for place in protocol.rater_sessions:
        is_other = place != (form.rater, form.session)
        if is_other and study.schedule_file(*place).exists():
            yield form_of(protocol, _drawn_schedule(study, protocol, *place))


def _begin(
    study: StudyPaths,
    protocol: Protocol,
    form: Form,
    device: str,
    state: SessionState,
    log: SessionLog,
) -> None:
    schedule_file = study.schedule_file(form.rater, form.session)
    same: dict[str, Fact] = {
        "format": FORMAT,
        "study": protocol.study.id,
        "rater": form.rater,
        "session": form.session,
        "presented_sha256": presented_hash(protocol),
        "schedule_sha256": sha256_of(schedule_file.read_bytes()),
        "simulated": False,
        "grades": FROM_PAPER,
        "device": device,
        "rehearsal": False,
    }
    if state.header:
        if state.header.get("clock") != NO_DEVICE:  # masrel presented it
            same["device"] = str(state.header["device"])
            same["simulated"] = bool(state.header["simulated"])
            _refuse_unpresented(form, state, log.path)
        check_same(log.path, state.header, same)
        return
    log.append(
        "session",
        {
            **same,
            "protocol_sha256": protocol_hash(protocol),
            "clock": NO_DEVICE,
            "masrel_version": masrel.__version__,
        },
    )


def _refuse_unpresented(form: Form, state: SessionState, path: Path) -> None:
    presented = [
        code
        for code, events in state.presented.items()
        if events and events[-1].fields["fault"] is None
    ]
    if left := [
        code for code in form.codes if code not in (*presented, *state.settled)
    ]:
        raise SessionLogError(
            f"{path}: needed every model of the session presented before its sheet is "
            f"entered, {len(left)} of {len(form.codes)} are not: masrel run --grades "
            "paper resumes it"
        )


def _check_device(device: str) -> None:
    # what is simulated is run by masrel, and says so in the log
    if not _DEVICE.fullmatch(device) or "simulated" in device.casefold():
        raise ParameterError(
            "device: needed a name of 1 to 32 letters, digits, '.', '_' or '-' of "
            f"a device that is not simulated, got {device!r}"
        )


def _refuse_entered(sheet: TypedSheet, log: SessionLog) -> None:
    # what the same file was entered from is gone on with, if it is not complete
    entered = [event for event in log.events if event.kind == "entered"]
    others = [e for e in entered if e.fields["file_sha256"] != sheet.sha256]
    is_complete = any(event.kind == "complete" for event in log.events)
    before = next(iter(others if not is_complete else entered), None)
    if before is None:
        return
    code, positions = before.fields["code"], before.fields["position"]
    row = next((r.number for r in sheet.rows if r["code"].upper() == code), "none")
    raise SessionLogError(
        f"{sheet.path}: row {row}: needed a presentation that was not entered yet, got "
        f"position {positions}, code {code}, entered on {before.time_utc[:10]} by "
        f"{before.fields['who']} from {before.fields['file']}, row "
        f"{before.fields['row']}: masrel paper again compares a second entry, and "
        "masrel record correct corrects a grade"
    )


def _refuse_answered(
    study: StudyPaths, sheet: TypedSheet, rows: Sequence[FilledRow], rater: str
) -> None:
    # about the study, in another session: an answer is corrected, not given twice
    answered = study_answers(study).get(rater, {})
    for row in rows if answered else ():
        for column, answer in row.answers if row.place == "study" else ():
            before = answered.get((column.questionnaire, column.question.id), answer)
            if before != answer:
                raise RatingsError(
                    f"{sheet.path}: row {row.number}: {column.column}: needed "
                    f"{before!r}, which {rater} has answered already, got {answer!r}: "
                    "masrel record answer corrects an answer"
                )


def _enter(
    row: FilledRow,
    sheet: TypedSheet,
    reasons: dict[str, str],
    state: SessionState,
    log: SessionLog,
) -> None:
    # state: before, when a process may have died in the middle of it
    if row.code not in (None, *state.settled):
        fields = {"code": row.code, "position": row.place, "grade": row.grade}
        log.append("entered", {**fields, **typed_fields(row, sheet), **reasons})
    for column, answer in row.answers:
        key = (column.questionnaire, column.question.id, row.code)
        if key not in state.answers:
            names = dict(zip(("questionnaire", "question", "code"), key, strict=True))
            log.append("answered", {**names, "answer": answer})


def _answer_about_study(
    study: StudyPaths,
    protocol: Protocol,
    row: FilledRow,
    rater: str,
    now: Callable[[], datetime],
) -> None:
    # in the log of the study, once
    answered = study_answers(study).get(rater, {})
    for column, answer in row.answers:
        names = {"questionnaire": column.questionnaire, "question": column.question.id}
        if tuple(names.values()) not in answered:
            fields: dict[str, Fact] = {"rater": rater, **names, "answer": answer}
            append_event(study, protocol, "answered", fields, now=now)


def typed_fields(row: FilledRow, sheet: TypedSheet) -> dict[str, Fact]:
    """Return where on a sheet something stood, as a log has it."""
    return {
        "file": sheet.path.name,
        "row": row.number,
        "file_sha256": sheet.sha256,
    }


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
        If the file is not such a sheet, as for :func:`enter_sheet`, or the very file
        that was entered.
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
    values: dict[str, Fact] = {"grade": row.grade} if row.code is not None else {}
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
