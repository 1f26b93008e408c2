"""What the rater's and the coordinator's page ask of the server, as an application."""

import asyncio
import contextlib
import json
import math
import mimetypes
import secrets
import time
import tomllib
from collections import OrderedDict
from collections.abc import AsyncIterator, Awaitable, Callable
from functools import cache
from pathlib import Path
from typing import Any, ClassVar

from starlette.applications import Starlette
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import (
    FileResponse,
    HTMLResponse,
    JSONResponse,
    Response,
    StreamingResponse,
)
from starlette.routing import Route

from masrel.errors import MasrelError
from masrel.lab._event_log import read_log
from masrel.lab.protocol import StudyPaths, read_protocol
from masrel.lab.recording import PHASES
from masrel.lab.run import GradeCorrection
from masrel.lab.run._rehearsal import last_rehearsal
from masrel.lab.serve._access import Access, Role
from masrel.lab.serve._coordinator import Coordinator, overview
from masrel.lab.serve._live import LiveTail, SampleTail
from masrel.lab.serve._manager import (
    AnsweredError,
    AnswerRefusedError,
    AskOverError,
    SessionManager,
)
from masrel.lab.serve._middleware import Middleware, page

_BEAT_S = 5.0
"""A page takes a stream for lost that says nothing for three times this."""

_FRAME_S = 0.04  # between two looks at the samples
_EVERY = 5  # rows of the recording for one point of the live view
_N_ACTS = 1000  # of which it is known what came of them
_N_LOG = 200  # events of the running session that are shown
_PRESENTED = ("code", "position", "practice", "again")  # which presentation it is
_HERE = Path(__file__).parent


def make_app(manager: SessionManager, access: Access) -> Middleware:
    """Return the application: every request passes `Middleware` first."""
    coordinator = _CoordinatorPages(manager, access)
    routes = [Route("/report/{path:path}", coordinator.report), _static()]
    for pages in (_RaterPages(manager, access), coordinator):
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
    files = {path.name: path.read_bytes() for path in (_HERE / "static").glob("*.*")}

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


@cache
def words_in(language: str) -> dict[str, Any]:
    """Return the rater's words by what they are for; ``meanings`` by scale, grade."""
    text = (_HERE / "words" / f"{language}.toml").read_text(encoding="utf-8")
    return tomllib.loads(text)


class _Pages:
    """The page of one role: itself, what it shows, and each change of that."""

    role: ClassVar[Role]

    def __init__(self, manager: SessionManager, access: Access) -> None:
        self._manager, self._access = manager, access

    async def page(self, request: Request) -> Response:
        """Answer with the page itself."""
        file = self._manager.study.protocol
        study = (await asyncio.to_thread(read_protocol, file)).study
        text = page(
            f"{self.role}.html",
            csrf=request.state.csrf,
            title=study.title,
            language=study.language,
            words=words_in(study.language),
            phases=",".join(PHASES),
        )
        return HTMLResponse(text)

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


class _RaterPages(_Pages):
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
            raise HTTPException(409, "this is not presented any more")
        self._manager.done()

    async def _stop(self, *_: object) -> None:
        # any tablet may
        self._manager.stop("rater's page")

    async def _correct(self, request: Request, fields: dict[str, Any]) -> None:
        # the last grade of the session that runs
        last, running = (await self._shown(request)).get("last"), self._manager.running
        code, grade, why = (fields.get(name) for name in ("code", "grade", "why"))
        if running is None or not last or last["code"] != code:
            raise HTTPException(409, "this grade is not the last one any more")
        if not isinstance(grade, str) or not isinstance(why, str):
            raise HTTPException(422, "needed a grade, and why it is corrected")
        rater, session, rehearsal = running
        correction = GradeCorrection(code=last["code"], grade=grade, who=rater, why=why)
        await self._manager.correct(rater, session, correction, rehearsal=rehearsal)

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


