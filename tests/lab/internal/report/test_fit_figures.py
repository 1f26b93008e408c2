"""Figures of a fit: every trial and law is in them, and the same data give one file."""

import dataclasses

import numpy as np
import pytest

from masrel.lab.elbow import STANDARD_MODELS, fit
from masrel.lab.elbow.identification import ElbowFit
from masrel.lab.report import _fit_figures as figures
from masrel.lab.report._fits import fit_figures
from tests.lab.elbow.identification.synthesis import Scatter, study


def svg_of(found: ElbowFit, view: str) -> str:
    return fit_figures(found)[f"fit_{view}"]["svg"].decode("utf-8")


@pytest.fixture(scope="module")
def found() -> ElbowFit:
    return fit(study(STANDARD_MODELS["HM3"], seed=31, n_slow=3, n_fast=6))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("terms", "law"),
    [
        ({}, "b·θ̇ + k·θ, fitted"),
        (
            {"inertia": "fitted", "gravity": "fitted", "drift": 0.1},
            "b·θ̇ + k·θ + m·θ̈ + G·sin(θ − θ_g) + drift, fitted",
        ),
        ({"lag": 0.01}, "b·θ̇ + k·θ with a lag, fitted"),
    ],
)
def test_the_legend_of_slow_trials_has_every_term(
    terms: dict[str, object], law: str
) -> None:
    movements = study(STANDARD_MODELS["HM3"], seed=31, n_slow=5, n_fast=0)
    assert svg_of(fit(movements, **terms), "slow").count(f"<!-- {law} -->") == 1  # type: ignore[arg-type]


@pytest.fixture(scope="module")
def outlasting() -> ElbowFit:
    """Most catches outlast their stretch, the slowest among them."""
    scatter = Scatter(catch_travel=0.035)
    joint = STANDARD_MODELS["HM2"]
    return fit(study(joint, seed=3, n_slow=4, scatter=scatter, fast=(70.0, 130.0)))


def test_an_interval_that_is_not_even_is_written_with_both_ends(
    outlasting: ElbowFit,
) -> None:
    travel = outlasting["catch_travel"]
    assert travel.high - travel.value > 1.01 * (travel.value - travel.low)
    low, high = (f"{np.degrees(end):.2f}" for end in (travel.low, travel.high))
    drawn = svg_of(outlasting, "catches")
    assert f"[{low}, {high}]" in drawn
    slope = outlasting["catch_slope"]
    assert f"α = {slope.value:.3f} ± {slope.high - slope.value:.3f} s" in drawn


def test_every_phase_that_is_drawn_is_in_the_legend(outlasting: ElbowFit) -> None:
    ends = [t.catch.end for t in outlasting.trials if t.catch is not None]
    assert None in ends
    drawn = svg_of(outlasting, "trials")
    assert drawn.count("<!-- catch -->") == drawn.count("<!-- post-catch -->") == 1


def test_the_law_of_the_catch_angle_is_the_joints(found: ElbowFit) -> None:
    names = ("catch_angle_constant", "catch_slope")
    values = {name: found[name].value for name in names}
    joint = dataclasses.replace(found.constants, **values)
    speeds = np.linspace(0.1, 1.2 * joint.fastest_mean_speed, 50)  # both clamps of (6)
    expected = [joint.catch_angle(speed) for speed in speeds.tolist()]
    law = figures._catch_angle_law(found, speeds)
    np.testing.assert_allclose(law, expected, rtol=1e-14)


def test_residuals_are_those_of_every_sample(found: ElbowFit) -> None:
    slow, fast = figures._slow_residuals(found), figures._fast_residuals(found)
    assert slow[0].size == slow[1].size
    assert fast[0].size == fast[1].size
    n_samples = sum(law.size for law in found.fitted_torque)
    assert slow[0].size + fast[0].size == n_samples
    together = np.concatenate([slow[1], fast[1]])
    assert np.abs(together).mean() < 0.1  # N·m: the noise that was put in
    assert fast[0].min() < 0.0 < fast[0].max()  # around the catch
