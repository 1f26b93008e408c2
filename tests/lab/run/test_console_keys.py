"""Keys of a terminal during a presentation: Enter says done, all others stop it."""

import os
import pty
import re
import select
import subprocess
import sys
import time
from contextlib import closing
from pathlib import Path

import pytest

from masrel.lab._event_log import read_log
from masrel.lab.protocol import StudyPaths
from tests.lab.hess.injected import small_study

# However late a busy machine is, that shall not end the presentation.
FREE = """[device]
missed_ticks_limit = 100000
watchdog_ms = 100
stale_limit_ms = 50

[presentation]
stretches = "free"
"""


RUN = ("run", "--rater", "R1", "--session", "test", "--clock", "real")


class Terminal:
    """A person at a terminal, who waits for what is shown and types."""

    def __init__(self, study: StudyPaths) -> None:
        self._keyboard, screen = pty.openpty()
        command = [sys.executable, "-m", "masrel", *RUN, str(study.root)]
        self._study, null = study, subprocess.DEVNULL
        self.session = subprocess.Popen(
            command, stdin=screen, stdout=screen, stderr=null
        )
        os.close(screen)

    def read_until(self, words: str) -> str:
        """Read until these words are shown -> all that was."""
        shown = b""
        while words.encode() not in shown:
            ready, _, _ = select.select([self._keyboard], [], [], 60.0)
            assert ready, shown
            shown += os.read(self._keyboard, 4096)
        return shown.decode()

    def type(self, keys: str) -> None:
        """Type keys; a star waits until a model is presented and keys count."""
        for part in re.split(r"(\*)", keys):
            if part == "*":
                wait_for_presentation(self._study)
            else:
                os.write(self._keyboard, part.encode())

    def close(self) -> None:
        """Go away."""
        self.session.kill()
        self.session.wait()
        os.close(self._keyboard)


def wait_for_presentation(study: StudyPaths) -> None:
    until = time.monotonic() + 60.0
    while not list(study.sessions.rglob("*.partial")):
        assert time.monotonic() < until
        time.sleep(0.002)
    time.sleep(0.1)  # until keys count


ONE = FREE.partition("[presentation]")[0]
CUED = FREE.replace('"free"', '["slow", "fast"]\nslow_speed_deg_s = 60.0')
FAST = "Stretch 2: fast, at least 120 deg/s (V3)"
ASKED = "Stretch the arm as often as you want, then press Enter"


@pytest.mark.parametrize(
    ("device", "asked", "typed", "shown", "answer", "end"),
    [
        # two Enters too many while it ends, and two where the grade is asked for
        (FREE, ASKED, "\n*\n\n\n", ["Grade of"], "\n\n2\n", ("done", "2")),
        (FREE, ASKED, "\n* ", ["Present it again?"], "no\n", "emergency stop: key"),
        (ONE, "Enter to begin", "\n*\n", ["Grade of"], "2\n", ("arrived", "2")),
        # the next cue is shown when a stretch is over
        (CUED, "slow", "\n", [FAST, "Grade of"], "2\n", ("stretches", "2")),
    ],
)
def test_enter_says_done_and_every_other_key_is_an_emergency_stop(
    tmp_path: Path,
    device: str,
    asked: str,
    typed: str,
    shown: list[str],
    answer: str,
    end: tuple[str, str] | str,
) -> None:
    speed = 30.0 if device == FREE else 90.0  # deg/s
    study, _ = small_study(tmp_path / "study", speed, device=device)
    with closing(Terminal(study)) as terminal:
        assert asked in terminal.read_until("or type stop")
        terminal.type(typed)
        for words in shown:
            terminal.read_until(words)
        terminal.type(answer)
        said = terminal.read_until("is complete") if end[0] != "e" else ""
        assert "is not a grade" not in said
        assert terminal.session.wait(60.0) == (end[0] == "e")
    log = read_log(study.log_file("R1", "test"))
    kinds = [event.kind for event in log]
    if isinstance(end, str):
        assert kinds[:3] == ["session", "presented", "fault"]
        assert log[2].fields["words"] == end
    else:
        assert kinds == ["session", "presented", "grade", "complete"]
        assert (log[1].fields["ended"], log[2].fields["grade"]) == end


def test_a_program_that_answers_says_done_with_an_empty_line(tmp_path: Path) -> None:
    study, _ = small_study(tmp_path / "study", 30.0, device=FREE)
    with subprocess.Popen(
        [sys.executable, "-u", "-m", "masrel", *RUN, str(study.root)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        bufsize=0,
    ) as program:
        assert program.stdin is not None
        program.stdin.write(b"\n")
        wait_for_presentation(study)
        program.stdin.write(b"\n2\n")  # done, and a grade that comes early
        assert program.wait(60.0) == 0
    log = read_log(study.log_file("R1", "test"))
    assert (log[1].fields["ended"], log[2].fields["grade"]) == ("done", "2")
