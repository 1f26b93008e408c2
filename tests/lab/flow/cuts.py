"""Verbs that are cut off at each call that changes a file.

In this process calls of `os` are wrapped: before each, and in the middle of a write,
the folder is what a kill there would leave. With strace, the process is really killed.
"""

import errno
import hashlib
import json
import os
import re
import signal
import subprocess
import sys
from collections import defaultdict
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest

from masrel.lab._event_log import Event, events_before_torn, read_log
from masrel.lab._study_files import is_cut_off
from masrel.lab.protocol import StudyPaths
from masrel.lab.schedule._secret import find_secret

NOTES = ".masrel_cache"  # of a report, beside it
CHANGING = ("open", "write", "fsync", "replace", "unlink", "mkdir", "chmod")

# Calls of the system that change a file or a folder, and those that need space
SYSCALLS = (
    *("open", "openat", "creat", "write", "writev", "pwrite64", "ftruncate"),
    *("fsync", "fdatasync", "rename", "renameat", "renameat2", "link", "symlink"),
    *("unlink", "unlinkat", "mkdir", "mkdirat", "rmdir", "chmod", "fchmod", "fchmodat"),
)
_TAKE_NONE = ("unlink", "unlinkat", "rmdir", "chmod", "fchmod", "fchmodat")
_OPENS = ("open", "openat")
_WRITES_TEXT = ("write", "writev", "pwrite64")  # which may name a folder

Contents = dict[str, str]
READY = "\n" * 99

_WRITES = os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC


def contents(root: Path) -> Contents:
    """Hashes of the files under a folder but the cache and what is not whole yet."""
    return {
        str(path.relative_to(root)): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in _whole_files(root)
    }


def events_and_contents(root: Path) -> Contents:
    """The same, of logs their events but when they were; every chain must hold."""
    logs = [path for path in _whole_files(root) if path.suffix == ".jsonl"]
    events = {
        str(log.relative_to(root)): "".join(
            f"{event.kind} {dict(event.fields)}\n"
            for event in _whole_events(log)
            if event.kind != "recovered"
        )
        for log in logs
    }
    return contents(root) | events


def _whole_events(log: Path) -> tuple[Event, ...]:
    before_torn = events_before_torn(log)  # of what was cut in the middle of a line
    return read_log(log) if before_torn is None else before_torn


def _whole_files(root: Path) -> Iterator[Path]:
    for path in root.rglob("*"):
        places = path.relative_to(root).parts
        # a cache notes when its files were written; what it holds is sealed, and held
        # by tests/lab/flow/test_report_builds.py
        left_out = any(part.startswith((".masrel-", NOTES)) for part in places)
        if path.is_file() and not left_out and path.suffix != ".torn":
            yield path


def commitment_of(root: Path) -> str:
    """What a study's secret is committed to by; fails where there is no secret."""
    key = find_secret(StudyPaths(root))
    assert key is not None
    return key.commitment


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
        self.before = events_and_contents(self.root)

    def look(self, _: str) -> None:
        self.left.append(events_and_contents(self.root))
        check_links(self.root)

    def check(self) -> None:
        """Every file is the old or the new one, at every moment."""
        check_old_or_new(self.before, self.left, events_and_contents(self.root))


def check_old_or_new(before: Contents, left: list[Contents], after: Contents) -> None:
    for moment in left:
        for path in {*before, *moment, *after}:
            old, now, new = (each.get(path) for each in (before, moment, after))
            if path.endswith(".jsonl") and now is not None and new is not None:
                assert new.startswith(now), path  # events are added one by one
                assert now.startswith(old or ""), path
            elif path.endswith("unfinished.json"):
                assert old is None, path
                assert new is None, path
            elif path.endswith("report/manifest.json"):
                assert now in (old, new, None), path  # it comes last
            else:
                assert now in (old, new), path


def check_links(root: Path) -> None:
    """A page of a report is whole, and with a manifest so is all that it links to."""
    for page in root.rglob("report.md"):
        text = page.read_text(encoding="utf-8")
        assert "Made by masrel" in text
        manifest = page.with_name("manifest.json")
        if manifest.exists():
            named = json.loads(manifest.read_bytes())["files"]
            assert {*re.findall(r"\]\((\S+\.png)\)", text)} <= {*named}
            there = contents(page.parent)
            assert {name: there.get(name) for name in named} == named
        else:
            assert is_cut_off(page.parent)


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


@dataclass(frozen=True, slots=True)
class Syscall:
    """A call of the system: its name, and which of that name in the process."""

    name: str
    place: int

    @property
    def needs_space(self) -> bool:
        return self.name not in _TAKE_NONE

    def inject(self, what: str, command: list[str]) -> subprocess.CompletedProcess[str]:
        """Run a command in which this call meets a signal or an error instead."""
        # The faster way, by which strace 6.1 injects errors, but no signals
        fast = [] if what.startswith("signal") else ["-f", "--seccomp-bpf"]
        traced = ["strace", *fast, "-o", os.devnull, "-e", f"trace={self.name}"]
        traced += ["-e", f"inject={self.name}:{what}:when={self.place}"]
        return run_ready([*traced, *command])


def run_ready(command: list[str]) -> subprocess.CompletedProcess[str]:
    """Run a command; whoever it asks presses Enter."""
    return subprocess.run(command, input=READY, capture_output=True, text=True)


def syscalls_on(root: Path, log: Path, command: list[str]) -> list[Syscall]:
    """Return the calls of a command that change anything in a folder, in order."""
    traced = ["strace", "-f", "--seccomp-bpf", "-y", "-s", "4096", "-o", str(log)]
    traced += ["-e", f"trace={','.join(SYSCALLS)}"]
    assert run_ready([*traced, *command]).returncode == 0
    counts: dict[str, int] = defaultdict(int)
    found, threads = [], set()
    lines = log.read_text(errors="replace").splitlines()
    main = lines[0].split()[0]
    for line in lines:
        thread, name = re.match(r"(\d+) +(\w*)", line).groups()
        counts[name] += thread == main
        reads = name in _OPENS and not re.search("O_WRONLY|O_RDWR|O_CREAT", line)
        target = line.partition(">")[0] if name in _WRITES_TEXT else line
        if name in SYSCALLS and str(root) in target and not reads:
            found.append(Syscall(name, counts[name]))
            threads.add(thread)
    assert threads == {main}  # the one whose calls strace counts
    return found


def killed_by_strace(syscall: Syscall, command: list[str]) -> None:
    done = syscall.inject("signal=SIGKILL", command)
    assert done.returncode == -signal.SIGKILL, (syscall, done.stderr)
