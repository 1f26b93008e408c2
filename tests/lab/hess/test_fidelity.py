"""Rendered torque beside the one that was asked for, and how late ticks are."""

from dataclasses import replace

import numpy as np
import pytest

from masrel.lab.hess import PlantParameters, SimulatedOptions, TorqueSensor
from masrel.lab.hess._calibration import compare_models, lateness_ms, rendered
from masrel.lab.recording import ESTIMATED_TORQUE, RECORDING_COLUMNS, Recording

from .rig import present


def recording(time_s: np.ndarray, **columns: np.ndarray) -> Recording:
    """One of zeros, but for some columns, with a board that estimates its torque."""
    zeros = dict.fromkeys(RECORDING_COLUMNS, np.zeros(time_s.size))
    channel = {ESTIMATED_TORQUE.column: np.zeros(time_s.size)}
    every = {n: c.copy() for n, c in {**zeros, **channel, **columns}.items()}
    return Recording(
        columns={**every, "time_s": time_s}, facts={}, channels=(ESTIMATED_TORQUE,)
    )


def test_a_wave_that_is_late_differs_by_what_trigonometry_says() -> None:
    # A sin ωt less A sin ω(t - d) is 2 A sin(ωd/2) at most, and that over √2 as a root
    # of the mean square
    time, omega, late = np.arange(1000) * 1e-3, 2.0 * np.pi * 5.0, 0.004
    sent, given = (3.0 * np.sin(omega * (time - d)) for d in (0.0, late))
    found = rendered(recording(time, command_torque_nm=sent, estimated_torque_nm=given))
    most = 6.0 * np.sin(0.5 * omega * late)
    assert found["max_nm"] == pytest.approx(most, rel=1e-3)
    assert found["rmse_nm"] == pytest.approx(most / np.sqrt(2.0), rel=1e-3)
    assert found["peak_nm"] == pytest.approx(3.0, rel=1e-3)
    assert found["delay_ms"] == pytest.approx(4.0, abs=0.02)


def test_a_motor_that_is_later_is_seen_by_the_sensor_behind_friction() -> None:
    sensor, arm = TorqueSensor(noise=0.0, step=0.0), PlantParameters()
    delays = [
        rendered(
            present(
                "HM4",
                80.0,
                backend=SimulatedOptions(
                    torque_sensor=sensor, arm=replace(arm, delay=arm.delay + more)
                ),
            ).recording
        )["delay_ms"]
        for more in (0.0, 0.003)
    ]
    # .5 of delay, .5 of lag, .8 of the sensor, .5 of a torque that is held for a tick
    assert delays[0] == pytest.approx(2.3, abs=0.2)
    assert delays[1] - delays[0] == pytest.approx(3.0, abs=0.1)


def test_a_device_without_either_torque_says_nothing_of_it() -> None:
    assert rendered(present("HM2").recording) == {}
    models, (line,) = compare_models([{"model": "HM2", "mean_speed_deg_s": 92.0}])
    assert (models, line) == (
        {},
        "torque: the device neither measures nor estimates it",
    )


def test_stretches_of_a_model_are_the_sample_of_its_interval() -> None:
    # Mean .2, standard deviation .1, three of them: t of 2 df is 4.303
    one = {"model": "HM1", "mean_speed_deg_s": 90.0, "delay_ms": 2.0, "peak_nm": 4.0}
    several = [{**one, "rmse_nm": r, "max_nm": 5.0 * r} for r in (0.1, 0.2, 0.3)]
    models, _ = compare_models(several)
    half = 4.302652730 * 0.1 / np.sqrt(3.0)
    assert models["HM1"]["rmse_nm"] == pytest.approx((0.2, 0.2 - half, 0.2 + half))
    assert models["HM1"]["max_nm"] == 1.5
    assert models["HM1"]["percent_of_peak"] == pytest.approx(5.0)


def test_lateness_is_beside_the_prompt_ticks() -> None:
    # readings take 0.4 ms, and one that is 0.9 ms late comes in the next tick's time
    late_ms = np.zeros(2000)
    late_ms[[300, 700, 1100]] = 0.2, 0.5, 0.9
    made = recording(np.arange(2000) * 1e-3 + 1e-3 * (0.4 + late_ms))
    np.testing.assert_allclose(lateness_ms([made], 1000), late_ms, atol=1e-6)
