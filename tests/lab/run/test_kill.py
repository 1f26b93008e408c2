"""A session that is really killed, at every line of its log, loses no grade."""

import json
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from masrel.lab._event_log import Event, read_log
from masrel.lab.protocol import Protocol, StudyPaths
from masrel.lab.ratings import ratings_from_logs
from masrel.lab.recording import read_recording
from masrel.lab.run._simulated_raters import SimulatedGrades
from masrel.lab.run.session import run_session
from masrel.lab.verification import verify_study
from tests.faults import Faults

Small = tuple[StudyPaths, Protocol]
KILLER = Path(__file__).with_name("kill_at.py")
OCCASIONS = (
    "[schedule]",
    """
[occasions]
instructions = "Hold the wrist."
practice = ["HM3"]
break_after = 2

[[questionnaires]]
id = "each"
title = "This one"
when = "presentation"
[[questionnaires.questions]]
id = "sure"
text = "How sure are you?"
type = "visual-analogue"

[[questionnaires]]
id = "realism"
title = "Realism"
when = "session"
[[questionnaires.questions]]
id = "score"
text = "How real did it feel?"
type = "whole"
low = 1
high = 10

[schedule]""",
)
KINDS = [
    *("session", "instructed", "practised", "practice-grade"),
    *("presented", "grade", "answered") * 2,
    *("break", "presented", "grade", "answered", "answered", "complete"),
]


def whole_lines(log: Path) -> list[bytes]:
    return log.read_bytes().split(b"\n")[:-1] if log.exists() else []


def ratings_of(study: StudyPaths, protocol: Protocol) -> pd.DataFrame:
    # but for when, and in which attempt, which a kill may change
    table = ratings_from_logs(study, protocol).table
    return table.drop(columns=["graded_at", "n_attempts"])


def go_on(small: Small) -> None:
    grades = SimulatedGrades(small[1])
    run_session(*small, "R1", "test", grades=grades, clock="simulated")


def killed(
    small: Small, folder: Path, mode: str, number: int, n_copies: int
) -> list[StudyPaths]:
    """Copies of a study whose session was killed; of moments the first is whole."""
    copies = [StudyPaths(folder / f"killed_{n}") for n in range(n_copies)]
    for copy in copies:
        shutil.copytree(small[0].root, copy.root)
    roots = [str(copy.root) for copy in copies]
    command = [sys.executable, str(KILLER), mode, str(number), *roots]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return copies


def gone_on_with(
    copy: StudyPaths, protocol: Protocol, expected: pd.DataFrame
) -> tuple[int, tuple[Event, ...], set[str]]:
    """Go on with a session that was killed -> lines it had, its events, recordings."""
    log = copy.log_file("R1", "test")
    before = whole_lines(log)
    go_on((copy, protocol))
    assert whole_lines(log)[: len(before)] == before
    events = read_log(log)
    # every recording is in the log, also of a presentation that was not logged
    named = {str(e.fields.get("recording")) for e in events} - {"None"}
    assert named == {f"test_R1/{f.name}" for f in copy.sessions.glob("*/*.npz")}
    assert not list(copy.sessions.glob("*/*.partial"))
    assert ratings_of(copy, protocol).equals(expected)
    return len(before), events, named


@pytest.mark.slow
@pytest.mark.faults
@pytest.mark.parametrize("n_bytes", [0, 60])
def test_killed_at_each_line_and_gone_on_with_it_is_as_if_never_killed(
    new_study: Callable[..., Small], tmp_path: Path, n_bytes: int, faults: Faults
) -> None:
    study, protocol = small = new_study(OCCASIONS)
    copies = killed(small, tmp_path, "line", n_bytes, len(KINDS))
    go_on(small)
    expected = ratings_of(study, protocol)
    whole = read_log(study.log_file("R1", "test"))
    assert [event.kind for event in whole] == KINDS
    for line, copy in enumerate(copies, start=1):
        with faults("a session killed at each line of its log, and gone on with"):
            n_before, events, recordings = gone_on_with(copy, protocol, expected)
            assert n_before == line - 1
            for kind in ("grade", "practice-grade", "answered", "break", "instructed"):
                assert facts(events, kind) == facts(whole, kind)
            assert ("recovered" in {e.kind for e in events}) is (n_bytes > 0)
            presented = ("presented", "practised", "grade", "practice-grade")
            assert len(recordings) == 4 + (KINDS[line - 1] in presented)
            assert verify_study(copy).is_whole


