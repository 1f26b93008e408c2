"""The coordinator's page: sessions, what commands record, long work, and the report."""

import asyncio
import contextlib
import json
import math
import os
import secrets
import signal
import sys
from collections import OrderedDict, deque
from collections.abc import Awaitable, Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import FileResponse, JSONResponse, Response

from masrel.errors import MasrelError, ParameterError
from masrel.lab._event_log import read_log
from masrel.lab._study_files import read_once
from masrel.lab.conduct import (
    Note,
    allot_schedules,
    record_note,
    record_standing,
    record_unblinding,
)
from masrel.lab.conduct._study_log import check_choice, check_rater
from masrel.lab.progress import study_status
from masrel.lab.protocol import Protocol, StudyPaths, read_protocol
from masrel.lab.run._corrections import record_answer, record_day, record_skip
from masrel.lab.run._rehearsal import last_rehearsal
from masrel.lab.run._settings import torque_problems
from masrel.lab.schedule.presentation import is_sealed
from masrel.lab.serve._access import Access, qr_svg
from masrel.lab.serve._live import SampleTail
from masrel.lab.serve._manager import SessionManager
from masrel.lab.serve._role_pages import Pages

Fields = Mapping[str, Any]
"""What a page sends: texts, and booleans."""

JOBS = ("ratings", "report", "verify", "check", "plan")
"""Commands that a coordinator can start from the page."""

_EVERY = 5  # rows of the recording for one point of the live view
_N_ACTS = 1000  # of which it is known what came of them
_N_LOG = 200  # events of the running session that are shown
_N_LINES = 60
_N_BYTES = 4096
_N_EVENTS = 100
_DEVICE = (
    "backend",
    "rate_hz",
    "torque_limit_nm",
    "torque_rate_limit_nm_s",
    "speed_limit_deg_s",
    "lowest_angle_deg",
    "highest_angle_deg",
    "missed_ticks_limit",
    "watchdog_ms",
)


@dataclass(frozen=True, slots=True)
class _Action:
    """What a page and a command record: the texts it takes, and its message."""

    record: Callable[..., object]
    needed: tuple[str, ...]
    optional: Mapping[str, str | None]  # with what each is unless it is sent
    done: str  # with what it took, and what it returned as {result}


def _unblind(*where: Any, **fields: Any) -> str:
    return "; ".join(
        f"{one.code} of {schedule.rater}, session {schedule.session}, is {one.model}"
        for schedule, one in record_unblinding(*where, **fields)
    )


def _note(study: StudyPaths, protocol: Protocol, **fields: Any) -> None:
    record_note(study, protocol, Note(**fields))


_SIGNED = ("who", "why")
_SESSION = ("rater", "session")
ACTIONS = {
    "draw": _Action(
        lambda *where: len(allot_schedules(*where)),
        (),
        {},
        "All {result} schedules are drawn.",
    ),
    "note": _Action(
        _note,
        ("text", "who"),
        {
            "kind": "note",
            **dict.fromkeys((*_SESSION, "on", "severity", "seriousness")),
            **dict.fromkeys(("relatedness", "onset", "action", "outcome")),
        },
        "Recorded: {kind}.",
    ),
    "answer": _Action(
        record_answer,
        (*_SESSION, "question", *_SIGNED),
        dict.fromkeys(("answer", "code")),
        "The answer to {question} is corrected; the original stays in the log.",
    ),
    "day": _Action(
        record_day,
        (*_SESSION, "on", *_SIGNED),
        {},
        "Session {session} of {rater} was held on {on}, as is logged.",
    ),
    "skip": _Action(
        record_skip,
        (*_SESSION, "code", *_SIGNED),
        {},
        "{code} of {rater}, session {session}, is left without a grade.",
    ),
    "withdraw": _Action(
        partial(record_standing, standing="withdrawn"),
        ("rater", *_SIGNED),
        {"on": None},
        "{rater} is withdrawn; the grades given before are kept.",
    ),
    "unblind": _Action(
        _unblind, ("code", *_SIGNED), dict.fromkeys(_SESSION), "Recorded. {result}."
    ),
}
"""What is recorded of a study, by name."""


def text(fields: Fields, name: str) -> str | None:
    """Return a text that may be left out."""
    words = fields.get(name)
    if words is not None and not isinstance(words, str):
        raise ParameterError(f"{name}: needed text, got {words!r}")
    return (words or "").strip() or None


def needed(fields: Fields, *names: str) -> dict[str, Any]:
    """Return texts that are needed."""
    texts = {name: text(fields, name) for name in names}
    for name, words in texts.items():
        if words is None:
            raise ParameterError(f"{name}: needed text, got none")
    return texts


