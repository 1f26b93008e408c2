"""Run a session in each of many copies of a study and die in it by SIGKILL.

``line N_BYTES ROOT...``: in the nth copy while its nth line of the log is written,
after so many bytes of it. ``moment SEED WHOLE ROOT...``: at a tick of the loop that is
drawn, or, each fourth, at a call that changes a file, of so many as the session that is
run in WHOLE has. ``call SEED COMMAND WHOLE ROOT...``: the same of a command, in which
``{0}`` is the folder; where it has no loop always at a call that changes a file, each
other time in the middle of what is written. Each copy has a process of its own, forked
from this one.
"""

import json
import os
import random
import signal
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path

from click.testing import CliRunner

from masrel.cli import cli
from masrel.lab.hess import SimulatedClock
from masrel.lab.protocol import StudyPaths, read_protocol
from masrel.lab.run._simulated_raters import SimulatedGrades
from masrel.lab.run.session import run_session

FILE_CALLS = ("write", "fsync", "replace", "ftruncate")


def die() -> None:
    """End as a process ends whose machine loses its power."""
    os.kill(os.getpid(), signal.SIGKILL)


def die_at_line(fatal: int, n_bytes: int, die: Callable[[], object] = die) -> None:
    """Let `os.write` write some bytes of the nth line of a log, and no more ever."""
    write = os.write
    n_lines = 0

    def write_or_die(descriptor: int, data: bytes) -> int:
        nonlocal n_lines
        is_log = os.readlink(f"/proc/self/fd/{descriptor}").endswith(".jsonl")
        n_lines += is_log
        if is_log and n_lines == fatal:
            write(descriptor, bytes(data)[:n_bytes])
            die()
        return write(descriptor, data)

    os.write = write_or_die


def die_at_moment(
    kind: str, fatal: int | None, *, tears: bool = False
) -> dict[str, int]:
    """Count ticks and calls that change a file, and die at one of them -> how many."""
    n, write = {"tick": 0, "file": 0}, os.write

    def counting(of: str, call: Callable[..., object]) -> Callable[..., object]:
        def counted(*arguments: object, **options: object) -> object:
            n[of] += 1
            if of == kind and n[of] == fatal:
                if tears and call is write:
                    write(arguments[0], arguments[1][: len(arguments[1]) // 2])
                die()
            return call(*arguments, **options)

        return counted

    sleep = counting("tick", SimulatedClock.sleep_until_ns)
    SimulatedClock.sleep_until_ns = sleep  # type: ignore[method-assign,assignment]
    for name in FILE_CALLS:
        setattr(os, name, counting("file", getattr(os, name)))
    return n


def session(root: Path) -> None:
    """Run the session of the first rater."""
    study = StudyPaths(root)
    protocol = read_protocol(study.protocol)
    grades = SimulatedGrades(protocol)
    run_session(study, protocol, "R1", "test", grades=grades, clock="simulated")


def command(call: str, root: Path) -> None:
    """Call the command line; whoever it asks presses Enter."""
    done = CliRunner().invoke(cli, call.format(root).split(), input="\n" * 99)
    assert done.exit_code == 0, done.output


def forked(
    act: Callable[[Path], None], root: Path, prepare: Callable[[], object]
) -> int:
    """Do it in another process -> how that ended."""
    process = os.fork()
    if process == 0:
        n = prepare()
        act(root)
        root.with_suffix(".counts").write_text(json.dumps(n))
        os._exit(0)
    return os.waitstatus_to_exitcode(os.waitpid(process, 0)[1])


def main(mode: str, number: int, act: Callable[[Path], None], *roots: Path) -> None:
    """Die in each copy."""
    drawn, n = random.Random(number), {"tick": 0, "file": 0}
    if mode != "line":
        whole, *roots = roots
        if forked(act, whole, partial(die_at_moment, "tick", None)):
            sys.exit("the whole session failed")
        n = json.loads(whole.with_suffix(".counts").read_text())
    for index, root in enumerate(roots):
        kind = "tick" if index % 4 and n["tick"] else "file"
        how = partial(die_at_line, index + 1, number)
        if mode != "line":
            tears = mode == "call" and index % 2 == 0
            how = partial(die_at_moment, kind, drawn.randint(1, n[kind]), tears=tears)
        if (status := forked(act, root, how)) != -signal.SIGKILL:
            sys.exit(f"{root}: ended with {status}, not killed at {how}")


if __name__ == "__main__":
    mode, number, *rest = sys.argv[1:]
    act = partial(command, rest.pop(0)) if mode == "call" else session
    main(mode, int(number), act, *map(Path, rest))
