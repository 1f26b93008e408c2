"""The server: its port, its connections, its certificate, and how it stops."""

import asyncio
import os
import signal
import ssl
import sys
from collections.abc import Awaitable, Callable
from pathlib import Path

import httpx
import pytest

from masrel.errors import ParameterError
from masrel.lab.protocol import StudyPaths, copy_template
from masrel.lab.run import read_log
from masrel.lab.serve import _server
from masrel.lab.serve._access import Access
from masrel.lab.serve._addresses import hosts, is_loopback, qr_lines, qr_svg
from masrel.lab.serve._desk import Desk
from masrel.lab.serve._server import alone, encryption, listen, serve
from tests.lab.serve.desks import Page, n_sampled, small_study

DATA = Path(__file__).with_name("data")
CERTIFICATE, KEY = DATA / "cert.pem", DATA / "key.pem"

Reader, Writer = asyncio.StreamReader, asyncio.StreamWriter


class PatientDesk(Desk):
    """A desk that closes when a test says so."""

    def __init__(self, study: StudyPaths) -> None:
        super().__init__(study)
        self.may_close = asyncio.Event()
        self.may_close.set()
        self.is_closed = False

    async def close(self) -> None:
        """Stop what runs."""
        await self.may_close.wait()
        await super().close()
        self.is_closed = True


class Running:
    """A server that runs in this process."""

    def __init__(self, root: Path, *, tls: bool = False, host: str = "127.0.0.1"):
        if not root.exists():
            copy_template("small", root)
        self.context = encryption(CERTIFICATE, KEY) if tls else None
        self.listener = listen(host, 0)
        self.port = self.listener.getsockname()[1]
        names = hosts(self.listener, host, encrypted=tls)
        origin = f"{'https' if tls else 'http'}://{names[0]}"
        paths = StudyPaths(root)
        self.access = Access(paths, origin=origin, hosts=frozenset(names))
        self.desk = PatientDesk(StudyPaths(root))
        self.serving: asyncio.Task[bool] | None = None

    async def __aenter__(self) -> "Running":
        """Start it."""
        started = asyncio.Event()
        pages = (self.desk, self.access, self.listener, self.context)
        self.serving = asyncio.create_task(serve(*pages, show=started.set))
        waiting = asyncio.create_task(started.wait())
        await asyncio.wait([self.serving, waiting], return_when=asyncio.FIRST_COMPLETED)
        if self.serving.done():
            waiting.cancel()
            await self.serving
        return self

    async def __aexit__(self, *_: object) -> None:
        """Stop it, as Ctrl-C does."""
        if self.serving and not self.serving.done():
            os.kill(os.getpid(), signal.SIGINT)
            assert await self.serving

    async def connect(self, host: str = "127.0.0.1") -> tuple[Reader, Writer]:
        """Open a connection."""
        return await asyncio.open_connection(host, self.port)

    async def is_cut(self, reader: Reader, s: float = 0.4) -> bool:
        """Return whether a connection ends within so many seconds."""
        try:
            await asyncio.wait_for(reader.read(), s)
        except TimeoutError:
            return False
        except ConnectionError:
            pass
        return True


HEAD = b"GET /rater HTTP/1.1\r\nHost: 127.0.0.1\r\n"
BODY = HEAD.replace(b"GET", b"POST") + b"Content-Length: 100\r\n\r\n"


async def dribble(writer: Writer, begin: bytes) -> None:
    writer.write(begin)
    for _ in range(100):
        await asyncio.sleep(0.02)
        writer.write(b"x")


async def slow_request(running: Running, begin: bytes) -> bool:
    """Return whether somebody who sends a letter now and then keeps a connection."""
    reader, writer = await running.connect()
    sending = asyncio.create_task(dribble(writer, begin))
    is_cut = await running.is_cut(reader)
    sending.cancel()
    writer.close()
    return not is_cut


async def slow_second_request(running: Running) -> bool:
    reader, writer = await running.connect()
    writer.write(HEAD + b"\r\n")
    await reader.readuntil(b"</html>")
    sending = asyncio.create_task(dribble(writer, HEAD))
    is_cut = await running.is_cut(reader)
    sending.cancel()
    writer.close()
    return not is_cut


async def many_connections(running: Running) -> bool:
    pairs = [await running.connect() for _ in range(60)]
    cut = await asyncio.gather(*(running.is_cut(reader, 0.2) for reader, _ in pairs))
    for _, writer in pairs:
        writer.close()
    return not any(cut)


ATTACKS: dict[str, tuple[Callable[[Running], Awaitable[bool]], str]] = {
    "head": (lambda running: slow_request(running, HEAD), "_REQUEST_S"),
    "body": (lambda running: slow_request(running, BODY), "_REQUEST_S"),
    "second": (slow_second_request, "_REQUEST_S"),
    "connections": (many_connections, "_MAX_OF_ONE"),
}


