"""``masrel note``: a note, a deviation from the protocol, or an adverse event."""

from pathlib import Path

import click

from masrel.lab.conduct._statements import NOTE_KINDS, SEVERITIES, NoteKind, Severity
from masrel.lab.protocol import StudyPaths, read_protocol


@click.command("note")
@click.argument("study", type=click.Path(path_type=Path))
@click.argument("text")
@click.option("--who", required=True, help="Who says so.")
@click.option(
    "--kind", type=click.Choice(NOTE_KINDS), default="note", show_default=True
)
@click.option("--rater", help="To whom it happened.")
@click.option("--session", help="In which session.")
@click.option("--severity", type=click.Choice(SEVERITIES), help="Of an adverse event.")
@click.option("--action", help="What was done about an adverse event.")
@click.option("--outcome", help="What came of an adverse event.")
def note(
    study: Path,
    text: str,
    who: str,
    kind: NoteKind,
    rater: str | None,
    session: str | None,
    severity: Severity | None,
    action: str | None,
    outcome: str | None,
) -> None:
    """Record TEXT in the log of STUDY, with the time of day.

    masrel status shows it; the report shows what kind it is and when, and the text if
    --include notes asks for it.
    """
    from masrel.lab.conduct import record_note

    paths = StudyPaths(study)
    record_note(
        paths,
        read_protocol(paths.protocol),
        text,
        who=who,
        kind=kind,
        rater=rater,
        session=session,
        severity=severity,
        action=action,
        outcome=outcome,
    )
    click.echo(f"{kind} recorded: {paths.conduct_file}")
