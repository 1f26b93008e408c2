"""A session presents, asks and logs; stopped anywhere, it goes on there."""

import csv
import errno
import hashlib
import io
import os
import signal
from collections.abc import Callable
from contextlib import nullcontext
from itertools import pairwise
from pathlib import Path
from typing import Literal

import msgspec
import numpy as np
import pytest

from masrel.errors import (
    DeviceError,
    ParameterError,
    ScheduleError,
    SessionLogError,
    SessionStoppedError,
)
from masrel.lab._event_log import read_log
from masrel.lab.hess import SimulatedClock
from masrel.lab.protocol import DeviceSettings, Protocol, StudyPaths
from masrel.lab.ratings import ratings_from_logs
from masrel.lab.recording import MEASURED_TORQUE, RECORDING_COLUMNS, read_recording
from masrel.lab.run._corrections import record_correction
from masrel.lab.run._grade_sources import GradeRequest, GradeSource
from masrel.lab.run._simulated_raters import SimulatedGrades
from masrel.lab.run.console import ConsoleGrades
from masrel.lab.run.session import SessionSummary, run_session
from masrel.lab.schedule.presentation import read_schedule
from masrel.scales import MODIFIED_ASHWORTH, Scale
from tests.lab.script import ScriptGrades

Small = tuple[StudyPaths, Protocol]


def run(small: Small, grades: GradeSource, **options: object) -> SessionSummary:
    return run_session(
        *small,
        "R1",
        "test",
        grades=grades,
        clock="simulated",
        **options,  # type: ignore[arg-type]
    )


def events(small: Small) -> list[str]:
    return [event.kind for event in read_log(small[0].log_file("R1", "test"))]


def console(answers: str | io.StringIO) -> tuple[ConsoleGrades, io.StringIO]:
    typed = io.StringIO(answers) if isinstance(answers, str) else answers
    said = io.StringIO()
    return ConsoleGrades(MODIFIED_ASHWORTH, answers=typed, questions=said), said


def test_a_session_logs_each_presentation_and_its_grade(small: Small) -> None:
    study, _ = small
    summary = run(small, ScriptGrades(["1", "1+", "3"]))
    assert summary.n_presentations == 3
    assert summary.simulated
    assert events(small) == ["session", *["presented", "grade"] * 3, "complete"]
    schedule = read_schedule(study.schedule_file("R1", "test"))
    log = read_log(study.log_file("R1", "test"))
    for shown, presented, grade in zip(
        schedule.presentations, log[1::2], log[2::2], strict=False
    ):
        assert presented.fields["code"] == grade.fields["code"] == shown.code
        file = study.log_file("R1", "test").with_suffix("") / f"{shown.code}.npz"
        assert study.sessions / str(presented.fields["recording"]) == file
        assert (
            presented.fields["sha256"] == hashlib.sha256(file.read_bytes()).hexdigest()
        )
        facts = read_recording(file).facts
        assert (facts["model"], facts["simulated"]) == (shown.model, True)
        assert facts["mean_speed_deg_s"] == presented.fields["mean_speed_deg_s"]
    assert [e.fields["grade"] for e in log if e.kind == "grade"] == ["1", "1+", "3"]
    assert log[0].fields["simulated"] is True
    before, done = study.log_file("R1", "test").read_bytes(), list[str]()
    run(small, ScriptGrades([]), progress=lambda shown: done.append(shown.code))
    assert study.log_file("R1", "test").read_bytes() == before
    assert len(done) == 3


class Interrupted(io.StringIO):
    """A terminal where Ctrl-C is pressed after so many lines."""

    def readline(self, size: int | None = -1) -> str:  # type: ignore[override]
        if not (line := super().readline(size)):
            raise KeyboardInterrupt
        return line


@pytest.mark.parametrize(
    ("answers", "why"),
    [
        (io.StringIO("\n1\n\nstop\n"), "on request"),
        (io.StringIO("\n1\n\n"), "by the end of its input"),
        (Interrupted("\n1\n\n"), "by an interrupt"),
    ],
)
def test_a_stopped_session_goes_on_where_it_stopped(
    small: Small, answers: io.StringIO, why: str
) -> None:
    with pytest.raises(SessionStoppedError, match=f"{why} at presentation 2 of 3"):
        run(small, console(answers)[0])
    source, said = console("\n2\n\n3\n")
    run(small, source)
    assert "Presentation 1 of 3" not in said.getvalue()
    assert "Presentation 2 of 3" in said.getvalue()
    assert events(small) == [
        *("session", "presented", "grade", "presented", "stopped"),
        *("resumed", "presented", "grade", "presented", "grade", "complete"),
    ]
    log = read_log(small[0].log_file("R1", "test"))
    again = log[6].fields
    assert (again["attempt"], again["code"]) == (2, log[3].fields["code"])
    assert again["recording"] == f"test_R1/{again['code']}-2.npz"
    both = [small[0].sessions / str(log[i].fields["recording"]) for i in (3, 6)]
    assert all(path.is_file() for path in both)


