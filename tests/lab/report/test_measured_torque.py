"""The report shows measured torque beside what was sent, where there is any."""

from pathlib import Path

import msgspec
import numpy as np

from masrel.lab.analysis import analyze
from masrel.lab.protocol import Protocol
from masrel.lab.recording import (
    MEASURED_TORQUE,
    RECORDING_COLUMNS,
    Recording,
    write_recording,
)
from masrel.lab.report import write_report
from tests.lab.analysis.studies import protocol_with
from tests.lab.report.pages import simulated_ratings


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


def with_sensor(has_sensor: bool = True) -> Protocol:
    protocol = protocol_with(sections=("traces",))
    device = msgspec.structs.replace(protocol.device, torque_sensor=has_sensor)
    return msgspec.structs.replace(protocol, device=device)


def test_one_presentation_of_each_model_is_drawn(tmp_path: Path) -> None:
    folder = tmp_path / "sessions" / "test_R1"
    recorded(folder / "A1.npz", "HM2", fault="speed")
    recorded(folder / "A2.npz", "HM2")
    recorded(folder / "A3.npz", "HM1")
    protocol, ratings = with_sensor(), simulated_ratings()
    files = write_report(
        protocol,
        ratings,
        analyze(protocol, ratings),
        tmp_path / "report",
        recordings=folder.parent,
    )
    text = files.markdown.read_text(encoding="utf-8")
    assert "the device's sensor measured of HM1, HM2 (line)" in text
    assert "the largest measured torque is 3.3 N·m" in text
    drawn = [path for path in files.figures if path.name.startswith("measured_1")]
    assert {path.suffix for path in drawn} == {".png", ".svg"}
