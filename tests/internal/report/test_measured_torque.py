"""Which recordings are drawn with their measured torque."""

from pathlib import Path

import pytest

from masrel.analysis import analyze
from masrel.errors import RecordingError
from masrel.report._material import Drawing, Paragraph, gather
from masrel.report._measured_torque import measured_blocks
from tests.report.pages import simulated_ratings
from tests.report.test_measured_torque import recorded, with_sensor


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
    assert [panel.title for panel in drawing.content.panels] == ["HM1\nR1, test"]


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
