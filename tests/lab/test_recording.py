"""A recording survives the disk, and damage to it is seen."""

import json
import os
from pathlib import Path

import numpy as np
import pytest

from masrel.errors import ParameterError, RecordingError
from masrel.lab.recording import (
    MEASURED_TORQUE,
    RECORDING_COLUMNS,
    Channel,
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


EMPTY = "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855"


@pytest.mark.parametrize(
    ("facts", "words"),
    [
        (None, r"a\.json: no such file"),
        *((text, r"a\.json") for text in ("", "[]", '{"model": "HM1"}')),
        # which fit a file that is no archive
        (json.dumps({"sha256": EMPTY}), "not an archive of columns"),
    ],
)
def test_facts_that_are_missing_or_of_another_file_are_an_error(
    recording: Recording, tmp_path: Path, facts: str | None, words: str
) -> None:
    path = tmp_path / "a.npz"
    write_recording(recording, path)
    path.with_suffix(".json").unlink()
    if facts is not None:
        path.with_suffix(".json").write_text(facts)
        if EMPTY in facts:
            path.write_bytes(b"")
    with pytest.raises(RecordingError, match=words):
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


def test_a_recording_is_never_overwritten(recording: Recording, tmp_path: Path) -> None:
    path = tmp_path / "a.npz"
    write_recording(recording, path)
    before = path.read_bytes()
    with pytest.raises(RecordingError, match=r"a\.npz: needs a new file, a recording"):
        write_recording(recording, path)
    assert path.read_bytes() == before
    with pytest.raises(RecordingError, match=r"must end in \.npz"):
        write_recording(recording, tmp_path / "a.csv")


def test_a_full_disk_leaves_no_half_of_a_recording(
    recording: Recording, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(_descriptor: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.fsync", full)
    with pytest.raises(OSError, match="No space left"):
        write_recording(recording, tmp_path / "a.npz")
    assert list(tmp_path.iterdir()) == []


def test_a_recording_that_is_there_has_its_facts(
    recording: Recording, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    replace = os.replace

    def stopped(part: Path, path: Path) -> None:
        if any(tmp_path.glob("a.*")):
            raise InterruptedError
        replace(part, path)

    monkeypatch.setattr(os, "replace", stopped)
    with pytest.raises(InterruptedError):
        write_recording(recording, tmp_path / "a.npz")
    assert [path.name for path in tmp_path.iterdir()] == ["a.json"]


# Channels


@pytest.fixture
def measured(recording: Recording) -> Recording:
    columns = {**recording.columns, "measured_torque_nm": np.array([0.1, np.nan, 2, 3])}
    return Recording(
        columns=columns, facts=recording.facts, channels=(MEASURED_TORQUE,)
    )


def test_a_channel_is_written_with_its_name_and_unit(
    measured: Recording, tmp_path: Path
) -> None:
    path = tmp_path / "a.npz"
    write_recording(measured, path)
    facts = json.loads(path.with_suffix(".json").read_text())
    assert facts["channels"] == [{"name": "measured_torque", "unit": "nm"}]
    back = read_recording(path)
    assert (back.channels, back.facts) == (measured.channels, measured.facts)
    column = back.columns["measured_torque_nm"]
    assert np.array_equal(column, [0.1, np.nan, 2, 3], equal_nan=True)


def test_a_channel_needs_its_column_and_a_column_its_channel(
    recording: Recording, measured: Recording
) -> None:
    with pytest.raises(RecordingError, match=r"phase, ramp.*, measured_torque_nm, got"):
        Recording(columns=recording.columns, facts={}, channels=(MEASURED_TORQUE,))
    with pytest.raises(RecordingError, match=r"got .*measured_torque_nm"):
        Recording(columns=measured.columns, facts={})


@pytest.mark.parametrize(
    "channels", [3, [3], [{"name": "a"}], [{"name": "a", "unit": 1}], [{"unit": "nm"}]]
)
def test_channels_that_are_none_are_an_error(
    measured: Recording, tmp_path: Path, channels: object
) -> None:
    path = tmp_path / "a.npz"
    write_recording(measured, path)
    facts = json.loads(path.with_suffix(".json").read_text()) | {"channels": channels}
    path.with_suffix(".json").write_text(json.dumps(facts))
    with pytest.raises(RecordingError, match=r"a\.json: channels: needs name and unit"):
        read_recording(path)


@pytest.mark.parametrize(
    ("name", "unit"),
    [
        *(("", ""), ("EMG", "mv"), ("emg biceps", "mv"), ("emg", "µV"), ("a" * 50, "")),
        ("angle", "deg"),  # which every recording has
    ],
)
def test_a_channel_needs_a_name_that_a_column_can_have(name: str, unit: str) -> None:
    words = "channel: needs a name and a unit .* that no other column has"
    with pytest.raises(ParameterError, match=words):
        Channel(name=name, unit=unit)
