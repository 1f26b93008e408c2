"""The page of a role, and the rater's page."""

import asyncio
import contextlib
import json
import time
import tomllib
from collections.abc import AsyncIterator, Awaitable, Callable
from functools import cache
from pathlib import Path
from typing import Any, ClassVar

from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import (
    HTMLResponse,
    JSONResponse,
    Response,
    StreamingResponse,
)

from masrel.errors import MasrelError
from masrel.lab.protocol import read_protocol
from masrel.lab.recording import PHASES
from masrel.lab.serve._access import Access, Role
from masrel.lab.serve._live import LiveTail, SampleTail
from masrel.lab.serve._manager import (
    AnsweredError,
    AnswerRefusedError,
    AskOverError,
    SessionManager,
)
from masrel.lab.serve._middleware import page

_BEAT_S = 5.0  # a page takes a stream for lost that says nothing for three times this

_FRAME_S = 0.04  # between two looks at the samples
_PRESENTED = ("code", "position", "practice", "again")  # which presentation it is
HERE = Path(__file__).parent


@cache
def words_in(language: str) -> dict[str, str]:
    """Return the rater's words by what they are for."""
    return tomllib.loads((HERE / "words" / f"{language}.toml").read_text("utf-8"))


class Pages:
    """The page of one role: itself, what it shows, and each change of that."""

    role: ClassVar[Role]

    def __init__(self, manager: SessionManager, access: Access) -> None:
        self._manager, self._access = manager, access

    async def page(self, request: Request) -> Response:
        """Answer with the page itself."""
        file = self._manager.study.protocol
        study = (await asyncio.to_thread(read_protocol, file)).study
        return HTMLResponse(
            page(
                f"{self.role}.html",
                csrf=request.state.csrf,
                title=study.title,
                language=study.language,
                words=words_in(study.language),
                phases=",".join(PHASES),
            )
        )

    async def state(self, request: Request) -> Response:
        """Answer with what is shown."""
        return JSONResponse(await self._shown(request))

    async def events(self, request: Request) -> Response:
        """Answer with what is shown, each time it changes, and what is live."""
        await self._parts(request)  # what cannot be read is refused in a sentence
        return StreamingResponse(self._changes(request), media_type="text/event-stream")

    async def _changes(self, request: Request) -> AsyncIterator[str]:
        yield "retry: 1000\n\n"
        sent: dict[str, Any] = {}
        parts: dict[str, Any] = {}
        version, latest = 0, time.monotonic()
        with contextlib.closing(LiveTail()) as live:
            while True:
                if self._manager.version != version or self._manager.samples is None:
                    version, parts = self._manager.version, await self._parts(request)
                samples = self._followed(parts)
                news = [*parts.items(), *map(self._live, live.news(samples))]
                for name, part in news:
                    if part is not None and sent.get(name) != part:
                        yield _event_text(name, part)
                        sent[name], latest = part, time.monotonic()
                if time.monotonic() - latest >= _BEAT_S:
                    # beside these changes the study is looked at, by other hands too
                    yield _event_text("beat", {})  # comments reach no page
                    latest = time.monotonic()
                wait_s = _BEAT_S if samples is None else _FRAME_S
                with contextlib.suppress(TimeoutError):
                    await asyncio.wait_for(self._manager.changed(version), wait_s)

    async def _shown(self, request: Request) -> dict[str, Any]:
        raise NotImplementedError

    def _live(self, tail: SampleTail | None) -> tuple[str, Any]:
        # what is new of what is presented, of which None is the beginning
        raise NotImplementedError

    async def _parts(self, request: Request) -> dict[str, Any]:
        # what is shown, by the kind of event that says so
        return await self._shown(request)

    def _followed(self, parts: dict[str, Any]) -> Path | None:  # noqa: ARG002 - as all
        # the file of samples that is followed now
        return self._manager.samples


def _event_text(kind: str, data: object) -> str:
    return f"event: {kind}\ndata: {json.dumps(data, ensure_ascii=False)}\n\n"


class RaterPages(Pages):
    """The rater's page of one study; a tablet sees its own rater's sessions only."""

    role = "rater"

    def __init__(self, manager: SessionManager, access: Access) -> None:
        super().__init__(manager, access)
        # the session that runs or ran last, and the tablets that were shown it
        self._session: dict[str, Any] | None = None
        self._tablets: set[str] = set()
        self._actions: dict[str, Callable[..., Awaitable[None]]] = {
            "answer": self._answer,
            "done": self._done,
            "stop": self._stop,
            "correct": self._correct,
        }

    async def _parts(self, request: Request) -> dict[str, Any]:
        return {"state": await self._shown(request)}

    def _followed(self, parts: dict[str, Any]) -> Path | None:
        is_one = parts["state"].get("rules", {}).get("stretches", 1) == 1
        return None if is_one else self._manager.samples

    def _live(self, tail: SampleTail | None) -> tuple[str, Any]:
        if tail is not None:
            tail.new_rows()
        return "stretches", {"n_over": 0 if tail is None else tail.n_stretches_over}

    async def act(self, request: Request) -> Response:
        """Do what a tablet asks, and answer with what it shows now."""
        action = self._actions.get(request.path_params["action"])
        if action is None:
            raise HTTPException(404)
        status, why, is_answered = 200, None, False
        try:
            await action(request, request.state.fields)
        except HTTPException as error:
            status, why = error.status_code, error.detail
        except AskOverError as error:
            status, why = 409, f"{error}"
            is_answered = isinstance(error, AnsweredError)
        except MasrelError as error:
            status, why = 422, f"{error}"
        shown = {"state": await self._shown(request), "answered": is_answered}
        return JSONResponse({"why": why, **shown}, status_code=status)

    async def _answer(self, request: Request, fields: dict[str, Any]) -> None:
        # when this returns, the answer is on disk
        self._check_own(request)
        ask, answer = fields.get("ask"), fields.get("answer")
        if not isinstance(ask, str) or not isinstance(answer, dict):
            raise AnswerRefusedError("needed what is answered, and the answer")
        await self._manager.answer(ask, answer)

    async def _done(self, request: Request, fields: dict[str, Any]) -> None:
        # the rater has felt enough of what is presented
        self._check_own(request)
        state = self._manager.state()
        if state["screen"] != "presenting" or any(
            fields.get(name) != state[name] for name in _PRESENTED
        ):  # it has come late, after a connection that was lost
            raise HTTPException(409, "this is no longer presented")
        self._manager.done()

    async def _stop(self, *_: object) -> None:
        # any tablet may
        self._manager.stop("rater's page")

    async def _correct(self, request: Request, fields: dict[str, Any]) -> None:
        # the last grade of the session that runs
        last, running = (await self._shown(request)).get("last"), self._manager.running
        code, grade, why = (fields.get(name) for name in ("code", "grade", "why"))
        if running is None or not last or last["code"] != code:
            raise HTTPException(409, "this is no longer the last grade")
        if not isinstance(grade, str) or not isinstance(why, str):
            raise HTTPException(422, "needed a grade, and why it is corrected")
        rater, session, rehearsal = running
        await self._manager.correct(
            *(rater, session),
            rehearsal=rehearsal,
            code=code,
            grade=grade,
            who=rater,
            why=why,
        )

    def _check_own(self, request: Request) -> None:
        # whether what runs is a session of this tablet's rater
        running, tablet = self._manager.running, request.state.tablet
        if running is not None and not self._access.is_of_rater(tablet, running[0]):
            raise HTTPException(403, "This tablet is another rater's.")

    async def _shown(self, request: Request) -> dict[str, Any]:
        state, tablet = self._manager.state(), request.state.tablet
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
