"""The writer of files: whole, on disk, through no link, never over a record."""

import errno
import os
import stat
import subprocess
import sys
import time
from pathlib import Path

import pytest

from masrel._files import make_folder, write_file, write_files
from masrel.errors import ParameterError
from masrel.lab._study_files import new_file, no_follow


def study(root: Path) -> Path:
    for name in ("sessions", "schedules", "ratings"):
        (root / name).mkdir(parents=True)
    (root / "protocol.toml").write_text("")
    return root


def test_an_output_takes_the_place_of_a_link_and_not_of_what_it_leads_to(
    tmp_path: Path,
) -> None:
    profile, output = tmp_path / "profile", tmp_path / "out.csv"
    profile.write_text("mine")
    output.symlink_to(profile)
    write_file(output, "new")
    assert profile.read_text() == "mine"
    assert not output.is_symlink()
    assert output.read_text() == "new"


def test_a_folder_that_leads_out_of_the_study_is_refused(tmp_path: Path) -> None:
    root, home = tmp_path / "study", tmp_path / "home"
    root.mkdir()
    home.mkdir()
    (root / "ratings").symlink_to(home)
    with pytest.raises(ParameterError, match="got a link to"):
        write_file(root / "ratings" / "deep" / "ratings.csv", "x", within=root)
    assert not list(home.iterdir())


@pytest.mark.parametrize(
    "record",
    [
        "protocol.toml",
        "sessions/test_R1.jsonl",
        "sessions/test_R1/123.npz",
        "schedules/new.csv",
        "ratings/published.csv",
    ],
)
def test_no_output_is_written_over_or_among_primary_records(
    record: str, tmp_path: Path
) -> None:
    root = study(tmp_path / "study")
    before = sorted(root.rglob("*"))
    with pytest.raises(ParameterError, match="is a primary record"):
        write_file(root / record, "x")
    with (
        pytest.raises(ParameterError, match="is a primary record"),
        new_file(root / record),
    ):
        pass
    assert sorted(root.rglob("*")) == before
    write_file(root / "ratings" / "ratings.csv", "x")


def test_nothing_but_files_is_replaced(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "to_null").symlink_to("/dev/null")
    for target in (tmp_path, tmp_path / "pipe", tmp_path / "to_null"):
        with pytest.raises(OSError, match="needed a file or a new name") as raised:
            write_file(target, "x")
        assert raised.value.filename == str(target)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["pipe", "to_null"]


@pytest.mark.parametrize("mode", [0o600, 0o666])  # less and more than a umask leaves
def test_permissions_stay(mode: int, tmp_path: Path) -> None:
    secret = tmp_path / "secret.csv"
    secret.write_text("old")
    secret.chmod(mode)
    write_file(secret, "new")
    assert stat.S_IMODE(secret.stat().st_mode) == mode


@pytest.mark.parametrize("call", ["open", "fdopen", "fsync", "replace"])
def test_a_full_disk_leaves_all_as_it_was_and_names_the_file(
    call: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    first, second = tmp_path / "a.json", tmp_path / "b.npz"
    first.write_text("old")

    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(os, call, full)
    with pytest.raises(OSError, match="No space left on device") as raised:
        write_files({first: "new", second: b"new"})
    monkeypatch.undo()
    assert raised.value.filename == str(first)
    assert [path.name for path in tmp_path.iterdir()] == ["a.json"]
    assert first.read_text() == "old"


@pytest.fixture
def events(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """What is synced and what gets its name, in order, as it comes."""
    events: list[str] = []
    fsync, replace = os.fsync, os.replace

    def synced(descriptor: int) -> None:
        fsync(descriptor)
        name = Path(os.readlink(f"/proc/self/fd/{descriptor}")).name
        events.append("part" if name.endswith(".part") else name)

    def named(part: Path, path: Path) -> None:
        replace(part, path)
        events.append(f"= {path.name}")

    monkeypatch.setattr(os, "fsync", synced)
    monkeypatch.setattr(os, "replace", named)
    return events


def test_files_that_belong_together_are_all_on_disk_before_one_has_its_name(
    tmp_path: Path, events: list[str]
) -> None:
    # and each folder, also a new one, is synced after it has the name
    write_files({tmp_path / "new" / name: "x" for name in ("a", "b")})
    new = ["part", "part", "= a", "= b", "new"]
    assert events == [tmp_path.name, *new]


def test_a_file_that_is_written_bit_by_bit_is_on_disk_before_it_has_its_name(
    tmp_path: Path, events: list[str]
) -> None:
    with new_file(tmp_path / "a") as out:
        out.write("x")
    assert events == ["part", "= a", tmp_path.name]


KILLED = """
import os, signal, sys
from pathlib import Path
from masrel._files import write_file
os.replace = lambda *_: os.kill(os.getpid(), signal.SIGKILL)
write_file(Path(sys.argv[1]), "new")
"""


def test_what_a_kill_leaves_is_taken_away_after_a_day(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text("old")
    died = subprocess.run([sys.executable, "-c", KILLED, str(path)], check=False)
    assert died.returncode < 0
    (left,) = tmp_path.glob(".masrel-*.part")
    assert path.read_text() == "old"
    with new_file(tmp_path / "b.csv") as out:  # whose own part is not taken away
        write_file(path, "new")
        assert left.exists()  # it may be of a process that lives
        yesterday = time.time() - 90_000
        os.utime(left, (yesterday, yesterday))
        write_file(path, "new")
        assert not left.exists()
        out.write("whole")
    assert {p.name: p.read_text() for p in tmp_path.iterdir()} == {
        "a.csv": "new",
        "b.csv": "whole",
    }


def test_a_file_that_is_added_to_is_not_opened_through_a_link(tmp_path: Path) -> None:
    (tmp_path / "target").write_text("mine")
    (tmp_path / "log").symlink_to(tmp_path / "target")
    with pytest.raises(OSError, match="is a link, which is not followed"):
        open(tmp_path / "log", "ab", opener=no_follow)


def test_folders_are_made_one_in_the_other(tmp_path: Path) -> None:
    make_folder(tmp_path / "a" / "b")
    make_folder(tmp_path / "a" / "b")
    assert (tmp_path / "a" / "b").is_dir()
