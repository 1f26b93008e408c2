"""``masrel status``: how far a study is, and what to do next."""

import dataclasses
from pathlib import Path
from typing import TYPE_CHECKING

import click

from masrel.cli import STUDY, Commands
from masrel.cli._options import (
    STDOUT,
    OutputOptions,
    output_options,
    write_json,
    write_output,
)
from masrel.errors import SessionLogError
from masrel.lab._once import read_once
from masrel.lab.protocol import StudyPaths, read_protocol
from masrel.lab.protocol._values import field_heading

if TYPE_CHECKING:
    from masrel.lab._event_log import Event
    from masrel.lab.progress import NextStep, RaterProgress, SessionProgress
    from masrel.lab.protocol import Protocol
    from masrel.tables._tables import Table


@click.group("status", cls=Commands)
def status() -> None:
    """Say how far a study is, or what is known of its raters.

    masrel status STUDY says how far it is.
    """


@status.command(STUDY)
@click.argument("study", type=click.Path(path_type=Path))
@output_options(json="Write it as JSON here; - prints it, and nothing else.")
def _study(study: Path, output: OutputOptions) -> None:
    """Say how far STUDY is: every session, what happened beside them, one next step.

    By the logs alone, whose chains are verified; no recording is read, nothing is
    changed, and no model is named.
    """
    overview = _Overview.of(StudyPaths(study))
    if output.json_file is not None:
        write_json(overview.document(), output.json_file)
    if output.json_file != STDOUT:
        click.echo(overview.text())


@dataclasses.dataclass(frozen=True, slots=True, kw_only=True)
class _Overview:
    """What is shown of a study."""

    study: str
    sessions: "tuple[SessionProgress, ...]"
    raters: "tuple[RaterProgress, ...]"
    events: "tuple[Event, ...]"
    problem: str | None  # why what happened beside the sessions cannot be read
    next: "NextStep"

    @classmethod
    @read_once()
    def of(cls, paths: StudyPaths) -> "_Overview":
        from masrel.lab.conduct import read_conduct
        from masrel.lab.progress import next_step, rater_progress, session_progress

        protocol = read_protocol(paths.protocol)
        sessions = session_progress(paths, protocol)
        raters: tuple[RaterProgress, ...] = ()
        events: tuple[Event, ...] = ()
        problem = None
        try:
            raters = rater_progress(paths, protocol, sessions)
            events = read_conduct(paths)
        except SessionLogError as error:  # hides no session
            problem = str(error)
        return cls(
            study=protocol.study.id,
            sessions=sessions,
            raters=raters,
            events=events,
            problem=problem,
            next=next_step(paths, sessions, raters),
        )

    def document(self) -> dict[str, object]:
        return {
            "format": "masrel status 1",
            "study": self.study,
            "sessions": [dataclasses.asdict(session) for session in self.sessions],
            "raters": [
                {"rater": r.rater, "status": r.status, "is_late": r.is_late}
                for r in self.raters
            ],
            "events": [
                {"event": e.kind, "time_utc": e.time_utc, **e.fields}
                for e in self.events
            ],
            "problem": self.problem,
            "next": dataclasses.asdict(self.next),
        }

    def text(self) -> str:
        from masrel.tables._tables import as_text

        parts = [as_text(_sessions_table(self))]
        problems = (self.problem, *(session.problem for session in self.sessions))
        parts += [problem for problem in problems if problem is not None]
        if self.events:
            parts.append("\n".join(map(_event_line, self.events)))
        parts.append(f"next: {self.next.command}  ({self.next.why})")
        return "\n\n".join(parts)


_COUNTS = {
    "Practised": "n_practised",
    "Breaks": "n_breaks",
    "Answers": "n_answers",
    "Skipped": "n_skipped",
    "Faults": "n_faults",
    "Corrections": "n_corrections",
}
"""Columns that are there when any session has something in them."""


