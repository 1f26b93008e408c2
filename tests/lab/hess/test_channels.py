"""What a device measures beside the angle is recorded, and what fails there is said."""

import math
import warnings
from collections.abc import Callable
from dataclasses import replace
from math import radians
from pathlib import Path

import numpy as np
import pytest

from masrel.errors import ParameterError, RecordingWarning
from masrel.lab.elbow import STANDARD_MODELS
from masrel.lab.hess import (
    Controller,
    DeviceLimits,
    Presented,
    ReplayOptions,
    SimulatedClock,
    SimulatedHand,
    SimulatedOptions,
    StretchRules,
    TorqueSensor,
    cut_off,
    open_device,
    run_presentation,
)
from masrel.lab.recording import (
    MEASURED_TORQUE,
    RECORDING_COLUMNS,
    Channel,
    read_recording,
    write_recording,
)
from tests.lab.hess.rig import END, START, ScriptedDevice

MEASURED = MEASURED_TORQUE.column
SENSING = SimulatedOptions(torque_sensor=TorqueSensor())


def presented(
    options: SimulatedOptions | None = SENSING, *, spool: Path | None = None
) -> Presented:
    """HM3 at 92 deg/s on the simulated device."""
    clock = SimulatedClock()
    hand = SimulatedHand(start=START, end=END, mean_speed=radians(92.0))
    controller = Controller(STANDARD_MODELS["HM3"], start_angle=START)
    with open_device("simulated", clock=clock, hand=hand, options=options) as device:
        return run_presentation(
            device,
            controller,
            clock=clock,
            limits=DeviceLimits(),
            end_angle=END,
            spool=spool,
        )


def stretched(
    values: Callable[[float], tuple[float, ...]],
    *channels: Channel,
) -> Presented:
    """HM3 at an even 60 deg/s for half a second, and what `values` gives meanwhile."""
    clock = SimulatedClock()
    device = ScriptedDevice(clock, lambda time_s: START + radians(60.0) * time_s)
    device.channels, device.values = channels, values
    with device:
        return run_presentation(
            device,
            Controller(STANDARD_MODELS["HM3"], start_angle=START),
            clock=clock,
            limits=DeviceLimits(jump_angle=0.1, drift_speed=0.01),
            max_duration_s=0.5,
        )


# Recorded


def test_the_sensor_reads_the_torque_that_the_model_asked_for() -> None:
    # Nine tenths of the friction are compensated: at 92 deg/s 0.05 N·m are left
    columns = presented().recording.columns
    off = columns[MEASURED] - columns["model_torque_nm"]
    even = (columns["time_s"] > 0.15) & (columns["angle_deg"] < 143.0)
    for jump in np.flatnonzero(np.abs(np.diff(columns["model_torque_nm"])) > 0.5):
        even[jump : jump + 15] = False  # motor and sensor follow within 15 ms
    assert even.sum() > 1000
    tenth = 0.1 * (0.168 * radians(92.0) + 0.189)
    assert np.mean(off[even]) == pytest.approx(tenth, abs=0.015)
    assert np.abs(off[even]).max() < 0.2


def test_the_torque_of_the_device_is_the_same_with_a_sensor_and_without() -> None:
    sensed, bare = presented().recording, presented(None).recording
    assert (sensed.channels, bare.channels) == ((MEASURED_TORQUE,), ())
    for name in RECORDING_COLUMNS:
        assert sensed.columns[name].tobytes() == bare.columns[name].tobytes()
    assert not {key for key in bare.facts if "channel" in key or "missing" in key}


def test_the_noise_is_that_of_the_seed() -> None:
    first, same = presented().recording, presented().recording
    assert first.columns[MEASURED].tobytes() == same.columns[MEASURED].tobytes()
    other = presented(SimulatedOptions(torque_sensor=TorqueSensor(seed=1))).recording
    assert (other.columns[MEASURED] != first.columns[MEASURED]).mean() > 0.5


def test_every_stretch_of_a_presentation_has_its_measured_torque() -> None:
    clock = SimulatedClock()
    speed = radians(92.0)
    hand = SimulatedHand(
        start=START, end=END, mean_speed=speed, again=(speed, speed), returns=True
    )
    with open_device("simulated", clock=clock, hand=hand, options=SENSING) as device:
        presentation = run_presentation(
            device,
            Controller(STANDARD_MODELS["HM3"], start_angle=START),
            clock=clock,
            limits=DeviceLimits(),
            end_angle=END,
            stretches=StretchRules(n=3),
            max_duration_s=20.0,
        )
    recording = presentation.recording
    assert recording.facts["ended"] == "stretches"
    assert recording.facts["channel_faults"] is None
    torque, number = recording.columns[MEASURED], recording.columns["stretch"]
    assert np.isfinite(torque).all()
    peaks = [torque[number == stretch].max() for stretch in (1, 2, 3)]
    # Each is the end of post-catch: 0.02 N·m of noise and 10 ms of the hand's ramp
    assert max(peaks) - min(peaks) < 0.3
    assert min(peaks) > 10.0


def test_a_replay_gives_the_channels_again() -> None:
    first = presented().recording
    clock = SimulatedClock()
    with open_device(
        "replay", clock=clock, options=ReplayOptions(recording=first)
    ) as device:
        again = run_presentation(
            device,
            Controller(STANDARD_MODELS["HM3"], start_angle=START),
            clock=clock,
            limits=DeviceLimits(),
            end_angle=END,
        ).recording
    assert again.channels == first.channels
    assert again.columns[MEASURED].tobytes() == first.columns[MEASURED].tobytes()


