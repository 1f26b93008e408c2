"""``masrel demo``: the whole flow on the simulated device, and the published report."""

import warnings
from pathlib import Path
from typing import TYPE_CHECKING

import click
from tqdm import tqdm

from masrel.cli._output import OutputOptions, output_options
from masrel.errors import MasrelWarning, ParameterError
from masrel.protocol import (
    Protocol,
    StudyPaths,
    copy_template,
    read_protocol,
    scale_of,
)

if TYPE_CHECKING:
    from masrel.ratings import Ratings


@click.command("demo")
@click.argument("out", type=click.Path(path_type=Path))
@click.option(
    "--study",
    "template",
    default="hess2012",
    show_default=True,
    help="Bundled study to run.",
)
@output_options(quiet="No progress bars.")
def demo(out: Path, template: str, output: OutputOptions) -> None:
    """Run a complete simulated study in OUT and report it, and the published one.

    OUT must not exist or be empty. The same seed gives the same schedules, ratings,
    analysis and reports, byte for byte.
    """
    if out.exists() and (not out.is_dir() or any(out.iterdir())):
        raise ParameterError(f"{out}: needs a new or empty folder for the demo")
    quiet = output.quiet
    study = StudyPaths(out / "study")
    copy_template(template, study.root)
    protocol = read_protocol(study.protocol)
    with warnings.catch_warnings():
        # Every note on an interval is in its result, and so in the report.
        warnings.simplefilter("ignore", MasrelWarning)
        _simulate(study, protocol, quiet=quiet)
        pages = [_report_simulated(study, protocol, out / "report-simulated", quiet)]
        if study.published_file.is_file():
            pages += [
                _report_published(study, protocol, out / "report-published", quiet)
            ]
    click.echo(f"The simulated study is in {study.root}.")
    click.echo("Open these in a browser:")
    for page in pages:
        click.echo(f"  {page}")


def _simulate(study: StudyPaths, protocol: Protocol, *, quiet: bool) -> None:
    # Every rater of every session, on the simulated device and clock.
    from masrel.run import SimulatedGrades, run_session
    from masrel.schedule import write_schedules

    write_schedules(protocol, study)
    occasions = [(s.id, rater) for s in protocol.sessions for rater in s.raters]
    n_presentations = len(occasions) * len(protocol.models) * protocol.schedule.repeats
    with tqdm(
        total=n_presentations, desc="presentations", unit="", disable=quiet or None
    ) as bar:
        for session, rater in occasions:
            run_session(
                study,
                protocol,
                rater,
                session,
                grades=SimulatedGrades(protocol),
                clock="simulated",
                progress=lambda _: bar.update(),
            )


def _report_simulated(
    study: StudyPaths, protocol: Protocol, destination: Path, quiet: bool
) -> Path:
    from masrel.ratings import ratings_from_logs, read_ratings, write_ratings

    write_ratings(ratings_from_logs(study, protocol), study.ratings_file)
    ratings = read_ratings(study.ratings_file, scale=scale_of(protocol))
    return _report(study, protocol, ratings, study.analysis_file, destination, quiet)


def _report_published(
    study: StudyPaths, protocol: Protocol, destination: Path, quiet: bool
) -> Path:
    from masrel.ratings import read_ratings

    ratings = read_ratings(study.published_file, scale=scale_of(protocol))
    analysis_file = study.root / "analysis-published.json"
    return _report(study, protocol, ratings, analysis_file, destination, quiet)


def _report(
    study: StudyPaths,
    protocol: Protocol,
    ratings: "Ratings",
    analysis_file: Path,
    destination: Path,
    quiet: bool,
) -> Path:
    from masrel.analysis import analyze, write_analysis
    from masrel.ratings import read_in_person
    from masrel.report import write_report

    in_person = None
    # What clinicians said in person belongs to the published grades alone.
    if not ratings.simulated and study.in_person_file.is_file():
        in_person = read_in_person(study.in_person_file)
    analysis = analyze(protocol, ratings, in_person=in_person)
    write_analysis(analysis, analysis_file)
    with tqdm(desc=destination.name, unit=" files", disable=quiet or None) as bar:
        files = write_report(
            protocol,
            ratings,
            analysis,
            destination,
            in_person=in_person,
            progress=lambda _: bar.update(),
        )
    return files.html
