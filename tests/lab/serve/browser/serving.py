"""A server of a study as a person starts it: at a terminal, where Enter is pressed."""

import contextlib
import os
import pty
import re
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

ADDRESS = re.compile(r"(rater|coordinator): (https?://\S+)\s")
WITHIN_S = 30.0


class Server:
    """``masrel serve`` of one study, which can be stopped, killed and started again.

    Attributes
    ----------
    text : str
        What it has printed since it was started.
    """

    def __init__(self, study: Path, *options: str) -> None:
        self._command = [sys.executable, "-m", "masrel", "serve", str(study)]
        self._options = options
        self._port = 0
        self.start()

    def start(self) -> None:
        """Start it, at the port that it had."""
        self.text = ""
        self._terminal, theirs = pty.openpty()
        options = ["--port", str(self._port), *self._options]
        self._process = subprocess.Popen(
            [*self._command, *options],
            stdin=theirs,
            stdout=theirs,
            stderr=theirs,
            env={**os.environ, "COLUMNS": "200"},
        )
        os.close(theirs)
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()
        self._opened: set[str] = set()
        self._port = int(self._wait_for("coordinator").split("/")[2].split(":")[1])

    def _read(self) -> None:
        with contextlib.suppress(OSError):  # how a terminal says that it is closed
            while some := os.read(self._terminal, 65_536):
                self.text += some.decode(errors="replace")

    def _wait_for(self, role: str) -> str:
        until = time.monotonic() + WITHIN_S
        while time.monotonic() < until and self.is_up:
            shown = [url for who, url in ADDRESS.findall(self.text) if who == role]
            if shown and shown[-1] not in self._opened:
                return shown[-1]
            time.sleep(0.02)
        raise AssertionError(f"no address of the {role}'s page:\n{self.text}")

    def new_address(self, role: str) -> str:
        """Return an address that nobody has opened; pressing Enter if need be."""
        shown = [url for who, url in ADDRESS.findall(self.text) if who == role]
        if shown[-1] in self._opened:
            os.write(self._terminal, b"\n")
        address = self._wait_for(role)
        self._opened.add(address)
        return address

    @property
    def is_up(self) -> bool:
        """Whether it runs."""
        return self._process.poll() is None

    def stop(self) -> None:
        """Stop it as Ctrl-C does, and wait until it has."""
        self._end(signal.SIGINT)

    def kill(self) -> None:
        """Kill it, which it cannot answer."""
        self._end(signal.SIGKILL)

    def _end(self, how: signal.Signals) -> None:
        if not self.is_up:
            return
        self._process.send_signal(how)
        self._process.wait(WITHIN_S)
        os.close(self._terminal)
        self._reader.join()
