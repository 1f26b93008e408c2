"""A recording played back asks the same of the controller, and gets the same answer."""

from dataclasses import replace
from math import radians
from pathlib import Path

import numpy as np
import pytest

from masrel.errors import DeviceError
from masrel.lab.hess import (
    BackendOptions,
    Clock,
    Device,
    RealClock,
    ReplayOptions,
    SimulatedClock,
    SimulatedOptions,
    TorqueSensor,
    open_device,
    run_presentation,
)
from masrel.lab.recording import (
    MEASURED_TORQUE,
    RECORDING_COLUMNS,
    Recording,
    read_recording,
    write_recording,
)
from tests.lab.hess.puck.rig import fault
from tests.lab.hess.puck.rig import presented as on_a_puck
from tests.lab.hess.rig import END, LIMITS, controls, present, same_columns


def replaying(recording: Recording, clock: Clock) -> Device:
    options = ReplayOptions(recording=recording)
    return open_device("replay", clock=clock, options=options)


def played_back(recording: Recording, model: str, *, start_ns: int = 0) -> Recording:
    clock = SimulatedClock(start_ns)
    with replaying(recording, clock) as device:
        options = {"clock": clock, "limits": LIMITS, "end_angle": END}
        return run_presentation(device, controls(model), **options).recording


# The same inputs give the same torques


@pytest.mark.parametrize(("model", "speed_deg_s"), [("HM1", 100.0), ("HM4", 40.0)])
def test_it_gives_the_same_torques_bit_for_bit(
    model: str, speed_deg_s: float, tmp_path: Path
) -> None:
    sensing = SimulatedOptions(torque_sensor=TorqueSensor())
    first = present(model, speed_deg_s, backend=sensing).recording
    write_recording(first, tmp_path / "one.npz")
    read = read_recording(tmp_path / "one.npz")
    again = played_back(read, model, start_ns=987_654_321)
    assert same_columns(again, first)
    assert again.channels == (MEASURED_TORQUE,)
    assert again.facts["ended"] == first.facts["ended"]
    assert (again.facts["device"], again.facts["simulated"]) == ("replay", True)
    other = played_back(read, "HM3")  # its torque is not what the sensor measured
    assert other.facts["ended"] == first.facts["ended"]


@pytest.mark.filterwarnings("ignore::masrel.errors.OverrunWarning")
@pytest.mark.parametrize(
    "faults", [(), (fault("dropped-replies", 0.5, end_s=0.5015),)], ids=["", "missed"]
)
def test_it_does_so_for_what_a_puck_counted_and_where_replies_were_missed(
    faults: tuple,
) -> None:
    first = on_a_puck(*faults)[0].recording
    rows_are_missing = np.diff(first.columns["time_s"]).max() > 0.0025
    assert rows_are_missing == bool(faults)
    assert same_columns(played_back(first, "HM3"), first)


def test_after_a_fault_the_recording_ends() -> None:
    first = on_a_puck(fault("frozen-encoder", 0.7))[0].recording
    noticed_s = float(first.facts["fault_time_s"] or 0.0)
    n_before = int(np.sum(first.columns["time_s"] < noticed_s))
    again = played_back(first, "HM3")
    assert same_columns(again, first, n_before)
    assert again.facts["fault"] == "replay: the recording has no more readings"


def test_on_a_real_clock_it_takes_its_time_from_where_the_stretch_started() -> None:
    clock = RealClock()
    with replaying(present("HM3", 100.0).recording, clock) as device:
        begun_ns = clock.now_ns()
        readings = [device.read() for _ in range(20)]
        assert readings[-1].time_ns <= clock.now_ns()
    assert clock.now_ns() - begun_ns >= 19_000_000
    assert readings[0].angle == pytest.approx(radians(30.0), abs=1e-4)


def test_speeds_of_another_estimate_leave_the_nearest_radians() -> None:
    first = present().recording
    smoothed = first.columns["velocity_deg_s"] * 0.9
    foreign = replace(first, columns={**first.columns, "velocity_deg_s": smoothed})
    again = played_back(foreign, "HM3")
    # One last bit of the angle, 4e-16 rad, is 4e-13 rad/s over 1 ms
    for name in ("model_torque_nm", "command_torque_nm"):
        off = np.abs(again.columns[name] - first.columns[name])
        assert off.max() < 1e-11


# What cannot be played back


@pytest.mark.parametrize("options", [None, BackendOptions()])
def test_it_needs_a_recording(options: BackendOptions | None) -> None:
    with pytest.raises(DeviceError, match=r"of type ReplayOptions, got (none|Backend)"):
        open_device("replay", clock=SimulatedClock(), options=options)


@pytest.mark.parametrize("times", [[], [0.0, 0.0], [0.0, 0.002, 0.001], [-0.001, 0.0]])
def test_it_needs_readings_whose_times_grow(times: list[float]) -> None:
    columns = {name: np.zeros(len(times)) for name in RECORDING_COLUMNS}
    columns["time_s"] = np.array(times)
    recording = Recording(columns=columns, facts={})
    with pytest.raises(DeviceError, match="readings whose times grow from 0"):
        replaying(recording, SimulatedClock())
