"""The server: its port, its connections, its certificate, and how it stops."""

import asyncio
import importlib.util
import os
import re
import signal
import socket
import ssl
import sys
from collections.abc import Awaitable, Callable
from pathlib import Path

import httpx
import pytest

from masrel.errors import ParameterError
from masrel.lab.protocol import StudyPaths, copy_template
from tests.cli.process import Caller
from tests.lab.serve.pages import (
    CERTIFICATE,
    DATA,
    Page,
    Running,
    alone,
    encryption,
    listen,
    logged,
    n_sampled,
    processes_of,
    small_study,
)
from tests.lab.serve.terminal import Server

HEAD = b"GET /rater HTTP/1.1\r\nHost: 127.0.0.1\r\n"
BODY = HEAD.replace(b"GET", b"POST") + b"Content-Length: 100\r\n\r\n"


async def is_cut(reader: asyncio.StreamReader, s: float = 1.0) -> bool:
    """Whether a connection ends within so many seconds."""
    try:
        await asyncio.wait_for(reader.read(), s)
    except TimeoutError:
        return False
    except ConnectionError:
        pass
    return True


async def slow_request(running: Running, begin: bytes, before: bytes = b"") -> bool:
    """Whether somebody who sends a letter now and then keeps a connection."""
    reader, writer = await asyncio.open_connection("127.0.0.1", running.port)

    async def dribble() -> None:
        writer.write(begin)
        for _ in range(100):
            await asyncio.sleep(0.02)
            writer.write(b"x")

    if before:
        writer.write(before)
        await reader.readuntil(b"</html>")
    sending = asyncio.create_task(dribble())
    was_cut = await is_cut(reader)
    sending.cancel()
    writer.close()
    return not was_cut


async def many_connections(running: Running) -> bool:
    """Whether one computer keeps 60 connections."""
    call = asyncio.open_connection
    pairs = [await call("127.0.0.1", running.port) for _ in range(60)]
    cut = await asyncio.gather(*(is_cut(reader, 0.2) for reader, _ in pairs))
    for _, writer in pairs:
        writer.close()
    return not any(cut)


ATTACKS: dict[str, tuple[Callable[[Running], Awaitable[bool]], str, float]] = {
    "head": (lambda running: slow_request(running, HEAD), "_REQUEST_S", 0.1),
    "body": (lambda running: slow_request(running, BODY), "_REQUEST_S", 0.1),
    "second": (
        lambda running: slow_request(running, HEAD, HEAD + b"\r\n"),
        "_REQUEST_S",
        0.1,
    ),
    "connections": (many_connections, "_MAX_OF_ONE", 48),
}


@pytest.mark.parametrize("name", ATTACKS)
@pytest.mark.parametrize("guarded", [True, False])
def test_who_only_waits_is_cut_off(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, guarded: bool
) -> None:
    attack, guard, limit = ATTACKS[name]
    limit = limit if guarded else 1000
    monkeypatch.setattr(f"masrel.lab.serve._server.{guard}", limit)

    async def run() -> bool:
        async with Running(tmp_path / "study") as running:
            return await attack(running)

    assert asyncio.run(run()) is not guarded


@pytest.mark.skipif(sys.platform != "linux", reason="127.0.0.2 is Linux's own")
@pytest.mark.parametrize(("host", "open_"), [("127.0.0.1", False), ("0.0.0.0", True)])
def test_nobody_else_can_call_what_listens_here(
    tmp_path: Path, host: str, open_: bool
) -> None:
    async def run() -> bool:
        async with Running(tmp_path / "study", host=host) as running:
            try:
                _, writer = await asyncio.open_connection("127.0.0.2", running.port)
            except ConnectionRefusedError:
                return False
            writer.close()
            return True

    assert asyncio.run(run()) is open_


def test_a_page_is_encrypted_with_the_certificate(tmp_path: Path) -> None:
    async def run() -> httpx.Response:
        async with Running(tmp_path / "study", tls=True) as running:
            trusted = ssl.create_default_context(cafile=str(CERTIFICATE))
            async with httpx.AsyncClient(verify=trusted) as client:
                return await client.get(running.access.new_address("rater"))

    answer = asyncio.run(run())
    assert answer.status_code == 200
    assert "; Secure" in answer.headers["set-cookie"]


