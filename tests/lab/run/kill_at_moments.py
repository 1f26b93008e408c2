"""Run a session in each of many copies of a study and die in it: SEED ROOT...

Each copy has a process of its own, forked from this one, that is killed by SIGKILL: at
a tick of the loop that is drawn, or, each fourth, at a call that changes a file.
"""

import os
import random
import signal
import sys
from collections.abc import Callable
from pathlib import Path

from masrel.lab.hess import SimulatedClock
from masrel.lab.protocol import StudyPaths, read_protocol
from masrel.lab.run import SimulatedGrades, run_session
from masrel.lab.run._presenter import CLOCKS

FILE_CALLS = ("write", "fsync", "replace", "ftruncate")


class Moments:
    """Counts ticks or calls, and dies at one of them."""

    def __init__(self, kind: str, fatal: int | None) -> None:
        self.kind = kind
        self.fatal = fatal
        self.n = {"tick": 0, "file": 0}

    def pass_one(self, kind: str) -> None:
        self.n[kind] += 1
        if kind == self.kind and self.n[kind] == self.fatal:
            os.kill(os.getpid(), signal.SIGKILL)


def session(root: Path, moments: Moments) -> None:
    """Run the session of the first rater."""

    class Counting(SimulatedClock):
        def sleep_until_ns(self, deadline_ns: int) -> None:
            moments.pass_one("tick")
            super().sleep_until_ns(deadline_ns)

    def counting(call: Callable[..., object]) -> Callable[..., object]:
        def counted(*arguments: object, **options: object) -> object:
            moments.pass_one("file")
            return call(*arguments, **options)

        return counted

    CLOCKS["simulated"] = Counting
    for name in FILE_CALLS:
        setattr(os, name, counting(getattr(os, name)))
    study = StudyPaths(root)
    protocol = read_protocol(study.protocol)
    grades = SimulatedGrades(protocol)
    run_session(study, protocol, "R1", "test", grades=grades, clock="simulated")


def forked(act: Callable[[], None]) -> int:
    """Run something in another process -> how that ended."""
    process = os.fork()
    if process == 0:
        act()
        os._exit(0)
    return os.waitstatus_to_exitcode(os.waitpid(process, 0)[1])


def main(seed: int, whole: Path, roots: list[Path]) -> None:
    """Count what happens in a whole session, and die in the others."""
    counts = whole / "counts"

    def count() -> None:
        moments = Moments("tick", None)
        session(whole, moments)
        counts.write_text(f"{moments.n['tick']} {moments.n['file']}")

    if forked(count):
        sys.exit("the whole session failed")
    n_ticks, n_calls = map(int, counts.read_text().split())
    drawn = random.Random(seed)
    for index, root in enumerate(roots):
        kind, last = ("file", n_calls) if index % 4 == 0 else ("tick", n_ticks)
        moments = Moments(kind, drawn.randint(1, last))
        status = forked(lambda r=root, m=moments: session(r, m))
        if status != -signal.SIGKILL:
            sys.exit(f"{root}: ended with {status}, not killed at {moments.fatal}")


if __name__ == "__main__":
    main(int(sys.argv[1]), Path(sys.argv[2]), [Path(root) for root in sys.argv[3:]])
