"""``masrel joint``: traces of joints, joints of recordings, and models between."""

import click

from masrel.cli import Commands
from masrel.lab.cli._between import between
from masrel.lab.cli._fit import fit, friction
from masrel.lab.cli._trace import tardieu, trace


@click.group("joint", cls=Commands)
def joint() -> None:
    """Traces of joints, joints of recordings, and models between models."""


for _command in (trace, tardieu, fit, friction, between):
    joint.add_command(_command)
