"""A recording played back asks the same of the controller, and gets the same answer."""

from dataclasses import replace
from math import radians
from pathlib import Path

import numpy as np
import pytest

from masrel.errors import DeviceError
from masrel.lab.elbow import STANDARD_MODELS
from masrel.lab.hess import (
    BackendOptions,
    Clock,
    Controller,
    Device,
    RealClock,
    ReplayOptions,
    SimulatedClock,
    open_device,
    run_presentation,
)
from masrel.lab.recording import (
    RECORDING_COLUMNS,
    Recording,
    read_recording,
    write_recording,
)
from tests.lab.hess.puck.rig import fault
from tests.lab.hess.puck.rig import presented as on_a_puck
from tests.lab.hess.rig import END, LIMITS, START
from tests.lab.hess.rig import present as on_the_simulated_device


def replaying(recording: Recording, clock: Clock) -> Device:
    options = ReplayOptions(recording=recording)
    return open_device("replay", clock=clock, options=options)


def played_back(recording: Recording, model: str, *, start_ns: int = 0) -> Recording:
    clock = SimulatedClock(start_ns)
    controller = Controller(STANDARD_MODELS[model], start_angle=START)
    with replaying(recording, clock) as device:
        return run_presentation(
            device, controller, clock=clock, limits=LIMITS, end_angle=END
        ).recording


def is_the_same(again: Recording, first: Recording, n: int | None = None) -> bool:
    return all(
        np.array_equal(again.columns[name][:n], first.columns[name][:n])
        for name in RECORDING_COLUMNS
    )


# The same inputs give the same torques


@pytest.mark.parametrize("model", ["HM1", "HM2", "HM3", "HM4"])
@pytest.mark.parametrize("speed_deg_s", [40.0, 72.0, 100.0])
def test_it_gives_the_same_torques_bit_for_bit(model: str, speed_deg_s: float) -> None:
    first = on_the_simulated_device(model, speed_deg_s).recording
    again = played_back(first, model, start_ns=987_654_321)
    assert is_the_same(again, first)
    assert again.facts["ended"] == first.facts["ended"]
    assert (again.facts["device"], again.facts["simulated"]) == ("replay", True)


def test_it_does_so_for_what_a_puck_counted() -> None:
    first = on_a_puck()[0].recording
    assert is_the_same(played_back(first, "HM3"), first)


@pytest.mark.filterwarnings("ignore::masrel.errors.OverrunWarning")
def test_it_does_so_where_replies_were_missed() -> None:
    lost = fault("dropped-replies", 0.5, end_s=0.5015)
    first = on_a_puck(lost)[0].recording
    assert np.diff(first.columns["time_s"]).max() > 0.0025  # two rows are missing
    again = played_back(first, "HM3")
    assert is_the_same(again, first)


def test_it_does_so_after_the_recording_was_written_and_read(tmp_path: Path) -> None:
    first = on_the_simulated_device("HM4", 72.0).recording
    write_recording(first, tmp_path / "one.npz")
    assert is_the_same(played_back(read_recording(tmp_path / "one.npz"), "HM4"), first)


def test_another_model_gives_other_torques() -> None:
    first = on_the_simulated_device("HM2", 92.0).recording
    again = played_back(first, "HM4")
    assert np.array_equal(again.columns["angle_deg"], first.columns["angle_deg"])
    assert not np.array_equal(
        again.columns["model_torque_nm"], first.columns["model_torque_nm"]
    )


def test_after_a_fault_the_recording_ends() -> None:
    first = on_a_puck(fault("frozen-encoder", 0.7))[0].recording
    noticed_s = float(first.facts["fault_time_s"] or 0.0)
    n_before = int(np.sum(first.columns["time_s"] < noticed_s))
    again = played_back(first, "HM3")
    assert is_the_same(again, first, n_before)
    assert again.facts["fault"] == "replay: the recording has no more readings"


def test_on_a_real_clock_it_takes_its_time() -> None:
    first = on_the_simulated_device("HM3", 100.0).recording
    clock = RealClock()
    with replaying(first, clock) as device:
        begun_ns = clock.now_ns()
        for _ in range(20):
            reading = device.read()
            assert reading.time_ns <= clock.now_ns()
    assert clock.now_ns() - begun_ns >= 19_000_000


def test_speeds_of_another_estimate_leave_the_nearest_radians() -> None:
    first = on_the_simulated_device("HM3", 92.0).recording
    smoothed = first.columns["velocity_deg_s"] * 0.9
    foreign = replace(first, columns={**first.columns, "velocity_deg_s": smoothed})
    with replaying(foreign, SimulatedClock()) as device:
        assert not device.is_exact
    again = played_back(foreign, "HM3")
    # One last bit of the angle, 4e-16 rad, is 4e-13 rad/s over 1 ms
    for name in ("model_torque_nm", "command_torque_nm"):
        off = np.abs(again.columns[name] - first.columns[name])
        assert off.max() < 1e-11


# What cannot be played back


def test_it_needs_a_recording() -> None:
    with pytest.raises(DeviceError, match="of type ReplayOptions, got none"):
        open_device("replay", clock=SimulatedClock())
    with pytest.raises(DeviceError, match="of type ReplayOptions, got BackendOptions"):
        open_device("replay", clock=SimulatedClock(), options=BackendOptions())


@pytest.mark.parametrize("times", [[], [0.0, 0.0], [0.0, 0.002, 0.001], [-0.001, 0.0]])
def test_it_needs_readings_whose_times_grow(times: list[float]) -> None:
    columns = {name: np.zeros(len(times)) for name in RECORDING_COLUMNS}
    columns["time_s"] = np.array(times)
    recording = Recording(columns=columns, facts={})
    with pytest.raises(DeviceError, match="readings whose times grow from 0 on"):
        replaying(recording, SimulatedClock())


def test_its_first_reading_is_where_the_stretch_started() -> None:
    recording = on_the_simulated_device("HM1", 60.0).recording
    with replaying(recording, SimulatedClock()) as device:
        assert device.read().angle == pytest.approx(radians(30.0), abs=1e-4)
