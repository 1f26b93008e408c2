"""The log is a chain on disk: what was appended stays, what was changed shows."""

import hashlib
import json
import os
import re
import stat
import subprocess
import sys
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from docs.make.pages import read
from masrel.errors import SessionLogError
from masrel.lab._event_log import SessionLog, read_log
from masrel.lab.progress import SessionProgress, session_progress
from masrel.lab.protocol import Protocol, StudyPaths


def noon() -> datetime:
    return datetime(2031, 5, 6, 12, 0, tzinfo=UTC)


def filled(path: Path, n_events: int = 4) -> Path:
    with SessionLog.open(path, now=noon) as log:
        for number in range(n_events):
            log.append("grade", {"code": f"C{number}", "grade": "1+"})
    return path


def test_what_is_appended_is_what_is_read(tmp_path: Path) -> None:
    path = tmp_path / "sessions" / "a.jsonl"
    facts = {"code": "K7", "grade": "1+", "speed": 81.5, "fault": None, "n": 3}
    with SessionLog.open(path, now=noon) as log:
        log.append("grade", facts)
        log.append("correction", {"why": "Größe, 등급\u2028\n"})
        assert log.events == read_log(path)
    first, second = read_log(path)
    assert (first.line, first.kind, first.fields) == (1, "grade", facts)
    assert first.time_utc == "2031-05-06T12:00:00.000Z"
    assert second.fields["why"] == "Größe, 등급\u2028\n"


def test_the_chain_is_the_one_the_documentation_describes(tmp_path: Path) -> None:
    path = tmp_path / "sessions" / "a.jsonl"
    for n_events in (2, 3):  # opened again it goes on
        filled(path, n_events)
    previous = "0" * 64
    for line in path.read_bytes().splitlines():
        assert json.loads(line)["previous"] == previous
        previous = hashlib.sha256(line).hexdigest()
    assert [event.line for event in read_log(path)] == [1, 2, 3, 4, 5]
    modes = [stat.S_IMODE(each.stat().st_mode) for each in (path.parent, path)]
    assert modes == [0o700, 0o600]


