"""Long work for a study: the verbs themselves, each as a process of its own."""

import asyncio
import contextlib
import os
import re
import signal
import sys
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from masrel.errors import ParameterError
from masrel.lab.protocol import StudyPaths

JOBS = ("ratings", "report", "verify", "check", "plan")
"""The verbs that a coordinator can start from the page."""

_N_LINES = 60
_N_BYTES = 4096
_LINE_END = re.compile(r"[\r\n]+")  # a bar of progress comes back to where it began


@dataclass(slots=True, eq=False)
class _Job:
    process: asyncio.subprocess.Process
    lines: deque[str] = field(default_factory=lambda: deque(maxlen=_N_LINES))
    code: int | None = None
    is_cancelled: bool = False


class Jobs:
    """The work that goes on and how it ended, one of a kind at a time."""

    def __init__(self, study: StudyPaths, changed: Callable[[], None]) -> None:
        self._study, self._changed = study, changed
        self._jobs: dict[str, _Job] = {}
        self._following: set[asyncio.Task[None]] = set()
        self._starting = asyncio.Lock()

    async def start(self, verb: str) -> None:
        """Start a verb; nothing where it runs already."""
        _check_verb(verb)
        async with self._starting:  # two screens may ask at once
            if verb not in self._jobs or self._jobs[verb].code is not None:
                await self._start(verb)

    async def _start(self, verb: str) -> None:
        process = await asyncio.create_subprocess_exec(
            *(sys.executable, "-m", "masrel", verb, str(self._study.root)),
            stdin=asyncio.subprocess.DEVNULL,
            stdout=asyncio.subprocess.PIPE,
            stderr=asyncio.subprocess.STDOUT,
            # Ctrl-C is for the server, and it has a process group that `cancel` ends
            start_new_session=True,
        )
        self._jobs[verb] = job = _Job(process)
        task = asyncio.create_task(self._follow(job))
        self._following.add(task)
        task.add_done_callback(self._following.discard)
        self._changed()

    async def _follow(self, job: _Job) -> None:
        rest = ""
        while job.process.stdout is not None:
            data = await job.process.stdout.read(_N_BYTES)
            if not data:
                break
            *lines, rest = _LINE_END.split(rest + data.decode(errors="replace"))
            job.lines.extend(line for line in lines if line.strip())
            self._changed()
        if rest.strip():
            job.lines.append(rest)
        job.code = await job.process.wait()
        self._changed()

    def cancel(self, verb: str) -> None:
        """Stop a verb that runs, and the processes that it has started."""
        _check_verb(verb)
        job = self._jobs.get(verb)
        if job is not None and job.code is None:
            job.is_cancelled = True
            with contextlib.suppress(ProcessLookupError):
                os.killpg(job.process.pid, signal.SIGTERM)

    def state(self) -> dict[str, dict[str, Any]]:
        """Return of each verb how it stands."""
        return {
            verb: {
                "status": _status(job),
                "lines": list(job.lines),
            }
            for verb, job in self._jobs.items()
        }

    async def close(self) -> None:
        """Stop all of them."""
        for verb in self._jobs:
            self.cancel(verb)
        await asyncio.gather(*self._following, return_exceptions=True)


def _check_verb(verb: str) -> None:
    if verb not in JOBS:
        raise ParameterError(f"job: needed one of {', '.join(JOBS)}, got {verb!r}")


def _status(job: _Job) -> str:
    if job.code is None:
        return "running"
    if job.is_cancelled:
        return "cancelled"
    return "done" if job.code == 0 else "failed"
