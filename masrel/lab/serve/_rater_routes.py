"""What a rater's page asks of the server: what is shown now, and answers to it."""

import asyncio
import contextlib
import json
import time
from collections.abc import AsyncIterator
from contextlib import closing
from typing import Any

from starlette.requests import Request
from starlette.responses import JSONResponse, Response, StreamingResponse
from starlette.routing import Route

from masrel.errors import MasrelError
from masrel.lab.protocol import read_protocol
from masrel.lab.serve._access import Access
from masrel.lab.serve._desk import AnsweredError, AnswerRefusedError, AskOverError, Desk
from masrel.lab.serve._live import SampleTail
from masrel.lab.serve._page_templates import render
from masrel.lab.serve._words import words_in

BEAT_S = 5.0
"""A page takes a stream for lost that says nothing for three times this."""

_LOOK_S = 0.1  # how often it is looked whether a stretch is over

_NOT_YOURS = "This tablet is another rater's."
_PRESENTED = ("code", "position", "practice", "again")  # which presentation it is


def rater_routes(desk: Desk, access: Access) -> list[Route]:
    """Return the routes of the rater's page."""
    pages = _RaterPages(desk, access)
    return [
        Route("/rater", pages.page),
        Route("/rater/state", pages.state),
        Route("/rater/events", pages.events),
        Route("/rater/answer", pages.answer, methods=["POST"]),
        Route("/rater/done", pages.done, methods=["POST"]),
        Route("/rater/stop", pages.stop, methods=["POST"]),
        Route("/rater/correct", pages.correct, methods=["POST"]),
    ]


class _RaterPages:
    """The rater's page of one study; a tablet sees its own rater's sessions only."""

    def __init__(self, desk: Desk, access: Access) -> None:
        self._desk, self._access = desk, access
        # the session that runs or ran last, and the tablets that were shown it
        self._session: dict[str, Any] | None = None
        self._tablets: set[str] = set()

    async def page(self, request: Request) -> Response:
        """Answer with the page itself."""
        protocol = await asyncio.to_thread(read_protocol, self._desk.study.protocol)
        language = protocol.study.language
        return render(
            request,
            "rater.html",
            title=protocol.study.title,
            language=language,
            words=words_in(language),
        )

    async def state(self, request: Request) -> Response:
        """Answer with what is shown."""
        return JSONResponse(self._shown(request))

    async def events(self, request: Request) -> Response:
        """Answer with what is shown, each time it changes."""
        return StreamingResponse(self._changes(request), media_type="text/event-stream")

    async def _changes(self, request: Request) -> AsyncIterator[str]:
        yield "retry: 1000\n\n"
        shown: dict[str, Any] = {}
        while True:
            state = self._shown(request)
            if state != shown:
                shown = state
                yield event_text("state", state)
            if state.get("rules", {}).get("stretches", 1) != 1 and self._desk.samples:
                async for n_over in self._stretches():
                    yield event_text("stretches", {"n_over": n_over})
            try:
                await asyncio.wait_for(self._desk.changed(state["version"]), BEAT_S)
            except TimeoutError:
                yield event_text("beat", {})

    async def _stretches(self) -> AsyncIterator[int]:
        # how many stretches are over, while a presentation goes on
        file, before, at = self._desk.samples, -1, 0.0
        with contextlib.suppress(OSError), contextlib.ExitStack() as stack:
            tail: SampleTail | None = None
            while file is not None and self._desk.samples == file:
                if tail is None and file.exists():
                    with contextlib.suppress(FileNotFoundError, ValueError):
                        tail = stack.enter_context(closing(SampleTail(file)))
                n_over = 0
                if tail is not None:
                    tail.new_rows()
                    n_over = tail.n_stretches_over
                if n_over != before or time.monotonic() - at > BEAT_S:
                    before, at = n_over, time.monotonic()
                    yield before
                await asyncio.sleep(_LOOK_S)

    async def answer(self, request: Request) -> Response:
        """Take in an answer; when this returns, it is on disk."""
        fields = await request.json()
        ask, answer = fields.get("ask"), fields.get("answer")
        if not self._is_own(request):
            return self._response(request, 403, _NOT_YOURS)
        if not isinstance(ask, str) or not isinstance(answer, dict):
            return self._response(
                request, 422, "needed what is answered, and the answer"
            )
        try:
            await self._desk.answer(ask, answer)
        except AskOverError as error:
            is_answered = isinstance(error, AnsweredError)
            return self._response(request, 409, f"{error}", answered=is_answered)
        except AnswerRefusedError as error:
            return self._response(request, 422, f"{error}")
        return self._response(request, 200, None)

    async def done(self, request: Request) -> Response:
        """Say that the rater has felt enough of what is presented."""
        fields, state = await request.json(), self._desk.state()
        if not self._is_own(request):
            return self._response(request, 403, _NOT_YOURS)
        if state["screen"] != "presenting" or any(
            fields.get(name) != state[name] for name in _PRESENTED
        ):  # it has come late, after a connection that was lost
            return self._response(request, 409, "this is not presented any more")
        self._desk.done()
        return self._response(request, 200, None)

    async def stop(self, request: Request) -> Response:
        """Press the emergency stop: any tablet may."""
        self._desk.stop("rater's page")
        return self._response(request, 200, None)

    async def correct(self, request: Request) -> Response:
        """Correct the last grade of the session that runs."""
        fields, state = await request.json(), self._shown(request)
        last, running = state.get("last"), self._desk.running
        code, grade, why = (fields.get(name) for name in ("code", "grade", "why"))
        if running is None or not last or last["code"] != code:
            return self._response(
                request, 409, "this grade is not the last one any more"
            )
        if not isinstance(grade, str) or not isinstance(why, str):
            return self._response(
                request, 422, "needed a grade, and why it is corrected"
            )
        rater, session, rehearsal = running
        which = (rater, session, last["code"], grade)
        try:
            await self._desk.correct(*which, who=rater, why=why, rehearsal=rehearsal)
        except MasrelError as error:
            return self._response(request, 422, f"{error}")
        return self._response(request, 200, None)

    def _response(
        self, request: Request, status: int, why: str | None, **facts: bool
    ) -> Response:
        body = {"why": why, "state": self._shown(request), **facts}
        return JSONResponse(body, status_code=status)

    def _is_own(self, request: Request) -> bool:
        # whether what runs is a session of this tablet's rater
        running = self._desk.running
        return running is None or self._access.is_of_rater(
            request.state.tablet, running[0]
        )

    def _shown(self, request: Request) -> dict[str, Any]:
        state, tablet = self._desk.state(), request.state.tablet
        session = state["session"]
        if session and self._access.is_of_rater(tablet, session["rater"]):
            if session != self._session:
                self._session, self._tablets = session, set()
            self._tablets.add(tablet)
            return state
        if state["screen"] == "over" and tablet in self._tablets:
            # why it failed may be about a model
            return {key: state[key] for key in state if key not in ("text", "rater")}
        which = {name: state[name] for name in ("server", "version")}
        screen = "other" if session else "waiting"
        return {"screen": screen, "session": None, "ask": None, **which}


def event_text(kind: str, data: object) -> str:
    """Return an event of a stream."""
    return f"event: {kind}\ndata: {json.dumps(data, ensure_ascii=False)}\n\n"
