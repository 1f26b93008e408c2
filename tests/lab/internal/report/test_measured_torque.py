"""Which recordings are drawn with their measured torque."""

from pathlib import Path

import numpy as np
import pytest

from masrel.errors import RecordingError
from masrel.lab.analysis import analyze
from masrel.lab.recording import MEASURED_TORQUE, RECORDING_COLUMNS, Recording
from masrel.lab.report._material import gather
from masrel.lab.report._measured_torque import measured_blocks, measured_panel
from masrel.pages._sections import Drawing, Paragraph
from tests.lab.report.pages import simulated_ratings
from tests.lab.report.test_measured_torque import recorded, with_sensor


def blocks(folder: Path, *, has_sensor: bool = True) -> tuple[Paragraph | Drawing, ...]:
    protocol, ratings = with_sensor(has_sensor), simulated_ratings()
    analysis = analyze(protocol, ratings)
    return measured_blocks(gather(protocol, ratings, analysis, recordings=folder))


def test_only_models_that_were_recorded_are_drawn(tmp_path: Path) -> None:
    recorded(tmp_path / "retest_R2" / "A1.npz", "HM2")
    (drawing,) = blocks(tmp_path)
    assert "the device's sensor measured of HM2 (line)" in drawing.caption
    assert drawing.stamp == "SIMULATED DATA"


def test_the_first_session_and_rater_that_have_a_model_are_drawn(
    tmp_path: Path,
) -> None:
    for place in ("retest_R1", "test_R2", "test_R1"):
        recorded(tmp_path / place / "A1.npz", "HM1")
    (drawing,) = blocks(tmp_path)
    (panels,) = drawing.content.arguments
    assert [panel.title for panel in panels] == ["HM1\nR1, test"]


def test_of_many_stretches_the_first_that_could_catch_is_drawn() -> None:
    # 0.4 s at 10 deg/s, back, then 0.4 s at 60 deg/s: with 0.25 s around it
    time = np.arange(3000) * 1e-3
    columns = {name: np.zeros(3000) for name in RECORDING_COLUMNS} | {"time_s": time}
    columns |= {MEASURED_TORQUE.column: time}
    for number, start, speed in ((1, 500, 10.0), (2, 1500, 60.0)):
        columns["stretch"][start : start + 400] = number
        columns["velocity_deg_s"][start : start + 400] = speed
    recording = Recording(columns=columns, facts={}, channels=(MEASURED_TORQUE,))
    panel = measured_panel(recording, "HM1")
    assert panel.time[0] == pytest.approx(0.0, abs=1e-9)
    assert panel.measured[[0, -1]] == pytest.approx([1.25, 2.149])


def test_recordings_that_are_not_there_are_missed(tmp_path: Path) -> None:
    (paragraph,) = blocks(tmp_path)
    words = "Measured torque is not in these data: no recording has it."
    assert (paragraph.text, paragraph.absent) == (words, True)


def test_without_a_sensor_no_recording_is_looked_at(tmp_path: Path) -> None:
    file = tmp_path / "test_R1" / "A1.npz"
    file.parent.mkdir(parents=True)
    file.write_bytes(b"no recording")
    assert blocks(tmp_path, has_sensor=False) == ()
    with pytest.raises(RecordingError, match=r"A1\.json: no such file"):
        blocks(tmp_path)
