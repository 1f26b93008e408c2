"""The session manager of a study: at most one running session, and what it asks now.

Everything here runs in the event loop of the server; the session is a process of its
own, so that nothing here can be in the way of its control loop.
"""

import asyncio
import contextlib
import json
import secrets
import socket
import sys
import time
from collections import deque
from collections.abc import Awaitable, Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from masrel.errors import MasrelError, ParameterError
from masrel.lab.conduct._study_log import check_choice
from masrel.lab.protocol import StudyPaths, read_protocol
from masrel.lab.run._corrections import record_correction
from masrel.lab.run._presenter import ClockName
from masrel.lab.serve._session_process import MAX_LINE, Message, encoded

_TO_END_S = 10.0  # after a polite stop, until the process is terminated
_HELD_DOWN_S = 0.1  # within this, a button pressed again says nothing new

# Fields of a message that no page needs to see
_INNER = {"kind", "samples", "attempt", "rehearsal"}


class AskOverError(MasrelError):
    """What was answered is asked no more; somebody else may have answered."""


class AnsweredError(AskOverError):
    """Somebody else has answered, and otherwise."""


class AnswerRefusedError(MasrelError):
    """An answer is invalid; the question is asked still."""


@dataclass(slots=True, eq=False)
class _Running:
    """A session that runs, and what it last sent."""

    rater: str
    session: str
    rehearsal: bool
    process: asyncio.subprocess.Process
    reader: asyncio.StreamReader
    writer: asyncio.StreamWriter
    message: Message = field(default_factory=dict)
    since: float = 0.0  # when it came
    # at which message a button was pressed last, and when
    pressed: dict[str, tuple[Message, float]] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    # the answer to each question that was answered, and whether it is on disk
    answered: dict[str, tuple[object, "asyncio.Future[None]"]] = field(
        default_factory=dict
    )
    # those that are sent and not in the log yet, in order
    corrections: deque["asyncio.Future[None]"] = field(default_factory=deque)
    follows: "asyncio.Task[None] | None" = None

    @property
    def ask(self) -> str | None:
        """What identifies the question; the same after a restart of the server."""
        return self.message.get("ask")

    def send(self, message: Message) -> None:
        """Send a message to the process of the session."""
        if not self.writer.is_closing():
            self.writer.write(encoded(message))

    def press(self, message: Message) -> None:
        """Send what a button says; a button held down does not load the loop."""
        now = time.monotonic()
        last, when = self.pressed.get(message["kind"], (None, 0.0))
        if last is not self.message or now - when > _HELD_DOWN_S:
            self.pressed[message["kind"]] = self.message, now
            self.send(message)

    def settle(self, problem: Exception | None) -> None:
        """Tell who waits for an answer that it is on disk, or why it is not."""
        for _, future in self.answered.values():
            _end(future, problem)


