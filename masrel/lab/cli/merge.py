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
    help="Folder of the merged study; new or empty.",
)
def merge(studies: tuple[Path, ...], output: Path) -> None:
    """Put STUDIES, the folders of the sites of one study, together in a new folder.

    Everything is verified before and after. Protocols may differ in their raters
    alone, schedules are drawn from one secret, and no rater has sessions in two
    folders. No secret is copied, and nothing that is made of the logs: ratings,
    analysis and report are made anew, and so are sheets to print.
    """
    from masrel.lab.merging import merge_studies

    merged = merge_studies([StudyPaths(study) for study in studies], output)
    n_raters = len(read_protocol(merged.protocol).raters)
    click.echo(
        f"{output}: {len(studies)} studies with {n_raters} raters and "
        f"{len(merged.logs())} session logs, verified. Next: masrel ratings {output}"
    )
