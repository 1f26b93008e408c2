"""Samples in a file outlive their process; what a device measures beside the angle.

What was sampled is there for whoever comes after the process that took it; channels are
recorded, and what fails in them is said.
"""

import errno
import json
import math
import mmap
import warnings
from collections.abc import Callable
from math import degrees, radians
from pathlib import Path

import numpy as np
import pytest

from masrel.errors import ParameterError, RecordingError, RecordingWarning
from masrel.lab.hess import (
    DeviceLimits,
    Presented,
    SimulatedClock,
    SimulatedOptions,
    TorqueSensor,
    cut_off,
)
from masrel.lab.recording import (
    MEASURED_TORQUE,
    RECORDING_COLUMNS,
    Channel,
)

from .rig import START, ScriptedDevice, present, same_columns, scripted

HEADER, WORD = 4096, 8
FACTS = {"rate_hz": 2000, "speed_threshold_deg_s": 17.0, "n_columns": 8}


@pytest.fixture
def spool(tmp_path: Path) -> Path:
    return tmp_path / "sub" / "a.partial"


def left_at(spool: Path, time_s: float) -> list[Presented | None]:
    """Cut a presentation off where its samples go on -> what is left."""
    left = []

    def angle(now_s: float) -> float:
        if abs(now_s - time_s) < 1e-9:
            left.append(cut_off(spool))
        return START + 0.5 * now_s

    scripted(angle, spool=spool)
    return left


def laid(
    path: Path, facts: object, *rows: tuple[float, ...], n: float | None = None
) -> Presented | None:
    """What is read of a file with such facts, where three samples fit in."""
    columns = np.zeros((len(rows[0]) if rows else 8, 3))
    if rows:
        columns[:, : len(rows)] = np.array(rows).T
    header = json.dumps(facts).encode().ljust(HEADER)
    path.parent.mkdir(exist_ok=True)
    n = len(rows) if n is None else n
    path.write_bytes(header + np.array([n, *columns.ravel()]).tobytes())
    return cut_off(path)


def test_what_was_added_is_in_the_file_and_what_was_cut_off_says_where(spool) -> None:
    # Each sample is there when it is taken: the reading of 3 ms finds three.
    (left,) = left_at(spool, 0.003)
    assert left is not None
    assert left.fault is not None
    columns, facts = left.recording.columns, left.recording.facts
    assert set(columns) == set(RECORDING_COLUMNS)
    assert columns["time_s"].tolist() == pytest.approx([0.0, 1e-3, 2e-3])
    degrees_read = [degrees(START + 0.5 * tick * 1e-3) for tick in range(3)]
    assert columns["angle_deg"].tolist() == pytest.approx(degrees_read)
    assert left.fault.kind == facts["fault_kind"] == "process"
    assert left.fault.time_s == columns["time_s"][-1]
    assert left.fault.torque_nm == columns["command_torque_nm"][-1]
    assert (facts["ended"], facts["device"]) == ("fault", "scripted")
    assert (facts["rate_hz"], facts["speed_threshold_deg_s"]) == (1000, 20.0)
    assert left_at(spool.with_name("b.partial"), 0.0) == [None]  # not one sample yet


def test_the_whole_file_is_there_before_the_first_sample(spool) -> None:
    sizes = []

    def angle(_time_s: float) -> float:
        status = spool.stat()
        sizes.append((status.st_size, status.st_blocks * 512))
        return START

    scripted(angle, spool=spool, max_duration_s=1.0)
    (size,) = {size for size, _ in sizes}
    assert size == HEADER + WORD * (1 + 8 * (1000 + 155))  # and the ramps
    assert sizes[0][1] >= size  # not sparse: the disk has given it


def test_a_spooled_presentation_is_the_same_to_the_last_bit(spool) -> None:
    options = SimulatedOptions(torque_sensor=TorqueSensor())
    spooled = present(backend=options, spool=spool).recording
    kept = present(backend=options).recording
    assert same_columns(spooled, kept)
    left = cut_off(spool)  # whoever did not remove it can read it all again
    assert left is not None
    assert left.recording.channels == (MEASURED_TORQUE,)
    assert same_columns(left.recording, kept)
    for name in ("phases", "catch_angle_deg", "mean_speed_deg_s", "device"):
        assert left.recording.facts[name] == kept.facts[name]