def test_a_person_asks_what_grades_mean_feels_it_again_and_types_wrongly(
    small: Small,
) -> None:
    source, said = console("\n?\n1 +\n5\n\n1+\n\nagain\n\n2\n\n3\n")
    run(small, source)
    text = said.getvalue()
    for words in (
        "stop; ? for their meanings): ",
        "  1+  tone slightly up: a catch, then",
        "Phys Ther 1987",
        "'1 +' is not a grade: needed one of 0, 1, 1+, 2, 3, 4.",
        "again. Press Enter to begin",
    ):
        assert words in text
    assert text.count("is not a grade") == 2
    rated = ["presented", "grade"]
    assert events(small)[1:-1] == [*rated, "presented", *rated, *rated]
    log = read_log(small[0].log_file("R1", "test"))
    assert [e.fields["grade"] for e in log if e.kind == "grade"] == ["1+", "2", "3"]


def test_a_study_has_its_own_words_for_grades(small: Small) -> None:
    scale, said = Scale(name="our own", grades=("1", "2", "3")), io.StringIO()
    streams = {"answers": io.StringIO("\n?\n1\n\n2\n\n3\n"), "questions": said}
    run(small, ConsoleGrades(scale, anchors={"2": "a catch"}, **streams))
    assert "): In the words of this study:\n  2   a catch\nGrade of" in said.getvalue()


def test_faults_are_logged_with_the_data_before_them_and_stop_the_session_after_three(
    faulty: Small,
) -> None:
    with pytest.raises(DeviceError, match=r"presentation 1, code .*speed"):
        run(faulty, SimulatedGrades(faulty[1]))
    assert events(faulty) == ["session", *["presented", "fault"] * 3]
    log = read_log(faulty[0].log_file("R1", "test"))
    assert [event.fields["attempt"] for event in log[1:]] == [1, 1, 2, 2, 3, 3]
    for shown, fault in zip(log[1::2], log[2::2], strict=True):
        assert "speed" in str(shown.fields["fault"])
        recording = read_recording(faulty[0].sessions / str(shown.fields["recording"]))
        assert (
            recording.facts["fault"] == shown.fields["fault"] == fault.fields["words"]
        )
        assert fault.fields["kind"] == "speed"
        rows = list(csv.DictReader(io.StringIO(str(fault.fields["last_200_ms"]))))
        time_s = recording.columns["time_s"]
        assert rows[0].keys() == set(RECORDING_COLUMNS)
        assert len(rows) == np.sum(time_s >= float(fault.fields["time_s"]) - 0.2)
        for name in RECORDING_COLUMNS:
            logged = [float(row[name]) for row in rows]
            kept = recording.columns[name][-len(rows) :]
            np.testing.assert_allclose(logged, kept, atol=0.0051)
        assert float(rows[-1]["command_torque_nm"]) == 0.0


def test_a_person_decides_whether_to_try_again_after_a_fault(faulty: Small) -> None:
    source, said = console("\nyes\n\nperhaps\nno\n")
    with pytest.raises(DeviceError, match="stopped by a fault"):
        run(faulty, source)
    assert events(faulty) == ["session", *["presented", "fault"] * 2]
    assert said.getvalue().count("Present it again? (yes, no, or skip and why): ") == 3


@pytest.mark.parametrize(
    ("n_left", "words"),
    [
        (None, r"is gone or empty, and there are recordings in .*2 more"),
        (0, r"is gone or empty, and there are recordings in .*2 more"),
        (5, r"does not name recordings in .*\({code}\.npz\)"),
    ],
)
def test_recordings_that_no_log_names_stop_the_session(
    small: Small, n_left: int | None, words: str
) -> None:
    run(small, ScriptGrades(["1", "1+", "3"]))
    log = small[0].log_file("R1", "test")
    files = {path: path.read_bytes() for path in log.with_suffix("").iterdir()}
    lines = log.read_bytes().splitlines(keepends=True)
    log.unlink()
    if n_left is not None:  # of the third presentation nothing
        log.write_bytes(b"".join(lines[:n_left]))
    code = read_schedule(small[0].schedule_file("R1", "test")).presentations[2].code
    needed = rf"test_R1\.jsonl: {words}.*put the whole log back"
    with pytest.raises(SessionLogError, match=needed.replace("{code}", code)):
        run(small, ScriptGrades(["4", "4", "4"]))
    assert all(path.read_bytes() == data for path, data in files.items())
    assert log.exists() is (n_left is not None)
    assert not n_left or log.read_bytes() == b"".join(lines[:n_left])
    log.with_suffix("").rename(log.with_suffix(".old"))  # as the message says
    run(small, ScriptGrades(["4", "4", "4"]))


