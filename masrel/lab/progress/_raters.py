"""What became of every rater of a study, and the table of raters."""

import csv
import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from operator import itemgetter
from typing import Literal

from masrel._files import safe_cell
from masrel.errors import ScheduleError
from masrel.lab.conduct import excluded_raters, rater_values, read_conduct
from masrel.lab.progress._session_stages import (
    SessionProgress,
    _events,
    session_progress,
)
from masrel.lab.protocol import Protocol, StudyPaths, protocol_hash
from masrel.lab.protocol._rater_fields import FieldValue
from masrel.lab.schedule import read_schedule

RaterStatus = Literal["planned", "begun", "complete", "withdrawn", "excluded"]
"""What became of a rater; of two that hold the later one."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RaterProgress:
    """What became of one rater, and what is known of him or her.

    Attributes
    ----------
    rater : str
        Who.
    site : str or None
        Where, if the protocol says so.
    status : {"planned", "begun", "complete", "withdrawn", "excluded"}
        Whether a session has begun, and all of them are complete; or whether the rater
        has left, or is left out of the analysis.
    is_late : bool
        Whether the rater joined after the site's first draw of schedules;
        ``docs/conduct.md`` says how that is known.
    values : mapping of str to (str, int, float or None)
        What every field of the protocol holds; None where nothing is known.
    """

    rater: str
    site: str | None
    status: RaterStatus
    is_late: bool
    values: Mapping[str, FieldValue | None] = field(hash=False)


def rater_progress(
    study: StudyPaths, protocol: Protocol, sessions: Sequence[SessionProgress]
) -> tuple[RaterProgress, ...]:
    """Say what became of every rater of a study.

    Parameters
    ----------
    study : StudyPaths
        Where the study is.
    protocol : Protocol
        The study's protocol.
    sessions : sequence of SessionProgress
        What `session_progress` returned.

    Returns
    -------
    tuple of RaterProgress
        In the protocol's order.

    Raises
    ------
    SessionLogError
        If the log of the study's conduct is damaged.
    """
    values, late = rater_values(study, protocol), _late_raters(study, protocol)
    excluded = excluded_raters(study)
    withdrawn = {
        event.fields["rater"]
        for event in read_conduct(study)
        if event.kind == "withdrawn"
    }
    sites = {rater.id: rater.site for rater in protocol.raters}
    stages: dict[str, set[str]] = {rater.id: set() for rater in protocol.raters}
    for session in sessions:
        stages[session.rater].add(session.stage)
    return tuple(
        RaterProgress(
            rater=rater,
            site=sites[rater],
            status=(
                "excluded"
                if rater in excluded
                else "withdrawn"
                if rater in withdrawn
                else _reached(of_rater)
            ),
            is_late=rater in late,
            values=values[rater],
        )
        for rater, of_rater in stages.items()
    )


def _reached(stages: set[str]) -> RaterStatus:
    if stages == {"complete"}:
        return "complete"
    return "begun" if stages & {"begun", "complete", "unreadable"} else "planned"


def _late_raters(study: StudyPaths, protocol: Protocol) -> set[str]:
    # A rater who joins is put into the protocol, whose hash the schedules carry that
    # are drawn from then on.
    drawn_from: dict[str, str] = {}
    for session in protocol.sessions:
        for rater in session.raters:
            file = study.schedule_file(rater, session.id)
            if rater not in drawn_from and file.exists():
                try:
                    drawn_from[rater] = read_schedule(file).protocol_sha256
                except ScheduleError:
                    continue  # masrel check says so
    in_force = _protocols_in_force(study, protocol)
    late = set()
    for site in {rater.site for rater in protocol.raters}:
        of_site = {rater.id for rater in protocol.raters if rater.site == site}
        draws = {rater: drawn_from[rater] for rater in drawn_from if rater in of_site}
        first = _first_draw(draws, [pair for pair in in_force if pair[0] in draws])
        late |= {rater for rater, sha256 in draws.items() if sha256 != first}
    return late


def _protocols_in_force(study: StudyPaths, protocol: Protocol) -> list[tuple[str, str]]:
    # raters, each with the hash of the protocol under which a session of theirs began,
    # in order of time; then every rater with that of the protocol as it is now
    begun: list[tuple[str, str, str]] = []
    for session in protocol.sessions:
        for rater in session.raters:
            events, state, _ = _events(study.log_file(rater, session.id))
            if "protocol_sha256" in state.header:
                sha256 = str(state.header["protocol_sha256"])
                begun.append((events[0].time_utc, rater, sha256))
    begun.sort(key=itemgetter(0))
    now = protocol_hash(protocol)
    return [pair[1:] for pair in begun] + [(each.id, now) for each in protocol.raters]


def _first_draw(
    draws: Mapping[str, str], in_force: Sequence[tuple[str, str]]
) -> str | None:
    # the hash of the protocol from which the first schedules of a site were drawn
    hashes = [sha256 for _, sha256 in in_force]

    def is_later(sha256: str) -> bool:
        # A schedule is drawn before its session begins: one of another protocol whose
        # session began under this one, or earlier, was drawn before this one's.
        return sha256 in hashes and any(
            draws[rater] != sha256 and hashes.index(other) <= hashes.index(sha256)
            for rater, other in in_force
        )

    # Of several that may be the first it is that of the rater who is named first.
    return min(dict.fromkeys(draws.values()), key=is_later, default=None)


def raters_csv(
    raters: Sequence[RaterProgress], protocol: Protocol, *, simulated: bool
) -> str:
    """Return the table of raters as the text of its file, ``ratings/raters.csv``.

    Parameters
    ----------
    raters : sequence of RaterProgress
        What `rater_progress` returned.
    protocol : Protocol
        The study's protocol.
    simulated : bool
        Whether any of their sessions is simulated.

    Returns
    -------
    str
        One row a rater, with a column for every field; NA where nothing is known.
    """
    head = "# Raters, one row each, as they stand in the study; NA is not known.\n"
    if simulated:
        head = f"# SIMULATED: not sessions of persons on hardware.\n{head}"
    text = io.StringIO(newline="")
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(["rater", "site", "status", "late", *protocol.rater_fields])
    for each in raters:
        cells = [each.values[name] for name in protocol.rater_fields]
        late = "yes" if each.is_late else "no"
        known = [each.rater, _cell(each.site), each.status, late]
        writer.writerow([*known, *map(_cell, cells)])
    return f"{head}# format: 1\n{text.getvalue()}"


def raters_text(study: StudyPaths, protocol: Protocol) -> str:
    """Return the table of raters as protocol and logs have it now."""
    sessions = session_progress(study, protocol)
    raters = rater_progress(study, protocol, sessions)
    simulated = any(session.simulated for session in sessions)
    return raters_csv(raters, protocol, simulated=simulated)


def _cell(value: FieldValue | None) -> str:
    if value is None:
        return "NA"
    return safe_cell(value) if isinstance(value, str) else repr(value)
