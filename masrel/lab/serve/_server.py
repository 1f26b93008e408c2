"""The application and its server: connections, certificate, how it starts and stops."""

import asyncio
import contextlib
import errno
import fcntl
import ipaddress
import logging
import mimetypes
import os
import signal
import socket
import ssl
import sys
import threading
from collections.abc import Callable, Coroutine, Iterator
from contextlib import contextmanager
from pathlib import Path

import uvicorn
from starlette.applications import Starlette
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import JSONResponse, Response
from starlette.routing import Route
from uvicorn.protocols.http.h11_impl import H11Protocol

from masrel._files import make_folder
from masrel.errors import MasrelError, ParameterError
from masrel.lab.hess._clock import off_the_loop
from masrel.lab.protocol import StudyPaths
from masrel.lab.serve._access import Access
from masrel.lab.serve._coordinator import CoordinatorPages
from masrel.lab.serve._manager import SessionManager
from masrel.lab.serve._middleware import Middleware
from masrel.lab.serve._role_pages import HERE, RaterPages

_REQUEST_S = 10.0  # in which a request must have come in whole
_IDLE_S = 30  # that a connection may wait for its next request
_MAX_CONNECTIONS = 256
_MAX_OF_ONE = 48  # of one computer; a browser opens six
_MAX_HEAD = 32_768  # bytes before a request's head is whole
_TO_END_S = 3  # for answers that are on their way
_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)

# Addresses that are asked nothing: which of its own a computer would call them from
_NETWORKS = ("192.168.255.254", "10.255.255.254", "172.31.255.254", "169.254.255.254")
_ANY = ("0.0.0.0", "::")
_LOOPBACK = ("127.0.0.1", "localhost")


