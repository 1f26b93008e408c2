"""Run a session and die by SIGKILL at one line of its log: ROOT LINE N_BYTES.

The process dies while it writes the given line, after that many bytes of it.
"""

import os
import signal
import sys
from pathlib import Path

from masrel.lab.protocol import StudyPaths, read_protocol
from masrel.lab.run import SimulatedGrades, run_session


def die_at(fatal_line: int, n_bytes: int) -> None:
    """Let `os.write` write some bytes of its n-th line, and no more ever."""
    write = os.write
    n_lines = 0

    def write_or_die(descriptor: int, data: bytes) -> int:
        nonlocal n_lines
        n_lines += os.readlink(f"/proc/self/fd/{descriptor}").endswith(".jsonl")
        if n_lines == fatal_line:
            write(descriptor, bytes(data)[:n_bytes])
            os.kill(os.getpid(), signal.SIGKILL)
        return write(descriptor, data)

    os.write = write_or_die


def main(root: Path, fatal_line: int, n_bytes: int) -> None:
    """Run a session that dies."""
    die_at(fatal_line, n_bytes)
    study = StudyPaths(root)
    protocol = read_protocol(study.protocol)
    grades = SimulatedGrades(protocol)
    run_session(study, protocol, "R1", "test", grades=grades, clock="simulated")


if __name__ == "__main__":
    main(Path(sys.argv[1]), int(sys.argv[2]), int(sys.argv[3]))
