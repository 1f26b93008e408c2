"""What became of every rater of a study, and the table of raters."""

import csv
import io
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal

from masrel._cells import safe_cell
from masrel.conduct import excluded_raters, rater_values, read_conduct
from masrel.errors import ScheduleError
from masrel.progress._session_stages import SessionProgress, session_progress
from masrel.protocol import Protocol, StudyPaths
from masrel.protocol._rater_fields import FieldValue
from masrel.schedule import read_schedule

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
        Whether the rater joined later than most: the first schedule was drawn from
        another protocol than most of the site's.
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
    sites = {rater.id: rater.site for rater in protocol.raters}
    counts: dict[str | None, Counter[str]] = {}
    for rater, sha256 in drawn_from.items():
        counts.setdefault(sites[rater], Counter())[sha256] += 1
    return {
        rater
        for rater, sha256 in drawn_from.items()
        if sha256 != counts[sites[rater]].most_common(1)[0][0]
    }


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
