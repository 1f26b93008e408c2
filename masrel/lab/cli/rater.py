"""``masrel rater``: what is known of raters, and whether they are analysed."""

from pathlib import Path
from typing import TYPE_CHECKING

import click

from masrel.cli._options import OutputOptions, output_options, write_output
from masrel.errors import ParameterError
from masrel.lab._once import read_once
from masrel.lab.protocol import StudyPaths, read_protocol
from masrel.lab.protocol._values import field_heading

if TYPE_CHECKING:
    from masrel.lab.progress import RaterProgress
    from masrel.lab.protocol import Protocol
    from masrel.tables._tables import Table

_study = click.argument("study", type=click.Path(path_type=Path))
_rater = click.option("--rater", required=True, help="Id of the rater.")
_who = click.option("--who", required=True, help="Who says so.")
_why = click.option("--why", required=True, help="For what reason.")


@click.group("rater")
def rater() -> None:
    """Record what is known of a rater, and who is left out of the analysis."""


@rater.command("set")
@_study
@_rater
@click.argument("values", metavar="FIELD=VALUE...", nargs=-1, required=True)
@_who
def _set(study: Path, rater: str, values: tuple[str, ...], who: str) -> None:
    """Record fields of a rater of STUDY, such as years=12.

    The protocol declares the fields in [rater_fields]. What is recorded last counts,
    what was recorded before stays in the log; FIELD= alone says that nothing is known.
    """
    from masrel.lab.conduct import record_rater_values

    paths, by_field = StudyPaths(study), dict[str, str]()
    for entry in values:
        name, equals, text = entry.partition("=")
        if not equals or name in by_field:
            raise ParameterError(
                f"FIELD=VALUE: needed a field, '=' and its value, each field once, "
                f"got {entry!r}"
            )
        by_field[name] = text
    protocol = read_protocol(paths.protocol)
    record_rater_values(paths, protocol, rater, by_field, who=who)
    click.echo(f"{', '.join(by_field)} of {rater} recorded: {paths.conduct_file}")


@rater.command("exclude")
@_study
@_rater
@_who
@_why
def _exclude(study: Path, rater: str, who: str, why: str) -> None:
    """Leave a rater out of the analysis of STUDY; the grades stay in the study.

    Every verb that computes says so, and so does the report.
    """
    from masrel.lab.conduct import record_standing

    paths = StudyPaths(study)
    record_standing(
        paths, read_protocol(paths.protocol), rater, "excluded", who=who, why=why
    )
    click.echo(f"{rater} is excluded; the grades are kept: {paths.conduct_file}")


@rater.command("include")
@_study
@_rater
@_who
@_why
def _include(study: Path, rater: str, who: str, why: str) -> None:
    """Take a rater of STUDY who was excluded back into the analysis."""
    from masrel.lab.conduct import record_standing

    paths = StudyPaths(study)
    record_standing(
        paths, read_protocol(paths.protocol), rater, "included", who=who, why=why
    )
    click.echo(f"{rater} is analysed again: {paths.conduct_file}")


@rater.command("list")
@_study
@output_options(
    json="Write the list here; - prints it, and nothing else.",
    csv="Print the list as CSV.",
)
@read_once()
def _list(study: Path, output: OutputOptions) -> None:
    """List the raters of STUDY: how far each came, and what is known of him or her."""
    from masrel.lab.progress import rater_progress, session_progress

    paths = StudyPaths(study)
    protocol = read_protocol(paths.protocol)
    sessions = session_progress(paths, protocol)
    raters = rater_progress(paths, protocol, sessions)
    simulated = any(session.simulated for session in sessions)
    write_output(
        output,
        document=lambda: {"raters": [_document(each) for each in raters]},
        text=lambda: _table(raters, protocol, simulated=simulated),
    )


def _document(rater: "RaterProgress") -> dict[str, object]:
    return {
        "rater": rater.rater,
        "site": rater.site,
        "status": rater.status,
        "is_late": rater.is_late,
        "fields": dict(rater.values),
    }


def _table(
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
