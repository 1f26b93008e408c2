"""``masrel status``: how far a study is, and what to do next."""

import dataclasses
import time
from pathlib import Path
from typing import TYPE_CHECKING

import click

from masrel.cli._options import STDOUT, OutputOptions, output_options, write_json
from masrel.errors import ParameterError, SessionLogError
from masrel.lab._once import read_once
from masrel.lab.protocol import StudyPaths, read_protocol

if TYPE_CHECKING:
    from masrel.lab._event_log import Event
    from masrel.lab.progress import NextStep, RaterProgress, SessionProgress
    from masrel.tables._tables import Table

_EVERY_S = 2.0


@click.command("status")
@click.argument("study", type=click.Path(path_type=Path))
@output_options(json="Write it as JSON here; - prints it, and nothing else.")
@click.option("--watch", is_flag=True, help="Show it again when it changes.")
def status(study: Path, output: OutputOptions, watch: bool) -> None:
    """Say how far STUDY is: every session, what happened beside them, one next step.

    By the logs alone, whose chains are verified; no recording is read, nothing is
    changed, and no model is named.
    """
    if watch and output.json_file is not None:
        raise ParameterError("--watch: needed without --json, got both")
    overview = _Overview.of(StudyPaths(study))
    if output.json_file is not None:
        write_json(overview.document(), output.json_file)
    if output.json_file != STDOUT:
        click.echo(overview.text())
    while watch:
        time.sleep(_EVERY_S)
        before, overview = overview, _Overview.of(StudyPaths(study))
        if overview != before:
            click.clear()
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
