"""Studies and their pages, with and without a server, and who is at them.

``python -m tests.lab.serve.pages ROOT PORT`` serves a study and goes on with its
session, as often as it is killed: each line of input forks a server from this process,
which has loaded all it needs; it prints its number and addresses of pages.
"""

import asyncio
import contextlib
import json
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import AsyncIterator, Awaitable, Callable, Sequence
from contextlib import asynccontextmanager, suppress
from pathlib import Path
from typing import Any, Literal

import httpx
from starlette.responses import JSONResponse
from starlette.types import Message, Receive, Scope, Send

from masrel.lab._event_log import read_log
from masrel.lab.conduct import allot_schedules
from masrel.lab.protocol import StudyPaths, copy_template, read_protocol
from masrel.lab.serve import _access as access
from masrel.lab.serve import _middleware as middleware
from masrel.lab.serve._access import LIFE_S, ROLES, Access, Role
from masrel.lab.serve._coordinator import ACTIONS
from masrel.lab.serve._live import SampleTail
from masrel.lab.serve._manager import (
    AskOverError,
    SessionManager,
)
from masrel.lab.serve._middleware import Middleware
from masrel.lab.serve._server import (
    alone,
    encryption,
    hosts,
    listen,
    make_app,
    serve,
)

__all__ = [
    "ACTIONS",
    "LIFE_S",
    "ROLES",
    "Access",
    "AskOverError",
    "Middleware",
    "Role",
    "SampleTail",
    "SessionManager",
    "access",
    "alone",
    "encryption",
    "listen",
    "middleware",
]

PATIENCE_S = 60.0
HOST = "127.0.0.1:8723"
ORIGIN = f"http://{HOST}"
CLIENT = ("10.0.0.7", 50_000)
DATA = Path(__file__).with_name("data")
CERTIFICATE, KEY = DATA / "cert.pem", DATA / "key.pem"

App = Callable[[Scope, Receive, Send], Awaitable[None]]

# Half a second each; however late a busy machine is, that shall not end one.
_QUICK = (
    ("start_deg = 30.0", "start_deg = 110.0"),
    ("mean_speed_deg_s = 85.0", "mean_speed_deg_s = 150.0"),
    (
        "missed_ticks_limit = 20\n",
        """
missed_ticks_limit = 100000
jump_limit_deg = 5.0
stale_limit_ms = 50.0
frozen_limit_ms = 100.0
watchdog_ms = 100.0
end_ramp_ms = 20.0
""",
    ),
)

OCCASIONS = """
[occasions]
instructions = "Stretch the arm once."
practice = ["HM1"]
break_after = 2
break_minutes = 0.1

[[questionnaires]]
id = "realism"
title = "How real it felt"
when = "session"

[[questionnaires.questions]]
id = "score"
text = "How real?"
type = "visual-analogue"
"""

EACH = """
[[questionnaires]]
id = "each"
title = "This one"
when = "presentation"

[[questionnaires.questions]]
id = "sure"
text = "Sure?"
type = "choice"
choices = ["yes", "no"]

[[questionnaires.questions]]
id = "words"
text = "Why?"
type = "text"
required = false
"""

ANSWERS: dict[str, Any] = {
    "instructions": {"go_on": True},
    "break": {"go_on": True},
    "ready": {"begin": True},
    "grade": {"grade": "2", "stretch": None},
    "question": {"answer": 60},
    "fault": {"again": True},
}


def small_study(
    root: Path, added: str = "", *changes: tuple[str, str], quick: bool = False
) -> StudyPaths:
    """Make a study of four models with drawn schedules; a quick one in real time.

    Changes are (old, new) texts of the protocol.
    """
    study = StudyPaths(root)
    copy_template("small", root)
    of_time = _QUICK if quick else ()
    text = study.protocol.read_text()
    for old, new in (('stretches = "free"', "stretches = 1"), *of_time, *changes):
        assert old in text
        text = text.replace(old, new)
    study.protocol.write_text(text + added)
    allot_schedules(study, read_protocol(study.protocol))
    return study


def correction(code: object, grade: str | None) -> dict[str, str | None]:
    """That a rater's grade was another one."""
    return {"code": str(code), "grade": grade, "who": "R1", "why": "wrong button"}


class Page:
    """A rater at a page, without the page: answers go to the session manager."""

    def __init__(self, manager: SessionManager, **answers: Any) -> None:
        self.manager = manager
        self.answers = {**ANSWERS, **answers}

    async def until(self, *screens: str) -> dict[str, Any]:
        """Answer until one of these screens is shown -> it."""
        while (state := self.manager.state())["screen"] not in screens:
            if state["ask"] is None:
                await self.manager.changed(state["version"])
            else:
                await self.answer(state)
        return state

    async def answer(self, state: dict[str, Any]) -> None:
        """Answer what is asked."""
        await self.manager.answer(state["ask"], self.answers[state["screen"]])


