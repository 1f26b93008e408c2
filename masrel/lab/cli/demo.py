"""``masrel demo``: the whole flow on the simulated device, and the published report."""

import warnings
from datetime import UTC, datetime
from pathlib import Path

import click
from tqdm import tqdm

from masrel._files import write_file, write_files
from masrel.cli._options import OutputOptions, output_options
from masrel.errors import MasrelWarning, ParameterError
from masrel.lab.analysis import analyze, write_analysis
from masrel.lab.cli._study_options import read_study
from masrel.lab.conduct import Note, allot_schedules, record_note
from masrel.lab.protocol import StudyPaths, copy_template, read_protocol
from masrel.lab.ratings import (
    answers_from_logs,
    ratings_from_logs,
    write_answers,
    write_ratings,
)
from masrel.lab.report._conduct import study_conduct
from masrel.lab.report._document import write_report
from masrel.lab.run._simulated_raters import SimulatedGrades
from masrel.lab.run.session import run_session
from masrel.lab.schedule._secret import N_BYTES, SECRET_TEXT

# Of what is in the log of the study: the same each time, as reports have it
_DAY = datetime(2012, 1, 1, tzinfo=UTC)


@click.command("demo")
@click.argument("out", type=click.Path(path_type=Path))
@click.option(
    "--study",
    "template",
    metavar="NAME",
    help="Bundled study to run.  [default: hess2012, then tone]",
)
@click.option(
    "--device",
    type=click.Choice(["simulated", "puck", "moteus"]),
    default="simulated",
    show_default=True,
    help="Device that presents the models; a puck or a moteus is emulated.",
)
@output_options(quiet="Show no progress bars.")
def demo(out: Path, template: str | None, device: str, output: OutputOptions) -> None:
    """Run a complete simulated study in OUT; report it and the published study.

    A small study of other kinds of tone is run as well.

    OUT must be a new or empty folder. The same seed gives the same schedules, ratings,
    analysis and reports, byte for byte.
    """
    if out.exists() and (not out.is_dir() or any(out.iterdir())):
        raise ParameterError(f"{out}: needs a new or empty folder for the demo")
    studies = {"study": template} if template else {"study": "hess2012", "tone": "tone"}
    pages = []
    # Every note on an interval is in its result, and so in the report.
    with warnings.catch_warnings(action="ignore", category=MasrelWarning):
        for folder, name in studies.items():
            study = StudyPaths(out / folder)
            copy_template(name, study.root)
            if device != "simulated":
                _emulate(study, device)
            # A demo hides nothing, and is the same each time.
            if not study.published_secret_file.exists():
                secret = SECRET_TEXT.format(bytes(range(N_BYTES)).hex())
                write_file(study.published_secret_file, secret)
            _simulate(study, output)
            report = "simulated" if folder == "study" else folder
            pages.append(_report(study, study.ratings_file, report, output))
            if study.published_file.is_file():
                pages.append(_report(study, study.published_file, "published", output))
    for folder in studies:
        click.echo(f"A simulated study is in {out / folder}.")
    click.echo("Open these in a browser:")
    for page in pages:
        click.echo(f"  {page}")


def _emulate(study: StudyPaths, device: str) -> None:
    # an amplifier on a bus inside this process
    import tomlkit  # nothing else here needs it

    document = tomlkit.parse(study.protocol.read_text(encoding="utf-8"))
    table = {"interface": "virtual", "channel": "demo"}
    document.setdefault("device", {}).update({"backend": device, device: table})
    write_files({study.protocol: tomlkit.dumps(document)})


def _simulate(study: StudyPaths, output: OutputOptions) -> None:
    # every rater of every session, on the simulated device and clock
    protocol = read_protocol(study.protocol)
    allot_schedules(study, protocol, now=lambda: _DAY)
    occasions = protocol.rater_sessions
    n_presentations = len(occasions) * len(protocol.models) * protocol.schedule.repeats
    with tqdm(
        total=n_presentations,
        desc="presentations",
        unit="",
        disable=output.quiet or None,
    ) as bar:
        for rater, session in occasions:
            run_session(
                study,
                protocol,
                rater,
                session,
                grades=SimulatedGrades(protocol),
                clock="simulated",
                progress=lambda _: bar.update(),
            )
    note = Note(  # as a coordinator does
        text="simulated: sore wrist after the session",
        who="demo",
        kind="adverse-event",
        severity="mild",
        action="rest",
        outcome="gone the next day",
        rater=protocol.raters[0].id,
        session=protocol.sessions[0].id,
    )
    record_note(study, protocol, note, now=lambda: _DAY)
    write_ratings(ratings_from_logs(study, protocol), study.ratings_file)
    if protocol.questionnaires:
        write_answers(answers_from_logs(study, protocol), study.answers_file)


def _report(
    study: StudyPaths, ratings_file: Path, name: str, output: OutputOptions
) -> Path:
    # beside the study, in a folder of this name
    destination = study.root.parent / f"report-{name}"
    is_simulated = ratings_file == study.ratings_file
    data = read_study(study.root, None if is_simulated else ratings_file)
    analysis = analyze(
        data.protocol, data.ratings, in_person=data.in_person, answers=data.answers
    )
    write_analysis(
        analysis,
        study.analysis_file if is_simulated else study.root / "analysis-published.json",
    )
    with tqdm(
        desc=destination.name, unit=" files", disable=output.quiet or None
    ) as bar:
        write_report(
            data.protocol,
            data.ratings,
            analysis,
            destination,
            in_person=data.in_person,
            conduct=study_conduct(study, data.protocol, include=["notes"])
            if is_simulated
            else None,
            progress=lambda _: bar.update(),
        )
    return destination / "report.html"