class CoordinatorPages(Pages):
    """The coordinator's page of one study, and its report."""

    role = "coordinator"

    def __init__(self, manager: SessionManager, access: Access) -> None:
        super().__init__(manager, access)
        self._study = manager.study
        self._jobs = Jobs(manager.study, manager.note_change)
        manager.at_close.append(self._jobs.close)
        self._actions: dict[str, Callable[[Fields], Awaitable[Any]]] = {
            "start": self._start,
            "leave": self._leave,
            "correct": self._correct,
            "tablet": self._tablet,
            "job": self._job,
        }
        # what came of each act, by its name and all that its page sent, an id with it
        self._acts: OrderedDict[str, asyncio.Task[dict[str, Any]]] = OrderedDict()
        self._overview: dict[str, Any] = {}  # the last one that could be read

    async def _shown(self, request: Request) -> dict[str, Any]:  # noqa: ARG002 - as all
        # a protocol that is being edited ends no stream of a session that runs
        problem = {}
        try:
            self._overview = await asyncio.to_thread(overview, self._study)
        except (MasrelError, OSError) as error:
            if not self._overview:
                raise
            problem = {"problem": str(error)}
        return {
            "desk": {**self._manager.state(), "notes": self._manager.notes},
            "jobs": self._jobs.state(),
            "log": await asyncio.to_thread(self._log),
            "overview": {**self._overview, **problem},
        }

    def _log(self) -> list[dict[str, Any]]:
        # what is in the log of the session that runs: kinds, codes and times
        if self._manager.running is None:
            return []
        rater, session, is_rehearsal = self._manager.running
        file: Path | None = self._study.log_file(rater, session)
        if is_rehearsal:
            # while one starts, the last one is another rehearsal's
            starts = self._manager.state()["screen"] == "starting"
            of_last = last_rehearsal(self._study, rater, session)
            file = None if starts else of_last
        with contextlib.suppress(MasrelError, OSError):
            events = () if file is None else read_log(file)[-_N_LOG:]
            return [
                {"event": each.kind, "time_utc": each.time_utc, **_shown(each.fields)}
                for each in events
            ]
        return []

    def _live(self, tail: SampleTail | None) -> tuple[str, Any]:
        return "live", {"begins": True} if tail is None else _frame(
            tail, is_sealed=self._overview.get("sealed", True)
        )

    async def act(self, request: Request) -> Response:
        """Do what the page asks, once however often it sends the same."""
        name, fields = request.path_params["action"], request.state.fields
        if name == "stop":
            self._manager.stop("coordinator's page")
            return JSONResponse({"text": "The emergency stop is pressed."})
        if name not in (*self._actions, *ACTIONS):
            raise HTTPException(404)
        if not isinstance(fields.get("id"), str):  # from no page that sends it again
            fields["id"] = secrets.token_hex(8)
        sent = json.dumps([name, fields], sort_keys=True)
        if sent not in self._acts:
            acting = self._done(name, fields)
            self._acts[sent] = asyncio.create_task(acting)
            if len(self._acts) > _N_ACTS:
                self._acts.popitem(last=False)
        return JSONResponse(await asyncio.shield(self._acts[sent]))

    async def report(self, request: Request) -> Response:
        """Answer with a file of the report that was built."""
        path = request.path_params["path"]
        file = await asyncio.to_thread(_report_file, self._study, path)
        if file is None:
            raise HTTPException(404)
        return FileResponse(file)

    async def _done(self, name: str, fields: Fields) -> dict[str, Any]:
        # what was done, in `text`
        if name in self._actions:
            outcome = await self._actions[name](fields)
            return outcome if isinstance(outcome, dict) else {"text": outcome}
        sentence = await asyncio.to_thread(self._record, ACTIONS[name], fields)
        self._manager.note_change()
        return {"text": sentence}

    def _record(self, action: _Action, fields: Fields) -> str:
        texts = needed(fields, *action.needed)
        texts |= {
            name: text(fields, name) or usual for name, usual in action.optional.items()
        }
        protocol = read_protocol(self._study.protocol)
        result = action.record(self._study, protocol, **texts)
        return action.done.format(**texts, result=result)

    async def _start(self, fields: Fields) -> str:
        where = needed(fields, *_SESSION)
        rehearsal = fields.get("rehearsal") is True
        await self._manager.start(**where, rehearsal=rehearsal)
        return "Session {session} of {rater} is started.".format(**where)

    async def _leave(self, fields: Fields) -> str:  # noqa: ARG002 - as all
        await self._manager.leave()
        return "The session is stopped; it can be resumed."

    async def _correct(self, fields: Fields) -> str:
        where = needed(fields, *_SESSION)
        texts = needed(fields, "code", "grade", *_SIGNED)
        if texts["grade"] == "NA":
            texts["grade"] = None
        await self._manager.correct(**where, **texts)
        return f"{texts['code']} is corrected; the original stays in the log."

    async def _tablet(self, fields: Fields) -> dict[str, Any]:
        rater = text(fields, "rater")
        if rater is not None:
            check_rater(
                await asyncio.to_thread(read_protocol, self._study.protocol), rater
            )
        address = self._access.new_address("rater", rater)
        whose = rater or "the rater of the next session"
        sentence = f"This address works once, for the tablet of {whose}."
        return {"text": sentence, "address": address, "picture": qr_svg(address)}

    async def _job(self, fields: Fields) -> str:
        command = needed(fields, "verb")["verb"]
        check_choice("job", command, JOBS)
        if fields.get("cancel") is True:
            self._jobs.cancel(command)
            return f"{command} is stopped."
        await self._jobs.start(command)
        return f"{command} is started."


