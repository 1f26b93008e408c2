"""``masrel status``: the progress of a study, and what to do next."""

from textwrap import shorten
from typing import Any

import click

from masrel.cli._commands import STUDY, Commands
from masrel.cli._options import OutputOptions, output_options, write_output
from masrel.lab._study_files import read_once
from masrel.lab.cli._study_options import of_study
from masrel.lab.conduct import PlanChange
from masrel.lab.conduct._calibrations import calibration_notes
from masrel.lab.progress import rater_progress, session_progress, study_status
from masrel.lab.protocol import Protocol, StudyPaths
from masrel.lab.protocol._values import field_heading
from masrel.lab.run._settings import moves_hardware
from masrel.tables._tables import Column, Table, as_text, table_of


@click.group("status", cls=Commands)
def status() -> None:
    """Show the progress of a study, or what is known about its raters.

    masrel status STUDY shows the progress.
    """


@status.command(STUDY)
@read_once()
@of_study
@output_options(
    json='Write JSON to this file; "-" writes it to standard output and prints nothing '
    "else."
)
def _study(paths: StudyPaths, protocol: Protocol, output: OutputOptions) -> None:
    """Show the progress of STUDY: each session, other events, and the next step.

    Only the logs are read, and their hash chains are verified. Nothing is changed, and
    no model is named.
    """
    stands = study_status(paths, protocol)
    stands["device"] = [
        *calibration_notes(
            paths, protocol, moves_hardware=moves_hardware(protocol.device)
        )
    ]
    sessions = stands["sessions"]
    problems = (stands["problem"], *(session["problem"] for session in sessions))
    parts = (
        *(each for each in problems if each is not None),
        "\n".join(map(_event_line, stands["events"])),
        "\n".join(str(PlanChange(**each)) for each in stands["plan_changes"]),
        "\n".join(stands["device"]),
        "next: {command}  ({why})".format(**stands["next"]),
    )
    write_output(
        output,
        document=lambda: stands,
        text=lambda: "\n\n".join(
            [as_text(_sessions_table(stands)), *filter(None, parts)]
        ),
        mode=0o600,
    )


_MOST_SHOWN = 200  # characters of a text in the list of events

# Columns that are there when any session has something in them
_COUNTS = {
    "n_practised": "Practised",
    "n_breaks": "Breaks",
    "n_answers": "Answers",
    "n_skipped": "Skipped",
    "n_faults": "Faults",
    "n_corrections": "Corrections",
}


def _sessions_table(stands: dict[str, Any]) -> Table:
    absent = {
        rater["rater"]: f", {rater['status']}"
        for rater in stands["raters"]
        if rater["status"] in ("withdrawn", "excluded")
    }
    sessions = stands["sessions"]
    rows = [
        {
            **each,
            "stage": each["stage"] + absent.get(each["rater"], ""),
            "graded": "{n_graded} of {n_presentations}".format(**each),
            "day": each["held_on"]
            or (_due(**each["due"]) if each["rater"] not in absent else None),
            "last": each["last_time_utc"]
            and f"{_minute(each['last_time_utc'])} {each['last_event']}",
        }
        for each in sessions
    ]
    n_complete = sum(session["stage"] == "complete" for session in sessions)
    return table_of(
        "status",
        f"Study {stands['study']}: {n_complete} of {len(sessions)} sessions complete",
        (
            Column(key="session", heading="Session", align="left"),
            Column(key="rater", heading="Rater", align="left"),
            Column(key="stage", heading="Stage", align="left"),
            Column(key="graded", heading="Graded"),
            *[Column(key="day", heading="Day", align="left")]
            * any(row["day"] for row in rows),
            *(
                Column(key=key, heading=heading)
                for key, heading in _COUNTS.items()
                if any(row[key] for row in rows)
            ),
            Column(key="last", heading="Last event (UTC)", align="left"),
        ),
        rows,
        data="simulated" if any(s["simulated"] for s in sessions) else "recorded",
    )


def _due(
    first: str | None, last: str | None, *, is_overdue: bool, **_: object
) -> str | None:
    # the days on which it may begin
    words = (
        f"from {first}" if first else None,
        f"to {last}" if last else None,
        "(overdue)" if is_overdue else None,
    )
    return " ".join(filter(None, words)) or None


def _event_line(event: dict[str, Any]) -> str:
    fields = {name: value for name, value in event.items() if value is not None}
    time_utc, kind = fields.pop("time_utc"), fields.pop("event")
    kind = fields.pop("kind", kind)
    # one line, whatever was written
    details = ", ".join(
        f"{name} {shorten(str(value), _MOST_SHOWN, placeholder=' …')}"
        for name, value in fields.items()
    )
    return f"{_minute(time_utc)} {kind}: {details}"


def _minute(time_utc: str) -> str:
    return time_utc[:16].replace("T", " ")


@status.command("raters")
@read_once()
@of_study
@output_options(
    json='Write JSON to this file; "-" writes it to standard output and prints nothing '
    "else.",
    csv="Print the list as CSV.",
)
def _raters(paths: StudyPaths, protocol: Protocol, output: OutputOptions) -> None:
    """List the raters of STUDY, their progress, and what is known about them."""
    sessions = session_progress(paths, protocol)
    raters = rater_progress(paths, protocol, sessions)
    simulated = any(session.simulated for session in sessions)
    rows = [
        {
            "rater": rater.rater,
            "site": rater.site,
            "status": rater.status,
            "is_late": rater.is_late,
            "fields": dict(rater.values),
        }
        for rater in raters
    ]
    write_output(
        output,
        document=lambda: {"raters": rows},
        text=lambda: _raters_table(rows, protocol, simulated=simulated),
        mode=0o600,
    )


def _raters_table(
    rows: list[dict[str, Any]], protocol: Protocol, *, simulated: bool
) -> Table:
    has_sites = any(row["site"] for row in rows)
    columns = (
        Column(key="rater", heading="Rater", align="left"),
        *[Column(key="site", heading="Site", align="left")] * has_sites,
        Column(key="status", heading="Status", align="left"),
        Column(key="late", heading="Late", align="left"),
        *(
            Column(
                key=name,
                heading=field_heading(name, field),
                align="right" if field.type in ("whole", "number") else "left",
            )
            for name, field in protocol.rater_fields.items()
        ),
    )
    cells = [
        {**row["fields"], **row, "late": "yes" if row["is_late"] else None}
        for row in rows
    ]
    caption = f"Raters of study {protocol.study.id}"
    data = "simulated" if simulated else "recorded"
    return table_of("raters", caption, columns, cells, data=data)
