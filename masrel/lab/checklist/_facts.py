"""The facts of a study that guidelines ask for, each read once, and words for them."""

import statistics
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from datetime import date
from itertools import pairwise
from pathlib import Path

from masrel._input import listed
from masrel.lab.analysis import Analysis, analyze
from masrel.lab.progress import RaterProgress, rater_progress, session_progress
from masrel.lab.protocol import Protocol, StudyPaths
from masrel.lab.ratings import Ratings, corrections_of, read_study_data, study_remarks
from masrel.lab.report._design import (
    beside_presentations,
    size_sentence,
    stretches_asked_for,
)
from masrel.lab.report._material import TARGETS, coefficient_name
from masrel.lab.run._state import read_session
from masrel.lab.schedule._orders import orders_in_words
from masrel.lab.schedule.presentation import _read_drawn
from masrel.tables._estimate_words import sentence
from masrel.tables._tables import counted, number, percent

_CONDITIONS = {
    "device": "Device",
    "grades": "Grades from",
    "clock": "Clock of the device",
    "masrel_version": "Version of masrel",
    "presented_sha256": "SHA-256 of what is presented",
}
"""What must be the same for like conditions: fields of a log's head, and their names"""


@dataclass(frozen=True, slots=True, kw_only=True)
class SessionFacts:
    """One session of one rater that has begun."""

    rater: str
    day: date  # on which it began, UTC
    header: Mapping[str, str]  # by the keys of `_CONDITIONS`
    is_complete: bool
    n_faults: int
    log: Path


@dataclass(frozen=True, slots=True, kw_only=True)
class StudyFacts:
    """What the record of a study says."""

    # None before there are ratings
    ratings: Ratings | None
    analysis: Analysis | None
    sessions: tuple[SessionFacts, ...]
    days_between: Sequence[int]  # of a rater's session and the one before, sorted
    n_corrections: int
    remarks: tuple[str, ...]
    raters: tuple[RaterProgress, ...]
    n_schedules: int  # drawn
    n_concealed: int  # of these, those drawn from a secret that is not published
    files: Mapping[str, Sequence[Path]]  # by what they are, from the study's folder


def gather_facts(paths: StudyPaths, protocol: Protocol) -> StudyFacts:
    """Read everything of a study that a guideline asks for."""
    ratings = analysis = None
    tables = [f for f in (paths.ratings_file, paths.published_file) if f.is_file()]
    if paths.logs() or tables:
        data = read_study_data(paths, protocol)
        ratings = data.ratings
        analysis = analyze(
            protocol, ratings, in_person=data.in_person, excluded=data.excluded
        )
    pairs = protocol.rater_sessions
    drawn = [schedule for _, schedule in _read_drawn(paths, pairs)]
    is_published = paths.published_secret_file.is_file()
    begun = (_session(rater, paths.log_file(rater, each)) for rater, each in pairs)
    sessions = tuple(session for session in begun if session is not None)
    days: dict[str, list[date]] = {}
    for session in sessions:
        days.setdefault(session.rater, []).append(session.day)
    named = {
        "protocol": [paths.protocol],
        "logs": [session.log for session in sessions],
        "ratings": tables[:1],
    }
    return StudyFacts(
        ratings=ratings,
        analysis=analysis,
        sessions=sessions,
        days_between=sorted(
            (after - before).days
            for of_rater in days.values()
            for before, after in pairwise(sorted(of_rater))
        ),
        n_corrections=len(corrections_of(paths, protocol)),
        remarks=study_remarks(paths, protocol, include=()),
        raters=rater_progress(paths, protocol, session_progress(paths, protocol)),
        n_schedules=len(drawn),
        n_concealed=sum(s.commitment is not None for s in drawn) * (not is_published),
        files={
            key: [file.relative_to(paths.root) for file in files]
            for key, files in named.items()
        },
    )


def _session(rater: str, log: Path) -> SessionFacts | None:
    events, state = read_session(log) if log.is_file() else ((), None)
    if state is None or not state.header:
        return None
    shown = (event for events in state.presented.values() for event in events)
    return SessionFacts(
        rater=rater,
        day=date.fromisoformat(events[0].time_utc[:10]),
        header={name: str(state.header.get(name)) for name in _CONDITIONS},
        is_complete=state.is_complete,
        n_faults=sum(event.fields["fault"] is not None for event in shown),
        log=log,
    )


def words_of(facts: StudyFacts, protocol: Protocol) -> dict[str, object]:
    """Return what a template says facts with."""
    orders = "an order of their own, all orders equally likely"
    if protocol.schedule.scheme != "random-order":
        orders = orders_in_words(protocol.schedule)
    fields = protocol.rater_fields.items()
    return {
        "facts": facts,
        "protocol": protocol,
        "orders": orders,
        "not_public": listed(f.title or name for name, f in fields if not f.public),
        "names_of_conditions": _CONDITIONS,
        "targets": TARGETS,
        "tally": _tally,
        "range_of": _range_of,
        "counted": counted,
        "percent": percent,
        "sentence": sentence,
        "size_sentence": size_sentence,
        "coefficient_name": coefficient_name,
        "stretches_asked_for": stretches_asked_for,
        "beside_presentations": beside_presentations,
    }


def _tally(values: Iterable[object], form: str) -> list[str]:
    """Return each value with how often it comes, in the order of first coming."""
    return [form.format(value, n) for value, n in Counter(map(str, values)).items()]


def _range_of(values: Sequence[float], unit: str) -> str:
    if not values:
        return "not known"
    ends = f"{number(min(values), None)} to {number(max(values), None)} {unit}"
    return f"{ends.strip()}, median {number(statistics.median(values), None)}"
