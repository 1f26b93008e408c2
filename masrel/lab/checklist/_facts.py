"""The facts of a study that guidelines ask for, each read once."""

from collections import Counter
from dataclasses import dataclass
from datetime import date
from pathlib import Path

from masrel.lab.analysis import Analysis, analyze
from masrel.lab.progress import RaterProgress, rater_progress, session_progress
from masrel.lab.protocol import Protocol, StudyPaths
from masrel.lab.ratings import (
    Correction,
    Ratings,
    corrections_of,
    read_study_data,
    study_remarks,
)
from masrel.lab.run._state import SessionState, read_session
from masrel.lab.schedule import read_schedule


@dataclass(frozen=True, slots=True, kw_only=True)
class SessionFacts:
    """One session of one rater that has begun."""

    rater: str
    session: str
    day: date  # on which it began, UTC
    header: tuple[tuple[str, str], ...]  # what must be the same for like conditions
    is_complete: bool
    n_faults: int
    log: Path


@dataclass(frozen=True, slots=True, kw_only=True)
class StudyFacts:
    """What the record of a study says."""

    paths: StudyPaths
    protocol: Protocol
    # None before there are ratings
    ratings: Ratings | None
    analysis: Analysis | None
    sessions: tuple[SessionFacts, ...]
    corrections: tuple[Correction, ...]
    remarks: tuple[str, ...]
    raters: tuple[RaterProgress, ...]
    n_schedules: int  # drawn
    n_concealed: int  # of these, those drawn from a secret that is not published

    def relative(self, path: Path) -> Path:
        """Return a file of the study from its folder."""
        return path.relative_to(self.paths.root)


def gather_facts(paths: StudyPaths, protocol: Protocol) -> StudyFacts:
    """Read everything of a study that a guideline asks for."""
    ratings = analysis = None
    files = (paths.ratings_file, paths.published_file)
    if paths.logs() or any(file.is_file() for file in files):
        data = read_study_data(paths, protocol)
        ratings = data.ratings
        analysis = analyze(
            protocol, ratings, in_person=data.in_person, excluded=data.excluded
        )
    drawn = [
        read_schedule(file)
        for each in protocol.sessions
        for rater in each.raters
        if (file := paths.schedule_file(rater, each.id)).is_file()
    ]
    is_published = paths.published_secret_file.is_file()
    concealed = [s for s in drawn if s.commitment is not None and not is_published]
    return StudyFacts(
        paths=paths,
        protocol=protocol,
        ratings=ratings,
        analysis=analysis,
        sessions=_sessions(paths, protocol),
        corrections=corrections_of(paths, protocol),
        remarks=study_remarks(paths, protocol, include=()),
        raters=rater_progress(paths, protocol, session_progress(paths, protocol)),
        n_schedules=len(drawn),
        n_concealed=len(concealed),
    )


_CONDITIONS = ("device", "grades", "clock", "masrel_version", "presented_sha256")


def _sessions(paths: StudyPaths, protocol: Protocol) -> tuple[SessionFacts, ...]:
    begun = []
    for each in protocol.sessions:
        for rater in each.raters:
            log = paths.log_file(rater, each.id)
            if not log.is_file():
                continue
            events, state = read_session(log)
            if not state.header:
                continue
            day = date.fromisoformat(events[0].time_utc[:10])
            begun.append(_session(rater, each.id, day, state, log))
    return tuple(begun)


def _session(
    rater: str, session: str, day: date, state: SessionState, log: Path
) -> SessionFacts:
    shown = [event.fields for events in state.presented.values() for event in events]
    return SessionFacts(
        rater=rater,
        session=session,
        day=day,
        header=tuple((name, str(state.header.get(name))) for name in _CONDITIONS),
        is_complete=state.is_complete,
        n_faults=sum(fields["fault"] is not None for fields in shown),
        log=log,
    )


def days_between(facts: StudyFacts) -> Counter[int]:
    """Count the days between a rater's session and the one before it."""
    days: dict[str, list[date]] = {}
    for session in facts.sessions:
        days.setdefault(session.rater, []).append(session.day)
    return Counter(
        (after - before).days
        for of_rater in days.values()
        for before, after in zip(sorted(of_rater), sorted(of_rater)[1:], strict=False)
    )