def test_what_a_proxy_says_of_its_client_is_not_believed(tmp_path: Path) -> None:
    async def run() -> set[int]:
        async with (
            Running(tmp_path / "study") as running,
            httpx.AsyncClient() as client,
        ):
            address = f"{running.access.origin}/static/x"
            named = ({"X-Forwarded-For": f"10.0.0.{i}"} for i in range(100))
            answers = [await client.get(address, headers=each) for each in named]
            return {answer.status_code for answer in answers}

    assert asyncio.run(run()) == {404, 429}


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_stops_it_and_is_afterwards_as_it_was(
    tmp_path: Path, number: signal.Signals
) -> None:
    before = signal.getsignal(number)

    async def run() -> bool:
        async with Running(tmp_path / "study") as running:
            assert signal.getsignal(number) != before
            return await running.stopped(number) and running.manager.is_closed

    assert asyncio.run(run())
    assert signal.getsignal(number) == before


def test_a_second_signal_does_not_wait(tmp_path: Path) -> None:
    async def run() -> bool:
        async with Running(tmp_path / "study") as running:
            running.manager.may_close.clear()
            first = asyncio.create_task(running.stopped())
            await asyncio.sleep(0.1)
            assert not first.done()
            return await running.stopped()

    assert not asyncio.run(run())


@pytest.mark.parametrize(
    ("certificate", "key", "why"),
    [
        ("nothing.pem", "key.pem", "nothing.pem is not there"),
        ("cert.pem", "nothing.pem", "nothing.pem is not there"),
        ("cert.pem", "other_key.pem", "got that of another"),
        ("cert.pem", "locked_key.pem", "a key without a passphrase"),
        ("key.pem", "cert.pem", "a certificate and its key as PEM files"),
        ("../test_server.py", "key.pem", "a certificate and its key as PEM files"),
    ],
)
def test_what_is_no_certificate_with_its_key_is_said(
    certificate: str, key: str, why: str
) -> None:
    with pytest.raises(ParameterError, match=why):
        encryption(DATA / certificate, DATA / key)


@pytest.mark.skipif(os.geteuid() == 0, reason="root reads any")
def test_a_key_that_may_not_be_read_is_said(tmp_path: Path) -> None:
    key = tmp_path / "key.pem"
    key.touch(mode=0)
    with pytest.raises(ParameterError, match=r"key\.pem: needed files that can be"):
        encryption(CERTIFICATE, key)


@pytest.mark.parametrize("host", ["", "nosuch.invalid", "a" * 300, "8.8.8.8"])
def test_a_host_that_is_none_of_this_computers_is_said(host: str) -> None:
    with pytest.raises(ParameterError, match="--host: needed"):
        listen(host, 0)


def test_a_study_is_served_once(tmp_path: Path) -> None:
    study = StudyPaths(tmp_path)
    second = alone(study)
    with alone(study), pytest.raises(ParameterError, match="not being served"), second:
        pass
    with alone(study):
        pass


@pytest.mark.slow
@pytest.mark.parametrize("screen", ["ready", "presenting", "grade"])
def test_a_signal_leaves_a_session_that_can_be_gone_on_with(
    tmp_path: Path, screen: str, capsys: pytest.CaptureFixture[str]
) -> None:
    study = small_study(tmp_path / "study", quick=True)

    async def run() -> None:
        async with Running(study.root) as running:
            await running.manager.start("R1", "test")
            page = Page(running.manager)
            await page.until("ready" if screen == "presenting" else screen)
            if screen == "presenting":
                await page.answer(running.manager.state())
                await n_sampled(running.manager, 100)
            assert await running.stopped(signal.SIGTERM)

    async def go_on() -> None:
        async with Running(study.root) as running:
            await running.manager.start("R1", "test")
            state = await Page(running.manager).until("over")
            assert state["how"] == "complete"

    asyncio.run(run())
    assert "The session is being stopped. Ctrl-C again" in capsys.readouterr().out
    asyncio.run(go_on())
    grades = [event["code"] for event in logged(study, "grade")]
    assert len(grades) == len(set(grades)) == 4


