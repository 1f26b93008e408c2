"""``masrel merge``: sites of one study put together."""

from pathlib import Path

import click

from masrel.lab.protocol import StudyPaths, read_protocol


@click.command("merge")
@click.argument("studies", type=click.Path(path_type=Path), nargs=-1, required=True)
@click.option(
    "-o",
    "--output",
    type=click.Path(path_type=Path, file_okay=False),
    required=True,
    help="Folder for the merged study; it must be new or empty.",
)
def merge(studies: tuple[Path, ...], output: Path) -> None:
    """Combine STUDIES, the folders of the sites of one study, in a new folder.

    Everything is verified before and after. The protocols may differ only in their
    raters, the schedules must come from one secret, and no rater may have sessions in
    two folders. Secrets are not copied, nor is anything made from the logs: make
    ratings, analysis, report and printable sheets again in the new folder.
    """
    from masrel.lab.merging import merge_studies

    merged = merge_studies([StudyPaths(study) for study in studies], output)
    n_raters = len(read_protocol(merged.protocol).raters)
    click.echo(
        f"{output}: {len(studies)} studies with {n_raters} raters and "
        f"{len(merged.logs())} session logs, verified. Next: masrel ratings {output}"
    )