def at(
    study: StudyPaths,
    act: Callable[[SessionManager], Awaitable[None]],
    clock: Literal["real", "simulated"] = "simulated",
) -> None:
    """Run something with the session manager of a study."""

    async def run() -> None:
        manager = SessionManager(study, clock=clock)
        try:
            await asyncio.wait_for(act(manager), PATIENCE_S)
        finally:
            await manager.close()

    asyncio.run(run())


async def n_sampled(manager: SessionManager, least: int) -> None:
    """Return when a presentation has so many samples."""
    async with asyncio.timeout(PATIENCE_S):
        while manager.samples is None or samples_in(manager.samples) < least:
            await asyncio.sleep(0.002)


def samples_in(partial: Path) -> int:
    """How many samples a presentation has left so far."""
    try:
        words = partial.read_bytes()[4096:4104]
    except FileNotFoundError:
        return 0
    return int(memoryview(words).cast("d")[0]) if len(words) == 8 else 0


def logged(study: StudyPaths, *kinds: str, rater: str = "R1") -> list[dict[str, Any]]:
    """The fields of these events of a rater's log."""
    log = read_log(study.log_file(rater, "test"))
    return [dict(event.fields) for event in log if event.kind in kinds]


def kinds(study: StudyPaths) -> list[str]:
    """The kinds of events of the first rater's log."""
    return [event.kind for event in read_log(study.log_file("R1", "test"))]


async def echo(scope: Scope, receive: Receive, send: Send) -> None:
    """Answer with what a page would see of its sender."""
    await JSONResponse(scope.get("state", {}))(scope, receive, send)


class Clock:
    """Seconds that pass when a test says so."""

    def __init__(self) -> None:
        self.s = 1_000_000.0

    def __call__(self) -> float:
        return self.s


class Browser:
    """A browser at an address, with its cookies and what its page sends along."""

    def __init__(self, app: App, origin: str = ORIGIN, address: str = CLIENT[0]):
        self.app, self.origin, self.address = app, origin, address
        self.cookies, self.headers = httpx.Cookies(), httpx.Headers()

    def get(self, path: str, **headers: str) -> httpx.Response:
        """Ask for a page."""
        return self.all("GET", [path], headers=headers)[0]

    def post(self, path: str, body: Any = None, **headers: str) -> httpx.Response:
        """Send JSON as a page does, with other headers where they are named."""
        if not isinstance(body, bytes) and not hasattr(body, "__aiter__"):
            body = json.dumps(body or {}).encode()
        headers = {"Content_Type": "application/json", **headers}
        return self.all("POST", [path], headers=headers, content=body)[0]

    def all(
        self, method: str, paths: Sequence[str], **request: Any
    ) -> list[httpx.Response]:
        """Send requests one after the other."""
        named = {k.replace("_", "-"): v for k, v in request.pop("headers", {}).items()}

        async def send() -> list[httpx.Response]:
            transport = httpx.ASGITransport(self.app, client=(self.address, 50_000))
            async with httpx.AsyncClient(
                transport=transport,
                base_url=self.origin,
                headers=self.headers,
                cookies=self.cookies,
            ) as client:
                answers = [
                    await client.request(method, path, headers=named, **request)
                    for path in paths
                ]
                self.cookies = client.cookies
                return answers

        return asyncio.run(send())


class Site:
    """The pages of a study, without a server."""

    def __init__(self, root: Path, app: App = echo, *, origin: str = ORIGIN) -> None:
        self.now, self.ticks = Clock(), Clock()
        self.study = StudyPaths(root)
        root.mkdir(exist_ok=True)
        self.origin, self.inner = origin, app
        self.restart()

    def restart(self) -> None:
        """Let another server take the place of the one that was there."""
        clocks = {"now": self.now, "ticks": self.ticks}
        self.access = Access(self.study, origin=self.origin, **clocks)
        self.app = Middleware(self.inner, self.access, ticks=self.ticks)

    def browser(self, address: str = CLIENT[0]) -> Browser:
        """Return a browser that nobody has let in."""
        return Browser(self.app, self.origin, address)

    def let_in(self, role: Role = "rater", address: str = CLIENT[0]) -> Browser:
        """Return a browser that was let in, with all that its page sends."""
        browser = self.browser(address)
        assert browser.get(self.access.new_address(role)).status_code == 200
        browser.headers["X-Masrel-CSRF"] = secret_in(browser.get(f"/{role}").text)
        browser.headers["Origin"] = self.origin
        return browser


