"""What is on disk before a grade is asked for, as the system sees it."""

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from masrel.lab.protocol import Protocol, StudyPaths

_CALL = re.compile(r"(?:\d+ +)?(fsync|write)\((\d+)<([^>]*)>(.*)")


def calls_of(study: StudyPaths, tmp_path: Path) -> list[tuple[str, str, str]]:
    """Name, file and text of each sync and write of a session that is stopped."""
    log = tmp_path / "calls.txt"
    code = "from masrel.cli import main; main()"
    verb = ["run", str(study.root), "--rater", "R1", "--session", "test"]
    done = subprocess.run(
        [
            *("strace", "-f", "-y", "-s", "60", "-o", str(log)),
            *("-e", "trace=fsync,write", sys.executable, "-c", code, *verb),
            *("--clock", "simulated"),
        ],
        input="\n1\nstop\n",
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 1, done.stderr  # stopped on request
    lines = log.read_text(errors="replace").splitlines()
    matches = filter(None, map(_CALL.match, lines))
    return [(match[1], match[3], match[4]) for match in matches]


@pytest.mark.slow
def test_everything_is_synced_before_the_first_grade_is_asked(
    small: tuple[StudyPaths, Protocol], tmp_path: Path
) -> None:
    if shutil.which("strace") is None:
        pytest.skip("needs strace: it shows the calls of the system in their order")
    study, _ = small
    calls = calls_of(study, tmp_path)
    asked = next(i for i, (_, _, text) in enumerate(calls) if "Grade of" in text)
    synced = {file for name, file, _ in calls[:asked] if name == "fsync"}
    folders = {study.root, study.sessions, study.sessions / "test_R1"}
    assert synced >= {str(path) for path in folders}
    # the recording and its facts, while they had other names, and the log after them
    parts = {file for file in synced if "/test_R1/" in file}
    assert len(parts) == 2
    log = str(study.log_file("R1", "test"))
    logged = [(name, file) for name, file, _ in calls[:asked] if file == log]
    assert logged == [("write", log), ("fsync", log)] * 2  # session, presented
    last = next(i for i in range(asked, 0, -1) if calls[i][1] == log)
    assert last > max(i for i in range(asked) if calls[i][1] in parts)
    # the grade is on disk before the next presentation begins
    after = [
        call for call in calls[asked + 1 :] if call[1] == log or call[0] == "write"
    ]
    assert [(name, file) for name, file, _ in after[:2]] == logged[:2]