def test_a_session_goes_on_with_its_own_schedule_and_source_only(small: Small) -> None:
    study, protocol = small
    with pytest.raises(ParameterError, match="script: needed a grade of position 2"):
        run(small, ScriptGrades(["1"]))
    with pytest.raises(SessionLogError, match=r"begun with grades = script.*got simul"):
        run(small, SimulatedGrades(protocol))
    device = DeviceSettings(speed_limit_deg_s=30.0)
    slower = msgspec.structs.replace(protocol, device=device)
    with pytest.raises(ScheduleError, match="from before a change in what it presents"):
        run((study, slower), ScriptGrades(["1", "1", "1"]))
    file = study.schedule_file("R1", "test")
    own, others = file.read_bytes(), study.schedule_file("R2", "test").read_bytes()
    for data, error, words in (
        (own.replace(b"# seed: 11", b"# seed: 12"), SessionLogError, "schedule_sha256"),
        (others, ScheduleError, "of rater R1 in session test, got that of"),
    ):
        assert data != own
        file.write_bytes(data)
        with pytest.raises(error, match=words):
            run(small, ScriptGrades(["1", "1", "1"]))
    with pytest.raises(
        ScheduleError, match=r"^rater: needed one of R1, R2 for session"
    ):
        run_session(*small, "R9", "test", grades=ScriptGrades([]), clock="simulated")
    assert not study.log_file("R9", "test").exists()


def test_a_grade_beyond_the_scale_is_not_logged(small: Small) -> None:
    with pytest.raises(ParameterError, match=r"needed one of 0, 1.*got '7'"):
        run(small, ScriptGrades(["7", "1", "1"]))
    assert events(small) == ["session", "presented"]


@pytest.mark.parametrize("backend", ["nonesuch", "replay"])
@pytest.mark.parametrize("clock", ["real", "simulated"])
def test_a_device_that_no_session_can_use_is_refused(
    small: Small, backend: str, clock: Literal["real", "simulated"]
) -> None:
    study, protocol = small
    device = msgspec.structs.replace(protocol.device, backend=backend)
    other = msgspec.structs.replace(protocol, device=device)
    words = f"device.backend: needed one of moteus, puck, simulated, got '{backend}'"
    with pytest.raises(ParameterError, match=words):
        run_session(study, other, "R1", "test", grades=ScriptGrades([]), clock=clock)
    assert not study.log_file("R1", "test").exists()


def test_a_crash_while_presenting_leaves_only_what_was_done(small: Small) -> None:
    class Broken(ScriptGrades):
        def make_ready(self, request: GradeRequest) -> None:
            if request.presentation.position == 2:
                raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run(small, Broken(["1", "1", "1"]))
    assert events(small) == ["session", "presented", "grade"]
    run(small, ScriptGrades(["4", "2", "3"]))
    given = ratings_from_logs(*small).table.sort_values("position")["grade"]
    assert given.tolist() == ["1", "2", "3"]


def test_a_correction_is_a_new_event_with_who_and_why_and_the_grade_stays(
    small: Small,
) -> None:
    study, protocol = small
    run(small, ScriptGrades(["1", "1+", "3"]))
    first = read_schedule(study.schedule_file("R1", "test")).presentations[0]
    correction = {"code": first.code, "grade": "2", "who": "Kim ", "why": "misheard"}
    record_correction(study, protocol, "R1", "test", **correction)
    log = read_log(study.log_file("R1", "test"))
    assert log[2].fields["grade"] == "1"
    assert log[-1].fields == {**correction, "who": "Kim"}
    table = ratings_from_logs(study, protocol).table.set_index("model")
    assert table["grade"][first.model] == "2"
    for change, message in (
        ({"grade": "7"}, "grade: needed one of"),
        ({"who": " "}, "who: needed text"),
        ({"why": ""}, "why: needed text"),
        ({"code": "nope"}, r"needed a code that was presented \("),
        ({"code": "nope", "grade": None}, r"needed a code that has a grade \("),
    ):
        with pytest.raises((ParameterError, SessionLogError), match=message):
            record_correction(study, protocol, "R1", "test", **(correction | change))
    assert read_log(study.log_file("R1", "test")) == log


