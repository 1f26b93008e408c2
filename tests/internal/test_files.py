"""The writer of outputs: whole or not at all, and over nothing but a usual file."""

import errno
import os
import stat
from pathlib import Path

import pytest

from masrel._files import write_file


def test_an_output_takes_the_place_of_a_file_and_not_of_what_a_link_leads_to(
    tmp_path: Path,
) -> None:
    file, link = tmp_path / "out.csv", tmp_path / "link.csv"
    file.write_text("old")
    file.chmod(0o600)
    link.symlink_to(file)
    write_file(link, "through")
    assert file.read_text() == "old"
    write_file(file, "new")
    assert (file.read_text(), link.read_text()) == ("new", "through")
    assert stat.S_IMODE(file.stat().st_mode) == 0o600


def test_nothing_but_files_is_replaced(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    for target in (tmp_path, tmp_path / "pipe", Path("/dev/null")):
        with pytest.raises(OSError, match="needs to be a file"):
            write_file(target, "x")


def test_a_full_disk_leaves_what_there_was_and_names_the_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    file = tmp_path / "out.json"
    file.write_text("old")
    monkeypatch.setattr(os, "replace", full)
    with pytest.raises(OSError, match="No space left on device") as raised:
        write_file(file, "new")
    assert raised.value.filename == str(file)
    assert [path.read_text() for path in tmp_path.iterdir()] == ["old"]
