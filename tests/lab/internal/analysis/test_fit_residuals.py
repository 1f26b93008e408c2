"""What a fit leaves over is what the fit says it leaves over."""

import dataclasses

import numpy as np
import pytest

from masrel.lab.analysis import _fit_residuals as residuals
from masrel.lab.elbow import STANDARD_MODELS, fit
from masrel.lab.elbow.identification import ElbowFit
from tests.lab.elbow.identification.synthesis import study


@pytest.fixture(scope="module")
def fitted() -> ElbowFit:
    return fit(study(STANDARD_MODELS["HM3"], seed=31, n_slow=3, n_fast=6))


def test_the_law_of_the_catch_angle_is_the_joints(fitted: ElbowFit) -> None:
    names = ("catch_angle_constant", "catch_slope")
    values = {name: fitted[name].value for name in names}
    joint = dataclasses.replace(fitted.constants, **values)
    speeds = np.linspace(0.1, 1.2 * joint.fastest_mean_speed, 50)  # both clamps of (6)
    expected = [joint.catch_angle(speed) for speed in speeds.tolist()]
    law = residuals.catch_angle_law(fitted, speeds)
    np.testing.assert_allclose(law, expected, rtol=1e-14)


def test_residuals_are_those_of_every_sample(fitted: ElbowFit) -> None:
    slow, fast = residuals.slow_residuals(fitted), residuals.fast_residuals(fitted)
    n_samples = sum(law.size for law in fitted.fitted_torque)
    assert slow[0].size == slow[1].size
    assert fast[0].size == fast[1].size
    assert slow[0].size + fast[0].size == n_samples
    together = np.concatenate([slow[1], fast[1]])
    assert np.abs(together).mean() < 0.1  # N·m: the noise that was put in
    assert fast[0].min() < 0.0 < fast[0].max()  # around the catch


def test_errors_of_slow_trials_are_relative(fitted: ElbowFit) -> None:
    places = [i for i, trial in enumerate(fitted.trials) if trial.pace == "slow"]
    for place in places:
        measured = fitted.trials[place].pre_catch.measured
        error = np.abs(measured - fitted.fitted_torque[place]).sum()
        ratio = error / np.abs(measured).sum()
        assert residuals.slow_error(fitted, place) == pytest.approx(ratio, rel=1e-12)


def test_a_bin_of_few_samples_has_no_mean() -> None:
    x = np.array([0.0, 0.1, 0.2, 0.9, 1.0])
    y = np.array([1.0, 2.0, 3.0, 10.0, 20.0])
    middles, means = residuals.binned_means(x, y, 2, 3)
    np.testing.assert_allclose(middles, [0.25, 0.75])
    np.testing.assert_array_equal(means, [2.0, np.nan])


def test_every_catch_has_a_peak_above_its_residual(fitted: ElbowFit) -> None:
    readings = residuals.catch_readings(fitted)
    assert [catch for catch, _ in readings] == residuals.catches(fitted)
    assert all(levels.peak > levels.residual > 0.0 for _, levels in readings)
