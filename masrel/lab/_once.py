"""Files and protocols that many parts of a command ask about: each answered once."""

import functools
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path
from typing import Any, TypeVar

_About = TypeVar("_About")
_Answer = TypeVar("_Answer")

_memory: ContextVar[dict[Any, Any] | None] = ContextVar("_memory", default=None)


@contextmanager
def read_once() -> Iterator[None]:
    """Within it, what a file said when it was first read is what it says."""
    memory = _memory.get()  # one within another remembers with it
    token = _memory.set({} if memory is None else memory)
    try:
        yield
    finally:
        _memory.reset(token)


def once(answer: Callable[[_About], _Answer]) -> Callable[[_About], _Answer]:
    """Remember within `read_once` what a function said of a path, or of an object."""

    @functools.wraps(answer)
    def remembered(about: _About) -> _Answer:
        memory = _memory.get()
        if memory is None:
            return answer(about)
        key = answer, str(about) if isinstance(about, Path) else id(about)
        if key not in memory:
            memory[key] = about, answer(about)  # nothing else gets its id meanwhile
        result: _Answer = memory[key][1]
        return result

    return remembered
