"""The command: what it prints, what it refuses, and that it stops as it is told."""

import importlib.util
import os
import re
import signal
import socket
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from masrel.lab.protocol import copy_template
from tests.cli.process import Caller
from tests.lab.serve.pages import listen
from tests.lab.serve.terminal import Server


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


def test_a_protocol_that_cannot_be_read(masrel: Caller, study: Path) -> None:
    (study / "protocol.toml").write_text("models = 3")
    done = masrel("serve", study)
    assert (done.code, "protocol.toml" in done.err) == (2, True)
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


@pytest.fixture
def start(study: Path) -> Iterator[Callable[..., Server]]:
    """Start it, as often as a test likes."""
    started: list[Server] = []

    def begin(*options: str, **settings: bool) -> Server:
        started.append(Server(study, *options, **settings))
        return started[-1]

    yield begin
    for each in started:
        each.end(signal.SIGKILL)


@pytest.mark.slow
def test_two_addresses_each_with_a_qr_code_and_new_ones_at_enter(
    start: Callable[..., Server],
) -> None:
    server = start()
    address = r"http://127\.0\.0\.1:\d+/{}\?token=[\w-]{{22}}"
    for role in ("rater", "coordinator"):
        assert len(re.findall(address.format(role), server.text)) == 1
    assert server.text.count("\N{UPPER HALF BLOCK}") > 100
    server.enter()
    assert len(set(re.findall(r"token=([\w-]{22})", server.text))) == 4
    assert server.end() == 0


@pytest.mark.slow
def test_a_study_is_served_once_and_the_port_says_nothing_else(
    masrel: Caller, start: Callable[..., Server], study: Path
) -> None:
    server = start()
    done = masrel("serve", study, "--port", server.port)
    assert done.code == 2
    assert "needed a study that nobody serves, got one that another" in done.err
    assert server.end(signal.SIGTERM) == 0


@pytest.mark.slow
def test_an_open_connection_does_not_keep_it_and_what_is_risked_is_said_once(
    start: Callable[..., Server],
) -> None:
    server = start(at_a_terminal=False)
    assert "\N{UPPER HALF BLOCK}" not in server.text
    with socket.create_connection(("127.0.0.1", server.port)) as connection:
        connection.sendall(b"GET /rater HTTP/1.1\r\n")
        assert server.end() == 0
    again = start("--host=0.0.0.0", at_a_terminal=False)
    assert again.text.count("--host 0.0.0.0 without --tls: whoever is in") == 1
    assert again.end() == 0
