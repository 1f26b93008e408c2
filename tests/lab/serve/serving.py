"""Serve a study and go on with its session, as often as it is killed: ROOT PORT.

Each line of input forks a server from this process, which has loaded all it needs; it
prints its number and addresses of two raters' pages and a coordinator's.
"""

import asyncio
import os
import signal
import sys
from pathlib import Path

from masrel.lab.protocol import StudyPaths
from masrel.lab.serve._access import ROLES, Access
from masrel.lab.serve._desk import Desk
from masrel.lab.serve._server import alone, listen, serve


async def serving(study: StudyPaths, port: int) -> None:
    """Serve, as ``masrel serve`` does, and start the session as a coordinator does."""
    host = f"127.0.0.1:{port}"
    hosts = frozenset([host])
    access = Access(study, origin=f"http://{host}", hosts=hosts, say=lambda _: None)

    def show() -> None:
        print(os.getpid(), *map(access.new_address, ("rater", *ROLES)), flush=True)

    desk = Desk(study)
    with alone(study), listen("127.0.0.1", port) as listener:
        starting = asyncio.ensure_future(desk.start("R1", "test"))
        await serve(desk, access, listener, None, show=show)
        await starting


def main(root: Path, port: int) -> None:
    """Fork a server at each line."""
    signal.signal(signal.SIGCHLD, signal.SIG_IGN)  # nobody waits for those killed
    for _ in sys.stdin:
        if os.fork() == 0:
            signal.signal(signal.SIGCHLD, signal.SIG_DFL)
            os.close(0)  # that of the process that forks
            asyncio.run(serving(StudyPaths(root), port))
            os._exit(0)


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]))
