"""``masrel record``: what somebody states of a study, with who says so."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from masrel.cli._commands import STUDY, Commands
from masrel.cli._options import Decorator
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

if TYPE_CHECKING:
    from masrel.lab.conduct._statements import NoteKind, Standing
    from masrel.lab.protocol import Protocol, StudyPaths


@click.group("record", cls=Commands)
def record() -> None:
    """Record what happened to a study beside its presentations, and who says so.

    All of it is added to logs: what was recorded before stays there.
    """


_who = click.option("--who", required=True, help="Who says so.")
_why = click.option("--why", required=True, help="For what reason.")
_code = click.option("--code", required=True, help="Code of the presentation.")
_on = click.option(
    "--on", metavar="DATE", help="The day it happened; today unless said."
)
_about = several(
    of_study,
    click.argument("text"),
    _who,
    click.option("--rater", help="To whom it happened."),
    click.option("--session", help="In which session."),
    _on,
)


def _of_session(*options: Decorator) -> Decorator:
    return several(of_study, id_option, session_option, *options, _who, _why)


def _add_note(kind: "NoteKind", text: str, *options: Decorator) -> None:
    def command(study: "StudyPaths", protocol: "Protocol", **fields: Any) -> None:
        from masrel.lab.conduct import Note, record_note

        record_note(study, protocol, Note(kind=kind, **fields))
        click.echo(f"{kind} recorded: {study.conduct_file}")

    record.command(kind, help=text)(several(_about, *options)(command))


_add_note(
    "note",
    """Record TEXT in the log of STUDY, with the time of day.

    masrel status shows it; the report shows what kind it is and when, and the text if
    --include notes asks for it.
    """,
)
_add_note(
    "deviation", "Record TEXT, a deviation from the protocol, as a note is recorded."
)
_add_note(
    "adverse-event",
    "Record TEXT, an adverse event, as a note is recorded.",
    click.option("--severity", metavar="mild|moderate|severe"),
    click.option(
        "--seriousness", metavar="'serious'|'not serious'", help="As ICH E2A means it."
    ),
    click.option(
        "--relatedness",
        metavar="WORD",
        help="Whether the study caused it: unrelated, unlikely, possible, probable or "
        "definite.",
    ),
    click.option("--onset", metavar="DATE", help="The day it began."),
    click.option("--action", help="What was done about it."),
    click.option("--outcome", help="What came of it."),
)


def _or_missing(text: str) -> str | None:
    return None if text == "NA" else text  # no scale has such a grade


@record.command("correct")
@_of_session(
    _code,
    click.option(
        "--grade", required=True, help="What it should have been, NA for missing."
    ),
)
def _correct(
    study: "StudyPaths",
    protocol: "Protocol",
    rater: str,
    session: str,
    grade: str,
    code: str,
    **reasons: Any,
) -> None:
    """Correct the grade of a presentation of STUDY; the first one stays in the log."""
    from masrel.lab.run import record_correction

    record_correction(
        study, protocol, rater, session, code=code, grade=_or_missing(grade), **reasons
    )
    what = f"{code} of {rater}, session {session},"
    _say_corrected(what, _or_missing(grade), study.log_file(rater, session))


@record.command("day")
@_of_session(
    click.option("--on", metavar="DATE", required=True, help="The day it was held.")
)
def _day(
    study: "StudyPaths",
    protocol: "Protocol",
    rater: str,
    session: str,
    **fields: Any,
) -> None:
    """Correct the day of a session of STUDY; the first one stays in the log.

    The days between sessions are counted anew.
    """
    from masrel.lab.run import record_day

    with warnings_as_notes():
        record_day(study, protocol, rater, session, **fields)
    click.echo(
        f"session {session} of {rater} was held on {fields['on']}, as is said in "
        f"{study.log_file(rater, session)}"
    )


@record.command("skip")
@_of_session(_code)
def _skip(
    study: "StudyPaths",
    protocol: "Protocol",
    rater: str,
    session: str,
    code: str,
    **reasons: Any,
) -> None:
    """Leave a presentation of STUDY, after a fault, without a grade."""
    from masrel.lab.run import record_skip

    record_skip(study, protocol, rater, session, code=code, **reasons)
    log = study.log_file(rater, session)
    click.echo(
        f"{code} of {rater}, session {session}, is skipped, as is said in {log}. "
        "Then: masrel ratings"
    )


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
    study: "StudyPaths",
    protocol: "Protocol",
    rater: str,
    session: str,
    answer: str,
    **fields: Any,
) -> None:
    """Correct an answer to a question of STUDY; the first one stays in the log."""
    from masrel.lab.run import record_answer

    log = record_answer(
        study, protocol, rater, session, answer=_or_missing(answer), **fields
    )
    code = fields["code"]
    of = fields["question"] + ("" if code is None else f" of {code}")
    _say_corrected(f"the answer of {rater} to {of}", _or_missing(answer), log)


def _say_corrected(what: str, now: str | None, log: Path) -> None:
    click.echo(
        f"{what} is now {now or 'missing'}; what it was before stays in {log}. Then: "
        "masrel ratings"
    )


@record.group("rater", cls=Commands)
def _rater() -> None:
    """Record what is known of a rater, or take another one in.

    masrel record rater STUDY records fields of a rater.
    """


@_rater.command(STUDY)
@of_study
@id_option
@click.argument("values", metavar="FIELD=VALUE...", nargs=-1, required=True)
@_who
def _set(
    study: "StudyPaths",
    protocol: "Protocol",
    rater: str,
    values: tuple[str, ...],
    who: str,
) -> None:
    """Record fields of a rater of STUDY, such as years=12.

    The protocol declares the fields in [rater_fields]. What is recorded last counts,
    what was recorded before stays in the log; FIELD= alone says that nothing is known.
    """
    from masrel.lab.conduct import record_rater_values

    by_field = _by_field(values)
    record_rater_values(study, protocol, rater, by_field, who=who)
    click.echo(f"{', '.join(by_field)} of {rater} recorded: {study.conduct_file}")


@_rater.command("add")
@of_study
@id_option
@click.option(
    "--session", "sessions", multiple=True, required=True, help="In which; repeatable."
)
@click.option("--site", help="Where the rater is.")
@click.argument("values", metavar="[FIELD=VALUE]...", nargs=-1)
@_who
def _add(
    study: "StudyPaths",
    protocol: "Protocol",
    rater: str,
    sessions: tuple[str, ...],
    values: tuple[str, ...],
    **fields: Any,
) -> None:
    """Take another rater into STUDY: into its protocol, whose comments stay.

    Schedules that are drawn stay as they are.
    """
    from masrel.lab.conduct import record_new_rater

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
def _amend(study: "StudyPaths", protocol: "Protocol", who: str, why: str) -> None:
    """Record that the plan of STUDY was changed since its first schedules were drawn.

    Edit the protocol first: a copy of it goes into the log. What has changed, and when,
    is named by every command that reads the study, and in its report.
    """
    from masrel.lab.conduct import record_amendment

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
    help="The file, for a registry.",
)
@stamp_option
def _register(
    study: "StudyPaths", protocol: "Protocol", output: Path, stamp: str | None
) -> None:
    """Write what a registry keeps of STUDY: its plan, and a commitment to its orders.

    The protocol with its hash, and the hash of the secret that orders are drawn from,
    which says nothing of them.
    """
    from masrel.cli._options import write_json
    from masrel.lab.conduct import registration

    write_json(registration(study, protocol), output)
    click.echo(output)
    echo_stamp(output, stamp)


def _add_standing(
    name: str, standing: "Standing", words: str, text: str, *more: Decorator
) -> None:
    def command(
        study: "StudyPaths", protocol: "Protocol", rater: str, **reasons: Any
    ) -> None:
        from masrel.lab.conduct import record_standing

        record_standing(study, protocol, rater, standing, **reasons)
        click.echo(f"{rater} {words}: {study.conduct_file}")

    options = several(of_study, id_option, *more, _who, _why)
    record.command(name, help=text)(options(command))


_add_standing(
    *("exclude", "excluded", "is excluded; the grades are kept"),
    """Leave a rater out of the analysis of STUDY; the grades stay in the study.

    Every command that computes says so, and so does the report.
    """,
)
_add_standing(
    *("include", "included", "is analysed again"),
    "Take a rater of STUDY who was excluded back into the analysis.",
)
_add_standing(
    *("withdraw", "withdrawn", "is withdrawn; the grades given before are kept"),
    """Record that a rater has left STUDY.

    The rater stays in the protocol, the grades given before stay in the study and are
    counted, and the report says so. No session of the rater goes on.
    """,
    _on,
)


@record.command("unblind")
@of_study
@click.argument("code", required=False)
@click.option("--all", "every", is_flag=True, help="All codes of all schedules.")
@click.option("--rater", help="Of this rater alone.")
@click.option("--session", help="Of this session alone.")
@click.option("--who", required=True, help="Who is to know.")
@_why
def _unblind(
    study: "StudyPaths",
    protocol: "Protocol",
    code: str | None,
    every: bool,
    **fields: Any,
) -> None:
    """Print which model CODE of STUDY stands for, once it is recorded who asked.

    It is an event of STUDY/conduct.jsonl, and the report says so. A sealed study is
    opened by --all, once every session is over.
    """
    from masrel.lab.conduct import record_unblinding
    from masrel.lab.protocol.study import _OPENED
    from masrel.lab.sealing import unseal_study

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
