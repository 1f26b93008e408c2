"""Requests to the pages of a study, as browsers and attackers send them."""

import asyncio
import json
from collections.abc import Awaitable, Callable, Sequence
from pathlib import Path
from typing import Any

import httpx
from starlette.responses import JSONResponse
from starlette.types import Receive, Scope, Send

from masrel.lab.protocol import StudyPaths
from masrel.lab.serve._access import Access, Role
from masrel.lab.serve._middleware import Middleware

HOST = "127.0.0.1:8723"
ORIGIN = f"http://{HOST}"

App = Callable[[Scope, Receive, Send], Awaitable[None]]


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

    def __init__(self, app: App, origin: str, address: str) -> None:
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
        return asyncio.run(self._send(method, paths, **request))

    async def _send(
        self, method: str, paths: Sequence[str], headers: dict[str, str], **request: Any
    ) -> list[httpx.Response]:
        transport = httpx.ASGITransport(self.app, client=(self.address, 50_000))
        named = {name.replace("_", "-"): text for name, text in headers.items()}
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

    def browser(self, address: str = "10.0.0.7") -> Browser:
        """Return a browser that nobody has let in."""
        return Browser(self.app, self.origin, address)

    def let_in(self, role: Role = "rater", address: str = "10.0.0.7") -> Browser:
        """Return a browser that was let in, with all that its page sends."""
        browser = self.browser(address)
        assert browser.get(self.access.new_address(role)).status_code == 200
        state = browser.get(f"/{role}").json()
        browser.headers["X-Masrel-CSRF"] = state["csrf"]
        browser.headers["Origin"] = self.origin
        return browser