def _sessions_table(overview: _Overview) -> "Table":
    from masrel.tables._tables import Column, Table

    sessions = overview.sessions
    status = {rater.rater: rater.status for rater in overview.raters}
    n_complete = sum(session.stage == "complete" for session in sessions)
    counts = {
        heading: key
        for heading, key in _COUNTS.items()
        if any(getattr(session, key) for session in sessions)
    }
    return Table(
        name="status",
        caption=f"Study {overview.study}: {n_complete} of {len(sessions)} sessions "
        "complete",
        columns=(
            Column(key="session", heading="Session", align="left"),
            Column(key="rater", heading="Rater", align="left"),
            Column(key="stage", heading="Stage", align="left"),
            Column(key="graded", heading="Graded"),
            *(Column(key=key, heading=heading) for heading, key in counts.items()),
            Column(key="last", heading="Last event (UTC)", align="left"),
        ),
        rows=tuple(
            (
                session.session,
                session.rater,
                _stage(session, status.get(session.rater)),
                f"{session.n_graded} of {session.n_presentations}",
                *(getattr(session, key) for key in counts.values()),
                _last_event(session),
            )
            for session in sessions
        ),
        data="simulated" if any(s.simulated for s in sessions) else "recorded",
    )


def _stage(session: "SessionProgress", status: str | None) -> str:
    is_out = status in ("withdrawn", "excluded")
    return f"{session.stage}, {status}" if is_out else session.stage


def _last_event(session: "SessionProgress") -> str | None:
    if session.last_time_utc is None:
        return None
    return f"{_minute(session.last_time_utc)} {session.last_event}"


def _event_line(event: "Event") -> str:
    fields = {name: value for name, value in event.fields.items() if value is not None}
    kind = fields.pop("kind", event.kind)
    details = ", ".join(f"{name} {value}" for name, value in fields.items())
    return f"{_minute(event.time_utc)} {kind}: {details}"


def _minute(time_utc: str) -> str:
    return time_utc[:16].replace("T", " ")


@status.command("raters")
@click.argument("study", type=click.Path(path_type=Path))
@output_options(
    json="Write the list here; - prints it, and nothing else.",
    csv="Print the list as CSV.",
)
@read_once()
def _raters(study: Path, output: OutputOptions) -> None:
    """List the raters of STUDY: how far each came, and what is known of him or her."""
    from masrel.lab.progress import rater_progress, session_progress

    paths = StudyPaths(study)
    protocol = read_protocol(paths.protocol)
    sessions = session_progress(paths, protocol)
    raters = rater_progress(paths, protocol, sessions)
    simulated = any(session.simulated for session in sessions)
    write_output(
        output,
        document=lambda: {"raters": [_rater_document(each) for each in raters]},
        text=lambda: _raters_table(raters, protocol, simulated=simulated),
    )


def _rater_document(rater: "RaterProgress") -> dict[str, object]:
    return {
        "rater": rater.rater,
        "site": rater.site,
        "status": rater.status,
        "is_late": rater.is_late,
        "fields": dict(rater.values),
    }


def _raters_table(
    raters: "tuple[RaterProgress, ...]", protocol: "Protocol", *, simulated: bool
) -> "Table":
    from masrel.tables._tables import Column, Table

    has_sites = any(rater.site for rater in raters)
    columns = [Column(key="rater", heading="Rater", align="left")]
    columns += [Column(key="site", heading="Site", align="left")] * has_sites
    columns.append(Column(key="status", heading="Status", align="left"))
    columns.append(Column(key="late", heading="Late", align="left"))
    for name, field in protocol.rater_fields.items():
        is_number = field.type in ("whole", "number")
        columns.append(
            Column(
                key=name,
                heading=field_heading(name, field),
                align="right" if is_number else "left",
            )
        )
    rows = (
        (
            each.rater,
            *[each.site] * has_sites,
            each.status,
            "yes" if each.is_late else None,
            *each.values.values(),
        )
        for each in raters
    )
    return Table(
        name="raters",
        caption=f"Raters of study {protocol.study.id}",
        columns=tuple(columns),
        rows=tuple(rows),
        data="simulated" if simulated else "recorded",
    )