@pytest.mark.skipif(sys.platform != "linux", reason="processors as Linux has them")
def test_the_server_keeps_off_the_processor_of_the_loop(tmp_path: Path) -> None:
    study = small_study(tmp_path / "study", quick=True)
    allowed = os.sched_getaffinity(0)
    of_loop = {max(allowed)}

    async def run() -> None:
        async with Running(study.root) as server:
            others = allowed - of_loop or allowed  # all share a single one
            assert os.sched_getaffinity(0) == others
            job = await asyncio.create_subprocess_exec("sleep", "60")
            assert os.sched_getaffinity(job.pid) == others
            job.kill()
            await job.wait()
            await server.manager.start("R1", "test")
            page = Page(server.manager)
            await page.until("ready")
            (session,) = processes_of(study)
            assert os.sched_getaffinity(session) == allowed
            await page.answer(server.manager.state())
            await n_sampled(server.manager, 10)
            if os.sched_getscheduler(session) == os.SCHED_FIFO:
                fields = Path(f"/proc/{session}/stat").read_text().rpartition(")")[2]
                assert int(fields.split()[36]) in of_loop
            await server.manager.leave()

    asyncio.run(run())
    assert os.sched_getaffinity(0) == allowed


@pytest.fixture
def study(tmp_path: Path) -> Path:
    copy_template("small", tmp_path / "study")
    return tmp_path / "study"


def test_what_cannot_be_served_is_said(
    masrel: Caller, study: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with listen("127.0.0.1", 0) as other:
        done = masrel("serve", study, "--port", other.getsockname()[1])
    assert (done.code, done.err.count("\n")) == (2, 1)
    assert "in use, perhaps by another masrel serve; --port 0 takes any" in done.err
    if os.geteuid() != 0:  # root may open any
        done = masrel("serve", study, "--port", 80)
        assert done.code == 2
        assert "--port: needed one that this user may open" in done.err
    there: Callable[..., object] = importlib.util.find_spec
    for library in ("starlette", "uvicorn", "segno"):
        monkeypatch.setattr(
            "importlib.util.find_spec",
            lambda name, package=None, of=library: (
                None if name == of else there(name, package)
            ),
        )
        done = masrel("serve", study)
        install = "install it with: pip install 'masrel[serve]'"
        why = f"serve: needs {library}; {install}"
        assert (done.code, done.out, done.err) == (2, "", f"masrel: {why}\n")
    monkeypatch.undo()
    monkeypatch.setattr(sys, "platform", "win32")
    done = masrel("serve", study)
    why = "serve: needs Linux or macOS, got Windows; use masrel run instead"
    assert (done.code, done.out, done.err) == (2, "", f"masrel: {why}\n")


@pytest.mark.slow
def test_the_command_serves_a_study_once_says_what_is_risked_and_ends_at_a_signal(
    masrel: Caller, study: Path
) -> None:
    server = Server(study)
    try:
        address = r"http://127\.0\.0\.1:\d+/{}\?token=[\w-]{{22}}"
        for role in ("rater", "coordinator"):
            assert len(re.findall(address.format(role), server.text)) == 1
        assert server.text.count("\N{UPPER HALF BLOCK}") > 100
        server.enter()
        assert len(set(re.findall(r"token=([\w-]{22})", server.text))) == 4
        done = masrel("serve", study, "--port", server.port)
        assert done.code == 2
        assert "needed a study that is not being served, got one" in done.err
        with socket.create_connection(("127.0.0.1", server.port)) as connection:
            connection.sendall(b"GET /rater HTTP/1.1\r\n")  # and no more
            assert server.end() == 0
        server = Server(study, "--host=0.0.0.0", at_a_terminal=False)
        assert "\N{UPPER HALF BLOCK}" not in server.text
        assert server.text.count("--host 0.0.0.0 without --tls: anybody in") == 1
        assert server.end(signal.SIGTERM) == 0
    finally:
        server.end(signal.SIGKILL)
