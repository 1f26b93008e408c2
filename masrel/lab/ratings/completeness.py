"""What a study's table of ratings leaves out, and what happened to the study."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from masrel.errors import MasrelError, SessionLogError
from masrel.lab._event_log import Event
from masrel.lab.conduct import excluded_raters, plan_changes, read_conduct
from masrel.lab.conduct._study_log import study_answers
from masrel.lab.protocol import Protocol, StudyPaths
from masrel.lab.protocol._values import Answer
from masrel.lab.run._state import SessionState, read_session, sheet_differences
from masrel.lab.schedule.presentation import read_schedule


@dataclass(frozen=True, slots=True, kw_only=True)
class Correction:
    """A grade that was corrected, or given late.

    Attributes
    ----------
    session, rater : str
        Whose grade.
    model : str
        The model that was presented.
    repeat : int
        Which of its presentations in the session, from 1.
    first_grade : str or None
        What the rater gave; None where that was nothing.
    grade : str or None
        What it should have been; None for a missing one.
    who, why : str
        Who corrected it, and for what reason.
    """

    session: str
    rater: str
    model: str
    repeat: int
    first_grade: str | None
    grade: str | None
    who: str
    why: str


def corrections_of(study: StudyPaths, protocol: Protocol) -> tuple[Correction, ...]:
    """Collect the corrections of a study from its session logs.

    Parameters
    ----------
    study : StudyPaths
        Where the study is.
    protocol : Protocol
        The study's protocol.

    Returns
    -------
    tuple of Correction
        Sessions and raters in the protocol's order, then in order of time.

    Raises
    ------
    SessionLogError
        If a log is damaged, or corrects a code that its schedule has not.
    ScheduleError
        If the schedule of a log is missing or damaged.
    """
    return tuple(
        correction
        for rater, session in protocol.rater_sessions
        if study.log_file(rater, session).exists()
        for correction in _corrections(study, rater, session)
    )


def _corrections(study: StudyPaths, rater: str, session: str) -> Iterator[Correction]:
    log = study.log_file(rater, session)
    events, state = read_session(log)
    # those before a session began anew are set aside with what they corrected
    anew = max((e.line for e in events if e.kind == "restarted"), default=0)
    corrected = [e.fields for e in events if e.kind == "correction" and e.line > anew]
    if not corrected:
        return
    schedule = read_schedule(study.schedule_file(rater, session))
    shown = {each.code: each for each in schedule.presentations}
    for fields in corrected:
        code, grade = str(fields["code"]), fields["grade"]
        if code not in shown:
            raise SessionLogError(f"{log}: needed a code of the schedule, got {code!r}")
        yield Correction(
            session=session,
            rater=rater,
            model=shown[code].model,
            repeat=shown[code].repeat,
            first_grade=state.first_grades.get(code),
            grade=None if grade is None else str(grade),
            who=str(fields["who"]),
            why=str(fields["why"]),
        )


def study_remarks(
    study: StudyPaths,
    protocol: Protocol,
    *,
    file: Path | None = None,
    has_conduct: bool = True,
    include: Collection[str] = ("who", "notes"),
) -> tuple[str, ...]:
    """Say everything that a reader of a study's ratings must know beside them.

    Parameters
    ----------
    study : StudyPaths
        Where the study is.
    protocol : Protocol
        The study's protocol.
    file : Path, optional
        A table that is used whatever the session logs say.
    has_conduct : bool, optional
        Whether to say what happened beside the sessions, and what has changed in the
        plan, too.
    include : collection of str, optional
        Private content to include: ``"who"`` recorded each, and ``"notes"``, the
        reasons.

    Returns
    -------
    tuple of str
        A sentence each for raters who were withdrawn or are excluded, codes that were
        unblinded, logs of no rater of the protocol, days that were corrected, skipped
        presentations, sessions that were started again, empty logs, recordings without
        a log, and ratings that are not from the existing logs. Empty if there is
        nothing to say.

    Raises
    ------
    SessionLogError
        If the log of the study's conduct is damaged.

    Examples
    --------
    >>> from pathlib import Path
    >>> from masrel.lab.protocol import read_protocol, StudyPaths
    >>> study = StudyPaths(Path("studies/hess2012"))
    >>> study_remarks(study, read_protocol(study.protocol))
    ()
    """
    remarks: list[str] = []
    if has_conduct:
        changes = plan_changes(study, protocol)
        remarks += [*_of_conduct(study, include), *(f"{each}." for each in changes)]
    remarks += _of_sessions(study, protocol, include)
    if file not in (None, study.published_file) and any(study.sessions.glob("*.jsonl")):
        remarks.append(
            f"The ratings are from {file.name}, a file named by hand, and not from the "
            "session logs."
        )
    return tuple(remarks)


def _by_whom(event: Event, include: Collection[str]) -> str:
    # who recorded an event and why, as far as that is said
    who = f" by {event.fields['who']}" if "who" in include else ""
    return who + (f": {event.fields['why']}" if "notes" in include else "")


def _of_conduct(study: StudyPaths, include: Collection[str]) -> Iterator[str]:
    events = read_conduct(study)
    raters = excluded_raters(study)
    latest = {
        event.fields["rater"]: event
        for event in events
        if event.kind == "excluded" and event.fields["rater"] in raters
    }
    for event in events:
        fields = event.fields
        if "why" not in fields:
            continue
        by = f"on {fields.get('on') or event.time_utc[:10]}{_by_whom(event, include)}."
        if event.kind == "withdrawn":
            rater = fields["rater"]
            logs = map(_read, study.sessions.glob(f"*_{rater}.jsonl"))
            n_graded = sum(
                len(state.grades)
                for _, state in logs
                if state.header.get("rater") == rater
            )
            counted = "" if rater in latest else " and counted"
            yield (
                f"Rater {rater} was withdrawn {by} Grades given before, "
                f"{n_graded} by the logs, are kept{counted}."
            )
        elif event.kind == "unblinded":
            yield _of_unblinding(event, by)
        elif event in latest.values():
            yield (
                f"Rater {fields['rater']} was excluded {by} The grades are kept but "
                "not used in any number."
            )


def _of_unblinding(event: Event, by: str) -> str:
    fields = event.fields
    where = "".join(
        f" of {name} {fields[key]}"
        for key, name in (("rater", "rater"), ("session", "session"))
        if fields[key] is not None
    )
    if (code := fields["code"]) is None:
        return f"All codes{where} were unblinded {by}"
    return f"Code {code}{where} was unblinded {by}"


def _of_sessions(
    study: StudyPaths, protocol: Protocol, include: Collection[str]
) -> Iterator[str]:
    expected = {study.log_file(*each) for each in protocol.rater_sessions}
    there = sorted(study.sessions.glob("*.jsonl"))
    of_study = study_answers(study)
    for log in there:
        if log not in expected:
            yield (
                f"{_name(study, log)} belongs to no rater and session of the protocol: "
                "its grades are not among the ratings. Put the rater back into the "
                "session (masrel record withdraw keeps the grades of one who left), or "
                "move the log out of the study."
            )
        elif log.stat().st_size:
            yield from _of_days(study, log, include)
            yield from _of_skips(study, log, include)
            yield from _of_second_entries(study, log, of_study)
        else:
            yield (
                f"{_name(study, log)} is empty: its grades, if there were any, are not "
                "among the ratings. Put a copy of it back, or run the session."
            )
    for folder in sorted(path for path in study.sessions.glob("*") if path.is_dir()):
        if folder.with_name(f"{folder.name}.jsonl") not in there:
            yield (
                f"{_name(study, folder)} has recordings but no log: "
                "their grades are not among the ratings. Put a copy of the log back."
            )


def _of_days(study: StudyPaths, log: Path, include: Collection[str]) -> Iterator[str]:
    return (
        f"{_name(study, log)}: the session was held on {event.fields['on']}, as was "
        f"corrected on {event.time_utc[:10]}{_by_whom(event, include)}."
        for event in _read(log)[0]
        if event.kind == "day-correction"
    )


def _of_skips(study: StudyPaths, log: Path, include: Collection[str]) -> Iterator[str]:
    # those that did not get their grade later, and grades that count no more
    _, state = _read(log)
    if state.n_set_aside:
        yield (
            f"{_name(study, log)}: the session was started again; earlier grades, "
            f"kept in the log but not among the ratings: {state.n_set_aside}."
        )
    for code, event in state.skipped.items():
        if code not in state.grades:
            yield (
                f"{_name(study, log)}: presentation {event.fields['position']}, code "
                f"{code}, was skipped after a fault{_by_whom(event, include)}. Its "
                "grade is missing."
            )


def _of_second_entries(
    study: StudyPaths,
    log: Path,
    of_study: Mapping[str, Mapping[tuple[str, str], Answer]],
) -> Iterator[str]:
    _, state = _read(log)
    of_rater = of_study.get(str(state.header.get("rater")), {})
    for each in sheet_differences(state, of_rater):
        code = "" if each.code is None else f" code {each.code},"
        values = ""
        if each.column == "grade":  # an answer is its rater's
            values = f": the first has {each.first}, the second {each.second}"
        yield (
            f"{_name(study, log)}: the two entries of its sheet differ,{code} "
            f"{each.column}{values} ({each.file}, row {each.row}). The first counts "
            "until one is mended."
        )


def _read(log: Path) -> tuple[Sequence[Event], SessionState]:
    # of a log that cannot be read nothing; it is said to be damaged where it is read
    try:
        return read_session(log)
    except MasrelError:
        return (), SessionState()


def _name(study: StudyPaths, path: Path) -> str:
    # below the study's folder, so that a report does not depend on where that is
    return path.relative_to(study.root).as_posix()
