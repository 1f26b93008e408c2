"""The session of the page for coordinators, typed at a terminal by a person."""

import os
import pty
import re
import select
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from masrel.lab.protocol import StudyPaths, copy_template
from masrel.lab.run import read_log

PAGE = Path(__file__).parents[2] / "docs" / "coordinating.md"
SIMULATED = "--grades simulated"

# What is typed where the words before the cursor end so; later lines go first.
ANSWERS = {
    "stop to stop: ": "\n",
    "for their meanings): ": "2\n",
    "like a person; stop): ": "7\n",
    "as tired as can be; stop): ": "40\n",
}


def session_of_the_page() -> list[str]:
    """Return the first session of the page, as somebody at the console types it."""
    (command, *_) = re.findall(r"^\$ masrel (run .*)$", PAGE.read_text(), re.M)
    assert command.endswith(SIMULATED)
    return shlex.split(command.removesuffix(SIMULATED))


def typed(command: list[str], folder: Path) -> str:
    """Run a command in a terminal, answer what it asks, and return what was shown."""
    keyboard, screen = pty.openpty()
    words = (sys.executable, "-m", "masrel", *command)
    process = subprocess.Popen(
        words, cwd=folder, stdin=screen, stdout=screen, stderr=screen
    )
    os.close(screen)
    shown, answered = "", 0
    try:
        while select.select([keyboard], [], [], 60.0)[0]:
            try:
                shown += os.read(keyboard, 4096).decode()
            except OSError:  # the other end is closed
                break
            for words_before, answer in ANSWERS.items():
                if shown.endswith(words_before) and len(shown) > answered:
                    os.write(keyboard, answer.encode())
                    answered = len(shown) + len(answer)
        assert process.wait(60) == 0, shown
    finally:
        process.kill()
        process.wait()
        os.close(keyboard)
    return shown


@pytest.mark.slow  # a session of twelve presentations in a process of its own
def test_the_session_of_the_page_is_typed_at_a_terminal(tmp_path: Path) -> None:
    study = StudyPaths(tmp_path / "north")
    copy_template("two-sites", study.root)
    masrel = (sys.executable, "-m", "masrel")
    subprocess.run([*masrel, "schedule", study.root], check=True)
    shown = typed([*session_of_the_page(), "--clock", "simulated"], tmp_path)
    assert "Stretch the arm as often as you like" in shown
    assert shown.count("PRACTICE, no rating of the study") == 2
    assert shown.count("A break of 2 minutes") == 1
    assert "session test1 of R1 is complete: 10 grades" in shown
    assert not re.search("HM[1-4]|D0[1-6]", shown)  # no model is named
    kinds = [event.kind for event in read_log(study.log_file("R1", "test1"))]
    assert (kinds[0], kinds[-1]) == ("session", "complete")
    assert {kind: kinds.count(kind) for kind in ("grade", "answered", "practised")} == {
        "grade": 10,
        "answered": 11,
        "practised": 2,
    }
