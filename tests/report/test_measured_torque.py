"""The report shows measured torque beside what was sent, where there is any."""

from pathlib import Path

import msgspec
import numpy as np
import pytest

from masrel.analysis import analyze
from masrel.errors import RecordingError
from masrel.recording import (
    MEASURED_TORQUE,
    RECORDING_COLUMNS,
    Recording,
    write_recording,
)
from masrel.report import write_report
from tests.analysis.studies import protocol_with
from tests.report.pages import simulated_ratings


def recorded(file: Path, model: str, *, fault: str | None = None) -> None:
    time = np.arange(100) * 1e-3
    columns = {name: np.zeros(100) for name in RECORDING_COLUMNS} | {"time_s": time}
    columns["command_torque_nm"] = 30.0 * time
    columns[MEASURED_TORQUE.column] = 30.0 * time + 0.3
    columns[MEASURED_TORQUE.column][7] = np.nan
    session, rater = file.parent.name.split("_")
    facts = {"model": model, "rater": rater, "session": session, "simulated": True}
    recording = Recording(
        columns=columns,
        facts={**facts, "fault": fault},
        channels=(MEASURED_TORQUE,),
    )
    write_recording(recording, file)


def page(folder: Path, *, has_sensor: bool = True) -> str:
    """The Markdown of the traces of two simulated raters of HM1 and HM2."""
    protocol, ratings = protocol_with(sections=("traces",)), simulated_ratings()
    device = msgspec.structs.replace(protocol.device, torque_sensor=has_sensor)
    protocol = msgspec.structs.replace(protocol, device=device)
    files = write_report(
        protocol,
        ratings,
        analyze(protocol, ratings),
        folder / "report",
        recordings=folder / "sessions",
    )
    assert {path.suffix for path in files.figures} == {".png", ".svg"}
    return files.markdown.read_text(encoding="utf-8")


def test_one_presentation_of_each_model_is_drawn(tmp_path: Path) -> None:
    folder = tmp_path / "sessions" / "test_R1"
    recorded(folder / "A1.npz", "HM2", fault="speed")
    recorded(folder / "A2.npz", "HM2")
    recorded(folder / "A3.npz", "HM1")
    text = page(tmp_path)
    assert "the device's sensor measured of HM1, HM2 (line)" in text
    assert "the largest measured torque is 3.3 N·m" in text


def test_only_models_that_were_recorded_are_drawn(tmp_path: Path) -> None:
    recorded(tmp_path / "sessions" / "retest_R2" / "A1.npz", "HM2")
    assert "the device's sensor measured of HM2 (line)" in page(tmp_path)


def test_recordings_that_are_not_there_are_missed(tmp_path: Path) -> None:
    assert "Measured torque is not in these data: no recording has it." in page(
        tmp_path
    )


def test_without_a_sensor_no_recording_is_looked_at(tmp_path: Path) -> None:
    file = tmp_path / "sessions" / "test_R1" / "A1.npz"
    file.parent.mkdir(parents=True)
    file.write_bytes(b"no recording")
    assert "easured torque" not in page(tmp_path, has_sensor=False)
    with pytest.raises(RecordingError, match=r"A1\.json: no such file"):
        page(tmp_path)
