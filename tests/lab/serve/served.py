"""A study that is served by one process after the other, at one address."""

import contextlib
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import httpx

from masrel.lab.protocol import StudyPaths
from masrel.lab.serve._access import Role
from masrel.lab.serve._server import listen


class Served:
    """Starts servers of a study; each starts the session of the first rater."""

    def __init__(self, study: StudyPaths) -> None:
        self.study = study
        self._process: int | None = None
        # each opens a page of the server that was started last, once
        self._addresses: list[str] = []
        with listen("127.0.0.1", 0) as listener:
            self.origin = f"http://127.0.0.1:{listener.getsockname()[1]}"
        command = [sys.executable, "-m", "tests.lab.serve.serving", str(study.root)]
        self._forks = subprocess.Popen(
            [*command, self.origin.rpartition(":")[2]],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )

    def start(self) -> int:
        """Start a server -> its process."""
        assert self._forks.stdin is not None
        assert self._forks.stdout is not None
        self._forks.stdin.write("\n")
        self._forks.stdin.flush()
        process, *self._addresses = self._forks.stdout.readline().split()
        self._process = int(process)
        return self._process

    def browser(self, role: Role = "rater") -> httpx.Client:
        """Open a page -> a browser that sends what the page sends."""
        browser = httpx.Client(base_url=self.origin, headers={"Origin": self.origin})
        address = next(each for each in self._addresses if f"/{role}?" in each)
        self._addresses.remove(address)
        while True:
            try:
                browser.get(address)  # gives the cookie
                break
            except httpx.TransportError:  # it does not listen yet
                time.sleep(0.01)
        page = browser.get(f"/{role}").text
        csrf = re.search('name="csrf" content="([^"]+)"', page)
        assert csrf is not None, page
        browser.headers["X-Masrel-CSRF"] = csrf[1]
        return browser

    def kill(self, process: int) -> None:
        """Kill a server, and return when it is no more."""
        with contextlib.suppress(ProcessLookupError):  # it was killed before
            os.kill(process, signal.SIGKILL)
        while Path(f"/proc/{process}").exists():
            time.sleep(0.001)

    def sessions(self) -> list[int]:
        """Processes of sessions of this study."""
        return sessions_of(self.study)

    def close(self) -> None:
        """End the last server, and let no more start."""
        if self._process is not None:
            self.kill(self._process)
        self._forks.communicate()


def sessions_of(study: StudyPaths) -> list[int]:
    """Processes of sessions of a study that is served."""
    name = str(study.root).encode()
    return [
        int(folder.name)
        for folder in Path("/proc").glob("[0-9]*")
        if _is_session(folder / "cmdline", name)
    ]


def _is_session(cmdline: Path, name: bytes) -> bool:
    try:
        words = cmdline.read_bytes()
    except OSError:  # it ended meanwhile
        return False
    return b"_session_process" in words and name in words
