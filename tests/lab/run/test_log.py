"""The log is a chain on disk: what was appended stays, what was changed shows."""

import hashlib
import json
import os
import stat
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from masrel.errors import SessionLogError
from masrel.lab.run import SessionLog, read_log


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
    for read in (read_log, SessionLog.open):
        with pytest.raises(
            SessionLogError, match=rf"a\.jsonl: line {number}: needed p"
        ):
            read(path)


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
        assert not log.is_open
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
    assert (log.is_open, other.is_open) == (False, True)
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
