"""The command: what it prints, what it refuses, and that it stops as it is told."""

import importlib.util
import os
import pty
import re
import select
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from masrel.lab.protocol import copy_template
from tests.cli.process import Caller
from tests.lab.serve.pages import DATA, KEY, listen


@pytest.fixture
def masrel(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> Caller:
    return Caller(monkeypatch, capsys)


@pytest.fixture
def study(tmp_path: Path) -> Path:
    copy_template("small", tmp_path / "study")
    return tmp_path / "study"


INSTALL = "install it with: pip install 'masrel[serve]'"


@pytest.mark.parametrize(
    ("options", "why"),
    [
        (["--port", "-1"], "Invalid value for '--port'"),
        (["--port", "65536"], "Invalid value for '--port'"),
        (["--port", "http"], "Invalid value for '--port'"),
        (["--tls", str(DATA / "nothing.pem"), str(KEY)], "nothing.pem is not there"),
    ],
)
def test_what_is_no_option_is_refused(
    masrel: Caller, study: Path, options: list[str], why: str
) -> None:
    done = masrel("serve", study, *options)
    assert done.code == 2
    assert why in done.err


def test_no_study_and_a_protocol_that_cannot_be_read(
    masrel: Caller, study: Path, tmp_path: Path
) -> None:
    done = masrel("serve", tmp_path / "nothing")
    assert (done.code, done.out) == (2, "")
    assert re.fullmatch(r"masrel: \S+protocol.toml: needed a protocol .*\n", done.err)
    (study / "protocol.toml").write_text("models = 3")
    done = masrel("serve", study)
    assert done.code == 2
    assert "protocol.toml" in done.err
    assert not (study / ".key").exists()


def test_windows_is_told_what_it_has_instead(
    masrel: Caller, study: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "platform", "win32")
    done = masrel("serve", study)
    why = "serve: needs Linux or macOS, got Windows; there is masrel run"
    assert (done.code, done.out, done.err) == (2, "", f"masrel: {why}\n")


@pytest.mark.parametrize("library", ["starlette", "uvicorn", "segno"])
def test_the_extra_is_not_installed(
    masrel: Caller, study: Path, monkeypatch: pytest.MonkeyPatch, library: str
) -> None:
    there: Callable[..., object] = importlib.util.find_spec

    def find(name: str, package: str | None = None) -> object:
        return None if name == library else there(name, package)

    monkeypatch.setattr("importlib.util.find_spec", find)
    done = masrel("serve", study)
    assert done.code == 2
    assert done.err == f"masrel: serve: needs {library}; {INSTALL}\n"


def test_a_port_in_use(masrel: Caller, study: Path) -> None:
    with listen("127.0.0.1", 0) as other:
        done = masrel("serve", study, "--port", other.getsockname()[1])
    assert done.code == 2
    assert "in use, perhaps by another masrel serve; --port 0 takes any" in done.err
    assert done.err.count("\n") == 1


@pytest.mark.skipif(os.name != "posix" or os.geteuid() == 0, reason="root may open any")
def test_a_port_that_only_root_may_open(masrel: Caller, study: Path) -> None:
    done = masrel("serve", study, "--port", 80)
    assert done.code == 2
    assert "--port: needed one that this user may open" in done.err


class Terminal:
    """``masrel serve`` at a terminal."""

    def __init__(self, study: Path, *options: str, at_a_terminal: bool = True) -> None:
        self._ours, theirs = pty.openpty() if at_a_terminal else os.pipe()
        self.process = subprocess.Popen(
            [sys.executable, "-m", "masrel", "serve", str(study), "--port=0", *options],
            stdin=theirs if at_a_terminal else subprocess.DEVNULL,
            stdout=theirs,
            stderr=theirs,
        )
        os.close(theirs)
        self.text = ""

    def until(self, text: str, n_times: int = 1) -> str:
        """Read until a text has come so many times -> all that has come."""
        until = time.monotonic() + 60
        while self.text.count(text) < n_times and time.monotonic() < until:
            if select.select([self._ours], [], [], 1)[0]:
                try:
                    self.text += os.read(self._ours, 65_536).decode(errors="replace")
                except OSError:  # a terminal whose other side is gone
                    break
        assert self.text.count(text) >= n_times, self.text
        return self.text

    def enter(self) -> None:
        """Press Enter."""
        os.write(self._ours, b"\n")

    def port(self) -> int:
        """The port that is printed."""
        return int(re.findall(r"http://127.0.0.1:(\d+)/", self.until("Ctrl-C"))[0])

    def stop(self, number: signal.Signals) -> int:
        """Send a signal -> the exit code."""
        self.process.send_signal(number)
        return self.process.wait(20)

    def close(self) -> None:
        """End it however it stands."""
        self.process.kill()
        self.process.wait()
        os.close(self._ours)


@pytest.fixture
def start() -> Iterator[Callable[..., Terminal]]:
    """Start it, as often as a test likes."""
    started: list[Terminal] = []

    def begin(*words: object, **settings: bool) -> Terminal:
        started.append(Terminal(*words, **settings))  # type: ignore[arg-type]
        return started[-1]

    yield begin
    for each in started:
        each.close()


@pytest.mark.slow
def test_two_addresses_each_with_a_qr_code_and_new_ones_at_enter(
    start: Callable[..., Terminal], study: Path
) -> None:
    terminal = start(study)
    text = terminal.until("Ctrl-C: stop.")
    address = r"http://127\.0\.0\.1:\d+/{}\?token=[\w-]{{22}}"
    for role in ("rater", "coordinator"):
        assert len(re.findall(address.format(role), text)) == 1
    assert text.count("\N{UPPER HALF BLOCK}") > 100
    terminal.enter()
    text = terminal.until("Ctrl-C: stop.", 2)
    assert len(set(re.findall(r"token=([\w-]{22})", text))) == 4
    assert terminal.stop(signal.SIGINT) == 0


@pytest.mark.slow
def test_a_study_is_served_once_and_the_port_says_nothing_else(
    masrel: Caller, start: Callable[..., Terminal], study: Path
) -> None:
    terminal = start(study)
    done = masrel("serve", study, "--port", terminal.port())
    assert done.code == 2
    assert "needed a study that nobody serves, got one that another" in done.err
    assert terminal.stop(signal.SIGTERM) == 0


@pytest.mark.slow
def test_an_open_connection_does_not_keep_it_and_what_is_risked_is_said_once(
    start: Callable[..., Terminal], study: Path
) -> None:
    server = start(study, at_a_terminal=False)
    port = server.port()
    assert "\N{UPPER HALF BLOCK}" not in server.text
    with socket.create_connection(("127.0.0.1", port)) as connection:
        connection.sendall(b"GET /rater HTTP/1.1\r\n")
        assert server.stop(signal.SIGINT) == 0
    again = start(study, "--host=0.0.0.0", at_a_terminal=False)
    text = again.until("Ctrl-C: stop.")
    assert text.count("--host 0.0.0.0 without --tls: whoever is in") == 1
    assert again.stop(signal.SIGINT) == 0
