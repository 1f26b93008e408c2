"""``masrel serve`` as a person starts it: at a terminal, where Enter is pressed."""

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
WITHIN_S = 60.0


class Server:
    """A server of one study, which can be stopped, killed and started again.

    Attributes
    ----------
    port : int
        Which it has.
    text : str
        What it has printed since it was started.
    """

    def __init__(self, study: Path, *options: str, at_a_terminal: bool = True) -> None:
        self._command = [sys.executable, "-m", "masrel", "serve", str(study), *options]
        self._at_a_terminal = at_a_terminal
        self.port = 0
        self.start()

    def start(self) -> None:
        """Start it, at the port that it had."""
        self.text, self._opened = "", set[str]()
        self._ours, theirs = pty.openpty() if self._at_a_terminal else os.pipe()
        self._process = subprocess.Popen(
            [*self._command, f"--port={self.port}"],
            stdin=theirs if self._at_a_terminal else subprocess.DEVNULL,
            stdout=theirs,
            stderr=theirs,
            env={**os.environ, "COLUMNS": "200"},
        )
        os.close(theirs)
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()
        self.until("Ctrl-C: stop.")
        self.port = int(re.findall(r":(\d+)/", self.text)[0])

    def _read(self) -> None:
        with contextlib.suppress(OSError):  # how a terminal says that it is closed
            while some := os.read(self._ours, 65_536):
                self.text += some.decode(errors="replace")

    def until(self, text: str, n_times: int = 1) -> str:
        """Wait until a text has come so many times -> all that has come."""
        until = time.monotonic() + WITHIN_S
        while self.text.count(text) < n_times and time.monotonic() < until:
            time.sleep(0.02)
        assert self.text.count(text) >= n_times, self.text
        return self.text

    def enter(self) -> None:
        """Press Enter, and wait for new addresses."""
        n_before = self.text.count("Ctrl-C: stop.")
        os.write(self._ours, b"\n")
        self.until("Ctrl-C: stop.", n_before + 1)

    def new_address(self, role: str) -> str:
        """Return an address that nobody has opened; pressing Enter if need be."""

        def latest() -> str:
            return [url for who, url in ADDRESS.findall(self.text) if who == role][-1]

        if latest() in self._opened:
            self.enter()
        self._opened.add(address := latest())
        return address

    @property
    def is_up(self) -> bool:
        """Whether it runs."""
        return self._process.poll() is None

    def end(self, how: signal.Signals = signal.SIGINT) -> int:
        """Stop it, as Ctrl-C does by default -> its exit code."""
        if self.is_up:
            self._process.send_signal(how)
            self._process.wait(WITHIN_S)
            os.close(self._ours)
            self._reader.join()
        return self._process.returncode