def _shown(fields: Any) -> dict[str, Any]:
    # of an event: what says no model and no grade's meaning
    names = ("code", "position", "attempt", "grade", "kind", "fault", "why", "who")
    return {name: fields[name] for name in names if fields.get(name) is not None}


def _frame(tail: SampleTail, *, is_sealed: bool) -> dict[str, Any] | None:
    # of a sealed study not what is felt
    columns = ("time_s", "angle_deg", "command_torque_nm", "phase")
    rows = tail.new_rows(*columns, every=_EVERY)
    seconds, angles, torques, phases = rows.values()
    if not seconds:
        return None
    return {
        "time_s": [round(value, 3) for value in seconds],
        "angle_deg": [round(math.degrees(value), 2) for value in angles],
        "torque_nm": [0.0 if is_sealed else round(value, 3) for value in torques],
        "phase": [0 if is_sealed else int(value) for value in phases],
    }


def _report_file(study: StudyPaths, path: str) -> Path | None:
    folder = (study.root / "report").resolve()
    file = (folder / (path or "report.html")).resolve()
    return file if file.is_relative_to(folder) and file.is_file() else None


@dataclass(slots=True, eq=False)
class _Job:
    process: asyncio.subprocess.Process
    lines: deque[str] = field(default_factory=lambda: deque(maxlen=_N_LINES))
    is_cancelled: bool = False
    status: str = "running"  # then "done", "failed" or "cancelled"
    follows: "asyncio.Task[None] | None" = None


class Jobs:
    """Commands about a study, each a process of its own, one of a kind at a time."""

    def __init__(self, study: StudyPaths, changed: Callable[[], None]) -> None:
        self._study, self._changed = study, changed
        self._jobs: dict[str, _Job] = {}
        self._starting = asyncio.Lock()

    async def start(self, command: str) -> None:
        """Start a command; nothing where it runs already."""
        async with self._starting:  # two screens may ask at once
            if self._runs(command) is not None:
                return
            process = await asyncio.create_subprocess_exec(
                *(sys.executable, "-m", "masrel", command, str(self._study.root)),
                stdin=asyncio.subprocess.DEVNULL,
                stdout=asyncio.subprocess.PIPE,
                stderr=asyncio.subprocess.STDOUT,
                # Ctrl-C is for the server; it has a process group that `cancel` ends
                start_new_session=True,
            )
            self._jobs[command] = job = _Job(process)
            job.follows = asyncio.create_task(self._follow(job))
            self._changed()

    def _runs(self, command: str) -> _Job | None:
        job = self._jobs.get(command)
        return job if job is not None and job.status == "running" else None

    async def _follow(self, job: _Job) -> None:
        rest, output = "", job.process.stdout
        while output is not None and (data := await output.read(_N_BYTES)):
            *lines, rest = (rest + data.decode(errors="replace")).split("\n")
            job.lines.extend(line for line in lines if line.strip())
            self._changed()
        if rest.strip():
            job.lines.append(rest)
        ended = "done" if await job.process.wait() == 0 else "failed"
        job.status = "cancelled" if job.is_cancelled else ended
        self._changed()

    def cancel(self, command: str) -> None:
        """Stop a command that runs, and the processes that it has started."""
        if (job := self._runs(command)) is not None:
            job.is_cancelled = True
            with contextlib.suppress(ProcessLookupError):
                os.killpg(job.process.pid, signal.SIGTERM)

    def state(self) -> dict[str, dict[str, Any]]:
        """Return the status of each command, and what it has printed."""
        return {
            command: {"status": job.status, "lines": list(job.lines)}
            for command, job in self._jobs.items()
        }

    async def close(self) -> None:
        """Stop all of them."""
        for command in self._jobs:
            self.cancel(command)
        following = [job.follows for job in self._jobs.values() if job.follows]
        await asyncio.gather(*following, return_exceptions=True)


@read_once()
def overview(study: StudyPaths) -> dict[str, Any]:
    """Return sessions, raters, what happened beside them, and the device.

    By the logs; no model is named.
    """
    protocol = read_protocol(study.protocol)
    stands = study_status(study, protocol)
    return {
        **stands,
        "events": stands["events"][-_N_EVENTS:],
        "title": protocol.study.title,
        "grades": list(protocol.scale.grades),
        "questions": [
            f"{questionnaire.id}.{question.id}"
            for questionnaire in protocol.questionnaires
            for question in questionnaire.questions
        ],
        "sealed": is_sealed(study, protocol),
        "device": {name: getattr(protocol.device, name) for name in _DEVICE},
        "n_torque_problems": len(tuple(torque_problems(protocol))),
        "has_report": (study.root / "report" / "report.html").is_file(),
    }
