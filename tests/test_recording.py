"""A recording survives the disk, and damage to it is seen."""

import json
from pathlib import Path

import numpy as np
import pytest

from masrel.errors import RecordingError
from masrel.recording import (
    RECORDING_COLUMNS,
    Recording,
    read_recording,
    write_recording,
)


@pytest.fixture
def recording() -> Recording:
    columns = {name: np.arange(4.0) + i for i, name in enumerate(RECORDING_COLUMNS)}
    return Recording(columns=columns, facts={"simulated": True, "model": "HM1"})


def test_what_is_written_is_read_back(recording: Recording, tmp_path: Path) -> None:
    write_recording(recording, tmp_path / "a.npz")
    back = read_recording(tmp_path / "a.npz")
    assert back.facts == recording.facts
    for name in RECORDING_COLUMNS:
        assert np.array_equal(back.columns[name], recording.columns[name])


def test_the_same_recording_has_the_same_bytes(
    recording: Recording, tmp_path: Path
) -> None:
    first = write_recording(recording, tmp_path / "a.npz")
    second = write_recording(recording, tmp_path / "sub" / "b.npz")
    assert first == second
    assert (tmp_path / "a.json").read_bytes() == (
        tmp_path / "sub" / "b.json"
    ).read_bytes()


@pytest.mark.parametrize("place", [0, 100, -1])
def test_one_changed_byte_is_an_error(
    recording: Recording, tmp_path: Path, place: int
) -> None:
    path = tmp_path / "a.npz"
    write_recording(recording, path)
    data = bytearray(path.read_bytes())
    data[place] ^= 1
    path.write_bytes(bytes(data))
    with pytest.raises(RecordingError, match="is not the file whose checksum"):
        read_recording(path)


def test_a_missing_half_is_an_error(recording: Recording, tmp_path: Path) -> None:
    path = tmp_path / "a.npz"
    write_recording(recording, path)
    path.with_suffix(".json").unlink()
    with pytest.raises(RecordingError, match=r"a\.json: no such file"):
        read_recording(path)


@pytest.mark.parametrize("text", ["", "[]", '{"model": "HM1"}'])
def test_foreign_facts_are_an_error(
    recording: Recording, tmp_path: Path, text: str
) -> None:
    path = tmp_path / "a.npz"
    write_recording(recording, path)
    path.with_suffix(".json").write_text(text)
    with pytest.raises(RecordingError, match=r"a\.json"):
        read_recording(path)


def test_facts_that_fit_a_file_that_is_no_archive_are_an_error(tmp_path: Path) -> None:
    path = tmp_path / "a.npz"
    path.write_bytes(b"")
    empty = "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855"
    path.with_suffix(".json").write_text(json.dumps({"sha256": empty}))
    with pytest.raises(RecordingError, match="not an archive of columns"):
        read_recording(path)


def test_columns_are_complete_equal_and_read_only(recording: Recording) -> None:
    columns = dict(recording.columns)
    with pytest.raises(ValueError, match="read-only"):
        columns["time_s"][0] = 1.0
    short = columns | {"phase": np.zeros(3)}
    with pytest.raises(RecordingError, match="one length"):
        Recording(columns=short, facts={})
    del columns["phase"]
    with pytest.raises(RecordingError, match="needs the columns"):
        Recording(columns=columns, facts={})


def test_another_ending_is_refused(recording: Recording, tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match=r"must end in \.npz"):
        write_recording(recording, tmp_path / "a.csv")


def test_a_recording_is_never_overwritten(recording: Recording, tmp_path: Path) -> None:
    path = tmp_path / "a.npz"
    write_recording(recording, path)
    before = path.read_bytes()
    with pytest.raises(RecordingError, match=r"a\.npz: needs a new file, a recording"):
        write_recording(recording, path)
    assert path.read_bytes() == before


def test_a_full_disk_leaves_no_half_of_a_recording(
    recording: Recording, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(_descriptor: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.fsync", full)
    with pytest.raises(OSError, match="No space left"):
        write_recording(recording, tmp_path / "a.npz")
    assert list(tmp_path.iterdir()) == []