class _Connection(H11Protocol):
    """A connection, cut off where no whole request comes or there are too many."""

    _deadline: asyncio.TimerHandle | None = None

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Take a connection, unless there are too many."""
        super().connection_made(transport)
        hosts = [
            each.client[0]
            for each in self.connections
            if isinstance(each, H11Protocol) and each.client
        ]
        of_one = hosts.count(self.client[0]) if self.client else 0
        if len(self.connections) > _MAX_CONNECTIONS or of_one > _MAX_OF_ONE:
            transport.abort()
        self._watch()

    def data_received(self, data: bytes) -> None:
        """Take what has come, and wait only so long for the rest."""
        super().data_received(data)
        self._watch()

    def connection_lost(self, exc: Exception | None) -> None:
        """Forget a connection."""
        self._forget_deadline()
        super().connection_lost(exc)

    def _watch(self) -> None:
        cycle = self.cycle
        is_answered = cycle is not None and not (
            cycle.more_body or cycle.response_complete
        )
        # uvicorn itself ends a connection that is idle, but not one that dribbles
        if is_answered or self.timeout_keep_alive_task is not None:
            self._forget_deadline()
        elif self._deadline is None:
            self._deadline = self.loop.call_later(_REQUEST_S, self.transport.abort)

    def _forget_deadline(self) -> None:
        if self._deadline is not None:
            self._deadline.cancel()
            self._deadline = None


class _Server(uvicorn.Server):
    """A server whose signals are looked after elsewhere."""

    @contextmanager
    def capture_signals(self) -> Iterator[None]:
        """Leave them alone."""
        yield


def encryption(certificate: Path, key: Path) -> ssl.SSLContext:
    """Return what encrypts connections.

    Raises
    ------
    ParameterError
        If the files are not a certificate and its key.
    """
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.minimum_version = ssl.TLSVersion.TLSv1_2
    where = f"--tls {certificate} {key}: needed"

    def refuse() -> str:
        # else OpenSSL would ask at the terminal
        raise ParameterError(f"{where} a key without a passphrase, got one with")

    for file in (certificate, key):
        if not file.is_file():
            raise ParameterError(f"{where} two files, {file} is not there")
    try:
        context.load_cert_chain(certificate, key, password=refuse)
    except ssl.SSLError as error:
        if error.reason == "KEY_VALUES_MISMATCH":
            raise ParameterError(
                f"{where} the key of this certificate, got that of another"
            ) from None
        raise ParameterError(
            f"{where} a certificate and its key as PEM files, got others"
        ) from None
    except OSError as error:  # which names neither of them
        raise ParameterError(
            f"{where} files that can be read, got: {error.strerror}"
        ) from None
    return context


def listen(host: str, port: int) -> socket.socket:
    """Return a socket that listens at an address of this computer.

    Raises
    ------
    ParameterError
        If it cannot.
    """
    try:
        known = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM)
    except (socket.gaierror, UnicodeError):
        raise ParameterError(
            f"--host: needed a name or address of this computer, got {host!r}"
        ) from None
    family, kind, number, _, address = known[0]
    listener = socket.socket(family, kind, number)
    try:
        # the port of a server that has just stopped
        listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listener.bind(address)
        listener.listen(128)
    except OSError as error:
        listener.close()
        raise ParameterError(_cannot_listen(host, port, error)) from None
    return listener


def _cannot_listen(host: str, port: int, error: OSError) -> str:
    if error.errno == errno.EADDRINUSE:
        return (
            f"--port: needed a free one, {port} of {host} is in use, perhaps by "
            "another masrel serve; --port 0 takes any free one"
        )
    if error.errno in (errno.EACCES, errno.EPERM):
        return f"--port: needed one that this user may open, such as 8723, got {port}"
    if error.errno == errno.EADDRNOTAVAIL:
        return f"--host: needed an address of this computer, got {host!r}"
    return f"--host {host} --port {port}: {error.strerror or error}"


def is_loopback(host: str) -> bool:
    """Return whether only this computer itself can call an address."""
    with contextlib.suppress(ValueError):
        return ipaddress.ip_address(host.partition("%")[0]).is_loopback
    return False


def hosts(listener: socket.socket, host: str, *, encrypted: bool) -> list[str]:
    """Return by which names and ports a browser may call, the best one first."""
    address, port = listener.getsockname()[:2]
    if address in _ANY:
        names = [*_own_addresses(), *_LOOPBACK]
    elif is_loopback(address):
        names = [host, address, "localhost"]
    else:
        names = [host, address]
    usual = port == (443 if encrypted else 80)  # which browsers leave out
    names = [f"[{name}]" if ":" in name else name.lower() for name in names]
    return [name if usual else f"{name}:{port}" for name in dict.fromkeys(names)]


def _own_addresses() -> list[str]:
    addresses = []
    for network in _NETWORKS:
        with (
            contextlib.suppress(OSError),
            socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as caller,
        ):
            caller.connect((network, 9))  # sends nothing
            addresses.append(str(caller.getsockname()[0]))
    return [each for each in dict.fromkeys(addresses) if not is_loopback(each)]


@contextmanager
def alone(study: StudyPaths) -> Iterator[None]:
    """Refuse a second server of a study: each would have its tablets and sessions.

    Raises
    ------
    ParameterError
        If another process serves it.
    """
    # Released by the system when the process ends, killed or not.
    folder = study.serve_key_file.parent
    make_folder(folder)
    descriptor = os.open(folder / "serve.lock", os.O_RDWR | os.O_CREAT, 0o600)
    with os.fdopen(descriptor) as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise ParameterError(
                f"{study.root}: needed a study that is not being served, got one that "
                "another masrel serve has open"
            ) from None
        yield


def make_app(manager: SessionManager, access: Access) -> Middleware:
    """Return the application: every request passes `Middleware` first."""
    coordinator = CoordinatorPages(manager, access)
    routes = [Route("/report/{path:path}", coordinator.report), _static()]
    for pages in (RaterPages(manager, access), coordinator):
        role = pages.role
        routes += [
            Route(f"/{role}", pages.page),
            Route(f"/{role}/state", pages.state),
            Route(f"/{role}/events", pages.events),
            Route(f"/{role}/{{action}}", pages.act, methods=["POST"]),
        ]
    kinds = (HTTPException, MasrelError, OSError, Exception)
    failures = dict.fromkeys(kinds, _failure)
    return Middleware(Starlette(routes=routes, exception_handlers=failures), access)


def _static() -> Route:
    # Read once: no path of a request reaches the disk.
    files = {path.name: path.read_bytes() for path in (HERE / "static").glob("*.*")}

    async def show(request: Request) -> Response:
        name = request.path_params["name"]
        if name not in files:
            raise HTTPException(404)
        return Response(files[name], media_type=mimetypes.guess_type(name)[0])

    return Route("/static/{name}", show)


async def _failure(_: Request, error: Exception) -> Response:
    status, why = 500, "The server failed; see its terminal."
    if isinstance(error, HTTPException):
        status = error.status_code
        why = "There is no such page." if status == 404 else error.detail
    elif isinstance(error, MasrelError):
        status, why = 422, str(error)
    elif isinstance(error, OSError):
        why = error.strerror or why
        why = f"{error.filename}: {why}" if error.filename else why
    return JSONResponse({"why": why}, status_code=status)


async def serve(
    manager: SessionManager,
    access: Access,
    listener: socket.socket,
    context: ssl.SSLContext | None,
    *,
    show: Callable[[], None],
) -> bool:
    """Serve until a signal says to stop; return whether it ended politely.

    The first signal waits for the session that runs, the second does not. `show` is
    called at the beginning, and where a person presses Enter at the terminal.
    """
    app = make_app(manager, access)
    server = _Server(_configured(app, context))
    logging.getLogger("uvicorn.error").setLevel(logging.ERROR)
    with off_the_loop() as manager.processors, _signals() as signals, _enter(show):
        show()  # whoever reads it may send a signal
        serving = asyncio.ensure_future(server.serve([listener]))
        await _first(serving, signals.get())
        if manager.running is not None:
            access.say("The session is being stopped. Ctrl-C again: do not wait.")
        closing = asyncio.ensure_future(manager.close())
        is_polite = await _first(closing, signals.get()) is closing
        app.close_streams()
        server.should_exit, server.force_exit = True, not is_polite
        await serving
        if is_polite:
            await closing  # which says what went wrong
    return is_polite


def _configured(app: Middleware, context: ssl.SSLContext | None) -> uvicorn.Config:
    config = uvicorn.Config(
        app,
        loop="asyncio",
        http=_Connection,
        ws="none",
        lifespan="off",
        interface="asgi3",
        log_config=None,
        access_log=False,  # it would have tokens in it
        proxy_headers=False,  # anybody can say that he is somewhere else
        server_header=False,
        timeout_keep_alive=_IDLE_S,
        timeout_graceful_shutdown=_TO_END_S,
        h11_max_incomplete_event_size=_MAX_HEAD,
    )
    config.load()
    config.ssl = context
    return config


async def _first(
    task: "asyncio.Future[None]", other: "Coroutine[None, None, None]"
) -> "asyncio.Future[None]":
    """Wait for the first of two, and return it; the other coroutine is given up."""
    waiting = asyncio.ensure_future(other)
    done, _ = await asyncio.wait([task, waiting], return_when=asyncio.FIRST_COMPLETED)
    if task in done:
        waiting.cancel()
        return task
    return waiting


@contextmanager
def _signals() -> Iterator["asyncio.Queue[None]"]:
    """Give a queue of the signals that ask the process to end."""
    loop, signals = asyncio.get_running_loop(), asyncio.Queue[None]()
    n_signals = 0

    def note(*_: object) -> None:
        nonlocal n_signals
        n_signals += 1
        if n_signals > 2:  # the loop itself hangs
            raise KeyboardInterrupt
        loop.call_soon_threadsafe(signals.put_nowait, None)

    # one that is ignored, as with nohup, stays so
    caught = [each for each in _SIGNALS if signal.getsignal(each) != signal.SIG_IGN]
    before = {number: signal.signal(number, note) for number in caught}
    try:
        yield signals
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


@contextmanager
def _enter(call: Callable[[], None]) -> Iterator[None]:
    """Call a function in the event loop whenever Enter is pressed."""
    loop = asyncio.get_running_loop()

    def read() -> None:
        # not through `sys.stdin`, whose lock would be held at the end
        with contextlib.suppress(OSError, RuntimeError):
            while os.read(0, 1024):
                loop.call_soon_threadsafe(call)

    if sys.stdin is not None and sys.stdin.isatty():
        threading.Thread(target=read, daemon=True).start()
    yield