def test_a_log_and_each_of_its_events_are_synced_before_anything_follows(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    synced: list[tuple[str, int]] = []
    fsync = os.fsync

    def noted(descriptor: int) -> None:
        fsync(descriptor)
        name = os.readlink(f"/proc/self/fd/{descriptor}")
        synced.append((name, os.fstat(descriptor).st_size))

    monkeypatch.setattr(os, "fsync", noted)
    with SessionLog.open(tmp_path / "a.jsonl") as log:
        assert [name for name, _ in synced] == [str(tmp_path)]  # that of the new log
        for number in (2, 3, 4):
            log.append("grade", {"code": "A"})
            assert len(synced) == number
            assert synced[-1] == (str(log.path), log.path.stat().st_size)


Lines = list[bytes]


@pytest.mark.parametrize(
    ("forged", "number"),
    [
        *(
            (
                lambda a, n=n: [*a[: n - 1], a[n - 1].replace(b"1+", b"2 "), *a[n:]],
                n + 1,
            )
            for n in (1, 2, 3)
        ),
        *((lambda a, n=n: [*a[: n - 1], *a[n:]], n) for n in (1, 2, 3)),
        (lambda a: [a[0], a[2], a[1], a[3]], 2),
    ],
)
def test_a_line_that_is_changed_removed_or_exchanged_is_found(
    tmp_path: Path, forged: Callable[[Lines], Lines], number: int
) -> None:
    path = filled(tmp_path / "a.jsonl")
    path.write_bytes(b"".join(forged(path.read_bytes().splitlines(keepends=True))))
    for opened in (read_log, SessionLog.open):
        with pytest.raises(
            SessionLogError, match=rf"a\.jsonl: line {number}: needed p"
        ):
            opened(path)


@pytest.mark.parametrize(
    "line",
    [
        b"not json",
        b"[1, 2]",
        b'{"event": "grade"}',
        b"\xff\xfe",
        b"",
        b'{"event": 1, "time_utc": "", "previous": "", "fields": {}}',
        b'{"event": "a", "time_utc": "", "previous": "", "fields": {"a": [1]}}',
    ],
)
def test_a_line_that_is_no_event_is_refused(tmp_path: Path, line: bytes) -> None:
    path = filled(tmp_path / "a.jsonl", 1)
    path.write_bytes(path.read_bytes() + line + b"\n")
    with pytest.raises(SessionLogError, match=r"a\.jsonl: line 2: "):
        read_log(path)
    with pytest.raises(SessionLogError, match=r"gone\.jsonl: no such session log"):
        read_log(tmp_path / "gone.jsonl")


@settings(
    max_examples=40,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
    deadline=None,
)
@given(cut=st.integers(min_value=1, max_value=400))
def test_a_log_cut_anywhere_keeps_every_whole_event(tmp_path: Path, cut: int) -> None:
    path = tmp_path / "a.jsonl"
    path.unlink(missing_ok=True)
    beside = tmp_path / "a.jsonl.torn"
    beside.unlink(missing_ok=True)
    whole = filled(path).read_bytes()
    left = whole[:-cut]
    path.write_bytes(left)
    *lines, torn = left.split(b"\n")
    with SessionLog.open(path, now=noon) as log:
        log.append("grade", {"code": "after"})
    events = read_log(path)
    # All but its newline is a whole event: its closing brace is there.
    kept = len(lines) + (1 if torn.endswith(b"}}") else 0)
    assert path.read_bytes().startswith(b"\n".join([*lines, b""]))
    assert [e.fields["code"] for e in events[:kept]] == [f"C{i}" for i in range(kept)]
    assert [e.kind for e in events[kept:]] == ["recovered"] * bool(torn) + ["grade"]
    if torn and kept == len(lines):
        assert beside.read_bytes() == torn + b"\n"
        assert os.name == "nt" or beside.stat().st_mode & 0o077 == 0
        recovered = events[kept].fields
        assert recovered["sha256"] == hashlib.sha256(torn).hexdigest()
        assert (recovered["kept"], recovered["moved_to"]) == (False, beside.name)
    else:
        assert not beside.exists()


def test_a_torn_line_is_set_aside_whole_whatever_happens_meanwhile(
    tmp_path: Path,
) -> None:
    path, beside = filled(tmp_path / "a.jsonl", 2), tmp_path / "a.jsonl.torn"
    whole = path.read_bytes()
    torn = (
        b'{"event": "correction", "why": "' + b"long " * 400
    )  # longer than "recovered"
    path.write_bytes(whole + torn)
    with pytest.raises(SessionLogError, match="line 3: ends without a newline"):
        read_log(path)
    SessionLog.open(path, now=noon).close()
    assert beside.read_bytes() == torn + b"\n"
    # the event that takes its place is itself torn
    path.write_bytes(path.read_bytes()[:-30])
    SessionLog.open(path, now=noon).close()
    assert [event.kind for event in read_log(path)] == ["grade"] * 2 + ["recovered"]
    assert path.read_bytes().startswith(whole)
    assert beside.read_bytes().startswith(torn + b'\n{"event": "recov')


def test_after_a_failed_write_nothing_follows_on_the_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = filled(tmp_path / "a.jsonl", 1)
    write = os.write

    def full_disk(descriptor: int, data: bytes) -> int:
        if len(data) < 40:
            raise OSError(28, "No space left on device")
        return write(descriptor, data[: len(data) - 30])

    with SessionLog.open(path) as log:
        monkeypatch.setattr(os, "write", full_disk)
        with pytest.raises(OSError, match="No space left"):
            log.append("grade", {"code": "B"})
        monkeypatch.undo()
        with pytest.raises(SessionLogError, match="closed"):
            log.append("grade", {"code": "B"})
    filled(path, 1)
    assert [event.kind for event in read_log(path)] == ["grade", "recovered", "grade"]


@pytest.mark.parametrize("call", ["write", "fsync", "ftruncate"])
def test_a_full_disk_during_the_recovery_closes_the_log_once(
    call: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = filled(tmp_path / "a.jsonl", 2)
    path.write_bytes(path.read_bytes()[:-10])
    torn = path.read_bytes()

    def full_disk(descriptor: int, *_: object) -> int:
        if os.path.samestat(os.fstat(descriptor), path.stat()):
            raise OSError(28, "No space left on device")
        return 0

    monkeypatch.setattr(os, call, full_disk)
    with pytest.raises(OSError, match="No space left"):
        SessionLog.open(path, now=noon)
    monkeypatch.undo()
    if call == "write":
        assert path.read_bytes() == torn
    SessionLog.open(path, now=noon).close()
    assert [event.kind for event in read_log(path)][-1] == "recovered"


def test_a_log_has_one_writer_and_is_closed_once(tmp_path: Path) -> None:
    with (
        SessionLog.open(tmp_path / "a.jsonl") as log,
        pytest.raises(SessionLogError, match="another process has this log open"),
    ):
        SessionLog.open(tmp_path / "a.jsonl")
    other = SessionLog.open(tmp_path / "a.jsonl")
    log.close()  # again: the descriptor is another file's now
    other.append("grade", {"code": "A"})
    other.close()


@pytest.mark.parametrize("fact", [float("nan"), float("inf"), "\ud800", [1], {"a": 1}])
def test_a_fact_that_is_no_json_is_refused_and_leaves_the_log_whole(
    tmp_path: Path, fact: object
) -> None:
    with SessionLog.open(tmp_path / "a.jsonl") as log:
        with pytest.raises(SessionLogError, match=r"event 'grade': speed needs"):
            log.append("grade", {"speed": fact})  # type: ignore[dict-item]
        log.append("grade", {"speed": 1.0})
    assert len(read_log(tmp_path / "a.jsonl")) == 1


PAGE = Path(__file__).parents[3] / "docs/reference/formats/session_log.md"


def verified(folder: Path) -> subprocess.CompletedProcess[str]:
    blocks = read(PAGE.read_text(encoding="utf-8"))
    (code,) = ["\n".join(block.lines) for block in blocks if block.language == "python"]
    command = [sys.executable, "-I", "-S", "-c", code]
    return subprocess.run(command, cwd=folder, capture_output=True, text=True)


def test_the_documented_lines_find_a_change(tmp_path: Path) -> None:
    path = tmp_path / "pilot" / "sessions" / "test_R1.jsonl"
    with SessionLog.open(path) as log:
        for code in "ABC":
            log.append("grade", {"code": code, "grade": "1+"})
    whole = path.read_bytes()
    last = hashlib.sha256(whole.splitlines()[-1]).hexdigest()
    assert verified(tmp_path).stdout.strip() == last
    path.write_bytes(whole.replace(b"1+", b"2 ", 1))
    changed = verified(tmp_path)
    assert changed.returncode == 1
    assert "line 2: a line before it was changed" in changed.stderr


Small = tuple[StudyPaths, Protocol]
Step = tuple[str, dict[str, str | int | float | bool | None]]

FIELDS = {
    "session": "format study rater session protocol_sha256 presented_sha256 "
    "schedule_sha256 simulated grades device clock masrel_version rehearsal",
    "resumed": "protocol_sha256 n_graded clock masrel_version grades",
    "presented": "code position attempt recording sha256 facts_sha256 mean_speed_deg_s "
    "n_missed_ticks fault simulated stretches ended n_stretches felt r1_deg r2_deg "
    "grip_lost",
    "grade": "code position grade stretch",
    "correction": "code grade who why",
    "skipped": "code position who why",
    "stopped": "code position why",
    "recovered": "line n_bytes sha256 kept moved_to",
    "complete": "n_presentations",
}


def step(kind: str, **facts: str | int | float | bool | None) -> Step:
    return kind, {**dict.fromkeys(FIELDS[kind].split()), **facts}


def after(small: Small, *steps: Step) -> SessionProgress:
    with SessionLog.open(small[0].log_file("R1", "test")) as log:
        for kind, facts in steps:
            log.append(kind, facts)
    return session_progress(*small)[0]


BEGUN = step("session", format=2, rater="R1")
A_SHOWN, A_GRADED = step("presented", code="A"), step("grade", code="A", grade="1")
B_SHOWN, B_GRADED = step("presented", code="B"), step("grade", code="B", grade="2")
FAULT = step("presented", code="A", fault="too fast")
CORRECTED = step("correction", code="A", grade="3")
TAKEN, SKIPPED = step("correction", code="A"), step("skipped", code="A")
OTHER_SOURCE = step("resumed", grades="script")
RECOVERED = step("recovered")
DONE = [step("complete", n_presentations=number) for number in range(2)]


@pytest.mark.parametrize(
    ("steps", "stage", "n_graded", "n_skipped"),
    [
        ([], "drawn", 0, 0),
        (
            [
                *(RECOVERED, BEGUN, FAULT, step("stopped"), step("resumed"), A_SHOWN),
                *(A_GRADED, CORRECTED, B_SHOWN),
            ],
            "begun",
            1,
            0,
        ),
        ([BEGUN, A_SHOWN, A_GRADED, CORRECTED, DONE[1], CORRECTED], "complete", 1, 0),
        ([BEGUN, FAULT, SKIPPED, DONE[1]], "complete", 0, 1),
        ([BEGUN, FAULT, SKIPPED, DONE[1], CORRECTED], "complete", 1, 1),
        ([BEGUN, A_SHOWN, A_GRADED, TAKEN, B_SHOWN, CORRECTED, TAKEN], "begun", 0, 0),
    ],
)
def test_a_log_says_where_its_session_stands(
    small: Small, steps: list[Step], stage: str, n_graded: int, n_skipped: int
) -> None:
    stands = after(small, *steps)
    assert stands.problem is None
    assert (stands.stage, stands.n_graded, stands.n_skipped) == (
        stage,
        n_graded,
        n_skipped,
    )


@pytest.mark.parametrize(
    ("steps", "message"),
    [
        ([A_SHOWN], "line 1: presented: needed the event session once"),
        ([BEGUN, BEGUN], "line 2: session: needed the event session once"),
        ([("party", {})], "line 1: party: needed an event of session"),
        ([("grade", {"code": "A"})], "line 1: grade: needed the fields code, posit"),
        ([BEGUN, A_SHOWN, step("grade", code="A")], "line 3: grade: needed a grade of"),
        ([BEGUN, A_GRADED], "line 2: grade: needed a presentation of A"),
        ([BEGUN, FAULT, A_GRADED], "line 3: grade: .* without fault before"),
        ([BEGUN, A_SHOWN, FAULT, A_GRADED], "line 4: grade: .* without fault"),
        ([BEGUN, A_SHOWN, A_GRADED, A_GRADED], "line 4: grade: needed one grade"),
        ([BEGUN, A_SHOWN, A_GRADED, A_SHOWN], "line 4: presented: .* neither gr"),
        ([BEGUN, CORRECTED], "line 2: correction: needed a code that was presented"),
        (
            [step("session", format=2, grades="console"), A_SHOWN, OTHER_SOURCE],
            "line 3: resumed: needed a session that resumes with console, got script",
        ),
        ([BEGUN, A_SHOWN, TAKEN], "line 3: correction: needed a code that has a gra"),
        ([BEGUN, FAULT, SKIPPED, TAKEN], "line 4: correction: needed a code that has"),
        ([BEGUN, SKIPPED], "line 2: skipped: needed a presentation of A that a fault"),
        ([BEGUN, A_SHOWN, SKIPPED], "line 3: skipped: needed a presentation of A tha"),
        ([BEGUN, FAULT, SKIPPED, SKIPPED], "line 4: skipped: .* nor skipped, got A"),
        ([BEGUN, FAULT, SKIPPED, A_SHOWN], "line 4: presented: .* nor skipped, got A"),
        ([BEGUN, FAULT, step("skipped", code="A", who=3)], "line 3: .* value of who"),
        ([BEGUN, DONE[0], A_SHOWN], "line 3: presented: needed no event but a corr"),
        ([BEGUN, DONE[1]], "line 2: complete: needed n_presentations 0, as many as"),
    ],
)
def test_what_makes_no_session_is_refused_with_the_line(
    small: Small, steps: list[Step], message: str
) -> None:
    stands = after(small, *steps)
    assert stands.stage == "unreadable"
    assert re.search(rf"test_R1\.jsonl: {message}", str(stands.problem))
