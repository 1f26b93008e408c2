"""A session that is really killed, at every line of its log, loses no grade."""

import json
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from masrel.protocol import Protocol, StudyPaths
from masrel.ratings import ratings_from_logs
from masrel.run import SimulatedGrades, read_log, run_session

Small = tuple[StudyPaths, Protocol]
KILLER = Path(__file__).with_name("kill_at.py")
N_LINES = 8  # session, 3 x (presented, grade), complete


def whole_lines(log: Path) -> list[bytes]:
    return log.read_bytes().split(b"\n")[:-1] if log.exists() else []


def go_on(small: Small) -> None:
    grades = SimulatedGrades(small[1])
    run_session(*small, "R1", "test", grades=grades, clock="simulated")


def killed_at(root: Path, line: int, n_bytes: int) -> None:
    command = [sys.executable, str(KILLER), str(root), str(line), str(n_bytes)]
    died = subprocess.run(command, capture_output=True, text=True)
    assert died.returncode == -signal.SIGKILL, died.stderr


@pytest.mark.parametrize("n_bytes", [0, 60])
def test_killed_at_each_line_and_gone_on_with_it_is_as_if_never_killed(
    small: Small, tmp_path: Path, n_bytes: int
) -> None:
    study, protocol = small
    # All runs go at once; each in a copy of the study.
    copies = {}
    for line in range(1, N_LINES + 1):
        copies[line] = StudyPaths(tmp_path / f"killed_{line}")
        shutil.copytree(study.root, copies[line].root)
    go_on(small)
    expected = ratings_from_logs(study, protocol)
    assert len(whole_lines(study.log_file("R1", "test"))) == N_LINES
    for line, copy in copies.items():
        killed_at(copy.root, line, n_bytes)
        log = copy.log_file("R1", "test")
        before = whole_lines(log)
        assert len(before) == line - 1
        go_on((copy, protocol))
        after = whole_lines(log)
        assert after[: len(before)] == before
        events = read_log(log)
        graded = [e.fields["code"] for e in events if e.kind == "grade"]
        assert len(graded) == len(set(graded)) == 3
        assert ("recovered" in {e.kind for e in events}) is (n_bytes > 0)
        assert ratings_from_logs(copy, protocol).table.equals(expected.table)


def test_the_command_killed_from_outside_goes_on(small: Small) -> None:
    study, protocol = small
    command = [sys.executable, "-c", "from masrel.cli import main; main()"]
    command += ["run", str(study.root), "--rater", "R1", "--session", "test"]
    command += ["--clock", "simulated", "--quiet"]
    # A person who is not asked to the end.
    with subprocess.Popen(
        command,
        stdin=subprocess.PIPE,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        text=True,
    ) as process:
        assert process.stdin is not None
        process.stdin.write("\n1+\n\n")
        process.stdin.flush()
        log = study.log_file("R1", "test")
        deadline = time.monotonic() + 60
        while len(whole_lines(log)) < 3 and time.monotonic() < deadline:
            time.sleep(0.02)
        process.kill()
    (given,) = [json.loads(x) for x in whole_lines(log) if b'"event": "grade"' in x]
    assert given["fields"]["grade"] == "1+"
    done = subprocess.run(
        command, input="\n2\n\n3\n", capture_output=True, text=True, timeout=60
    )
    assert done.returncode == 0, done.stderr
    grades = [e.fields["grade"] for e in read_log(log) if e.kind == "grade"]
    assert grades == ["1+", "2", "3"]
    assert ratings_from_logs(study, protocol).table["grade"].notna().all()