class _CoordinatorPages(_Pages):
    """The coordinator's page of one study, and its report."""

    role = "coordinator"

    def __init__(self, manager: SessionManager, access: Access) -> None:
        super().__init__(manager, access)
        self._coordinator = Coordinator(manager, access)
        # what came of each act, by its name and all that its page sent, an id with it
        self._acts: OrderedDict[str, asyncio.Task[dict[str, Any]]] = OrderedDict()
        self._overview: dict[str, Any] = {}  # the last one that could be read

    async def _shown(self, request: Request) -> dict[str, Any]:  # noqa: ARG002 - as all
        # a protocol that is being edited ends no stream of a session that runs
        problem = {}
        try:
            self._overview = await asyncio.to_thread(overview, self._manager.study)
        except (MasrelError, OSError) as error:
            if not self._overview:
                raise
            problem = {"problem": str(error)}
        return {
            "desk": {**self._manager.state(), "notes": self._manager.notes},
            "jobs": self._coordinator.jobs.state(),
            "log": await asyncio.to_thread(self._log),
            "overview": {**self._overview, **problem},
        }

    def _log(self) -> list[dict[str, Any]]:
        # what is in the log of the session that runs: kinds, codes and times
        if self._manager.running is None:
            return []
        rater, session, is_rehearsal = self._manager.running
        file: Path | None = self._manager.study.log_file(rater, session)
        if is_rehearsal:
            # while one starts, the last one is another rehearsal's
            starts = self._manager.state()["screen"] == "starting"
            of_last = last_rehearsal(self._manager.study, rater, session)
            file = None if starts else of_last
        with contextlib.suppress(MasrelError, OSError):
            events = () if file is None else read_log(file)[-_N_LOG:]
            return [
                {"event": each.kind, "time_utc": each.time_utc, **_shown(each.fields)}
                for each in events
            ]
        return []

    def _live(self, tail: SampleTail | None) -> tuple[str, Any]:
        return "live", {"begins": True} if tail is None else _frame(tail)

    async def act(self, request: Request) -> Response:
        """Do what the page asks, once however often it sends the same."""
        name, fields = request.path_params["action"], request.state.fields
        if name == "stop":
            self._manager.stop("coordinator's page")
            return JSONResponse({"text": "The emergency stop is pressed."})
        if not self._coordinator.knows(name):
            raise HTTPException(404)
        if not isinstance(fields.get("id"), str):  # from no page that sends it again
            fields["id"] = secrets.token_hex(8)
        sent = json.dumps([name, fields], sort_keys=True)
        if sent not in self._acts:
            acting = self._coordinator.act(name, fields)
            self._acts[sent] = asyncio.create_task(acting)
            if len(self._acts) > _N_ACTS:
                self._acts.popitem(last=False)
        return JSONResponse(await asyncio.shield(self._acts[sent]))

    async def report(self, request: Request) -> Response:
        """Answer with a file of the report that was built."""
        path = request.path_params["path"]
        file = await asyncio.to_thread(_report_file, self._manager.study, path)
        if file is None:
            raise HTTPException(404)
        return FileResponse(file)


def _shown(fields: Any) -> dict[str, Any]:
    # of an event: what says no model and no grade's meaning
    names = ("code", "position", "attempt", "grade", "kind", "fault", "why", "who")
    return {name: fields[name] for name in names if fields.get(name) is not None}


def _frame(tail: SampleTail) -> dict[str, Any] | None:
    columns = ("time_s", "angle_deg", "command_torque_nm", "phase")
    rows = tail.new_rows(*columns, every=_EVERY)
    seconds, angles, torques, phases = rows.values()
    if not seconds:
        return None
    return {
        "time_s": [round(value, 3) for value in seconds],
        "angle_deg": [round(math.degrees(value), 2) for value in angles],
        "torque_nm": [round(value, 3) for value in torques],
        "phase": [int(value) for value in phases],
    }


def _report_file(study: StudyPaths, path: str) -> Path | None:
    folder = (study.root / "report").resolve()
    file = (folder / (path or "report.html")).resolve()
    return file if file.is_relative_to(folder) and file.is_file() else None