class SessionManager:
    """One study: start a session, see what it asks, answer, stop.

    Attributes
    ----------
    study : StudyPaths
        Where the study is.
    version : int
        Grows with everything that pages should see.
    processors : list of int
        Those of the process of a session; if empty, those of this process.
    at_close : list of callable
        What is ended when this is closed.
    """

    def __init__(self, study: StudyPaths, *, clock: ClockName = "real") -> None:
        self.study = study
        self.version = 1
        self.processors: list[int] = []
        self.at_close: list[Callable[[], Awaitable[None]]] = []
        self._id = secrets.token_hex(4)  # by which pages know that it is another one
        self._clock = clock
        self._running: _Running | None = None
        self._latest: _Running | None = None
        self._over: Message = {"screen": "waiting"}
        self._changed = asyncio.Event()
        self._starting = asyncio.Lock()
        self._following: set[asyncio.Task[None]] = set()

    async def start(self, rater: str, session: str, *, rehearsal: bool = False) -> None:
        """Start a session, or resume it.

        Raises
        ------
        ParameterError
            If a session runs, or the protocol has no such rater or session.
        """
        async with self._starting:
            if (other := self._running) is not None:
                raise ParameterError(
                    "session: needed no other session running, "
                    f"got {other.session} of {other.rater}"
                )
            await asyncio.to_thread(_check_session, self.study, rater, session)
            running = await self._spawned(rater, session, rehearsal)
            self._running = self._latest = running
        running.follows = asyncio.create_task(self._follow(running))
        self._following.add(running.follows)
        running.follows.add_done_callback(self._following.discard)
        self.note_change()

    async def _spawned(self, rater: str, session: str, rehearsal: bool) -> _Running:
        ours, theirs = socket.socketpair()
        order = {
            "socket": theirs.fileno(),
            "study": str(self.study.root),
            "rater": rater,
            "session": session,
            "rehearsal": rehearsal,
            "clock": self._clock,
            "processors": self.processors,
        }
        with theirs:
            process = await asyncio.create_subprocess_exec(
                *(sys.executable, "-m", "masrel.lab.serve._session_process"),
                json.dumps(order),
                stdin=asyncio.subprocess.DEVNULL,
                pass_fds=(theirs.fileno(),),
                start_new_session=True,  # Ctrl-C is for the server
            )
        reader, writer = await asyncio.open_connection(sock=ours, limit=MAX_LINE)
        return _Running(rater, session, rehearsal, process, reader, writer)

    async def _follow(self, running: _Running) -> None:
        # Takes in what the session says until it is over
        with contextlib.suppress(ConnectionError, ValueError):
            while line := await running.reader.readline():
                message = json.loads(line)
                if message["kind"] == "over":
                    self._end(running, message)  # its process only has to end
                    break
                self._take_in(running, message)
        running.writer.close()
        code = await running.process.wait()
        if self._running is running:
            text = f"the process of the session ended without a message (code {code})"
            self._end(running, {"how": "failed", "text": text})

    def _end(self, running: _Running, over: Message) -> None:
        shown = {"how": over["how"], "text": over["text"], "rater": running.rater}
        self._over = {"screen": "over", **shown}
        self._running = None
        # An answer that was taken is followed by a question, or by the end.
        is_complete = over["how"] == "complete"
        running.settle(None if is_complete else AskOverError(over["text"]))
        for future in running.corrections:
            _end(future, AskOverError("the session is over"))
        self.note_change()

    def _take_in(self, running: _Running, message: Message) -> None:
        match message["kind"]:
            case "ask" | "presenting":
                running.message, running.since = message, time.monotonic()
                running.settle(None)  # what was answered is in the log
            case "refused":
                _, future = running.answered.pop(running.ask or "", (None, None))
                _end(future, AnswerRefusedError(message["why"]))
            case "corrected":
                last = running.message.get("last")  # what a page may correct
                if last and last["code"] == message["code"]:
                    running.message = {
                        **running.message,
                        "last": {**last, "grade": message["grade"]},
                    }
                _end(running.corrections.popleft(), None)
            case "not-corrected":
                _end(running.corrections.popleft(), ParameterError(message["why"]))
            case "note":
                running.notes.append(message["text"])
        self.note_change()

    def note_change(self) -> None:
        """Say that there is something new for pages."""
        self.version += 1
        self._changed.set()
        self._changed = asyncio.Event()

    async def changed(self, since: int) -> int:
        """Wait until there is a version after `since`, and return it."""
        while self.version <= since:
            await self._changed.wait()
        return self.version

    async def answer(self, ask: str, answer: Message) -> None:
        """Answer what is asked, and return when the answer is on disk.

        The same answer to the same question again does nothing more.

        Raises
        ------
        AskOverError
            If it is not asked any more, or was answered otherwise.
        AnswerRefusedError
            If it is invalid.
        """
        running = self._running
        if running is None:
            raise AskOverError("no session runs")
        if ask not in running.answered:
            if ask != running.ask:
                raise AskOverError("this is no longer asked")
            running.answered[ask] = answer, _future()
            running.send({"kind": "answer", "ask": ask, "answer": answer})
        before, future = running.answered[ask]
        if before != answer:
            raise AnsweredError("this was answered already")
        await asyncio.shield(future)

    def done(self) -> None:
        """Say that the rater has felt enough."""
        if self._running is not None:
            self._running.press({"kind": "done"})

    def stop(self, who: str) -> None:
        """Press the emergency stop."""
        if self._running is not None:
            self._running.press({"kind": "stop", "who": who})

    async def leave(self) -> None:
        """Stop the session at its next question; return when it is over."""
        running = self._running
        if running is None or running.follows is None:
            return
        running.send({"kind": "leave"})
        await asyncio.shield(running.follows)

    async def correct(
        self,
        rater: str,
        session: str,
        *,
        rehearsal: bool = False,
        **correction: Any,
    ) -> None:
        """Correct a grade, of the session that runs or of another one.

        What it should have been as `record_correction` takes it.

        Raises
        ------
        MasrelError
            As `record_correction` raises it, or if a model is presented in that session
            now.
        """
        running = self._running
        if self.running != (rater, session, rehearsal) or running is None:
            if rehearsal:
                raise ParameterError("rehearsal: needed the one that runs to correct")
            protocol = await asyncio.to_thread(read_protocol, self.study.protocol)
            where = (self.study, protocol, rater, session)
            await asyncio.to_thread(record_correction, *where, **correction)
            self.note_change()
            return
        if running.message.get("kind") != "ask":
            raise ParameterError("grade: needed a presentation that is over to correct")
        future = _future()
        running.corrections.append(future)
        running.send({"kind": "correct", **correction})
        await asyncio.shield(future)

    @property
    def running(self) -> tuple[str, str, bool] | None:
        """Rater, session and whether it is a rehearsal, of what runs."""
        if self._running is None:
            return None
        return self._running.rater, self._running.session, self._running.rehearsal

    @property
    def samples(self) -> Path | None:
        """File of the samples of the presentation that goes on, if one does."""
        running = self._running
        if running is None or running.message.get("kind") != "presenting":
            return None
        return Path(running.message["samples"])

    @property
    def notes(self) -> tuple[str, ...]:
        """Warnings of the session that runs."""
        return () if self._running is None else tuple(self._running.notes)

    def state(self) -> Message:
        """Return what a page shows: never which model is presented."""
        running = self._running
        which = {"server": self._id, "version": self.version}
        if running is None:
            return {"session": None, "ask": None, **self._over, **which}
        message = running.message or {"screen": "starting"}
        shown = {key: value for key, value in message.items() if key not in _INNER}
        if shown["screen"] == "break":
            left = 60.0 * shown["minutes"] - (time.monotonic() - running.since)
            shown["seconds_left"] = max(0.0, round(left, 1))
        shown["again"] = message.get("attempt", 1) > 1
        session = {
            "rater": running.rater,
            "session": running.session,
            "rehearsal": running.rehearsal,
        }
        return {"session": session, "ask": running.ask, **shown, **which}

    async def close(self) -> None:
        """Stop what runs: politely, and if that does not help, at once."""
        for end in self.at_close:
            await end()
        running = self._latest  # also one that is over, and whose process ends now
        if running is None or running.follows is None:
            return
        if self.samples is not None:
            self.stop("server closed")
        running.send({"kind": "leave"})
        for stop in (running.process.terminate, running.process.kill):
            with contextlib.suppress(TimeoutError):
                await asyncio.wait_for(asyncio.shield(running.follows), _TO_END_S)
                break
            with contextlib.suppress(ProcessLookupError):
                stop()
        await asyncio.gather(*self._following)  # also of one before, which ends now


def _future() -> "asyncio.Future[None]":
    # of which nobody need take the exception: who waits may be gone
    future: asyncio.Future[None] = asyncio.get_running_loop().create_future()
    future.add_done_callback(lambda done: done.cancelled() or done.exception())
    return future


def _end(future: "asyncio.Future[None] | None", problem: Exception | None) -> None:
    # what was told before stays
    if future is None or future.done():
        return
    if problem is None:
        future.set_result(None)
    else:
        future.set_exception(problem)


def _check_session(study: StudyPaths, rater: str, session: str) -> None:
    sessions = {each.id: each.raters for each in read_protocol(study.protocol).sessions}
    check_choice("session", session, sessions)
    check_choice("rater", rater, sessions[session])
