"""Verbs that are cut off at each call that changes a file.

In this process calls of `os` are wrapped: before each, and in the middle of a write,
the folder is what a kill there would leave. With strace, the process is really killed.
"""

import errno
import hashlib
import os
import re
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest

CHANGING = ("open", "write", "fsync", "replace", "unlink", "mkdir", "chmod")
SYSCALLS = ("openat", "write", "fsync", "rename", "unlink", "mkdir", "chmod", "close")

Contents = dict[str, str]

_WRITES = os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC


def contents(root: Path) -> Contents:
    """Hashes of the files under a folder but those that are not whole yet."""
    return {
        str(path.relative_to(root)): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in root.rglob("*")
        if path.is_file() and not path.name.startswith(".masrel-")
    }


@contextmanager
def called_before(act: Callable[[str], None]) -> Iterator[None]:
    """Call `act` before each call that changes a file, writes being in two halves."""

    def wrapped(name: str, call: Callable[..., Any]) -> Callable[..., Any]:
        def instead(first: Any, *rest: Any, **named: Any) -> Any:
            if name == "open" and not rest[0] & _WRITES:
                return call(first, *rest, **named)
            act(name)
            if name == "write" and len(rest[0]) > 1:
                return call(first, rest[0][: len(rest[0]) // 2])
            return call(first, *rest, **named)

        return instead

    with pytest.MonkeyPatch.context() as patch:
        for name in CHANGING:
            patch.setattr(os, name, wrapped(name, getattr(os, name)))
        yield


@dataclass
class Cuts:
    """What kills at every call would have left of a folder."""

    root: Path
    before: Contents = field(init=False)
    left: list[Contents] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.before = contents(self.root)

    def look(self, _: str) -> None:
        self.left.append(contents(self.root))
        check_links(self.root)

    def check(self) -> None:
        """Every file is the old or the new one, at every moment."""
        check_old_or_new(self.before, self.left, contents(self.root))


def check_old_or_new(before: Contents, left: list[Contents], after: Contents) -> None:
    for moment in left:
        for path in {*before, *moment, *after}:
            assert moment.get(path) in (before.get(path), after.get(path)), path


def check_links(root: Path) -> None:
    """Every page of a report is whole, and its links lead to what it was built with."""
    for page in root.rglob("report.md"):
        text = page.read_text(encoding="utf-8")
        assert "Made by masrel" in text
        for link in re.findall(r"\]\((\S+-([0-9a-f]{16})\.png)\)", text):
            picture = (page.parent / link[0]).read_bytes()
            assert hashlib.sha256(picture).hexdigest().startswith(link[1])


@contextmanager
def full_disk_at(place: int) -> Iterator[list[str]]:
    """Let the n-th call that needs space fail; gives the calls so far."""
    calls: list[str] = []

    def fail(name: str) -> None:
        if name in ("unlink", "chmod"):
            return
        calls.append(name)
        if len(calls) == place:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with called_before(fail):
        yield calls


def masrel_command(*arguments: object) -> list[str]:
    code = "from masrel.cli import main; main()"
    return [sys.executable, "-B", "-c", code, *map(str, arguments)]


def syscalls_on(root: Path, log: Path, *arguments: object) -> list[tuple[str, int]]:
    """The calls of a verb that touch a folder: name, and count of that name so far."""
    command = ["strace", "-y", "-o", str(log), "-e", f"trace={','.join(SYSCALLS)}"]
    subprocess.run([*command, *masrel_command(*arguments)], check=True)
    counts = dict.fromkeys(SYSCALLS, 0)
    found = []
    for line in log.read_text(errors="replace").splitlines():
        name = line.partition("(")[0]
        if name in counts:
            counts[name] += 1
            if str(root) in line:
                found.append((name, counts[name]))
    return found


def killed_by_strace(name: str, place: int, *arguments: object) -> None:
    inject = f"inject={name}:signal=SIGKILL:when={place}"
    command = ["strace", "-o", os.devnull, "-e", f"trace={name}", "-e", inject]
    done = subprocess.run([*command, *masrel_command(*arguments)], capture_output=True)
    assert done.returncode == -signal.SIGKILL, (name, place)