def test_a_process_that_died_leaves_the_channels_too(tmp_path: Path) -> None:
    path = tmp_path / "a.partial"
    spooled = presented(spool=path).recording
    left = cut_off(path)
    assert left is not None
    assert left.recording.channels == (MEASURED_TORQUE,)
    column = left.recording.columns[MEASURED]
    assert column.tobytes() == spooled.columns[MEASURED].tobytes()


def test_channels_of_any_name_and_unit_are_written_and_read(tmp_path: Path) -> None:
    emg, key = Channel(name="emg_biceps", unit="mv"), Channel(name="key")
    recording = stretched(lambda time_s: (time_s, float(time_s > 0.3)), emg, key)
    write_recording(recording.recording, tmp_path / "a.npz")
    back = read_recording(tmp_path / "a.npz")
    assert back.channels == (emg, key)
    assert back.columns["emg_biceps_mv"].tolist() == back.columns["time_s"].tolist()
    assert set(back.columns["key"]) == {0.0, 1.0}


# What fails


def test_a_number_that_does_not_come_is_missing_and_that_is_said() -> None:
    # Late, none at all, or infinite: there is no number for that reading
    def values(time_s: float) -> tuple[float]:
        if time_s < 0.1:
            return (math.nan,)
        return (math.inf,) if time_s < 0.15 else (-math.inf if time_s < 0.2 else 0.5,)

    emg = Channel(name="emg_biceps", unit="mv")
    words = r"^scripted: emg_biceps_mv: no number in 200 of \d+ samples$"
    with pytest.warns(RecordingWarning, match=words):
        presentation = stretched(values, emg)
    recording = presentation.recording
    assert presentation.fault is None  # a grade does not rest on it
    assert np.isnan(recording.columns["emg_biceps_mv"][:200]).all()
    assert (recording.columns["emg_biceps_mv"][200:] == 0.5).all()
    assert recording.facts["n_missing_emg_biceps_mv"] == 200
    assert str(recording.facts["channel_faults"]).startswith("emg_biceps_mv: no number")


@pytest.mark.parametrize("value", [0.0, 3.1])
def test_a_torque_sensor_that_stays_where_it_is_is_said(value: float) -> None:
    words = (
        rf"^scripted: measured_torque_nm: stays at {value:.2f} N·m for 0\.\d\d s while "
        r"the torque that is sent changes by \d\.\d\d N·m$"
    )
    with pytest.warns(RecordingWarning, match=words):
        presentation = stretched(lambda _time_s: (value,), MEASURED_TORQUE)
    assert presentation.fault is None


def test_a_torque_sensor_at_the_end_of_its_range_is_said() -> None:
    with pytest.warns(RecordingWarning, match="stays at 2.00 N·m"):
        stretched(lambda time_s: (min(2.0, 20.0 * time_s),), MEASURED_TORQUE)


def test_a_sensor_that_works_is_not_suspected() -> None:
    # Of no noise, and with steps of half a N·m
    coarse = TorqueSensor(noise=0.0, step=0.5)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        for options in (SENSING, SimulatedOptions(torque_sensor=coarse)):
            assert presented(options).recording.facts["channel_faults"] is None


def test_what_stays_is_no_fault_of_other_channels() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        stretched(lambda _time_s: (0.0,), Channel(name="key"))


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
    def angle(time_s: float) -> float:
        return START + radians(60.0) * time_s + (0.5 if time_s > 0.3 else 0.0)

    clock = SimulatedClock()
    device = ScriptedDevice(clock, angle)
    device.channels = (MEASURED_TORQUE,)
    device.values = lambda time_s: (10.0 * time_s,)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        presentation = run_presentation(
            device.__enter__(),
            Controller(STANDARD_MODELS["HM3"], start_angle=START),
            clock=clock,
            limits=DeviceLimits(drift_speed=0.01),
        )
    assert presentation.fault is not None
    assert presentation.fault.kind == "jump"
    columns = presentation.recording.columns
    assert np.isnan(columns[MEASURED][columns["ramp"] == 3]).all()
    assert np.isfinite(columns[MEASURED][columns["ramp"] == 0]).all()
    assert presentation.recording.facts[f"n_missing_{MEASURED}"] == 0


# What cannot be


@pytest.mark.parametrize(
    "change", [{"noise": -0.1}, {"lag_time": math.nan}, {"step": math.inf}]
)
def test_a_sensor_that_cannot_be_is_refused(change: dict[str, float]) -> None:
    with pytest.raises(ParameterError, match="needs 0 or more, got"):
        replace(TorqueSensor(), **change)


def test_more_channels_than_a_file_can_name_are_refused(tmp_path: Path) -> None:
    channels = tuple(Channel(name=f"emg_of_muscle_{i}", unit="mv") for i in range(100))
    clock = SimulatedClock()
    device = ScriptedDevice(clock)
    device.channels = channels
    with device, pytest.raises(ParameterError, match="got 100 channels"):
        run_presentation(
            device,
            Controller(STANDARD_MODELS["HM3"], start_angle=START),
            clock=clock,
            limits=DeviceLimits(),
            spool=tmp_path / "a.partial",
        )