@pytest.mark.parametrize(
    ("times_s", "n_missed"),
    [
        ((0.0, 0.001, 0.002), 2),  # 2 ms at 2 kHz are five ticks, three are there
        ((0.0, 0.0002, 0.0005), 0),  # a row of a ramp between two ticks
    ],
)
def test_a_ramp_between_two_ticks_is_no_tick_that_was_missed(
    spool, times_s: tuple[float, ...], n_missed: int
) -> None:
    rows = [(time_s, 0.5, 1.0, 2.0, 3.0, 1.0, 0.0, 1.0) for time_s in times_s]
    left = laid(spool, {**FACTS, "capacity": 3}, *rows)
    assert left is not None
    assert left.n_missed_ticks == n_missed


def test_samples_of_a_process_that_died_before_there_were_ramps_are_read(spool) -> None:
    facts = {"rate_hz": 1000, "speed_threshold": 0.35, "capacity": 3}
    left = laid(spool, facts, (0.0, 0.5, 1.0, 2.0, 3.0, 1.0))
    assert left is not None
    columns = {k: v.tolist() for k, v in left.recording.columns.items()}
    assert columns == {
        "time_s": [0.0],
        "angle_deg": [degrees(0.5)],
        "velocity_deg_s": [degrees(1.0)],
        "model_torque_nm": [2.0],
        "command_torque_nm": [3.0],
        "phase": [1.0],
        "ramp": [0.0],
        "stretch": [1.0],
    }


