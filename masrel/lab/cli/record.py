"""``masrel record``: what somebody states of a study, with who says so."""

from pathlib import Path
from typing import Any

import click

from masrel.cli._commands import STUDY, Commands
from masrel.cli._options import Decorator, write_json
from masrel.errors import ParameterError
from masrel.lab.cli._study_options import (
    echo_stamp,
    id_option,
    of_study,
    session_option,
    several,
    stamp_option,
    warnings_as_notes,
)
from masrel.lab.conduct import (
    Note,
    record_amendment,
    record_new_rater,
    record_note,
    record_rater_values,
    record_standing,
    record_unblinding,
    registration,
)
from masrel.lab.conduct._statements import NoteKind, Standing
from masrel.lab.progress import unseal_study
from masrel.lab.protocol import Protocol, StudyPaths
from masrel.lab.protocol.study import _OPENED
from masrel.lab.run._corrections import (
    record_answer,
    record_correction,
    record_day,
    record_skip,
)


@click.group("record", cls=Commands)
def record() -> None:
    """Record notes, events, corrections and changes of raters, and who reports them.

    Everything is added to the logs; earlier entries are kept.
    """


_who = click.option("--who", required=True, help="Who reports this.")
_why = click.option("--why", required=True, help="The reason.")
_code = click.option("--code", required=True, help="Code of the presentation.")
_on = click.option(
    "--on", metavar="DATE", help="Date on which it happened; default: today."
)
_about = several(
    of_study,
    click.argument("text"),
    _who,
    click.option("--rater", help="The rater it concerns."),
    click.option("--session", help="The session it concerns."),
    _on,
)


def _of_session(*options: Decorator) -> Decorator:
    return several(of_study, id_option, session_option, *options, _who, _why)


def _add_note(kind: NoteKind, text: str, *options: Decorator) -> None:
    def command(study: StudyPaths, protocol: Protocol, **fields: Any) -> None:
        record_note(study, protocol, Note(kind=kind, **fields))
        click.echo(f"{kind} recorded: {study.conduct_file}")

    record.command(kind, help=text)(several(_about, *options)(command))


_add_note(
    "note",
    """Record TEXT as a note in the log of STUDY, with the time.

    masrel status shows the note. The report shows its kind and time, and its text only
    with --include notes.
    """,
)
_add_note(
    "deviation",
    "Record TEXT as a deviation from the protocol, in the same way as a note.",
)
_add_note(
    "adverse-event",
    "Record TEXT as an adverse event, in the same way as a note.",
    click.option(
        "--severity",
        metavar="mild|moderate|severe",
        help="Severity of the adverse event.",
    ),
    click.option(
        "--seriousness",
        metavar="'serious'|'not serious'",
        help="Whether the event is serious as defined by ICH E2A.",
    ),
    click.option(
        "--relatedness",
        metavar="WORD",
        help="Whether the study caused the event: unrelated, unlikely, possible, "
        "probable or definite.",
    ),
    click.option("--onset", metavar="DATE", help="Date on which the event began."),
    click.option("--action", help="Action taken."),
    click.option("--outcome", help="Outcome of the event."),
)


def _or_missing(text: str) -> str | None:
    return None if text == "NA" else text  # no scale has such a grade


@record.command("correct")
@_of_session(
    _code,
    click.option(
        "--grade", required=True, help="The correct grade, or NA for missing."
    ),
)
def _correct(
    study: StudyPaths,
    protocol: Protocol,
    rater: str,
    session: str,
    grade: str,
    code: str,
    **reasons: Any,
) -> None:
    """Correct the grade of a presentation; the original grade stays in the log."""
    record_correction(
        study, protocol, rater, session, code=code, grade=_or_missing(grade), **reasons
    )
    what = f"{code} of {rater}, session {session},"
    _say_corrected(what, _or_missing(grade), study.log_file(rater, session))


@record.command("day")
@_of_session(
    click.option(
        "--on",
        metavar="DATE",
        required=True,
        help="Date on which the session was held.",
    )
)
def _day(
    study: StudyPaths,
    protocol: Protocol,
    rater: str,
    session: str,
    **fields: Any,
) -> None:
    """Correct the date of a session; the original date stays in the log.

    The days between sessions are recalculated.
    """
    with warnings_as_notes():
        record_day(study, protocol, rater, session, **fields)
    click.echo(
        f"session {session} of {rater} was held on {fields['on']}; recorded in "
        f"{study.log_file(rater, session)}"
    )


@record.command("skip")
@_of_session(_code)
def _skip(
    study: StudyPaths,
    protocol: Protocol,
    rater: str,
    session: str,
    code: str,
    **reasons: Any,
) -> None:
    """Leave a presentation without a grade after a fault."""
    record_skip(study, protocol, rater, session, code=code, **reasons)
    log = study.log_file(rater, session)
    click.echo(
        f"{code} of {rater}, session {session}, is skipped; recorded in {log}. "
        "Next: masrel ratings"
    )


@record.command("answer")
@_of_session(
    click.option(
        "--question", required=True, help="The question, as QUESTIONNAIRE.QUESTION."
    ),
    click.option(
        "--answer", required=True, help="The correct answer, or NA for missing."
    ),
    click.option(
        "--code", help="Code of the presentation that the question was about."
    ),
)
def _answer(
    study: StudyPaths,
    protocol: Protocol,
    rater: str,
    session: str,
    answer: str,
    **fields: Any,
) -> None:
    """Correct an answer to a question; the original answer stays in the log."""
    log = record_answer(
        study, protocol, rater, session, answer=_or_missing(answer), **fields
    )
    code = fields["code"]
    of = fields["question"] + ("" if code is None else f" of {code}")
    _say_corrected(f"the answer of {rater} to {of}", _or_missing(answer), log)