class Noting(ScriptGrades):
    """A script that notes when a grade is asked."""

    def __init__(self, order: list[str]) -> None:
        super().__init__(["1", "1", "1"])
        self.order = order

    def grade(self, request: GradeRequest) -> str | None:
        self.order.append("asked")
        return super().grade(request)


def test_all_is_on_disk_before_the_next_is_asked_and_a_recording_before_its_line(
    small: Small, monkeypatch: pytest.MonkeyPatch
) -> None:
    order: list[str] = []
    folders: set[Path] = set()
    fsync, replace = os.fsync, os.replace

    def noted(descriptor: int) -> None:
        fsync(descriptor)
        path = Path(os.readlink(f"/proc/self/fd/{descriptor}"))
        order.append(path.suffix)
        if "asked" not in order and path.is_dir():
            folders.add(path)

    def renamed(part: Path, path: Path) -> None:
        replace(part, path)
        order.append(path.suffix)

    monkeypatch.setattr(os, "fsync", noted)
    monkeypatch.setattr(os, "replace", renamed)
    study, _ = small
    run(small, Noting(order))
    kinds = (".part", ".npz", ".json", ".jsonl", "asked")
    assert [word for word in order if word in kinds] == [
        ".jsonl",
        *[".part", ".part", ".json", ".npz", ".jsonl", "asked", ".jsonl"] * 3,
        ".jsonl",
    ]
    assert folders >= {study.root, study.sessions, study.sessions / "test_R1"}


def test_a_full_disk_between_a_recording_and_its_line_loses_neither(
    small: Small, monkeypatch: pytest.MonkeyPatch
) -> None:
    write = os.write

    def full(descriptor: int, data: bytes) -> int:
        if bytes(data).startswith(b'{"event": "presented"'):
            raise OSError(errno.ENOSPC, "No space left on device")
        return write(descriptor, data)

    monkeypatch.setattr(os, "write", full)
    with pytest.raises(OSError, match="No space left"):
        run(small, ScriptGrades(["1", "1", "1"]))
    monkeypatch.undo()
    run(small, ScriptGrades(["1", "1", "1"]))
    assert events(small)[:5] == ["session", "resumed", *["presented"] * 2, "grade"]


def test_a_sensor_is_recorded_with_noise_of_its_own_each_time(
    new_study: Callable[..., Small],
) -> None:
    sensing = "[device]\ntorque_sensor = true\n\n[schedule]"
    small = new_study(("[schedule]", sensing))
    run(small, SimulatedGrades(small[1]))
    measured = []
    for file in sorted(small[0].sessions.rglob("*.npz")):
        recording = read_recording(file)
        assert recording.channels == (MEASURED_TORQUE,)
        measured.append(recording.columns[MEASURED_TORQUE.column][:20].tolist())
    assert len(measured) == 3
    assert all(one != other for one, other in pairwise(measured))


@pytest.mark.parametrize(
    ("number", "left"),
    [
        (signal.SIGINT, ["presented", "fault", "presented", "grade"]),
        (signal.SIGTERM, ["presented", "fault", "stopped"]),
    ],
)
def test_a_signal_is_an_emergency_stop(
    small: Small,
    monkeypatch: pytest.MonkeyPatch,
    number: signal.Signals,
    left: list[str],
) -> None:
    # The signal comes while the first presentation runs, from its own clock.
    handlers, sleep = [signal.getsignal(number)], SimulatedClock.sleep_until_ns

    def signalled(clock: SimulatedClock, deadline_ns: int) -> None:
        if deadline_ns == 300_000_000 and len(handlers) == 1:
            handlers.append(signal.getsignal(number))
            signal.raise_signal(number)
        sleep(clock, deadline_ns)

    monkeypatch.setattr(SimulatedClock, "sleep_until_ns", signalled)
    is_left = number == signal.SIGTERM
    with (
        pytest.raises(SessionStoppedError, match="SIGTERM")
        if is_left
        else nullcontext()
    ):
        run(small, SimulatedGrades(small[1]))
    assert events(small)[1 : 1 + len(left)] == left
    fault = read_log(small[0].log_file("R1", "test"))[2]
    assert fault.fields["kind"] == "emergency-stop"
    assert fault.fields["words"] == f"emergency stop: signal {number.name}"
    assert signal.getsignal(number) is handlers[0]  # as it was before