def test_a_disk_that_fills_while_it_is_laid_down_leaves_no_file(
    spool, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(mmap, "mmap", full)  # the last thing that asks the disk
    device = ScriptedDevice(SimulatedClock())
    with device, pytest.raises(OSError, match="No space left") as caught:
        scripted(device=device, spool=spool)
    assert caught.value.filename == str(spool)
    assert not spool.exists()
    assert (device.n_reads, device.commands[:-1]) == (0, [])  # before the arm moves


def test_a_link_in_its_place_is_not_followed(spool) -> None:
    other = spool.parent.parent / "other"
    other.write_text("of somebody else")
    spool.parent.mkdir()
    spool.symlink_to(other)
    device = ScriptedDevice(SimulatedClock())
    with device, pytest.raises(OSError, match="is a link"):
        scripted(device=device, spool=spool)
    assert other.read_text() == "of somebody else"


@pytest.mark.parametrize("n_bytes", [0, 100, 4096, 4100, 4104, 4105, 4200])
def test_a_file_that_was_never_laid_down_is_nothing(spool, n_bytes: int) -> None:
    assert laid(spool, {**FACTS, "capacity": 3}) is None
    spool.write_bytes(spool.read_bytes()[:n_bytes])
    assert cut_off(spool) is None


ROW = (0.0, 0.5, 1.0, 2.0, 3.0, 1.0, 0.0, 1.0)


@pytest.mark.parametrize(
    ("facts", "n"),
    [
        ({"device": "none"}, None),
        ({"capacity": 3}, None),
        ({**FACTS, "capacity": None}, None),
        ({**FACTS, "capacity": -1}, None),
        ({**FACTS, "capacity": 0}, None),
        ({**FACTS, "capacity": 99}, None),  # more than there is
        ({**FACTS, "rate_hz": "x", "capacity": 3}, None),
        ({**FACTS, "capacity": 3, "channels": [{"unit": "mv"}]}, None),
        (5, None),
        ([], None),
        *(({**FACTS, "capacity": 3}, n) for n in (np.inf, np.nan, 0.5, 4.0, -1.0)),
    ],
)
def test_anything_else_is_refused_with_a_way_out(
    spool, facts: object, n: float | None
) -> None:
    with pytest.raises(RecordingError, match=r"a\.partial: needs .* move it away"):
        laid(spool, facts, ROW, n=n)
    spool.write_bytes(b"x" * 5000)
    with pytest.raises(RecordingError, match=r"a\.partial: needs .* move it away"):
        cut_off(spool)


# Channels

MEASURED = MEASURED_TORQUE.column
EMG, KEY = Channel(name="emg_biceps", unit="mv"), Channel(name="key")


def sensing(**options: float) -> SimulatedOptions:
    return SimulatedOptions(torque_sensor=TorqueSensor(**options))


def moving(time_s: float) -> float:
    return START + radians(60.0) * time_s


def stretched(
    values: Callable[[float], tuple], *channels: Channel, angle=moving, **options
) -> Presented:
    """HM3 at an even 60 deg/s for half a second, and what `values` gives meanwhile."""
    device = ScriptedDevice(SimulatedClock(), angle)
    device.channels, device.values = channels, values
    limits = DeviceLimits(jump_angle=0.1, drift_speed=0.01)
    return scripted(
        device=device, **{"limits": limits, "max_duration_s": 0.5, **options}
    )[1]


# Recorded


def test_a_sensor_changes_no_torque_and_its_noise_is_that_of_the_seed() -> None:
    sensed, bare = present(backend=sensing()).recording, present().recording
    assert (sensed.channels, bare.channels) == ((MEASURED_TORQUE,), ())
    for name in RECORDING_COLUMNS:
        assert sensed.columns[name].tobytes() == bare.columns[name].tobytes()
    assert not {key for key in bare.facts if "channel" in key or "missing" in key}
    same, other = (
        present(backend=sensing(seed=seed)).recording.columns[MEASURED]
        for seed in (0, 1)
    )
    assert sensed.columns[MEASURED].tobytes() == same.tobytes()
    assert (other != same).mean() > 0.5


# What fails


def test_a_number_that_does_not_come_is_missing_and_that_is_said() -> None:
    # Late, none at all, or infinite: there is no number for that reading
    def values(time_s: float) -> tuple[float]:
        if time_s < 0.1:
            return (math.nan,)
        return (math.inf,) if time_s < 0.15 else (-math.inf if time_s < 0.2 else 0.5,)

    words = r"^scripted: emg_biceps_mv: no number in 200 of \d+ samples$"
    with pytest.warns(RecordingWarning, match=words):
        presentation = stretched(values, EMG)
    recording = presentation.recording
    assert presentation.fault is None  # a grade does not rest on it
    assert np.isnan(recording.columns["emg_biceps_mv"][:200]).all()
    assert (recording.columns["emg_biceps_mv"][200:] == 0.5).all()
    assert recording.facts["n_missing_emg_biceps_mv"] == 200
    assert str(recording.facts["channel_faults"]).startswith("emg_biceps_mv: no number")


def test_a_torque_sensor_at_the_end_of_its_range_is_said() -> None:
    words = (
        r"^scripted: measured_torque_nm: stays at 2\.00 N·m for 0\.\d\d s while "
        r"the torque that is sent changes by \d\.\d\d N·m$"
    )
    with pytest.warns(RecordingWarning, match=words):
        presentation = stretched(
            lambda time_s: (min(2.0, 20.0 * time_s),), MEASURED_TORQUE
        )
    assert presentation.fault is None


def test_a_sensor_that_works_or_measures_something_else_is_not_suspected() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        # Of no noise, and with steps of half a N·m
        for options in (sensing(), sensing(noise=0.0, step=0.5)):
            made = present(backend=options)
            assert made.recording.facts["channel_faults"] is None
        stretched(lambda _time_s: (0.0,), KEY)


@pytest.mark.parametrize("values", [(), (1.0, 2.0), (None,), ("1",)])
def test_a_device_that_does_not_give_what_it_declares_has_a_fault(values) -> None:
    presentation = stretched(lambda _time_s: values, MEASURED_TORQUE)
    assert presentation.fault is not None
    assert presentation.fault.kind == "device"
    assert presentation.fault.message == (
        "scripted: needs a number for each of its channels (measured_torque), "
        f"got {values}"
    )


def test_a_ramp_after_a_fault_has_no_readings_and_misses_none() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        presentation = stretched(
            lambda time_s: (10.0 * time_s,),
            MEASURED_TORQUE,
            angle=lambda t: moving(t) + (0.5 if t > 0.3 else 0.0),
        )
    assert presentation.fault is not None
    assert presentation.fault.kind == "jump"
    columns = presentation.recording.columns
    assert np.isnan(columns[MEASURED][columns["ramp"] == 3]).all()
    assert np.isfinite(columns[MEASURED][columns["ramp"] == 0]).all()
    assert presentation.recording.facts[f"n_missing_{MEASURED}"] == 0


# What cannot be


def test_more_channels_than_a_file_can_name_are_refused(tmp_path: Path) -> None:
    device = ScriptedDevice(SimulatedClock())
    device.channels = tuple(Channel(name=f"emg_of_muscle_{i:03}") for i in range(100))
    with device, pytest.raises(ParameterError, match="got 100 channels"):
        scripted(device=device, spool=tmp_path / "a.partial")