@pytest.mark.parametrize("name", ATTACKS)
@pytest.mark.parametrize("guarded", [True, False])
def test_who_only_waits_is_cut_off(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, guarded: bool
) -> None:
    attack, guard = ATTACKS[name]
    limits = {"_REQUEST_S": 0.1, "_MAX_OF_ONE": 48}
    monkeypatch.setattr(_server, guard, limits[guard] if guarded else 1000)

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
                _, writer = await running.connect("127.0.0.2")
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
            statuses = set()
            for i in range(100):
                named = {"X-Forwarded-For": f"10.0.0.{i}"}
                address = f"{running.access.origin}/static/x"
                statuses.add((await client.get(address, headers=named)).status_code)
            return statuses

    assert asyncio.run(run()) == {404, 429}


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_stops_it_with_streams_open(
    tmp_path: Path, number: signal.Signals
) -> None:
    async def run() -> bool:
        async with Running(tmp_path / "study") as running:
            assert running.serving
            os.kill(os.getpid(), number)
            return await running.serving and running.desk.is_closed

    assert asyncio.run(run())


def test_a_second_signal_does_not_wait(tmp_path: Path) -> None:
    async def run() -> bool:
        async with Running(tmp_path / "study") as running:
            assert running.serving
            running.desk.may_close.clear()
            os.kill(os.getpid(), signal.SIGINT)
            await asyncio.sleep(0.1)
            assert not running.serving.done()
            os.kill(os.getpid(), signal.SIGINT)
            return await running.serving

    assert not asyncio.run(run())


def test_signals_are_as_they_were_afterwards(tmp_path: Path) -> None:
    before = signal.getsignal(signal.SIGINT), signal.getsignal(signal.SIGTERM)

    async def run() -> None:
        async with Running(tmp_path / "study"):
            pass

    asyncio.run(run())
    assert (signal.getsignal(signal.SIGINT), signal.getsignal(signal.SIGTERM)) == before


def test_a_port_in_use_is_said() -> None:
    with listen("127.0.0.1", 0) as first:
        port = first.getsockname()[1]
        with pytest.raises(ParameterError, match=f"--port: needed a free one, {port}"):
            listen("127.0.0.1", port)


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


@pytest.mark.skipif(os.name != "posix" or os.geteuid() == 0, reason="root reads any")
def test_a_key_that_may_not_be_read_is_said(tmp_path: Path) -> None:
    key = tmp_path / "key.pem"
    key.write_bytes((DATA / "key.pem").read_bytes())
    key.chmod(0)
    with pytest.raises(
        ParameterError, match=r"key\.pem: needed files that can be read"
    ):
        encryption(DATA / "cert.pem", key)


@pytest.mark.parametrize("host", ["", "nosuch.invalid", "a" * 300, "8.8.8.8"])
def test_a_host_that_is_none_of_this_computers_is_said(host: str) -> None:
    with pytest.raises(ParameterError, match="--host: needed"):
        listen(host, 0)


def test_a_study_is_served_once(tmp_path: Path) -> None:
    study = StudyPaths(tmp_path)
    with (
        alone(study),
        pytest.raises(ParameterError, match="nobody serves"),
        alone(study),
    ):
        pass
    with alone(study):
        pass


@pytest.mark.parametrize(
    ("host", "loopback"),
    [("127.0.0.1", True), ("::1", True), ("127.3.2.1", True), ("10.0.0.1", False)],
)
def test_what_is_loopback(host: str, loopback: bool) -> None:
    assert is_loopback(host) is loopback


def test_a_qr_code_is_of_the_address() -> None:
    address = "http://192.168.178.20:8723/coordinator?token=" + "x" * 22
    assert qr_lines(address) != qr_lines(f"{address}y")
    assert qr_svg(address).startswith("data:image/svg+xml")
    assert "token" not in qr_svg(address)


@pytest.mark.slow
@pytest.mark.parametrize("screen", ["ready", "presenting", "grade"])
def test_a_signal_leaves_a_session_that_can_be_gone_on_with(
    tmp_path: Path, screen: str, capsys: pytest.CaptureFixture[str]
) -> None:
    study = small_study(tmp_path / "study", quick=True)

    async def run() -> None:
        async with Running(study.root) as running:
            assert running.serving
            await running.desk.start("R1", "test")
            page = Page(running.desk)
            await page.until("ready" if screen == "presenting" else screen)
            if screen == "presenting":
                await page.answer(running.desk.state())
                await n_sampled(running.desk, 100)
            os.kill(os.getpid(), signal.SIGTERM)
            assert await running.serving

    async def go_on() -> None:
        async with Running(study.root) as running:
            await running.desk.start("R1", "test")
            state = await Page(running.desk).until("over")
            assert state["how"] == "complete"

    asyncio.run(run())
    assert "The session is being stopped. Ctrl-C again" in capsys.readouterr().out
    asyncio.run(go_on())
    grades = [
        event.fields["code"]
        for event in read_log(study.log_file("R1", "test"))
        if event.kind == "grade"
    ]
    assert len(grades) == len(set(grades)) == 4
