"""Rows of designs, allotted to raters in the order in which the study's log has them.

Nobody asks for a row: whoever comes next gets the next one that no event has, in the
session and at the site; a row that was allotted once stays that rater's.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING

from masrel._input import listed
from masrel.errors import ScheduleError
from masrel.lab._event_log import Event, utc_now
from masrel.lab.conduct._study_log import events_of_logs, open_conduct
from masrel.lab.protocol import Protocol, StudyPaths
from masrel.lab.schedule import Schedule, read_schedule, write_schedules
from masrel.lab.schedule._orders import WITH_ROWS
from masrel.lab.schedule._secret import site_of

if TYPE_CHECKING:
    from masrel.lab.recording import _Fact  # loads numpy

_Occasion = tuple[str, str]  # rater, session


def allot_schedules(
    study: StudyPaths,
    protocol: Protocol,
    *,
    site: str | None = None,
    redraw: bool = False,
    now: Callable[[], datetime] = utc_now,
) -> tuple[Path, ...]:
    """Draw every schedule that is not there yet, its row allotted by the study's log.

    Parameters
    ----------
    study : StudyPaths
        Where the study is.
    protocol : Protocol
        The study's protocol. Where its scheme has no rows, nothing is logged.
    site : str, optional
        Of the raters of this site alone; sites must be strata.
    redraw : bool
        Draw stale or damaged schedules anew; a rater's row stays the same.
    now : callable, optional
        Gives the time of day, aware.

    Returns
    -------
    tuple of Path
        The files written; empty when all were there.

    Raises
    ------
    ScheduleError
        As :func:`masrel.lab.schedule.write_schedules` does; no row is allotted then.
    SessionLogError
        If the log of the study's conduct is damaged.
    OSError
        If the system refuses a folder or file.
    """

    def allot(places: Sequence[_Occasion]) -> dict[_Occasion, int]:
        return _allot(study, protocol, places, now)

    has_rows = protocol.schedule.scheme in WITH_ROWS
    return write_schedules(
        protocol, study, redraw=redraw, site=site, allot=allot if has_rows else None
    )


def _allot(
    study: StudyPaths,
    protocol: Protocol,
    places: Sequence[_Occasion],
    now: Callable[[], datetime],
) -> dict[_Occasion, int]:
    """Return the rows of raters in sessions; those without one get the next."""
    scheme = protocol.schedule.scheme
    with open_conduct(study, protocol, now=now) as log:  # nobody else allots meanwhile
        rows = _Rows(events_of_logs(study))
        allotted = {}
        for rater, session in places:
            design = (session, site_of(protocol, rater), scheme)
            row = rows.of_rater.get((rater, *design))
            if row is None:
                row = rows.n_allotted(design) + 1
                fields: dict[str, _Fact] = {
                    "rater": rater,
                    "session": session,
                    "site": design[1],
                    "scheme": scheme,
                    "row": row,
                }
                rows.add(log.path, log.append("allotted", fields))
            allotted[rater, session] = row
    return allotted


_Design = tuple[str, str | None, str]  # session, site, scheme


class _Rows:
    """The rows that events of a log allotted."""

    def __init__(self, events: Iterable[tuple[Path, Event]]) -> None:
        self.of_rater: dict[tuple[str, str, str | None, str], int] = {}
        self._n: dict[_Design, int] = {}
        self.log_of_row: dict[tuple[str, str, str | None, str], Path] = {}
        self.problems: list[tuple[Path, str]] = []
        for log, event in events:
            if event.kind == "allotted":
                self.add(log, event)

    def n_allotted(self, design: _Design) -> int:
        """Return how many rows of a design were allotted."""
        return self._n.get(design, 0)

    def add(self, log: Path, event: Event) -> None:
        """Take in an event, and note what is wrong with it."""
        fields = event.fields
        rater, site = str(fields["rater"]), fields["site"]
        design = (
            str(fields["session"]),
            None if site is None else str(site),
            str(fields["scheme"]),
        )
        if self.of_rater.get((rater, *design)) == fields["row"]:
            return  # the log of another copy of the study has it, too
        row = self._n[design] = self.n_allotted(design) + 1
        where = f"line {event.line}: allotted: rater {rater} in session {design[0]}"
        if fields["row"] != row:
            needed = f"needed row {row}, the next one, got {fields['row']}"
            self.problems.append((log, f"{where}: {needed}"))
        if (rater, *design) in self.of_rater:
            got = f"row {self.of_rater[rater, *design]}"
            needed = f"needed a rater without a row, got one with {got}"
            self.problems.append((log, f"{where}: {needed}"))
            return
        self.of_rater[rater, *design] = row
        self.log_of_row[rater, *design] = log


def allotment_problems(
    study: StudyPaths, protocol: Protocol
) -> Iterator[tuple[Path, str]]:
    """Yield where allotted rows, or rows of schedules, are not those of the logs."""
    # of a merged study the logs of its sites
    rows = _Rows(events_of_logs(study))
    yield from rows.problems
    logs = listed(map(str, study.conduct_logs() or [study.conduct_file]))
    for schedule, path in _drawn(study, protocol):
        design = (schedule.session, schedule.site, schedule.scheme)
        row = rows.of_rater.get((schedule.rater, *design))
        if schedule.row != row and schedule.scheme in WITH_ROWS:
            needed = f"a row that was allotted, by {logs}"
            if row is not None:
                needed = f"row {row}, by {rows.log_of_row[schedule.rater, *design]}"
            yield path, f"needed {needed}, got row {schedule.row}"


def _drawn(study: StudyPaths, protocol: Protocol) -> Iterator[tuple[Schedule, Path]]:
    for session in protocol.sessions:
        for rater in session.raters:
            path = study.schedule_file(rater, session.id)
            if path.exists():
                try:
                    yield read_schedule(path), path
                except ScheduleError:
                    continue  # one of `schedule_problems`