def facts(events: Sequence[Event], kind: str) -> list[object]:
    # what events of a kind say, in order
    return [dict(event.fields) for event in events if event.kind == kind]


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


def n_kept(study: StudyPaths) -> dict[str, int]:
    """Samples of presentations that go on, by the file that will have them."""
    kept = {}
    for partial in study.sessions.glob("*/*.partial"):
        words = partial.read_bytes()[4096:4104]
        if not partial.with_suffix(".npz").exists() and len(words) == 8:
            kept[partial.stem] = int(np.frombuffer(words)[0])
    return kept


def test_killed_in_the_middle_of_a_presentation_its_recording_is_kept(
    new_study: Callable[..., Small],
) -> None:
    # However late a busy machine is, that shall not end the presentation.
    lenient = "[device]\nmissed_ticks_limit = 100000\nwatchdog_ms = 100.0\n\n[schedule]"
    small = new_study(("[schedule]", lenient))
    study, protocol = small
    command = [sys.executable, "-c", "from masrel.cli import main; main()"]
    command += ["run", str(study.root), "--rater", "R1", "--session", "test"]
    command += ["--grades", "simulated", "--clock", "real", "--quiet"]
    log = study.log_file("R1", "test")
    with subprocess.Popen(command, stderr=subprocess.DEVNULL) as process:
        deadline = time.monotonic() + 60
        while sum(n_kept(study).values()) < 50 and time.monotonic() < deadline:
            time.sleep(0.01)
        process.kill()
    n_before = len(whole_lines(log))
    go_on(small)
    events = read_log(log)
    kinds = [event.kind for event in events[n_before:]]
    assert kinds[:5] == ["resumed", "presented", "fault", "presented", "grade"]
    shown, fault = events[n_before + 1], events[n_before + 2]
    assert fault.fields["kind"] == "process"
    recording = read_recording(study.sessions / str(shown.fields["recording"]))
    assert recording.n_samples >= 50
    assert np.all(np.diff(recording.columns["time_s"]) > 0.0)
    assert not list(study.sessions.glob("*/*.partial"))
    assert ratings_from_logs(study, protocol).table["grade"].notna().all()


FREE = ("[schedule]", '[presentation]\nstretches = "free"\n\n[schedule]')


@pytest.mark.parametrize(
    "n_kills",
    [
        pytest.param(7, marks=pytest.mark.slow),
        pytest.param(300, marks=[pytest.mark.long, pytest.mark.faults]),
    ],
)
def test_killed_at_any_moment_of_many_stretches_nothing_that_was_logged_is_lost(
    new_study: Callable[..., Small], tmp_path: Path, n_kills: int, faults: Faults
) -> None:
    _, protocol = small = new_study(OCCASIONS, FREE)
    whole, *copies = killed(small, tmp_path, "moment", n_kills, n_kills + 1)
    expected = ratings_of(whole, protocol)
    assert expected["n_stretches"].max() > 1
    n_cut = 0
    for copy in copies:
        with faults("a session killed at a random moment, and gone on with"):
            kept = n_kept(copy)
            _, events, _ = gone_on_with(copy, protocol, expected)
            graded = [e.fields["code"] for e in events if e.kind == "grade"]
            assert len(graded) == len(set(graded)) == 3
            for stem, n_samples in kept.items():
                if n_samples > 0:  # else it had not begun
                    file = copy.sessions / "test_R1" / f"{stem}.npz"
                    assert read_recording(file).n_samples == n_samples
                    n_cut += 1
    assert n_cut > n_kills / 2