class Pages(Site):
    """A study and its pages as they are, without a server and without limits."""

    def __init__(self, study: StudyPaths) -> None:
        self.manager = SessionManager(study, clock="simulated")
        super().__init__(study.root)

    def restart(self) -> None:
        """Let another server take the place of the one that was there."""
        self.access = Access(self.study, origin=ORIGIN)
        self.app = make_app(self.manager, self.access)
        self.app._with_cookie.allow = lambda _: True  # type: ignore[method-assign]

    def routes(self, role: str, actions: Sequence[str]) -> list[tuple[str, str]]:
        """Methods and paths of what is there for a role."""
        routes = []
        for route in self.app._app.routes:  # type: ignore[attr-defined]
            path = route.path.replace("{path:path}", "report.html")
            if path.startswith(f"/{role}"):
                names = actions if "{action}" in path else ("",)
                for method in route.methods - {"HEAD"}:
                    routes += [(method, path.replace("{action}", n)) for n in names]
        return routes


def secret_in(page: str) -> str:
    secret = re.search(r'"csrf"(?: content=|:)"(\w+)"', page)
    assert secret is not None, page
    return secret[1]


class Tablet:
    """A browser at the rater's page, or the coordinator's.

    Attributes
    ----------
    sent : list of str
        What it was sent: pages, answers, events.
    """

    def __init__(
        self,
        app: App,
        access: Access,
        rater: str | None = None,
        role: Role = "rater",
        address: str | None = None,
    ) -> None:
        transport = httpx.ASGITransport(app, client=CLIENT)
        self._client = httpx.AsyncClient(transport=transport, base_url=ORIGIN)
        self._client.headers["Origin"] = ORIGIN
        self._app, self._access = app, access
        self._address = address or access.new_address(role, rater=rater)
        self._role = role
        self.sent: list[str] = []

    async def open(self) -> str:
        """Open the page -> it."""
        await self._client.get(self._address)
        page = await self._get(f"/{self._role}")
        self._client.headers["X-Masrel-CSRF"] = secret_in(page)
        return page

    def at(self, address: str) -> "Tablet":
        """Another tablet, at an address of its own."""
        return Tablet(self._app, self._access, address=address)

    async def get(self, path: str) -> httpx.Response:
        """Ask for anything."""
        return await self._client.get(path)

    async def _get(self, path: str) -> str:
        answer = await self._client.get(path)
        assert answer.status_code == 200, answer.text
        self.sent.append(answer.text)
        return answer.text

    async def state(self) -> dict[str, Any]:
        """What it shows."""
        state: dict[str, Any] = json.loads(await self._get(f"/{self._role}/state"))
        return state

    async def post(self, action: str, /, **fields: Any) -> tuple[int, dict[str, Any]]:
        """Send something as the page does -> status and body."""
        answer = await self._client.post(f"/{self._role}/{action}", json=fields)
        self.sent.append(answer.text)
        return answer.status_code, answer.json()

    async def done(self, action: str, /, **fields: Any) -> dict[str, Any]:
        """Send something that is done -> what is said of it."""
        status, body = await self.post(action, **fields)
        assert status == 200, body
        return body

    async def answer(self, state: dict[str, Any], **answer: Any) -> dict[str, Any]:
        """Answer what a state asks -> the next state."""
        return (await self.done("answer", ask=state["ask"], answer=answer))["state"]  # type: ignore[no-any-return]

    async def until(self, *screens: str) -> dict[str, Any]:
        """Answer as a rater does until one of these screens is shown -> its state."""
        while (state := await self.state())["screen"] not in screens:
            assert state["screen"] not in ("over", "other"), state
            if state["ask"] is None:
                await asyncio.sleep(0.05)
            else:
                await self.answer(state, **ANSWERS[state["screen"]])
        return state

    @asynccontextmanager
    async def listening(self) -> AsyncIterator[list[tuple[str, Any]]]:
        """Listen to events -> those that came, more and more."""
        events: list[tuple[str, Any]] = []

        async def receive() -> Message:
            await asyncio.Event().wait()
            raise AssertionError

        async def send(message: Message) -> None:
            text = message.get("body", b"").decode()
            self.sent.append(text)
            for kind, data in re.findall(r"event: (\w+)\ndata: (.*)\n\n", text):
                events.append((kind, json.loads(data)))

        request = self._client.build_request("GET", f"/{self._role}/events")
        stream = asyncio.ensure_future(self._app(scope_of(request), receive, send))
        try:
            yield events
        finally:
            stream.cancel()
            with suppress(asyncio.CancelledError):
                await stream


def scope_of(request: httpx.Request) -> Scope:
    """A request as an application gets it."""
    return {
        "type": "http",
        "method": request.method,
        "path": request.url.path,
        "query_string": b"",
        "headers": [(k.lower(), v) for k, v in request.headers.raw],
        "client": CLIENT,
        "http_version": "1.1",
    }


