"""A calibration of the device: kept, used, recorded, and reported when it is old."""

from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from math import radians

import msgspec
import numpy as np
import pytest

from masrel.errors import ParameterError
from masrel.lab.conduct._calibrations import (
    Calibration,
    calibration_notes,
    last_calibration,
    write_calibration,
)
from masrel.lab.hess import PlantParameters, SimulatedOptions, TorqueSensor
from masrel.lab.protocol import Protocol, StudyPaths
from masrel.lab.recording import read_recording
from masrel.lab.report._conduct import study_conduct
from masrel.lab.run._settings import calibrated
from masrel.lab.run.session import run_session
from masrel.lab.verification import verify_study
from tests.lab.hess.rig import ScriptedDevice, present
from tests.lab.script import ScriptGrades

Small = tuple[StudyPaths, Protocol]
NOW = datetime(2026, 11, 30, 12, tzinfo=UTC)


def calibration(days: int = 0, **changes) -> Calibration:
    """One of a simulated device, so many days ago."""
    values = {
        "encoder_noise_deg": 0.01,
        "delay_ms": 3.0,
        "inertia_kg_m2": 0.08,
        "viscous_nms_rad": 0.1,
        "coulomb_nm": 0.0,
        "torque_gain": 1.05,
    }
    told = {
        "device": "simulated",
        "boards": [],
        "distribution": "masrel 0",
        "who": "Kim",
        "time_utc": NOW - timedelta(days),
        "simulated": True,
        "gain_from": "weights",
        "values": {n: (v, 0.9 * v, 1.1 * v) for n, v in values.items()},
    }
    return Calibration(**{**told, **changes})


def last(small: Small, *, simulated: bool = True) -> tuple[Calibration, str] | None:
    return last_calibration(*small, simulated=simulated)


def test_the_last_one_of_the_device_counts(small: Small) -> None:
    study, _ = small
    assert last(small) is None
    for days in (3, 1, 2):
        write_calibration(study, calibration(days))
    write_calibration(study, calibration(device="puck"))
    found, sha256 = last(small)
    assert found == calibration(1)
    assert len(sha256) == 64


def test_what_was_measured_on_an_emulator_says_nothing_of_hardware(
    small: Small,
) -> None:
    write_calibration(small[0], calibration())
    assert last(small, simulated=False) is None
    (note,) = notes(small, moves=True)
    assert note.endswith("was never calibrated for this study")


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('"who": "Kim",', "", "missing required field `who`"),
        ('"format": 1', '"format": 2', "format 1, got 2"),
        ('"coulomb_nm"', '"other"', "values: needs coulomb_nm, too"),
        ("1.05,", "0.02,", "values.torque_gain: needs a number within its interval"),
        ("1.05,\n      0.9450000000000001,", "0.85,\n      0.8,", "needs 0.9 to 1.1"),
        ("2026-11-30T12:00:00Z", "2026-11-30T12:00:00", "timezone"),
        ("2026-11-30T12:00:00Z", "yesterday", "Invalid RFC3339"),
    ],
)
def test_an_invalid_file_is_refused(
    small: Small, old: str, new: str, words: str
) -> None:
    file = write_calibration(small[0], calibration())
    whole = file.read_text(encoding="utf-8")
    assert old in whole
    file.write_text(whole.replace(old, new), encoding="utf-8")
    with pytest.raises(ParameterError, match=words):
        last(small)


def test_a_session_uses_it_and_records_it(small: Small) -> None:
    study, protocol = small
    file = write_calibration(study, calibration())
    _, sha256 = last(small)
    script = ScriptGrades(["1", "1", "1"])
    run_session(study, protocol, "R1", "test", grades=script, clock="simulated")
    recording = read_recording(next(study.sessions.rglob("*.npz")))
    assert recording.facts["calibration_sha256"] == sha256
    # nine tenths of the least that B may be, and none of β, are taken off the hand
    columns = recording.columns
    rows = columns["ramp"] == 0.0
    off = columns["model_torque_nm"] - columns["command_torque_nm"]
    helping = 0.9 * 0.09 * np.radians(columns["velocity_deg_s"])
    np.testing.assert_allclose(off[rows], helping[rows], atol=1e-9)
    assert verify_study(study).is_whole
    file.write_text(file.read_text("utf-8").replace("Kim", "Lee"), "utf-8")
    changed = verify_study(study)
    assert not changed.is_whole
    assert any(sha256 in finding.message for finding in changed.findings)


