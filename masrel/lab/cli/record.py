"""``masrel record``: what somebody states of a study, with who says so."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import click

from masrel.cli import Commands
from masrel.cli._options import Decorator
from masrel.errors import ParameterError
from masrel.lab.conduct._statements import SEVERITIES
from masrel.lab.protocol import StudyPaths, read_protocol


@click.group("record", cls=Commands)
def record() -> None:
    """Record what happened to a study beside its presentations, and who says so.

    All of it is added to logs: what was recorded before stays there.
    """


def _options(*options: Decorator) -> Decorator:
    """Return a decorator of the study, and of options in this order."""

    def decorate(command: Callable[..., Any]) -> Callable[..., Any]:
        for option in reversed(options):
            command = option(command)
        return click.argument("study", type=click.Path(path_type=Path))(command)

    return decorate


_rater = click.option("--rater", required=True, help="Id of the rater.")
_session = click.option("--session", required=True, help="Id of the session.")
_who = click.option("--who", required=True, help="Who says so.")
_why = click.option("--why", required=True, help="For what reason.")
_code = click.option("--code", required=True, help="Code of the presentation.")
_about = _options(
    click.argument("text"),
    _who,
    click.option("--rater", help="To whom it happened."),
    click.option("--session", help="In which session."),
)
_of_rater = _options(_rater, _who, _why)


def _of_session(*options: Decorator) -> Decorator:
    return _options(_rater, _session, *options, _who, _why)


@record.command("note")
@_about
def _note(study: Path, **fields: Any) -> None:
    """Record TEXT in the log of STUDY, with the time of day.

    masrel status shows it; the report shows what kind it is and when, and the text if
    --include notes asks for it.
    """
    _record_note(study, "note", fields)


@record.command("deviation")
@_about
def _deviation(study: Path, **fields: Any) -> None:
    """Record TEXT, a deviation from the protocol, as a note is recorded."""
    _record_note(study, "deviation", fields)


@record.command("adverse-event")
@_about
@click.option("--severity", type=click.Choice(SEVERITIES))
@click.option("--action", help="What was done about it.")
@click.option("--outcome", help="What came of it.")
def _adverse_event(study: Path, **fields: Any) -> None:
    """Record TEXT, an adverse event, as a note is recorded."""
    _record_note(study, "adverse-event", fields)


def _record_note(study: Path, kind: Any, fields: dict[str, Any]) -> None:
    from masrel.lab.conduct import record_note

    paths = StudyPaths(study)
    record_note(paths, read_protocol(paths.protocol), kind=kind, **fields)
    click.echo(f"{kind} recorded: {paths.conduct_file}")


@record.command("correct")
@_of_session(
    _code,
    click.option(
        "--grade", required=True, help="What it should have been, NA for missing."
    ),
)
def _correct(
    study: Path, rater: str, session: str, code: str, grade: str, who: str, why: str
) -> None:
    """Correct the grade of a presentation of STUDY; the first one stays in the log."""
    from masrel.lab.run import record_correction

    paths = StudyPaths(study)
    corrected = None if grade == "NA" else grade  # no scale has such a grade
    record_correction(
        paths,
        read_protocol(paths.protocol),
        *(rater, session),
        code=code,
        grade=corrected,
        who=who,
        why=why,
    )
    what = "missing" if corrected is None else grade
    _say(
        f"{code} of {rater}, session {session}, is now {what}; what it was before "
        f"stays in {paths.log_file(rater, session)}"
    )


@record.command("skip")
@_of_session(_code)
def _skip(study: Path, rater: str, session: str, code: str, who: str, why: str) -> None:
    """Leave a presentation of STUDY, after a fault, without a grade."""
    from masrel.lab.run import record_skip

    paths = StudyPaths(study)
    record_skip(paths, rater, session, code=code, who=who, why=why)
    log = paths.log_file(rater, session)
    _say(f"{code} of {rater}, session {session}, is skipped, as is said in {log}")


@record.command("answer")
@_of_session(
    click.option(
        "--question", required=True, help="Which, named as QUESTIONNAIRE.QUESTION."
    ),
    click.option(
        "--answer", required=True, help="What it should have been, NA for missing."
    ),
    click.option("--code", help="Of which presentation."),
)
def _answer(
    study: Path,
    rater: str,
    session: str,
    question: str,
    answer: str,
    code: str | None,
    who: str,
    why: str,
) -> None:
    """Correct an answer to a question of STUDY; the first one stays in the log."""
    from masrel.lab.run import record_answer

    paths = StudyPaths(study)
    log = record_answer(
        paths,
        read_protocol(paths.protocol),
        *(rater, session),
        question=question,
        answer=None if answer == "NA" else answer,
        code=code,
        who=who,
        why=why,
    )
    what = "missing" if answer == "NA" else answer
    of = f"{question} of {code}" if code is not None else question
    _say(
        f"the answer of {rater} to {of} is now {what}; what it was before stays in "
        f"{log}"
    )


def _say(message: str) -> None:
    click.echo(f"{message}. Then: masrel ratings")


@record.command("rater")
@_options(_rater)
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


@record.command("exclude")
@_of_rater
def _exclude(study: Path, **fields: Any) -> None:
    """Leave a rater out of the analysis of STUDY; the grades stay in the study.

    Every command that computes says so, and so does the report.
    """
    _record_standing(study, "excluded", "is excluded; the grades are kept", fields)


@record.command("include")
@_of_rater
def _include(study: Path, **fields: Any) -> None:
    """Take a rater of STUDY who was excluded back into the analysis."""
    _record_standing(study, "included", "is analysed again", fields)


@record.command("withdraw")
@_of_rater
def _withdraw(study: Path, **fields: Any) -> None:
    """Record that a rater has left STUDY.

    The rater stays in the protocol, the grades given before stay in the study and are
    counted, and the report says so. No session of the rater goes on.
    """
    _record_standing(
        study, "withdrawn", "is withdrawn; the grades given before are kept", fields
    )


def _record_standing(
    study: Path, standing: Any, words: str, fields: dict[str, Any]
) -> None:
    from masrel.lab.conduct import record_standing

    paths = StudyPaths(study)
    record_standing(paths, read_protocol(paths.protocol), standing=standing, **fields)
    click.echo(f"{fields['rater']} {words}: {paths.conduct_file}")


@record.command("unblind")
@_options(click.argument("code", required=False))
@click.option("--all", "every", is_flag=True, help="All codes of all schedules.")
@click.option("--rater", help="Of this rater alone.")
@click.option("--session", help="Of this session alone.")
@click.option("--who", required=True, help="Who is to know.")
@_why
def _unblind(study: Path, code: str | None, every: bool, **fields: Any) -> None:
    """Print which model CODE of STUDY stands for, once it is recorded who asked.

    It is an event of STUDY/conduct.jsonl, and the report says so.
    """
    from masrel.lab.conduct import record_unblinding

    if (code is None) != every:
        raise click.UsageError("needs either a CODE or --all")
    paths = StudyPaths(study)
    protocol = read_protocol(paths.protocol)
    for schedule, shown in record_unblinding(paths, protocol, code, **fields):
        click.echo(
            f"{shown.code} of {schedule.rater}, session {schedule.session}, is "
            f"{shown.model} (presentation {shown.position}, repeat {shown.repeat})"
        )
