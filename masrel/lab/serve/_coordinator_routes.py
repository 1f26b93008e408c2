"""What the coordinator's page asks of the server."""

import asyncio
import contextlib
import json
import math
import secrets
from collections import OrderedDict
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any

from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import FileResponse, JSONResponse, Response, StreamingResponse
from starlette.routing import Route

from masrel.errors import MasrelError, ParameterError
from masrel.lab._event_log import read_log
from masrel.lab.protocol import StudyPaths, read_protocol
from masrel.lab.recording import PHASES
from masrel.lab.run._rehearsal import last_rehearsal
from masrel.lab.serve._access import Access
from masrel.lab.serve._acts import ACTS, needed, text
from masrel.lab.serve._addresses import qr_svg
from masrel.lab.serve._desk import Desk
from masrel.lab.serve._jobs import Jobs
from masrel.lab.serve._live import SampleTail
from masrel.lab.serve._overview import overview
from masrel.lab.serve._page_templates import render
from masrel.lab.serve._rater_routes import BEAT_S, event_text

_FRAME_S = 0.04  # between two frames of the live view
_EVERY = 5  # rows of the recording for one point of the live view
_N_ACTS = 1000  # of which it is known what came of them
_N_LOG = 200  # events of the running session that are shown


def coordinator_routes(desk: Desk, access: Access) -> list[Route]:
    """Return the routes of the coordinator's page, and of the report."""
    pages = _CoordinatorPages(desk, access)
    return [
        Route("/coordinator", pages.page),
        Route("/coordinator/state", pages.state),
        Route("/coordinator/events", pages.events),
        Route("/coordinator/stop", pages.stop, methods=["POST"]),
        Route("/coordinator/{act}", pages.act, methods=["POST"]),
        Route("/report/{path:path}", pages.report),
    ]