def _say_corrected(what: str, now: str | None, log: Path) -> None:
    click.echo(
        f"{what} is now {now or 'missing'}; the original stays in {log}. Next: "
        "masrel ratings"
    )


@record.group("rater", cls=Commands)
def _rater() -> None:
    """Record information about a rater, or add a rater.

    masrel record rater STUDY records fields of a rater.
    """


@_rater.command(STUDY)
@of_study
@id_option
@click.argument("values", metavar="FIELD=VALUE...", nargs=-1, required=True)
@_who
def _set(
    study: StudyPaths,
    protocol: Protocol,
    rater: str,
    values: tuple[str, ...],
    who: str,
) -> None:
    """Record fields of a rater of STUDY, such as years=12.

    The protocol declares the fields in [rater_fields]. The latest value counts; earlier
    values stay in the log. FIELD= alone records that the value is unknown.
    """
    by_field = _by_field(values)
    record_rater_values(study, protocol, rater, by_field, who=who)
    click.echo(f"{', '.join(by_field)} of {rater} recorded: {study.conduct_file}")


@_rater.command("add")
@of_study
@id_option
@click.option(
    "--session",
    "sessions",
    multiple=True,
    required=True,
    help="Session of the rater. Repeatable.",
)
@click.option("--site", help="Site of the rater.")
@click.argument("values", metavar="[FIELD=VALUE]...", nargs=-1)
@_who
def _add(
    study: StudyPaths,
    protocol: Protocol,
    rater: str,
    sessions: tuple[str, ...],
    values: tuple[str, ...],
    **fields: Any,
) -> None:
    """Add a rater to the protocol of STUDY, whose comments are kept.

    Schedules that have been drawn are not changed.
    """
    by_field = _by_field(values)
    record_new_rater(study, protocol, rater, sessions, values=by_field, **fields)
    click.echo(f"{rater} is in {study.protocol}. Next: masrel schedule {study.root}")


def _by_field(values: tuple[str, ...]) -> dict[str, str]:
    by_field: dict[str, str] = {}
    for entry in values:
        name, equals, text = entry.partition("=")
        if not equals or name in by_field:
            raise ParameterError(
                f"FIELD=VALUE: needed a field, '=' and its value, each field once, "
                f"got {entry!r}"
            )
        by_field[name] = text
    return by_field


@record.command("amend")
@of_study
@_who
@_why
def _amend(study: StudyPaths, protocol: Protocol, who: str, why: str) -> None:
    """Record that the plan of STUDY was changed after its first schedules were drawn.

    Edit the protocol first; a copy of it is added to the log. Every command that reads
    the study, and its report, will then state what changed and when.
    """
    for change in record_amendment(study, protocol, who=who, why=why):
        click.echo(change)
    click.echo(f"amendment recorded: {study.conduct_file}")


@record.command("register")
@of_study
@click.option(
    "-o",
    "--output",
    type=click.Path(path_type=Path, dir_okay=False),
    required=True,
    help="File to write, for a registry.",
)
@stamp_option
def _register(
    study: StudyPaths, protocol: Protocol, output: Path, stamp: str | None
) -> None:
    """Write a file for a registry: the plan of STUDY and a commitment to its orders.

    The file has the protocol with its hash, and the hash of the secret that the orders
    are drawn from, which reveals nothing about them.
    """
    write_json(registration(study, protocol), output)
    click.echo(output)
    echo_stamp(output, stamp)


def _add_standing(
    name: str, standing: Standing, words: str, text: str, *more: Decorator
) -> None:
    def command(
        study: StudyPaths, protocol: Protocol, rater: str, **reasons: Any
    ) -> None:
        record_standing(study, protocol, rater, standing, **reasons)
        click.echo(f"{rater} {words}: {study.conduct_file}")

    options = several(of_study, id_option, *more, _who, _why)
    record.command(name, help=text)(options(command))


_add_standing(
    *("exclude", "excluded", "is excluded; the grades are kept"),
    """Exclude a rater from the analysis of STUDY; the grades are kept.

    Every command that computes results states the exclusion, and so does the report.
    """,
)
_add_standing(
    *("include", "included", "is analysed again"),
    "Include an excluded rater of STUDY in the analysis again.",
)
_add_standing(
    *("withdraw", "withdrawn", "is withdrawn; the grades given before are kept"),
    """Record that a rater has left STUDY.

    The rater stays in the protocol. Grades given so far are kept and analysed, and the
    report says so. The rater's sessions cannot be resumed.
    """,
    _on,
)


@record.command("unblind")
@of_study
@click.argument("code", required=False)
@click.option(
    "--all", "every", is_flag=True, help="Unblind all codes of all schedules."
)
@click.option("--rater", help="Only codes of this rater.")
@click.option("--session", help="Only codes of this session.")
@click.option("--who", required=True, help="Who is being unblinded.")
@_why
def _unblind(
    study: StudyPaths,
    protocol: Protocol,
    code: str | None,
    every: bool,
    **fields: Any,
) -> None:
    """Print which model has CODE, after recording who is unblinded and why.

    This becomes an event in STUDY/conduct.jsonl, and the report states it. --all opens
    a sealed study once every session is over.
    """
    if (code is None) != every:
        raise click.UsageError("needs either a CODE or --all")
    if every and not (fields["rater"] or fields["session"]):
        reasons = {key: fields[key] for key in ("who", "why")}
        if n := unseal_study(study, protocol, **reasons):
            click.echo(f"{n} schedules are open: {study.schedules / _OPENED}")
            return
    for schedule, shown in record_unblinding(study, protocol, code, **fields):
        click.echo(
            f"{shown.code} of {schedule.rater}, session {schedule.session}, is "
            f"{shown.model} (presentation {shown.position}, repeat {shown.repeat})"
        )
