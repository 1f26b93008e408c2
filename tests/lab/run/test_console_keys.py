"""Keys of a terminal during a presentation: Enter says done, all others stop it."""

import os
import pty
import select
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from masrel.lab.protocol import StudyPaths
from masrel.lab.run import read_log
from tests.lab.hess.injected import small_study

# However late a busy machine is, that shall not end the presentation.
FREE = """[device]
missed_ticks_limit = 100000
watchdog_ms = 100
stale_limit_ms = 50

[presentation]
stretches = "free"
"""


class Terminal:
    """A person at a terminal, who waits for what is shown and types."""

    def __init__(self, study: StudyPaths) -> None:
        self.keyboard, screen = pty.openpty()
        command = (sys.executable, "-m", "masrel", "run", str(study.root))
        self.session = subprocess.Popen(
            (*command, "--rater", "R1", "--session", "test", "--clock", "real"),
            stdin=screen,
            stdout=screen,
            stderr=subprocess.DEVNULL,
        )
        os.close(screen)

    def read_until(self, words: str) -> str:
        shown = b""
        while words.encode() not in shown:
            ready, _, _ = select.select([self.keyboard], [], [], 60.0)
            assert ready, shown
            shown += os.read(self.keyboard, 4096)
        return shown.decode()

    def type(self, keys: str) -> None:
        os.write(self.keyboard, keys.encode())


@contextmanager
def at_a_terminal(study: StudyPaths) -> Iterator[Terminal]:
    terminal = Terminal(study)
    try:
        yield terminal
    finally:
        terminal.session.kill()
        terminal.session.wait()
        os.close(terminal.keyboard)


def wait_for_presentation(study: StudyPaths) -> None:
    until = time.monotonic() + 60.0
    while not list(study.sessions.rglob("*.partial")):
        assert time.monotonic() < until
        time.sleep(0.002)
    time.sleep(0.1)  # until keys count


def test_enter_says_done_and_one_too_many_does_nothing(tmp_path: Path) -> None:
    study, _ = small_study(tmp_path / "study", 30.0, device=FREE)
    with at_a_terminal(study) as terminal:
        asked = terminal.read_until("stop to stop")
        assert "Stretch the arm as often as you want, then Enter says done" in asked
        terminal.type("\n")
        wait_for_presentation(study)
        terminal.type("\n\n\n")  # two too many while it ends
        terminal.read_until("Grade of")
        terminal.type("\n\n")  # and two where the grade is asked for
        terminal.type("2\n")
        shown = terminal.read_until("is complete")
        assert "is not a grade" not in shown
    log = read_log(study.log_file("R1", "test"))
    assert [event.kind for event in log] == [
        *("session", "presented", "grade", "complete")
    ]
    assert (log[1].fields["ended"], log[2].fields["grade"]) == ("done", "2")


def test_every_other_key_is_an_emergency_stop(tmp_path: Path) -> None:
    study, _ = small_study(tmp_path / "study", 30.0, device=FREE)
    with at_a_terminal(study) as terminal:
        terminal.read_until("stop to stop")
        terminal.type("\n")
        wait_for_presentation(study)
        terminal.type(" ")
        terminal.read_until("Present it again?")
        terminal.type("no\n")
        assert terminal.session.wait(60.0) == 1
    log = read_log(study.log_file("R1", "test"))
    assert [event.kind for event in log][:3] == ["session", "presented", "fault"]
    assert log[2].fields["words"] == "emergency stop: key"


def test_enter_does_not_stop_a_presentation_of_one_stretch(tmp_path: Path) -> None:
    device = FREE.partition("[presentation]")[0]
    study, _ = small_study(tmp_path / "study", 60.0, device=device)
    with at_a_terminal(study) as terminal:
        terminal.read_until("stop to stop")
        terminal.type("\n")
        wait_for_presentation(study)
        terminal.type("\n")
        terminal.read_until("Grade of")
        terminal.type("2\n")
        terminal.read_until("is complete")
    log = read_log(study.log_file("R1", "test"))
    assert (log[1].fields["ended"], log[1].fields["n_stretches"]) == ("arrived", 1)


def test_a_program_that_answers_says_done_with_an_empty_line(tmp_path: Path) -> None:
    study, _ = small_study(tmp_path / "study", 30.0, device=FREE)
    command = (sys.executable, "-u", "-m", "masrel", "run", str(study.root))
    with subprocess.Popen(
        (*command, "--rater", "R1", "--session", "test", "--clock", "real"),
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
    ) as program:
        assert program.stdin is not None
        program.stdin.write(b"\n")
        program.stdin.flush()
        wait_for_presentation(study)
        program.stdin.write(b"\n2\n")  # done, and a grade that comes early
        program.stdin.flush()
        assert program.wait(60.0) == 0
    log = read_log(study.log_file("R1", "test"))
    assert (log[1].fields["ended"], log[2].fields["grade"]) == ("done", "2")