def with_tablets(
    study: StudyPaths,
    act: Callable[..., Awaitable[None]],
    *raters: str | None,
    clock: Literal["real", "simulated"] = "simulated",
    coordinated: bool = False,
) -> None:
    """Run something with a session manager, and tablets of these raters that are open.

    The coordinator's page comes before them.
    """

    async def run(manager: SessionManager) -> None:
        access = Access(study, origin=ORIGIN)
        app = make_app(manager, access)
        tablets = [Tablet(app, access, rater) for rater in raters]
        if coordinated:
            tablets.insert(0, Tablet(app, access, role="coordinator"))
        for tablet in tablets:
            await tablet.open()
        await act(manager, *tablets)

    at(study, run, clock)


async def seen(events: list[tuple[str, Any]], screen: str) -> dict[str, Any]:
    """Wait until a screen was announced -> its state."""
    while True:
        for kind, data in events:
            if kind == "state" and data["screen"] == screen:
                return dict(data)
        await asyncio.sleep(0.01)


class PatientManager(SessionManager):
    """A session manager that closes when a test says so."""

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
        self.access = Access(StudyPaths(root), origin=origin, hosts=frozenset(names))
        self.manager = PatientManager(StudyPaths(root))
        self.serving: asyncio.Task[bool] | None = None

    async def __aenter__(self) -> "Running":
        """Start it."""
        started = asyncio.Event()
        pages = (self.manager, self.access, self.listener, self.context)
        self.serving = asyncio.create_task(serve(*pages, show=started.set))
        waiting = asyncio.create_task(started.wait())
        await asyncio.wait([self.serving, waiting], return_when=asyncio.FIRST_COMPLETED)
        return self

    async def stopped(self, number: int = signal.SIGINT) -> bool:
        """Send a signal -> whether it ended politely."""
        assert self.serving
        os.kill(os.getpid(), number)
        return await self.serving

    async def __aexit__(self, *_: object) -> None:
        """Stop it, as Ctrl-C does."""
        if self.serving and not self.serving.done():
            assert await self.stopped()


class Served:
    """Servers of a study in other processes; each goes on with the first session."""

    def __init__(self, study: StudyPaths) -> None:
        self.study = study
        self._process: int | None = None
        # each opens a page of the server that was started last, once
        self._addresses: list[str] = []
        with listen("127.0.0.1", 0) as listener:
            self.origin = f"http://127.0.0.1:{listener.getsockname()[1]}"
        command = [sys.executable, "-m", "tests.lab.serve.pages", str(study.root)]
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
        browser.headers["X-Masrel-CSRF"] = secret_in(browser.get(f"/{role}").text)
        return browser

    def kill(self, process: int) -> None:
        """Kill a server, and return when it is no more."""
        with suppress(ProcessLookupError):  # it was killed before
            os.kill(process, signal.SIGKILL)
        while Path(f"/proc/{process}").exists():
            time.sleep(0.001)

    def close(self) -> None:
        """End the last server, and let no more start."""
        if self._process is not None:
            self.kill(self._process)
        self._forks.communicate()


def processes_of(study: StudyPaths, word: bytes = b"_session_process") -> list[int]:
    """Processes about a study whose command has a word: those of its sessions."""
    processes = []
    for folder in Path("/proc").glob("[0-9]*"):
        with contextlib.suppress(OSError):  # it ended meanwhile
            words = (folder / "cmdline").read_bytes()
            if word in words and str(study.root).encode() in words:
                processes.append(int(folder.name))
    return processes


async def _serving(study: StudyPaths, port: int) -> None:
    # serve as ``masrel serve`` does, and start the session as a coordinator does
    host = f"127.0.0.1:{port}"
    access = Access(study, origin=f"http://{host}", say=lambda _: None)

    def show() -> None:
        print(os.getpid(), *map(access.new_address, ("rater", *ROLES)), flush=True)

    manager = SessionManager(study)
    with alone(study), listen("127.0.0.1", port) as listener:
        starting = asyncio.ensure_future(manager.start("R1", "test"))
        await serve(manager, access, listener, None, show=show)
        await starting


def main(root: Path, port: int) -> None:
    """Fork a server at each line."""
    signal.signal(signal.SIGCHLD, signal.SIG_IGN)  # nobody waits for those killed
    for _ in sys.stdin:
        if os.fork() == 0:
            signal.signal(signal.SIGCHLD, signal.SIG_DFL)
            os.close(0)  # that of the process that forks
            asyncio.run(_serving(StudyPaths(root), port))
            os._exit(0)


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]))
