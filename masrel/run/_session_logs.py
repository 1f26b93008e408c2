"""Session logs read, verified and replayed: each once during a command."""

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path

from masrel._event_log import Event, read_log
from masrel.run._state import SessionState, replay

_Session = tuple[tuple[Event, ...], SessionState]

_memory: ContextVar[dict[Path, _Session] | None] = ContextVar("_memory", default=None)


@contextmanager
def logs_read_once() -> Iterator[None]:
    """Within it, what a log said when it was first read is what it says."""
    token = _memory.set({})
    try:
        yield
    finally:
        _memory.reset(token)


def read_session(log: Path) -> _Session:
    """Return the events of a session's log, and where the session stands."""
    memory = _memory.get()
    if memory is not None and log in memory:
        return memory[log]
    events = read_log(log)
    session = events, replay(log, events)
    if memory is not None:
        memory[log] = session
    return session