class _CoordinatorPages:
    """The coordinator's page of one study."""

    def __init__(self, desk: Desk, access: Access) -> None:
        self._desk, self._access = desk, access
        self._study = desk.study
        self.jobs = Jobs(desk.study, desk.note_change)
        desk.at_close(self.jobs.close)
        # what came of each act, by its name and all that its page sent, an id with it
        self._acts: OrderedDict[str, asyncio.Task[dict[str, Any]]] = OrderedDict()
        self._overview: dict[str, Any] = {}  # the last one that could be read

    async def page(self, request: Request) -> Response:
        """Answer with the page itself."""
        protocol = await asyncio.to_thread(read_protocol, self._study.protocol)
        return render(
            request,
            "coordinator.html",
            title=protocol.study.title,
            phases=",".join(PHASES),
        )

    async def state(self, request: Request) -> Response:  # noqa: ARG002 - as all
        """Answer with all that is shown, but the live view."""
        return JSONResponse(await self._state())

    async def _state(self) -> dict[str, Any]:
        return {
            "desk": {**self._desk.state(), "notes": self._desk.notes},
            "jobs": self.jobs.state(),
            "log": await asyncio.to_thread(self._log),
            "overview": await self._read_overview(),
        }

    async def _read_overview(self) -> dict[str, Any]:
        # a protocol that is being edited ends no stream of a session that runs
        try:
            self._overview = await asyncio.to_thread(overview, self._study)
        except (MasrelError, OSError) as error:
            if not self._overview:
                raise
            return {**self._overview, "problem": str(error)}
        return self._overview

    def _log(self) -> list[dict[str, Any]]:
        # what is in the log of the session that runs: kinds, codes and times
        file = self._log_file()
        if file is None:
            return []
        with contextlib.suppress(MasrelError, OSError):
            return [
                {
                    "event": event.kind,
                    "time_utc": event.time_utc,
                    **_shown(event.fields),
                }
                for event in read_log(file)[-_N_LOG:]
            ]
        return []

    def _log_file(self) -> Path | None:
        if self._desk.running is None:
            return None
        rater, session, is_rehearsal = self._desk.running
        if not is_rehearsal:
            return self._study.log_file(rater, session)
        if self._desk.state()["screen"] == "starting":
            return None  # the last one is another rehearsal's
        return last_rehearsal(self._study, rater, session)

    async def events(self, request: Request) -> Response:  # noqa: ARG002 - as all
        """Answer with all that is shown, each time it changes, and the live view."""
        if not self._overview:
            await self._read_overview()  # what cannot be read is refused in a sentence
        return StreamingResponse(self._changes(), media_type="text/event-stream")

    async def _changes(self) -> AsyncIterator[str]:
        yield "retry: 1000\n\n"
        parts: dict[str, Any] = {}
        version = 0
        with contextlib.closing(_LiveView()) as live:
            while True:
                if self._desk.version != version or self._desk.samples is None:
                    version, before = self._desk.version, parts
                    parts = await self._state()
                    for name, part in parts.items():
                        if before.get(name) != part:
                            yield event_text(name, part)
                if frame := live.frame(self._desk.samples):
                    yield event_text("live", frame)
                if self._desk.samples is not None:
                    await asyncio.sleep(_FRAME_S)
                    continue
                try:
                    # beside these changes the study is looked at, by other hands too
                    await asyncio.wait_for(self._desk.changed(version), BEAT_S)
                except TimeoutError:
                    yield event_text("beat", {})  # comments reach no page

    async def stop(self, request: Request) -> Response:  # noqa: ARG002 - as all
        """Press the emergency stop."""
        self._desk.stop("coordinator's page")
        return JSONResponse({"text": "The emergency stop is pressed."})

    async def act(self, request: Request) -> Response:
        """Do what the page asks, once however often it sends the same."""
        fields = await request.json()
        name = request.path_params["act"]
        if name not in (*_OWN, *ACTS):
            raise HTTPException(404)
        if not isinstance(fields.get("id"), str):  # from no page that sends it again
            fields["id"] = secrets.token_hex(8)
        sent = json.dumps([name, fields], sort_keys=True)
        if sent not in self._acts:
            self._acts[sent] = asyncio.create_task(self._done(name, fields))
            if len(self._acts) > _N_ACTS:
                self._acts.popitem(last=False)
        try:
            return JSONResponse(await asyncio.shield(self._acts[sent]))
        except MasrelError as error:
            return JSONResponse({"why": str(error)}, status_code=422)

    async def _done(self, name: str, fields: dict[str, Any]) -> dict[str, Any]:
        if name in _OWN:
            act = getattr(self, f"_{name}")
            outcome: dict[str, Any] = await act(fields)
            return outcome
        sentence = await asyncio.to_thread(self._act, name, fields)
        self._desk.note_change()
        return {"text": sentence}

    def _act(self, name: str, fields: dict[str, Any]) -> str:
        return ACTS[name](self._study, read_protocol(self._study.protocol), fields)

    async def _start(self, fields: dict[str, Any]) -> dict[str, Any]:
        rater, session = needed(fields, "rater"), needed(fields, "session")
        rehearsal = fields.get("rehearsal") is True
        await self._desk.start(rater, session, rehearsal=rehearsal)
        return {"text": f"Session {session} of {rater} is started."}

    async def _leave(self, fields: dict[str, Any]) -> dict[str, Any]:  # noqa: ARG002 - as all
        await self._desk.leave()
        return {"text": "The session is stopped; it goes on where it was."}

    async def _correct(self, fields: dict[str, Any]) -> dict[str, Any]:
        rater, session = needed(fields, "rater"), needed(fields, "session")
        code, grade = needed(fields, "code"), needed(fields, "grade")
        await self._desk.correct(
            *(rater, session, code, None if grade == "NA" else grade),
            who=needed(fields, "who"),
            why=needed(fields, "why"),
        )
        return {"text": f"{code} is corrected; what it was stays in the log."}

    async def _tablet(self, fields: dict[str, Any]) -> dict[str, Any]:
        rater = text(fields, "rater")
        protocol = await asyncio.to_thread(read_protocol, self._study.protocol)
        known = [each.id for each in protocol.raters]
        if rater is not None and rater not in known:
            raise ParameterError(
                f"rater: needed one of {', '.join(known)}, got {rater!r}"
            )
        address = self._access.new_address("rater", rater)
        picture = qr_svg(address)
        whose = "the rater of the next session" if rater is None else rater
        sentence = f"This address lets in one tablet, that of {whose}, once."
        return {"text": sentence, "address": address, "picture": picture}

    async def _job(self, fields: dict[str, Any]) -> dict[str, Any]:
        verb = needed(fields, "verb")
        if fields.get("cancel") is True:
            self.jobs.cancel(verb)
            return {"text": f"{verb} is stopped."}
        await self.jobs.start(verb)
        return {"text": f"{verb} is started."}

    async def report(self, request: Request) -> Response:
        """Answer with a file of the report that was built."""
        file = await asyncio.to_thread(
            _report_file, self._study, request.path_params["path"]
        )
        if file is None:
            raise HTTPException(404)
        return FileResponse(file)


_OWN = ("start", "leave", "correct", "tablet", "job")


def _shown(fields: Any) -> dict[str, Any]:
    # of an event: what says no model and no grade's meaning
    names = ("code", "position", "attempt", "grade", "kind", "fault", "why", "who")
    return {name: fields[name] for name in names if fields.get(name) is not None}


class _LiveView:
    """The samples of what is presented now, frame by frame."""

    def __init__(self) -> None:
        self._file: Path | None = None
        self._tail: SampleTail | None = None

    def close(self) -> None:
        """Let go of the samples."""
        if self._tail is not None:
            self._tail.close()
        self._file = self._tail = None

    def frame(self, file: Path | None) -> dict[str, Any] | None:
        """Return what is new of a presentation; None for nothing."""
        if self._tail is not None and file != self._file:
            last = _frame(self._tail)
            self.close()
            return last
        if file is None:
            return None
        if self._tail is None:
            with contextlib.suppress(OSError, ValueError):
                self._tail, self._file = SampleTail(file), file
                return {"begins": True}
            return None
        return _frame(self._tail)


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
