"""Browsers at the pages of a desk, which keep everything that they were sent."""

import asyncio
import json
import re
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager, suppress
from typing import Any, Literal

import httpx
from starlette.types import Message

from masrel.lab.protocol import StudyPaths
from masrel.lab.serve._access import Access, Role
from masrel.lab.serve._app import make_app
from masrel.lab.serve._desk import Desk
from tests.lab.serve.desks import at
from tests.lab.serve.sender import ORIGIN, App

ANSWERS: dict[str, Any] = {
    "instructions": {"go_on": True},
    "break": {"go_on": True},
    "ready": {"begin": True},
    "grade": {"grade": "2", "stretch": None},
    "question": {"answer": 60},
    "fault": {"again": True},
}


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
        transport = httpx.ASGITransport(app, client=("10.0.0.7", 50_000))
        self._client = httpx.AsyncClient(transport=transport, base_url=ORIGIN)
        self._client.headers["Origin"] = ORIGIN
        self._app, self._access = app, access
        self._address = address or access.new_address(role, rater=rater)
        self._role = role
        self.sent: list[str] = []
        self.screens: list[str] = []

    async def open(self) -> str:
        """Open the page -> it."""
        await self._client.get(self._address)
        page = await self._get(f"/{self._role}")
        token = re.search(r'name="csrf" content="(\w+)"', page)
        assert token is not None
        self._client.headers["X-Masrel-CSRF"] = token[1]
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

    async def post(self, act: str, **fields: Any) -> tuple[int, dict[str, Any]]:
        """Send something as the page does -> status and body."""
        answer = await self._client.post(f"/{self._role}/{act}", json=fields)
        self.sent.append(answer.text)
        return answer.status_code, answer.json()

    async def answer(self, state: dict[str, Any], **answer: Any) -> dict[str, Any]:
        """Answer what a state asks -> the next state."""
        status, body = await self.post("answer", ask=state["ask"], answer=answer)
        assert status == 200, body
        return dict(body["state"])

    async def until(self, *screens: str) -> dict[str, Any]:
        """Answer as a rater does until one of these screens is shown -> its state."""
        while (state := await self.state())["screen"] not in screens:
            assert state["screen"] not in ("over", "other"), state
            if state["ask"] is None:
                await asyncio.sleep(0.05)
                continue
            self.screens.append(state["screen"])
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
        scope = {
            "type": "http",
            "method": "GET",
            "path": f"/{self._role}/events",
            "query_string": b"",
            "headers": [(k.lower(), v) for k, v in request.headers.raw],
            "client": ("10.0.0.7", 50_000),
            "http_version": "1.1",
        }
        stream = asyncio.ensure_future(self._app(scope, receive, send))
        try:
            yield events
        finally:
            stream.cancel()
            with suppress(asyncio.CancelledError):
                await stream


def with_tablets(
    study: StudyPaths,
    act: Callable[..., Awaitable[None]],
    *raters: str | None,
    clock: Literal["real", "simulated"] = "simulated",
    coordinated: bool = False,
) -> None:
    """Run something with a desk, and tablets of these raters that are open.

    The coordinator's page comes before them.
    """

    async def run(desk: Desk) -> None:
        access = Access(study, origin=ORIGIN)
        app = make_app(desk, access)
        tablets = [Tablet(app, access, rater) for rater in raters]
        if coordinated:
            tablets.insert(0, Tablet(app, access, role="coordinator"))
        for tablet in tablets:
            await tablet.open()
        await act(desk, *tablets)

    at(study, run, clock)


async def seen(events: list[tuple[str, Any]], screen: str) -> dict[str, Any]:
    """Wait until a screen was announced -> its state."""
    while True:
        for kind, data in events:
            if kind == "state" and data["screen"] == screen:
                return dict(data)
        await asyncio.sleep(0.01)