def test_what_was_measured_replaces_what_was_assumed(small: Small) -> None:
    device = calibrated(small[1], calibration()).device
    assert device.encoder_noise_deg == 0.01
    assert device.loose_inertia_kg_m2 == 0.08
    assert device.friction_viscous_nms_rad == pytest.approx(0.09)
    assert device.friction_coulomb_nm == 0.0
    assert calibrated(small[1], None) is small[1]


def test_a_motor_that_gives_too_much_is_told_less() -> None:
    device = ScriptedDevice(torque_gain=1.05)
    with device:
        device.command(2.1)
    assert [torque for _, torque in device.commands] == [2.0, 0.0]


@pytest.mark.parametrize(("delay", "kind"), [(0.08, None), (0.0, "actuator")])
def test_the_guard_waits_for_a_torque_that_is_known_to_be_late(
    delay: float, kind: str | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    late = PlantParameters(delay=0.08, lag_time=0.0)
    backend = SimulatedOptions(torque_sensor=TorqueSensor(), arm=late)
    monkeypatch.setattr("masrel.lab.hess.device.Device.torque_delay", delay)
    fault = present("HM2", 60.0, backend=backend).fault
    assert (fault and fault.kind) == kind


def notes(small: Small, *, moves: bool, **device) -> list[str]:
    study, protocol = small
    settings = msgspec.structs.replace(protocol.device, **device)
    changed = msgspec.structs.replace(protocol, device=settings)
    return [*calibration_notes(study, changed, moves_hardware=moves, now=lambda: NOW)]


def test_a_device_that_was_never_calibrated_is_said(small: Small) -> None:
    (note,) = notes(small, moves=True)
    assert note.endswith('"simulated" was never calibrated for this study')
    assert not notes(small, moves=False)


@pytest.mark.parametrize(("most", "is_old"), [(None, 0), (9, 1), (10, 0), (11, 0)])
def test_an_old_calibration_is_said_where_the_protocol_has_a_limit(
    small: Small, most: int | None, is_old: int
) -> None:
    write_calibration(small[0], calibration(days=10, simulated=False))
    found = notes(small, moves=True, calibration_max_days=most)
    assert len(found) == is_old
    assert all("of 2026-11-20 by Kim is 10 days old" in note for note in found)


def test_check_and_status_say_it(
    new_study: Callable[..., Small], masrel: Callable
) -> None:
    study, _ = new_study(
        ("[schedule]", "[device]\ncalibration_max_days = 0\n[schedule]")
    )
    assert "calibration" not in masrel("check", study.root).out
    write_calibration(study, calibration(days=400))
    for done in (masrel("check", study.root), masrel("status", study.root)):
        assert done.code == 0
        assert "device.calibration_max_days (0): the calib" in done.out + done.err


def test_the_report_shows_it(small: Small) -> None:
    study, protocol = small
    write_calibration(study, calibration())
    script = ScriptGrades(["1", "1", "1"])
    run_session(study, protocol, "R1", "test", grades=script, clock="simulated")
    conduct = study_conduct(study, protocol)
    assert conduct is not None
    assert conduct.inputs["calibration_sha256"] == conduct.calibration[1]


def test_radians_of_a_noise_are_those_of_its_degrees(small: Small) -> None:
    from masrel.lab.run._settings import device_limits

    limits = device_limits(calibrated(small[1], calibration()).device)
    assert limits.encoder_noise == radians(0.01)
