"""``masrel check``: everything that is wrong with a study, at once."""

import contextlib
import sys
from collections.abc import Callable, Iterable
from pathlib import Path

import click

from masrel.errors import DeviceError, MasrelError, ParameterError, ProtocolError
from masrel.lab._study_files import read_once
from masrel.lab.analysis._plan import unanswered
from masrel.lab.cli._study_options import echo_remarks, study_argument
from masrel.lab.paper._form import off_scale
from masrel.lab.protocol import Protocol, StudyPaths, read_protocol, scale_of
from masrel.lab.protocol.content import _coefficient_problems
from masrel.lab.ratings import read_study_ratings, study_remarks
from masrel.lab.ratings.study_data import _table_problem
from masrel.lab.run._settings import check_backend, device_notes, torque_problems
from masrel.lab.schedule.sheets import concealment_notes, schedule_problems
from masrel.lab.verification import verify_sessions
from masrel.tables._tables import counted


@click.command("check")
@study_argument
@read_once()
def check(study: Path) -> None:
    """Check the protocol, schedules, record and ratings and list every problem."""
    paths = StudyPaths(study)
    notes: list[str] = []
    try:
        protocol = read_protocol(paths.protocol)
    except ProtocolError as error:
        problems = list(error.problems)
    else:
        problems = [each for checker in _CHECKERS for each in checker(protocol, paths)]
        # What only may happen is for a study of which all else is right.
        of_device = () if problems else device_notes(protocol, paths)
        notes += [f"{paths.protocol}: {note}" for note in of_device]
        with contextlib.suppress(MasrelError):  # a checker has said it
            notes += concealment_notes(protocol, paths)
        with contextlib.suppress(MasrelError):
            notes += study_remarks(paths, protocol)
    for problem in problems:
        click.echo(problem, err=True)
    echo_remarks(notes)
    if problems:
        click.echo(f"masrel: {study}: {counted(len(problems), 'problem')}", err=True)
        sys.exit(2)
    places = protocol.rater_sessions
    n_drawn = sum(paths.schedule_file(*place).is_file() for place in places)
    click.echo(
        f"{study}: no problems. {counted(len(protocol.models), 'model')}, "
        f"{counted(len(protocol.raters), 'rater')}, "
        f"{counted(len(protocol.sessions), 'session')}; "
        f"{n_drawn} of {counted(len(places), 'schedule')} drawn."
    )


def _plan_problems(protocol: Protocol, study: StudyPaths) -> Iterable[str]:
    unknown = dict(_coefficient_problems(protocol))
    for index, line in enumerate(protocol.analysis.estimates):
        if index in unknown:
            yield f"{study.protocol}: {unknown[index]}"
        elif (reason := unanswered(line, protocol)) is not None:
            yield (
                f"{study.protocol}: analysis.estimates[{index}]: has no estimate even "
                f'once every rating is there: {reason} (id "{line.id}")'
            )


def _device_problems(protocol: Protocol, study: StudyPaths) -> Iterable[str]:
    try:
        check_backend(protocol)
    except (ParameterError, DeviceError) as error:
        yield f"{study.protocol}: {error}"
    yield from (f"{study.protocol}: {each}" for each in torque_problems(protocol))


def _record_problems(protocol: Protocol, study: StudyPaths) -> Iterable[str]:
    if not study.sessions.is_dir() and not study.conduct_logs():
        return
    findings = verify_sessions(study, protocol).findings
    yield from (each.message for each in findings if each.weight == "broken")


def _sheet_problems(protocol: Protocol, study: StudyPaths) -> Iterable[str]:
    for place in protocol.rater_sessions:
        for file in (study.sheet_file(*place), study.typed_file(*place)):
            if file.is_file():
                yield from off_scale(file, protocol.scale.grades)


def _ratings_problems(protocol: Protocol, study: StudyPaths) -> Iterable[str]:
    for path in (study.ratings_file, study.published_file):
        try:
            if path.exists():
                read_study_ratings(path, scale_of(protocol))
        except MasrelError as error:
            yield str(error)
            return
    with contextlib.suppress(MasrelError):  # what of the logs, another has said
        is_stale, problem = _table_problem(study, protocol)
        if problem and not is_stale:
            yield problem


_CHECKERS: tuple[Callable[[Protocol, StudyPaths], Iterable[str]], ...] = (
    _plan_problems,
    _device_problems,
    schedule_problems,
    _sheet_problems,
    _record_problems,
    _ratings_problems,
)
