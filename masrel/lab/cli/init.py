"""``masrel init``: a new study from a bundled one."""

from pathlib import Path

import click

from masrel.lab.protocol import copy_template


@click.command("init")
@click.argument("folder", metavar="DIR", type=click.Path(path_type=Path))
@click.option(
    "--study",
    "template",
    default="small",
    show_default=True,
    metavar="NAME",
    help="Bundled study to copy: small, a template to edit; tone, with several kinds "
    "of models; two-sites, with everything a coordinator needs; or hess2012.",
)
def init(folder: Path, template: str) -> None:
    """Create a new study in DIR, which must be a new or empty folder."""
    copy_template(template, folder)
    click.echo(f"{folder}: a study made from {template}. Next:")
    click.echo(f"  edit {folder / 'protocol.toml'}")
    click.echo(f"  masrel check {folder}")
    click.echo(f"  masrel schedule {folder}")
