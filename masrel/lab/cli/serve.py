"""``masrel serve``: pages for the rater's tablet and the coordinator's screen."""

import importlib.util
import sys
from pathlib import Path

import click

from masrel.errors import ParameterError
from masrel.lab.protocol import StudyPaths, read_protocol
from masrel.lab.protocol.content import _refuse_unknown_coefficients

PORT = 8723
"""The default port, always the same: a tablet finds the pages again."""

_LIBRARIES = ("starlette", "uvicorn", "segno")


@click.command("serve")
@click.argument("study", type=click.Path(path_type=Path))
@click.option(
    "--port",
    type=click.IntRange(0, 65_535),
    default=PORT,
    show_default=True,
    help="Port of the pages; 0 uses any free port.",
)
@click.option(
    "--host",
    default="127.0.0.1",
    show_default=True,
    help="Address or name at which a tablet reaches this computer; 0.0.0.0 means all "
    "of its addresses.",
)
@click.option(
    "--tls",
    nargs=2,
    type=click.Path(path_type=Path),
    metavar="CERT KEY",
    help="Encrypt with this certificate and its key, two PEM files.",
)
def serve(study: Path, port: int, host: str, tls: tuple[Path, Path] | None) -> None:
    """Show STUDY in a browser: a page for the rater and one for the coordinator.

    Two one-time addresses are printed. Press Enter for new ones. A session in the
    browser leaves the same log as one of masrel run. Ctrl-C stops a running session and
    then the server; a second Ctrl-C does not wait.
    """
    if sys.platform == "win32":  # a session takes over a socket of the server
        raise ParameterError(
            "serve: needs Linux or macOS, got Windows; use masrel run instead"
        )
    for name in _LIBRARIES:
        if importlib.util.find_spec(name) is None:
            raise ParameterError(
                f"serve: needs {name}; install it with: pip install 'masrel[serve]'"
            )
    import asyncio

    from masrel.lab.serve import _server
    from masrel.lab.serve._access import Access
    from masrel.lab.serve._manager import SessionManager

    paths = StudyPaths(study)
    _refuse_unknown_coefficients(read_protocol(paths.protocol), paths.protocol)
    context = None if tls is None else _server.encryption(*tls)
    with _server.alone(paths), _server.listen(host, port) as listener:
        names = _server.hosts(listener, host, encrypted=tls is not None)
        scheme = "http" if tls is None else "https"
        origin = f"{scheme}://{names[0]}"
        access = Access(paths, origin=origin, hosts=frozenset(names), say=click.echo)
        if tls is None and not _server.is_loopback(listener.getsockname()[0]):
            click.echo(
                f"masrel: --host {host} without --tls: anybody in this network can "
                "read the grades, and act as the rater or the coordinator",
                err=True,
            )
        serving = _server.serve(
            SessionManager(paths), access, listener, context, show=access.show_addresses
        )
        if not asyncio.run(serving):
            raise KeyboardInterrupt
